// SPDX-License-Identifier: Apache-2.0
#include "tools/workspace/report_directory.h"

#include "cuda/error.h"
#include "tests/tools/other_user.h"
#include "tests/tools/temporary_directory.h"
#include "tools/settings/json_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <functional>
#include <map>

namespace shadowdag {
namespace {

/// How many renames this process has left before one ends it, as SIGKILL would; below 0: any
/// number.
long gRenamesLeft = -1;

} // namespace
} // namespace shadowdag

/// Takes the place of the C library's.
extern "C" __attribute__((visibility("default"))) int rename(const char* from,
                                                             const char* to) noexcept {
    if (shadowdag::gRenamesLeft == 0)
        _exit(1);
    --shadowdag::gRenamesLeft;
    return renameat(AT_FDCWD, from, AT_FDCWD, to);
}

namespace shadowdag {
namespace {

/// Runs a function in a process of its own, which is killed at a rename. Returns whether it was.
bool isKilledAtRename(long number, const std::function<void()>& act) {
    const pid_t child = fork();
    if (child == 0) {
        gRenamesLeft = number;
        try {
            act();
        } catch (const std::exception& error) {
            std::fputs(error.what(), stderr);
            _exit(2);
        }
        _exit(0);
    }
    int status = -1;
    waitpid(child, &status, 0);
    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) < 2) << status;
    return WIFEXITED(status) && WEXITSTATUS(status) == 1;
}

using Files = std::map<std::string, std::string>; ///< texts by their names in a folder

Files filesIn(const std::string& folder) {
    namespace fs = std::filesystem;
    Files files;
    for (const auto& entry : fs::recursive_directory_iterator(folder))
        if (entry.is_regular_file())
            files[fs::relative(entry.path(), folder).string()] = readText(entry.path().string());
    return files;
}

void writeFiles(const std::string& folder, const Files& files) {
    for (const auto& [name, text] : files) {
        std::filesystem::create_directories(
            std::filesystem::path(folder + "/" + name).parent_path());
        writeText(folder + "/" + name, text);
    }
}

// Old and new report have names of their own at the begin, in the middle and at the end of the
// order in which they are moved.
TEST(ReportDirectory, ASwapAndItsUndoKilledAtAnyRenameLoseNothing) {
    namespace fs = std::filesystem;
    const std::string results =
        R"({"provenance": {}, "experiment": {}, "runs": ["images/a.png", "charts/b.svg"]})";
    const std::string study = R"({"provenance": {}})";
    const Files one = {{"images/a.png", "1"}, {"charts/b.svg", "1"},    {"results.json", results},
                       {"lights.csv", "1"},   {"experiment.json", "1"}, {"ablation.json", study},
                       {"ablation.csv", "1"}};
    const Files other = {
        {"images/a.png", "2"},
        {"results.json", results.substr(0, results.size() - 1) + R"(, "sequence_runs": [1]})"},
        {"results.csv", "2"},
        {"index.html", "2"},
        {"sequence.csv", "2"},
        {"stability.json", study},
        {"stability.csv", "2"}};
    for (const auto& [old, fresh] : {std::pair(one, other), std::pair(other, one)}) {
        for (long number = 0, isKilled = true; isKilled; ++number) {
            SCOPED_TRACE(number);
            const TemporaryDirectory directory;
            const std::string report = directory / "report", kept = directory / "kept";
            writeFiles(report, old);
            static_cast<void>(prepareDirectory(report, false, false));
            writeFiles(report + "/partial", fresh);
            writeText(report + "/partial/journal.json", R"({"key": {}, "parts": {"a": {}}})");
            isKilled = isKilledAtRename(number, [&] { swapReport(report); });
            if (!isKilled) {
                EXPECT_EQ(filesIn(report), fresh);
                EXPECT_GT(number, long(old.size() + fresh.size()));
            }
            fs::rename(report, kept);
            for (long undo = 0, isAgain = isKilled; isAgain; ++undo) {
                SCOPED_TRACE("the undo at " + std::to_string(undo));
                fs::copy(kept, report, fs::copy_options::recursive);
                isAgain = isKilledAtRename(
                    undo, [&] { static_cast<void>(prepareDirectory(report, true, false)); });
                const DirectoryLock lock = prepareDirectory(report, true, false);
                Files found = filesIn(report);
                std::erase_if(found,
                              [](const auto& file) { return file.first.starts_with("partial"); });
                EXPECT_EQ(found, old);
                writeFiles(report + "/partial/done",
                           old); // as a kill while it is removed leaves it
                swapReport(report);
                EXPECT_EQ(filesIn(report), fresh);
                fs::remove_all(report);
                if (HasFailure())
                    return;
            }
        }
    }
}

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
    const std::string report =
        R"({"provenance": {}, "experiment": {}, "runs": [], "picture": "images/a.png"})";
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
        return asUser(user, {user}, [&] {
            const ReportDirectory held(report, false, false);
            return std::string();
        });
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
    writeText(directory / "results.json",
              R"({"provenance": {}, "experiment": {}, "runs": ["a.png"]})");
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

