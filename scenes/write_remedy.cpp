// SPDX-License-Identifier: Apache-2.0
#include "scenes/write_remedy.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>

namespace shadowdag {

namespace {

/// Returns whether this user may change the mode of a file and replace it in any folder.
bool owns(const struct stat& file) {
    return ::geteuid() == 0 || file.st_uid == ::geteuid();
}

} // namespace

std::string writeRemedy(int error) {
    switch (error) {
    case 0:
    case ENOSPC:
        return "choose another place or free some disk space";
    case EFBIG:
        return "raise the limit of the shell on the size of files (ulimit -f)";
    case ENAMETOOLONG: // OutputFile appends to it
        return "choose a shorter name; that of an unfinished file is longer than the output's";
    case EDQUOT:
        return "the quota of the disk is used up; free some of it or choose another place";
    default: // rights, a disk that fails, a folder that is gone: space would not help
        return "choose another place";
    }
}

std::string whyNotWritable(const std::string& path) {
    struct stat found {};
    if (::stat(path.c_str(), &found) != 0)
        return std::string(std::strerror(errno)) + "; " + writeRemedy(errno);
    const bool isFolder = S_ISDIR(found.st_mode);
    const std::string another = isFolder ? "choose another folder" : "name another file";
    if (found.st_nlink == 0) // a process may still be in it
        return "it was deleted; " + another;
    constexpr mode_t kAnyWriter = S_IWUSR | S_IWGRP | S_IWOTH;
    const bool isReadOnly = !isFolder && (found.st_mode & kAnyWriter) == 0; // root may write it
    const bool isRefused =
        ::faccessat(AT_FDCWD, path.c_str(), isFolder ? W_OK | X_OK : W_OK, AT_EACCESS) != 0;
    const int error = isRefused ? errno : EACCES;
    if (!isRefused && !isReadOnly)
        return "";
    if (error == EROFS)
        return "its file system is mounted read-only; choose a place on another one";
    if (error != EACCES) // as of a file that the system holds unchangeable
        return std::string(std::strerror(error)) + "; " + another;
    if (!owns(found))
        return "it belongs to another user and is not writable for this one; " + another;
    if (!isReadOnly && (found.st_mode & S_IWUSR) != 0) // another rule of the system
        return std::string(std::strerror(error)) + "; " + another;
    return "it is read-only; make it writable (chmod u+w) or " + another;
}

std::string whyNotReplaceable(const std::string& path) {
    const std::filesystem::path parent = std::filesystem::path(path).parent_path();
    struct stat found {
    }, folder{};
    if (::stat(path.c_str(), &found) != 0 ||
        ::stat(parent.empty() ? "." : parent.c_str(), &folder) != 0 ||
        (folder.st_mode & S_ISVTX) == 0 || owns(found) || owns(folder))
        return "";
    return "it belongs to another user, and in its folder only owners may replace files; name "
           "another file";
}

} // namespace shadowdag
