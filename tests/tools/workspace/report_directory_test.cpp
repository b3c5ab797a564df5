// SPDX-License-Identifier: Apache-2.0
#include "tools/workspace/report_directory.h"

#include "cuda/error.h"
#include "tests/tools/temporary_directory.h"
#include "tools/settings/json_file.h"

#include <gtest/gtest.h>

#include <grp.h>
#include <sys/wait.h>
#include <unistd.h>

namespace shadowdag {
namespace {

TEST(ReportDirectory, ResumingRemovesTheUnfinishedFilesOfAKilledRun) {
    const TemporaryDirectory directory;
    const std::string images = directory / "partial/images";
    std::filesystem::create_directories(images);
    const std::string journal = R"({"key": {}, "parts": {"a": {}}})";
    writeText(directory / "partial/journal.json", journal);
    const std::string kept[] = {images + "/a.exr", images + "/a.tmp-x-1", images + "/.tmp-1-2"};
    const std::string abandoned[] = {images + "/b.exr.tmp-4711-12",
                                     directory / "partial/journal.json.tmp-4711-0"};
    for (const std::string& path : kept)
        writeText(path, "finished");
    for (const std::string& path : abandoned)
        writeText(path, "half");
    const DirectoryLock lock = prepareDirectory(directory.path(), true, false);
    for (const std::string& path : kept)
        EXPECT_EQ(readText(path), "finished") << path;
    for (const std::string& path : abandoned)
        EXPECT_FALSE(std::filesystem::exists(path)) << path;
    EXPECT_EQ(readText(directory / "partial/journal.json"), journal);
}

TEST(ReportDirectory, FilesThatAreReplacedKeepTheirPermissions) {
    namespace fs = std::filesystem;
    const TemporaryDirectory directory;
    const std::string path = directory / "results.json";
    const std::string report = R"({"provenance": {}, "experiment": {}, "runs": []})";
    writeText(path, report);
    fs::permissions(path, fs::perms(0600));
    const std::string images = directory / "images", picture = images + "/a.png";
    fs::create_directory(images);
    writeText(picture, "old");
    fs::permissions(images, fs::perms(0710));
    fs::permissions(picture, fs::perms(0640));
    {
        const ReportDirectory held(directory.path(), false, false);
        writeText(directory / "partial/results.json", "{}");
        writeText(directory / "partial/images/a.png", "new");
        writeText(directory / "partial/images/b.png", "new");
        swapReport(directory.path());
    }
    EXPECT_EQ(readText(path), "{}");
    EXPECT_EQ(fs::status(path).permissions(), fs::perms(0600));
    EXPECT_EQ(readText(picture), "new");
    EXPECT_EQ(fs::status(images).permissions(), fs::perms(0710));
    EXPECT_EQ(fs::status(picture).permissions(), fs::perms(0640));
    writeText(path, report);
    fs::permissions(path, fs::perms(0444));
    EXPECT_THROW(ReportDirectory(directory.path(), false, false), Error);
    EXPECT_EQ(readText(path), report);
}

// To move a folder, one must be allowed to write into it, and, where only owners may replace files,
// to own it. Both are known before the work.
TEST(ReportDirectory, AFolderThatCannotBeReplacedIsRefusedBeforeTheWork) {
    namespace fs = std::filesystem;
    if (geteuid() != 0)
        GTEST_SKIP() << "only root can be another user";
    const TemporaryDirectory directory;
    const std::string report = directory / "report", images = report + "/images";
    fs::permissions(directory.path(), fs::perms(0777));
    fs::create_directories(images);
    writeText(report + "/results.json", R"({"provenance": {}, "experiment": {}, "runs": []})");
    for (const std::string& path : {report, images, report + "/results.json"})
        ASSERT_EQ(chown(path.c_str(), 65534, 65534), 0);
    const auto refusal = [&](uid_t user) {
        const std::string file = directory / "refusal";
        fs::remove(file);
        const pid_t child = fork();
        if (child == 0) {
            if (setgroups(0, nullptr) != 0 || setgid(user) != 0 || setuid(user) != 0)
                _exit(1);
            try {
                const ReportDirectory held(report, false, false);
                writeText(file, "");
            } catch (const std::exception& error) {
                writeText(file, error.what());
            }
            _exit(0);
        }
        waitpid(child, nullptr, 0);
        return readText(file);
    };
    EXPECT_EQ(refusal(65534), "");
    fs::permissions(images, fs::perms(0555));
    EXPECT_EQ(refusal(65534), images + ": cannot be replaced: it is read-only; make it writable "
                                       "(chmod u+w) or choose another folder");
    fs::permissions(images, fs::perms(0777));
    fs::permissions(report, fs::perms(01777));
    fs::permissions(report + "/results.json", fs::perms(0666));
    EXPECT_NE(refusal(65533).find("it belongs to another user"), std::string::npos);
}

// It may forbid to move the folder, which comes first.
TEST(ReportDirectory, AFolderGetsItsPermissionsAfterItHasMoved) {
    namespace fs = std::filesystem;
    const TemporaryDirectory directory;
    writeText(directory / "results.json", R"({"provenance": {}, "experiment": {}, "runs": []})");
    fs::create_directory(directory / "images");
    writeText(directory / "images/a.png", "old");
    {
        const ReportDirectory held(directory.path(), false, false);
        writeText(directory / "partial/results.json", "{}");
        writeText(directory / "partial/images/a.png", "new");
        fs::permissions(directory / "images", fs::perms(02750)); // while the run goes on
        swapReport(directory.path());
    }
    EXPECT_EQ(readText(directory / "images/a.png"), "new");
    EXPECT_EQ(fs::status(directory / "images").permissions(), fs::perms(02750));
}

TEST(ReportDirectory, ADamagedReportIsNotCalledForeign) {
    const TemporaryDirectory directory;
    std::filesystem::create_directory(directory / "images");
    writeText(directory / "results.json", R"({"provenance": {}, "experim)");
    try {
        const ReportDirectory held(directory.path(), false, false);
        ADD_FAILURE();
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kInput);
        EXPECT_NE(std::string(error.what()).find("results.json: is damaged or truncated"),
                  std::string::npos)
            << error.what();
    }
}

// Which a run that does not resume it would delete.
TEST(ReportDirectory, AJournalThatCannotBeReadDoesNotCountAsAbsent) {
    const TemporaryDirectory directory;
    std::filesystem::create_directory(directory / "partial");
    const std::string journal = directory / "partial/journal.json";
    writeText(directory / "results.json", R"({"provenance": {}, "experiment": {}, "runs": []})");
    writeText(journal, "{}");
    std::filesystem::resize_file(journal, kMaxJsonBytes + 1); // also for root, who reads all else
    try {
        const ReportDirectory held(directory.path(), false, false);
        ADD_FAILURE();
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kResource);
        EXPECT_NE(std::string(error.what()).find("journal.json: has "), std::string::npos)
            << error.what();
    }
    EXPECT_TRUE(std::filesystem::exists(journal));
}

TEST(ReportDirectory, APathWithoutRoomForItsFilesIsRefused) {
    const TemporaryDirectory directory;
    std::string path = directory.path();
    while (path.size() < 3800)
        path += "/" + std::string(100, 'a');
    try {
        createDirectory(path);
        ADD_FAILURE();
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kResource);
        EXPECT_NE(std::string(error.what()).find("choose a path of at most 3809 bytes"),
                  std::string::npos)
            << error.what();
    }
    EXPECT_FALSE(std::filesystem::exists(directory / std::string(100, 'a')));
}

} // namespace
} // namespace shadowdag
