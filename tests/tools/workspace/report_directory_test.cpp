// SPDX-License-Identifier: Apache-2.0
#include "tools/workspace/report_directory.h"

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

} // namespace
} // namespace shadowdag
