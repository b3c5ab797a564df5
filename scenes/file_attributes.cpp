// SPDX-License-Identifier: Apache-2.0
#include "scenes/file_attributes.h"

#include <sys/stat.h>
#include <sys/xattr.h>
#include <unistd.h>

#include <algorithm>

namespace shadowdag {

namespace {

constexpr const char* kAccessList = "system.posix_acl_access";

} // namespace

bool FileAttributes::giveTo(const std::string& path) const {
    // The owner first, as the system may drop bits of the mode then.
    const bool hasGroup =
        ::chown(path.c_str(), owner, group) == 0 || ::chown(path.c_str(), uid_t(-1), group) == 0;
    // Without a list of its own, the file would keep the one that its folder gives to new files.
    const bool isListed =
        hasGroup && !accessList.empty() &&
        ::setxattr(path.c_str(), kAccessList, accessList.data(), accessList.size(), 0) == 0;
    if (!isListed)
        ::removexattr(path.c_str(), kAccessList);
    const bool isSame = hasGroup && (isListed || accessList.empty());
    const mode_t others = mode & S_IRWXO;
    return ::chmod(path.c_str(), isSame ? mode : (mode & ~mode_t(S_IRWXG)) | (others << 3)) == 0;
}

std::optional<FileAttributes> attributesOf(const std::string& path) {
    struct stat status {};
    if (::stat(path.c_str(), &status) != 0)
        return std::nullopt;
    constexpr mode_t kRights = S_IRWXU | S_IRWXG | S_IRWXO;
    const mode_t kept = S_ISDIR(status.st_mode) ? kRights | S_ISUID | S_ISGID | S_ISVTX : kRights;
    FileAttributes found{status.st_mode & kept, status.st_uid, status.st_gid, ""};
    found.accessList.resize(
        size_t(std::max<ssize_t>(0, ::getxattr(path.c_str(), kAccessList, nullptr, 0))));
    if (!found.accessList.empty())
        found.accessList.resize(size_t(
            std::max<ssize_t>(0, ::getxattr(path.c_str(), kAccessList, found.accessList.data(),
                                            found.accessList.size()))));
    return found;
}

} // namespace shadowdag
