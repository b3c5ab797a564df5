// SPDX-License-Identifier: Apache-2.0
#include "scenes/output_file.h"

#include "cuda/error.h"
#include "tests/scenes/gltf_files.h"
#include "tests/tools/other_user.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <sys/xattr.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <new>
#include <sstream>
#include <thread>

namespace shadowdag {
namespace {

std::string content(const std::string& path) {
    std::stringstream text;
    text << std::ifstream(path, std::ios::binary).rdbuf();
    return text.str();
}

size_t fileCount(const test::TemporaryFolder& folder) {
    return size_t(std::distance(std::filesystem::directory_iterator(folder.path("")),
                                std::filesystem::directory_iterator()));
}

TEST(OutputFile, AppearsWholeOnCommit) {
    const test::TemporaryFolder folder;
    OutputFile file(folder.path("a"));
    file.write("one ");
    file.write("two", 3);
    EXPECT_FALSE(std::filesystem::exists(folder.path("a")));
    EXPECT_TRUE(std::filesystem::exists(file.temporaryPath()));
    file.commit();
    EXPECT_EQ(content(folder.path("a")), "one two");
    EXPECT_EQ(fileCount(folder), 1u);
}

TEST(OutputFile, WithoutCommitTheOldFileStays) {
    const test::TemporaryFolder folder;
    folder.write("a", "old");
    {
        OutputFile file(folder.path("a"));
        file.write("new");
    }
    EXPECT_EQ(content(folder.path("a")), "old");
    EXPECT_EQ(fileCount(folder), 1u);
}

TEST(OutputFile, ReplacesAnOldFile) {
    const test::TemporaryFolder folder;
    folder.write("a", "a long old file");
    OutputFile file(folder.path("a"));
    file.write("new");
    file.commit();
    EXPECT_EQ(content(folder.path("a")), "new");
}

TEST(OutputFile, TheNewFileHasThePermissionsOfTheOldOne) {
    const test::TemporaryFolder folder;
    const auto permissions = [](const std::string& path) {
        return unsigned(std::filesystem::status(path).permissions());
    };
    const std::string path = folder.write("a", "old");
    for (const unsigned mode : {0600u, 0200u, 0666u, 0755u, 06755u}) {
        std::filesystem::permissions(path, std::filesystem::perms(mode));
        OutputFile file(path);
        file.write("new");
        EXPECT_EQ(permissions(file.temporaryPath()), 0600u) << "may be read before";
        file.commit();
        EXPECT_EQ(permissions(path), mode & 0777u) << "or the bits that a write drops";
    }
    const mode_t before = umask(022);
    OutputFile(folder.path("b")).commit();
    umask(before);
    EXPECT_EQ(permissions(folder.path("b")), 0644u);
}

TEST(OutputFile, AFileThatVanishesMeanwhileGivesItsPermissionsToo) {
    const test::TemporaryFolder folder;
    const std::string path = folder.write("a", "old");
    for (const mode_t mode : {0640, 0604}) {
        ASSERT_EQ(chmod(path.c_str(), mode), 0);
        OutputFile file(path);
        std::filesystem::remove(path);
        file.commit();
        struct stat status {};
        ASSERT_EQ(stat(path.c_str(), &status), 0);
        EXPECT_EQ(status.st_mode & 07777u, mode);
    }
}

TEST(OutputFile, TheOwnerStaysWhereTheUserMayGiveFilesAway) {
    if (geteuid() != 0)
        GTEST_SKIP() << "only root may";
    const test::TemporaryFolder folder;
    const std::string path = folder.write("a", "old");
    ASSERT_EQ(chown(path.c_str(), 65534, 65533), 0);
    OutputFile(path).commit();
    struct stat status {};
    ASSERT_EQ(stat(path.c_str(), &status), 0);
    EXPECT_EQ(status.st_uid, 65534u);
    EXPECT_EQ(status.st_gid, 65533u);
}

// Another user may write the file, but not give the new one to its group.
TEST(OutputFile, AGroupThatCannotBeKeptLeavesNobodyMoreRights) {
    if (geteuid() != 0)
        GTEST_SKIP() << "only root can be another user";
    const test::TemporaryFolder folder;
    const std::string path = folder.write("a", "old");
    ASSERT_EQ(chmod(folder.path(".").c_str(), 0777), 0);
    ASSERT_EQ(chmod(path.c_str(), 0662), 0);
    const auto replace = [&] {
        OutputFile(path).commit();
        return "replaced";
    };
    EXPECT_EQ(asNobody(replace), "replaced");
    struct stat found {};
    ASSERT_EQ(stat(path.c_str(), &found), 0);
    EXPECT_EQ(found.st_uid, 65534u);
    EXPECT_EQ(found.st_mode & 0777u, 0622u);
}

/// An access list: the owner may all, user 4711 may read, others nothing.
constexpr uint16_t kAccessList[] = {2,      0, // version, 4 bytes; then tag, rights and id of each
                                    1,      7,      0xffff, 0xffff, 2,      4,     4711,
                                    0,      4,      0,      0xffff, 0xffff, 16,    4,
                                    0xffff, 0xffff, 32,     0,      0xffff, 0xffff};

TEST(OutputFile, TheAccessListStays) {
    const test::TemporaryFolder folder;
    const std::string path = folder.write("a", "old");
    const char* const name = "system.posix_acl_access";
    if (setxattr(path.c_str(), name, kAccessList, sizeof kAccessList, 0) != 0)
        GTEST_SKIP() << "this file system has no access lists";
    OutputFile(path).commit();
    uint16_t found[std::size(kAccessList)] = {};
    EXPECT_EQ(getxattr(path.c_str(), name, found, sizeof found), ssize_t(sizeof found));
    EXPECT_TRUE(std::equal(std::begin(found), std::end(found), kAccessList));
}

TEST(OutputFile, AReadOnlyFileIsNotReplaced) {
    const test::TemporaryFolder folder;
    const std::string path = folder.write("a", "old");
    std::filesystem::permissions(path, std::filesystem::perms(0444));
    std::filesystem::create_symlink("a", folder.path("b"));
    for (const char* name : {"a", "b"})
        try {
            OutputFile file(folder.path(name));
            ADD_FAILURE() << name;
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::kResource);
            EXPECT_THAT(error.what(),
                        testing::HasSubstr("cannot replace '" + folder.path(name) +
                                           "': it is read-only; make it writable (chmod u+w)"));
        }
    EXPECT_EQ(content(path), "old");
    EXPECT_EQ(fileCount(folder), 2u);
}

TEST(OutputFile, TwoWritersOfOneNameDoNotMix) {
    const test::TemporaryFolder folder;
    OutputFile a(folder.path("x")), b(folder.path("x"));
    a.write("aaaa");
    b.write("b");
    a.commit();
    EXPECT_EQ(content(folder.path("x")), "aaaa");
    b.commit();
    EXPECT_EQ(content(folder.path("x")), "b");
}

TEST(OutputFile, LibraryMayReplaceTheTemporaryFileByName) {
    const test::TemporaryFolder folder;
    OutputFile file(folder.path("a"));
    std::ofstream(file.temporaryPath(), std::ios::trunc) << "by a library";
    file.commit();
    EXPECT_EQ(content(folder.path("a")), "by a library");
}

TEST(OutputFile, ErrorsContainPathAndReason) {
    const test::TemporaryFolder folder;
    const auto message = [](const std::string& path) {
        try {
            OutputFile file(path);
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::kResource);
            return std::string(error.what());
        }
        return std::string("no error");
    };
    EXPECT_THAT(message(folder.path("absent/a")),
                testing::AllOf(testing::HasSubstr("absent/a"), testing::HasSubstr("No such file")));
    EXPECT_THAT(message(folder.path(".")), testing::HasSubstr("it is a folder"));
    EXPECT_THAT(message(""), testing::HasSubstr("empty name"));
}

