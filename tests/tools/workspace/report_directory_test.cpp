// SPDX-License-Identifier: Apache-2.0
#include "tools/workspace/report_directory.h"

#include "cuda/error.h"
#include "tests/tools/temporary_directory.h"
#include "tools/settings/json_file.h"

#include <gtest/gtest.h>

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
