// SPDX-License-Identifier: Apache-2.0
#include "tools/workspace/report_directory.h"

#include "cuda/error.h"
#include "tests/tools/temporary_directory.h"

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
    {
        const ReportDirectory held(directory.path(), false, false);
        writeText(directory / "partial/results.json", "{}");
        swapReport(directory.path());
    }
    EXPECT_EQ(readText(path), "{}");
    EXPECT_EQ(fs::status(path).permissions(), fs::perms(0600));
    writeText(path, report);
    fs::permissions(path, fs::perms(0444));
    EXPECT_THROW(ReportDirectory(directory.path(), false, false), Error);
    EXPECT_EQ(readText(path), report);
}

} // namespace
} // namespace shadowdag