// A full disk, played by a limit on file size: the write or the commit says so and nothing is left.
TEST(OutputFile, FullDiskIsReportedAndLeavesNoFile) {
    const test::TemporaryFolder folder;
    folder.write("a", "old");
    rlimit before{};
    getrlimit(RLIMIT_FSIZE, &before);
    rlimit small = before;
    small.rlim_cur = 1000;
    const auto handler = std::signal(SIGXFSZ, SIG_IGN);
    setrlimit(RLIMIT_FSIZE, &small);
    std::string message = "no error";
    try {
        OutputFile file(folder.path("a"));
        file.write(std::string(100'000, 'x'));
        file.commit();
    } catch (const Error& error) {
        message = error.what();
    }
    setrlimit(RLIMIT_FSIZE, &before);
    std::signal(SIGXFSZ, handler);
    EXPECT_THAT(message, testing::AllOf(testing::HasSubstr("cannot write"),
                                        testing::HasSubstr("too large")));
    EXPECT_EQ(content(folder.path("a")), "old");
    EXPECT_EQ(fileCount(folder), 1u);
}

/// Returns the number of a process that has ended.
pid_t endedProcess() {
    const pid_t child = fork();
    if (child == 0)
        _exit(0);
    waitpid(child, nullptr, 0);
    return child;
}

TEST(OutputFile, WhatKilledProcessesLeftOfItIsRemoved) {
    const test::TemporaryFolder folder;
    const std::string mark = ".tmp-" + std::to_string(endedProcess()) + "-";
    folder.write("a" + mark + "0", "half");
    folder.write("a" + mark + "17", "half");
    OutputFile(folder.path("a"));
    EXPECT_EQ(fileCount(folder), 0u);
}

TEST(OutputFile, FilesThatMayHaveAWriterAreNotRemoved) {
    const test::TemporaryFolder folder;
    const std::string gone = ".tmp-" + std::to_string(endedProcess()) + "-";
    folder.write("a.tmp-1-0", "of a process that runs");
    folder.write("b" + gone + "0", "of another output");
    folder.write("a" + gone + "x", "no name of ours");
    folder.write("a.tmp-0-0", "of no process");
    folder.write("a.tmp-99999999999-0", "of no process");
    // A writer in another container or on another machine, whose number is that of none here.
    const std::string locked = folder.write("a" + gone + "0", "half");
    const int file = open(locked.c_str(), O_RDWR);
    ASSERT_EQ(flock(file, LOCK_EX), 0);
    OutputFile(folder.path("a"));
    EXPECT_EQ(fileCount(folder), 6u);
    close(file);
}

TEST(OutputFile, LocksWhatItWrites) {
    const test::TemporaryFolder folder;
    OutputFile output(folder.path("a"));
    const int file = open(output.temporaryPath().c_str(), O_RDWR);
    EXPECT_NE(flock(file, LOCK_EX | LOCK_NB), 0);
    close(file);
}

TEST(OutputFile, DoesNotTakeAFileThatAnEarlierProcessOfItsNumberLeft) {
    const test::TemporaryFolder folder;
    std::string next;
    {
        const OutputFile first(folder.path("a"));
        const std::string path = first.temporaryPath();
        const size_t dash = path.rfind('-');
        next = path.substr(0, dash + 1) + std::to_string(std::stoi(path.substr(dash + 1)) + 1);
    }
    folder.write(std::filesystem::path(next).filename(), "another's");
    OutputFile(folder.path("a")).commit();
    EXPECT_EQ(content(next), "another's");
}

TEST(OutputFile, AbandonedFilesAreRemovedButNoPipes) {
    const test::TemporaryFolder folder;
    folder.write("a.tmp-1-0", "half");
    ASSERT_EQ(mkfifo(folder.path("b.tmp-1-0").c_str(), 0600), 0);
    removeAbandonedFiles(folder.path(""));
    EXPECT_FALSE(std::filesystem::exists(folder.path("a.tmp-1-0")));
    EXPECT_TRUE(std::filesystem::exists(folder.path("b.tmp-1-0")));
}

/// Removes the files of the process as its end does, in a process of its own.
template <class Body> void expectEndsByItself(const Body& body) {
    const pid_t child = fork();
    if (child == 0) {
        alarm(20); // ends one that waits forever
        body();
        _exit(0);
    }
    int status = -1;
    waitpid(child, &status, 0);
    EXPECT_EQ(status, 0);
}

TEST(OutputFile, AnEndRemovalThatFailsDoesNotBlockTheEnd) {
    const test::TemporaryFolder folder;
    bool isCalled = false;
    expectEndsByItself([&] {
        const OutputFile file(folder.path("a"));
        const EndRemoval failing([] { throw std::bad_alloc(); });
        const EndRemoval again([] { removeUnfinishedFiles(); }); // as std::terminate does
        const EndRemoval last([&] { isCalled = true; });
        removeUnfinishedFiles();
        _exit(isCalled ? 0 : 1);
    });
    EXPECT_EQ(fileCount(folder), 0u);
}

TEST(OutputFile, TheEndDoesNotWaitForARenameThatNeverEnds) {
    const test::TemporaryFolder folder;
    expectEndsByItself([&] {
        const OutputFile file(folder.path("a"));
        const auto held = delayRemovalOfUnfinishedFiles();
        std::thread([] {
            removeUnfinishedFiles();
            _exit(0);
        }).join();
    });
    EXPECT_EQ(fileCount(folder), 1u); // as after SIGKILL
}

TEST(OutputFile, FailedRenameIsReported) {
    const test::TemporaryFolder folder;
    OutputFile file(folder.path("a"));
    std::filesystem::create_directory(folder.path("a"));
    EXPECT_THROW(file.commit(), Error);
}

} // namespace
} // namespace shadowdag
