// SPDX-License-Identifier: Apache-2.0
#include "scenes/file_attributes.h"

#include <sys/stat.h>
#include <sys/xattr.h>
#include <unistd.h>

#include <algorithm>

namespace shadowdag {

namespace {

constexpr const char* kAccessList = "system.posix_acl_access";
constexpr const char* kDefaultList = "system.posix_acl_default";

/// Returns a list of a file or a folder; "" if there is none.
std::string listOf(const std::string& path, const char* name) {
    std::string list(size_t(std::max<ssize_t>(0, ::getxattr(path.c_str(), name, nullptr, 0))), '\0');
    if (!list.empty())
        list.resize(
            size_t(std::max<ssize_t>(0, ::getxattr(path.c_str(), name, list.data(), list.size()))));
    return list;
}

/// Gives a list to a file or a folder, or takes the one away that its folder gives to what is new.
/// Returns whether it has this list now.
bool giveList(const std::string& path, const char* name, const std::string& list) {
    if (!list.empty() && ::setxattr(path.c_str(), name, list.data(), list.size(), 0) == 0)
        return true;
    ::removexattr(path.c_str(), name);
    return list.empty();
}

/// Returns the rights, 0 to 7, that the owner, the group, all others and every entry of a list
/// have.
mode_t rightsOfAll(mode_t mode, const std::string& list) {
    mode_t rights = mode >> 6 & mode >> 3 & mode & S_IRWXO;
    // After a version of 4 bytes: 2 bytes each of the kind and the rights of an entry, 4 of whose.
    for (size_t i = 4; i + 8 <= list.size(); i += 8)
        rights &= static_cast<unsigned char>(list[i + 2]);
    return rights;
}

} // namespace

bool FileAttributes::giveTo(const std::string& path) const {
    // The owner first, as the system may drop bits of the mode then.
    const bool hasGroup =
        ::chown(path.c_str(), owner, group) == 0 || ::chown(path.c_str(), uid_t(-1), group) == 0;
    const bool hasDefault = giveList(path, kDefaultList, defaultList);
    const bool hasAccess = giveList(path, kAccessList, hasGroup ? accessList : "");
    if (hasGroup && hasDefault && hasAccess)
        return ::chmod(path.c_str(), mode) == 0;
    const mode_t all = rightsOfAll(mode, accessList);
    return ::chmod(path.c_str(), (mode & ~mode_t(S_IRWXG | S_IRWXO)) | all << 3 | all) == 0;
}

std::optional<FileAttributes> attributesOf(const std::string& path) {
    struct stat status {};
    if (::stat(path.c_str(), &status) != 0)
        return std::nullopt;
    constexpr mode_t kRights = S_IRWXU | S_IRWXG | S_IRWXO;
    const mode_t kept = S_ISDIR(status.st_mode) ? kRights | S_ISUID | S_ISGID | S_ISVTX : kRights;
    return FileAttributes{status.st_mode & kept, status.st_uid, status.st_gid,
                          listOf(path, kAccessList), listOf(path, kDefaultList)};
}

} // namespace shadowdag
