// SPDX-License-Identifier: Apache-2.0
#include "scenes/output_target.h"

#include "cuda/error.h"
#include "scenes/input_file.h"
#include "scenes/output_file.h"
#include "scenes/write_remedy.h"
#include "tests/tools/other_user.h"
#include "tests/tools/temporary_directory.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <climits>
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

/// Returns what an output's name is refused with; "" if it is not.
std::string refusal(const std::string& path) {
    try {
        static_cast<void>(outputTarget(path));
        return "";
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kResource);
        return error.what();
    }
}

TEST(OutputTarget, NamesLeaveRoomForThoseOfUnfinishedFiles) {
    const TemporaryDirectory directory;
    const size_t most = size_t(pathconf(directory.path().c_str(), _PC_NAME_MAX)) - 26;
    const auto named = [&](size_t bytes) { return directory / std::string(bytes, 'a'); };
    EXPECT_EQ(refusal(named(most)), "");
    EXPECT_NO_THROW(OutputFile(named(most)).commit());
    for (const size_t bytes : {most + 1, most + 26, most + 27, size_t(5000)})
        EXPECT_THAT(refusal(named(bytes)),
                    testing::HasSubstr("File name too long; choose a name of at most " +
                                       std::to_string(most) + " bytes"))
            << bytes;
    fs::create_symlink(named(most + 1), directory / "link");
    EXPECT_THAT(refusal(directory / "link"), testing::HasSubstr("File name too long"));
    // The longest suffix is in use: of the largest number of a process and of a file.
    EXPECT_EQ(kTemporarySuffixBytes, std::string(".tmp-2147483647-4294967295").size());
    EXPECT_EQ(outputNameBytes(255), 229u);
    EXPECT_EQ(outputNameBytes(1000), size_t(NAME_MAX - 26));
    EXPECT_EQ(outputNameBytes(-1), size_t(NAME_MAX - 26));
    for (const long longest : {14, 25, 26}) // 14 of Minix
        EXPECT_EQ(outputNameBytes(longest), 0u) << longest;
}

TEST(OutputTarget, PathsLeaveRoomForThoseOfUnfinishedFiles) {
    std::string path = ".";
    while (path.size() + 102 <= 4045)
        path += "/" + std::string(100, 'a');
    path += "/" + std::string(4045 - path.size() - 1, 'a');
    EXPECT_EQ(refusal(path), "");
    EXPECT_THAT(refusal(path + "a"),
                testing::HasSubstr("File name too long; choose a path of at most 4045 bytes"));
}

TEST(OutputTarget, AFileInPlaceOfAFolderIsNamed) {
    const TemporaryDirectory directory;
    writeText(directory / "file.svdag", "an asset");
    for (const char* name : {"file.svdag/x", "file.svdag/a/b/x.svdag", "file.svdag/"})
        EXPECT_THAT(refusal(directory / name),
                    testing::HasSubstr("'" + directory / "file.svdag" +
                                       "' is a file, not a folder; choose another place"))
            << name;
    EXPECT_EQ(refusal(directory / "none/x"), ""); // checkWritable refuses it
    EXPECT_EQ(refusal("/x"), "");
    EXPECT_EQ(refusal("x"), "");
}

// chmod is suggested only to the owner.
TEST(OutputTarget, RemediesAreThoseThatThisUserCanApply) {
    if (geteuid() != 0)
        GTEST_SKIP() << "only root can be another user";
    const TemporaryDirectory directory;
    const std::string file = directory / "a";
    writeText(file, "root's");
    const auto refusalOfNobody = [&] { return asNobody([&] { return refusal(file); }); };
    ASSERT_EQ(chmod(directory.path().c_str(), 0777), 0);
    for (const mode_t mode : {0644, 0444}) {
        ASSERT_EQ(chmod(file.c_str(), mode), 0);
        EXPECT_THAT(refusalOfNobody(), testing::EndsWith("it belongs to another user and is not "
                                                         "writable for this one; name another "
                                                         "file"));
    }
    ASSERT_EQ(chmod(file.c_str(), 0666), 0);
    EXPECT_EQ(refusalOfNobody(), "");
    ASSERT_EQ(chmod(directory.path().c_str(), 01777), 0);
    EXPECT_THAT(refusalOfNobody(), testing::EndsWith("it belongs to another user, and in its "
                                                     "folder only owners may replace files; name "
                                                     "another file"));
    ASSERT_EQ(chown(file.c_str(), 65534, 65534), 0);
    EXPECT_EQ(refusalOfNobody(), "");
    ASSERT_EQ(chmod(file.c_str(), 0444), 0);
    EXPECT_THAT(refusalOfNobody(), testing::HasSubstr("make it writable (chmod u+w)"));
    ASSERT_EQ(chmod(directory.path().c_str(), 0755), 0);
    const std::string folder = directory.path();
    EXPECT_EQ(asNobody([&] { return whyNotWritable(folder); }),
              "it belongs to another user and is not writable for this one; choose another folder");
    ASSERT_EQ(chown(folder.c_str(), 65534, 65534), 0);
    ASSERT_EQ(chmod(folder.c_str(), 0555), 0);
    EXPECT_THAT(asNobody([&] { return whyNotWritable(folder); }),
                testing::HasSubstr("make it writable (chmod u+w) or choose another folder"));
}

// As of a program with the set-user-id bit: the system asks for the effective user.
TEST(OutputTarget, TheEffectiveUserIsAskedForAndNotTheRealOne) {
    if (geteuid() != 0)
        GTEST_SKIP() << "only root can be another user";
    const TemporaryDirectory directory;
    const std::string file = directory / "a";
    writeText(file, "root's");
    ASSERT_EQ(chmod(directory.path().c_str(), 0755), 0);
    ASSERT_EQ(chmod(file.c_str(), 0640), 0);
    const auto asEffective = [&](const auto& function) {
        return asUser(0, {kNobody}, [&] { return seteuid(kNobody) == 0 ? function() : "root"; });
    };
    for (const std::string& path : {file, directory.path()})
        EXPECT_THAT(asEffective([&] { return whyNotWritable(path); }),
                    testing::StartsWith("it belongs to another user and is not writable for this"));
    EXPECT_EQ(asEffective([&] { return whyNoInput(file, 100); }),
              "cannot be opened: Permission denied");
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
