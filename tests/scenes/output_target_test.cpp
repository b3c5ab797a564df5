// SPDX-License-Identifier: Apache-2.0
#include "scenes/output_target.h"

#include "cuda/error.h"
#include "scenes/output_file.h"
#include "tests/tools/temporary_directory.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <iterator>
#include <string>
#include <vector>

namespace shadowdag {
namespace {

namespace fs = std::filesystem;

// Of a file that is there, of none, and through two links.
TEST(OutputTarget, FilesAreWrittenThroughSymbolicLinks) {
    const TemporaryDirectory directory;
    fs::create_directory(directory / "folder");
    writeText(directory / "folder/old", "a long old file");
    fs::create_symlink("folder/old", directory / "a");
    fs::create_symlink(directory / "folder/new", directory / "b");
    fs::create_symlink("a", directory / "c");
    for (const auto& [link, target] : {std::pair{"a", "folder/old"}, std::pair{"b", "folder/new"},
                                       std::pair{"c", "folder/old"}}) {
        OutputFile file(directory / link);
        file.write(link);
        file.commit();
        EXPECT_TRUE(fs::is_symlink(directory / link)) << link;
        EXPECT_FALSE(fs::is_symlink(directory / target)) << link;
        EXPECT_EQ(readText(directory / target), link);
    }
    EXPECT_EQ(std::distance(fs::directory_iterator(directory / "folder"), {}), 2);
}

// ln -s scene.glb picture.png; shadowdag render scene.glb -o picture.png
TEST(OutputTarget, ALinkToAFileOfAnotherKindIsRefused) {
    const TemporaryDirectory directory;
    writeText(directory / "scene.glb", "a scene");
    fs::create_symlink("scene.glb", directory / "picture.png");
    fs::create_symlink("new.glb", directory / "new.png");
    EXPECT_THROW(OutputFile(directory / "picture.png"), Error);
    EXPECT_EQ(readText(directory / "scene.glb"), "a scene");
    EXPECT_NO_THROW(OutputFile(directory / "new.png").commit());
    EXPECT_NO_THROW(OutputFile(directory / "scene.glb").commit());
}

TEST(OutputTarget, PipesDevicesAndLoopsAreRefused) {
    const TemporaryDirectory directory;
    const std::string pipe = directory / "pipe", loop = directory / "loop";
    ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
    fs::create_symlink("loop", loop);
    fs::create_symlink("/dev/null", directory / "null");
    for (const auto& [path, what] : {std::pair{pipe, "a pipe, a socket or a device"},
                                     std::pair{directory / "null", "a pipe, a socket or a device"},
                                     std::pair{loop, "a loop of symbolic links"}}) {
        try {
            OutputFile file(path);
            ADD_FAILURE() << path;
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::kResource);
            EXPECT_THAT(error.what(), testing::HasSubstr("'" + path + "': it is " + what));
        }
    }
    EXPECT_TRUE(fs::is_fifo(pipe));
}

TEST(OutputTarget, AFileThatStandardOutputIsIsRefusedThroughLinksOfTheSystem) {
    const TemporaryDirectory directory;
    writeText(directory / "log", "old");
    fs::create_symlink("/dev/stdout", directory / "link");
    std::fflush(stdout);
    const int before = ::dup(STDOUT_FILENO), log = ::open((directory / "log").c_str(), O_WRONLY);
    ::dup2(log, STDOUT_FILENO);
    std::vector<std::string> messages;
    for (const std::string& path : {std::string("/dev/stdout"), std::string("/dev/fd/1"),
                                    std::string("/proc/self/fd/1"), directory / "link"})
        try {
            messages.push_back(outputTarget(path));
        } catch (const Error& error) {
            messages.emplace_back(error.what());
        }
    ::dup2(before, STDOUT_FILENO);
    ::close(before);
    ::close(log);
    EXPECT_THAT(messages,
                testing::Each(testing::HasSubstr("a link of the system to an open file")));
}

} // namespace
} // namespace shadowdag