// Beside unfinished work, in a report's folders, and where they come during the run.
TEST(ReportDirectory, FilesOfOthersAreNotReplaced) {
    namespace fs = std::filesystem;
    const std::string report = R"({"provenance": {}, "experiment": {}, "runs": ["images/a.png"]})";
    const auto refusal = [](const std::function<void()>& act) -> std::string {
        try {
            act();
        } catch (const Error& error) {
            return error.kind() == ErrorKind::kUsage ? error.what() : "another kind";
        }
        return "";
    };
    for (const std::string name :
         {"index.html", "results.json", "images/a.jpg", "charts/mine.txt", "images/deep/b.png"}) {
        for (const bool isResumed : {true, false}) {
            const TemporaryDirectory directory;
            const auto prepare = [&] {
                static_cast<void>(prepareDirectory(directory.path(), isResumed, false));
            };
            if (isResumed) {
                fs::create_directories(directory / "partial/images");
                writeText(directory / "partial/journal.json", R"({"key": {}, "parts": {"a": {}}})");
            } else if (name.find('/') != std::string::npos) {
                fs::create_directory(directory / "images");
                writeText(directory / "results.json", report);
                writeText(directory / "images/a.png", "ours");
            }
            EXPECT_EQ(refusal(prepare), "");
            fs::create_directories(fs::path(directory / name).parent_path());
            writeText(directory / name, "{\"mine\": 1}");
            EXPECT_NE(refusal(prepare).find("which shadowdag did not write"), std::string::npos)
                << name << ", " << isResumed;
            writeText(directory / "partial/results.json", report);
            EXPECT_NE(refusal([&] { swapReport(directory.path()); }).find("did not write"),
                      std::string::npos)
                << name;
            EXPECT_EQ(readText(directory / name), "{\"mine\": 1}");
            EXPECT_TRUE(fs::exists(directory / "partial/results.json"));
        }
    }
}

// Also where its name is that of a file of another kind of report, or of a folder of this one.
TEST(ReportDirectory, FilesOfOthersBesideAReportAreNotReplaced) {
    namespace fs = std::filesystem;
    const std::string compare = R"({"provenance": {}, "experiment": {}, "runs": ["images/a.png"]})",
                      study = R"({"provenance": {}, "rows": ["images/a.png"]})";
    const auto refuses = [](const std::string& directory) {
        try {
            static_cast<void>(prepareDirectory(directory, false, false));
        } catch (const Error& error) {
            EXPECT_THAT(error.what(), testing::HasSubstr("which shadowdag did not write"));
            return error.kind() == ErrorKind::kUsage;
        }
        return false;
    };
    const auto expectRefusal = [&](const Files& report, const std::string& name, bool isFolder) {
        const TemporaryDirectory directory;
        writeFiles(directory.path(), report);
        EXPECT_FALSE(refuses(directory.path()));
        fs::remove_all(directory / name);
        fs::create_directories(fs::path(directory / name).parent_path());
        if (isFolder)
            fs::create_directory(directory / name);
        writeText(isFolder ? directory / (name + "/mine") : directory / name, "mine");
        EXPECT_TRUE(refuses(directory.path())) << name;
        EXPECT_EQ(readText(isFolder ? directory / (name + "/mine") : directory / name), "mine");
    };
    const Files ofStudy = {{"failures.json", study}, {"failures.csv", "1"}, {"images/a.png", "1"}};
    const Files ofCompare = {
        {"results.json", compare}, {"results.csv", "1"}, {"images/a.png", "1"}};
    for (const char* name : {"experiment.json", "costs.json", "results.csv", "sequence.csv"})
        expectRefusal(ofStudy, name, false);
    for (const char* name : {"costs.json", "sequence.csv", "real.csv", "images", "partial/mine"})
        expectRefusal(ofCompare, name, false);
    for (const char* name : {"results.csv", "index.html", "images/a.png"})
        expectRefusal(ofCompare, name, true);
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
    std::filesystem::resize_file(journal,
                                 kMaxOwnJsonBytes + 1); // also for root, who reads all else
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
    constexpr size_t kMostBytes = 3819;
    const TemporaryDirectory directory;
    std::string path = directory.path();
    while (path.size() < kMostBytes - 250)
        path += "/" + std::string(100, 'a');
    path += "/" + std::string(kMostBytes - path.size() - 1, 'a');
    {
        const ReportDirectory held(path, false, false); // the most is enough for all
        writeFiles(path + "/partial", {{"results.json", "{}"}, {"images/a.png", "new"}});
        swapReport(path);
        EXPECT_EQ(readText(path + "/images/a.png"), "new");
    }
    std::filesystem::remove_all(directory / std::string(100, 'a'));
    path += "a";
    try {
        createDirectory(path);
        ADD_FAILURE();
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kResource);
        EXPECT_NE(std::string(error.what()).find("choose a path of at most 3819 bytes"),
                  std::string::npos)
            << error.what();
    }
    EXPECT_FALSE(std::filesystem::exists(directory / std::string(100, 'a')));
}

TEST(ReportDirectory, AFolderMayHoldSomethingOfTheUsersNamedProbe) {
    const TemporaryDirectory directory;
    std::filesystem::create_directory(directory / "probe");
    EXPECT_NO_THROW(createDirectory(directory.path()));
}

TEST(ReportDirectory, AFolderThatTakesNoFilesIsRefusedWithTheReason) {
    const auto refusal = [](const std::string& path) {
        try {
            createDirectory(path);
            return std::string("no error");
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::kResource);
            return std::string(error.what());
        }
    };
    // Root has the rights, but the system creates no file there.
    EXPECT_NE(refusal("/proc").find(geteuid() == 0 ? "cannot create '/proc/.shadowdag-probe"
                                                   : "cannot be"),
              std::string::npos)
        << refusal("/proc");
    if (geteuid() != 0)
        GTEST_SKIP() << "only root can be another user";
    const TemporaryDirectory directory;
    std::filesystem::permissions(directory.path(), std::filesystem::perms(0755));
    EXPECT_EQ(asNobody([&] { return refusal(directory.path()); }),
              directory.path() + ": cannot be written into: it belongs to another user and is not "
                                 "writable for this one; choose another folder");
}

} // namespace
} // namespace shadowdag
