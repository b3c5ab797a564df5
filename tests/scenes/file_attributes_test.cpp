// SPDX-License-Identifier: Apache-2.0
#include "scenes/file_attributes.h"

#include "tests/tools/other_user.h"
#include "tests/tools/temporary_directory.h"

#include <gtest/gtest.h>

#include <sys/stat.h>
#include <sys/xattr.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace shadowdag {
namespace {

namespace fs = std::filesystem;

constexpr const char* kAccess = "system.posix_acl_access";
constexpr const char* kDefault = "system.posix_acl_default";

/// Whose rights an entry of a list has, as the system numbers them.
enum Tag : uint16_t { kOwner = 1, kUser = 2, kGroup = 4, kMask = 16, kOthers = 32 };

struct Entry {
    Tag tag;
    uint16_t rights;
    uint32_t id = ~0u;
};

/// Returns a list as the system stores it: a version, then tag, rights and id of each entry.
std::string listOf(const std::vector<Entry>& entries) {
    std::string list("\2\0\0\0", 4);
    for (const Entry& entry : entries) {
        list.append(reinterpret_cast<const char*>(&entry.tag), 2);
        list.append(reinterpret_cast<const char*>(&entry.rights), 2);
        list.append(reinterpret_cast<const char*>(&entry.id), 4);
    }
    return list;
}

/// Everybody may read and write, except user 4711.
const std::string kDenyingList =
    listOf({{kOwner, 6}, {kUser, 0, 4711}, {kGroup, 6}, {kMask, 6}, {kOthers, 6}});

bool setList(const std::string& path, const char* name, const std::string& list) {
    return ::setxattr(path.c_str(), name, list.data(), list.size(), 0) == 0;
}

/// Returns a list of a file or a folder; nothing if it has none.
std::optional<std::string> listAt(const std::string& path, const char* name) {
    std::string list(1024, '\0');
    const ssize_t size = ::getxattr(path.c_str(), name, list.data(), list.size());
    return size < 0 ? std::nullopt : std::optional(list.substr(0, size_t(size)));
}

struct stat statusOf(const std::string& path) {
    struct stat status {};
    EXPECT_EQ(::stat(path.c_str(), &status), 0);
    return status;
}

mode_t modeOf(const std::string& path) {
    return statusOf(path).st_mode & 07777u;
}

/// Returns whether a new file, or a new folder, got the attributes of an old one.
std::string give(const std::string& old, const std::string& fresh) {
    if (fs::is_directory(old))
        fs::create_directory(fresh);
    else
        writeText(fresh, "new");
    return attributesOf(old)->giveTo(fresh) ? "given" : "refused";
}

TEST(FileAttributes, AGroupThatCannotBeKeptGetsOnlyWhatEverybodyHad) {
    if (geteuid() != 0)
        GTEST_SKIP() << "only root can be another user";
    const TemporaryDirectory directory;
    const std::string old = directory / "old", fresh = directory / "fresh";
    writeText(old, "root's");
    ASSERT_EQ(chmod(directory.path().c_str(), 0777), 0);
    ASSERT_EQ(chown(old.c_str(), 0, 65533), 0);
    struct Case {
        mode_t before, after;
    };
    // Group 65533 is among the others of the new file, and could not read 0606 or 0604.
    for (const auto& [before, after] : {Case{0606, 0600}, Case{0604, 0600}, Case{0662, 0622},
                                        Case{0660, 0600}, Case{0664, 0644}, Case{0666, 0666}}) {
        ASSERT_EQ(chmod(old.c_str(), before), 0);
        ASSERT_EQ(asNobody([&] { return give(old, fresh); }), "given");
        EXPECT_EQ(statusOf(fresh).st_uid, kNobody);
        EXPECT_EQ(modeOf(fresh), after) << std::oct << before;
        fs::remove(fresh);
    }
    if (!setList(old, kAccess, kDenyingList))
        GTEST_SKIP() << "this file system has no access lists";
    ASSERT_EQ(modeOf(old), 0666u);
    ASSERT_EQ(asNobody([&] { return give(old, fresh); }), "given");
    EXPECT_EQ(modeOf(fresh), 0600u) << "user 4711 was denied";
}

TEST(FileAttributes, AListThatTheSystemRefusesLeavesOnlyWhatEverybodyHad) {
    const TemporaryDirectory directory;
    writeText(directory / "a", "new");
    FileAttributes attributes = *attributesOf(directory / "a");
    attributes.mode = 0666;
    attributes.accessList = listOf({{kOwner, 6}, {kUser, 4, 4711}, {kGroup, 6}, {kOthers, 6}});
    EXPECT_TRUE(attributes.giveTo(directory / "a")); // a named user without a mask is refused
    EXPECT_EQ(modeOf(directory / "a"), 0644u);
    attributes = {0664, attributes.owner, attributes.group, "", kDenyingList}; // only of folders
    EXPECT_TRUE(attributes.giveTo(directory / "a"));
    EXPECT_EQ(modeOf(directory / "a"), 0644u);
}

TEST(FileAttributes, AMemberOfTheGroupKeepsIt) {
    if (geteuid() != 0)
        GTEST_SKIP() << "only root can be another user";
    const TemporaryDirectory directory;
    writeText(directory / "old", "root's");
    ASSERT_EQ(chmod(directory.path().c_str(), 0777), 0);
    ASSERT_EQ(chown((directory / "old").c_str(), 0, 65533), 0);
    ASSERT_EQ(chmod((directory / "old").c_str(), 0660), 0);
    ASSERT_EQ(asUser(kNobody, {kNobody, 65533},
                     [&] { return give(directory / "old", directory / "fresh"); }),
              "given");
    EXPECT_EQ(statusOf(directory / "fresh").st_uid, kNobody);
    EXPECT_EQ(statusOf(directory / "fresh").st_gid, 65533u);
    EXPECT_EQ(modeOf(directory / "fresh"), 0660u);
}

TEST(FileAttributes, WhatTheFolderGivesToNewFilesIsTakenFromTheOneThatReplaces) {
    const TemporaryDirectory directory;
    writeText(directory / "file", "old");
    fs::create_directory(directory / "folder");
    const mode_t fileMode = modeOf(directory / "file"), folderMode = modeOf(directory / "folder");
    const std::string list =
        listOf({{kOwner, 7}, {kUser, 7, 4711}, {kGroup, 5}, {kMask, 7}, {kOthers, 5}});
    if (!setList(directory.path(), kDefault, list))
        GTEST_SKIP() << "this file system has no access lists";
    writeText(directory / "inheriting", "new");
    ASSERT_TRUE(listAt(directory / "inheriting", kAccess));
    EXPECT_EQ(give(directory / "file", directory / "new-file"), "given");
    EXPECT_FALSE(listAt(directory / "new-file", kAccess));
    EXPECT_EQ(modeOf(directory / "new-file"), fileMode);
    EXPECT_EQ(give(directory / "folder", directory / "new-folder"), "given");
    EXPECT_FALSE(listAt(directory / "new-folder", kAccess));
    EXPECT_FALSE(listAt(directory / "new-folder", kDefault));
    EXPECT_EQ(modeOf(directory / "new-folder"), folderMode);
}

TEST(FileAttributes, AFolderKeepsBothLists) {
    const TemporaryDirectory directory;
    const std::string old = directory / "old";
    fs::create_directory(old);
    const std::string list =
        listOf({{kOwner, 7}, {kUser, 5, 4711}, {kGroup, 5}, {kMask, 5}, {kOthers, 0}});
    if (!setList(old, kAccess, list) || !setList(old, kDefault, kDenyingList))
        GTEST_SKIP() << "this file system has no access lists";
    EXPECT_EQ(give(old, directory / "fresh"), "given");
    EXPECT_EQ(listAt(directory / "fresh", kAccess), list);
    EXPECT_EQ(listAt(directory / "fresh", kDefault), kDenyingList);
}

TEST(FileAttributes, AFolderKeepsItsSetIdAndStickyBitsAndAFileDoesNot) {
    const TemporaryDirectory directory;
    fs::create_directory(directory / "folder");
    writeText(directory / "file", "old");
    int count = 0;
    for (const mode_t mode : {02770, 01777, 06755, 0700}) {
        const std::string number = std::to_string(++count);
        ASSERT_EQ(chmod((directory / "folder").c_str(), mode), 0);
        ASSERT_EQ(chmod((directory / "file").c_str(), mode), 0);
        EXPECT_EQ(give(directory / "folder", directory / "folder" + number), "given");
        EXPECT_EQ(modeOf(directory / "folder" + number), mode);
        EXPECT_EQ(give(directory / "file", directory / "file" + number), "given");
        EXPECT_EQ(modeOf(directory / "file" + number), mode & 0777u);
    }
}

} // namespace
} // namespace shadowdag
