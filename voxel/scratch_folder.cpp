// SPDX-License-Identifier: Apache-2.0
#include "voxel/scratch_folder.h"

#include "cuda/error.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <exception>
#include <filesystem>
#include <string_view>

namespace shadowdag {

namespace fs = std::filesystem;

namespace {

const char* const kLockName = "lock";
const char* const kPartExtension = ".svpart";

/// Takes `prefix` off the front of `text`; returns whether it was there.
bool take(std::string_view& text, std::string_view prefix) {
    if (!text.starts_with(prefix))
        return false;
    text.remove_prefix(prefix.size());
    return true;
}

bool takeNumber(std::string_view& text) {
    const size_t count = std::min(text.find_first_not_of("0123456789"), text.size());
    text.remove_prefix(count);
    return count > 0;
}

/// Returns whether a build creates files of such a name: the lock, LevelMerge's files, parts, and
/// the temporary names that OutputFile gives to parts.
bool isOwn(std::string_view name) {
    std::string_view level = name, map = name, part = name;
    if (name == kLockName || (take(level, "level-") && takeNumber(level) && level == ".nodes") ||
        (take(map, "map-") && takeNumber(map) && take(map, "-") && takeNumber(map) && map.empty()))
        return true;
    return takeNumber(part) && take(part, kPartExtension) &&
           (part.empty() || (take(part, ".tmp-") && takeNumber(part) && take(part, "-") &&
                             takeNumber(part) && part.empty()));
}

} // namespace

ScratchFolder::ScratchFolder(const std::string& outputPath, bool resume)
    : path_(outputPath + ".scratch"), resume_(resume), exceptionCount_(std::uncaught_exceptions()) {
    while (!tryLock()) {
    }
    try {
        refuseForeign();
        if (!resume && !files(kPartExtension).empty())
            throw Error(ErrorKind::kUsage,
                        path_ + " holds the files of an unfinished voxelize; continue it with "
                                "voxelize --resume, or remove the folder");
        empty(false);
    } catch (...) {
        ::close(lock_);
        throw;
    }
}

bool ScratchFolder::tryLock() {
    std::error_code error;
    if (!fs::create_directory(path_, error) && !error)
        refuseForeign(); // before a lock is put into a folder of something else
    const std::string lockPath = path_ + "/" + kLockName;
    if (!error)
        lock_ = ::open(lockPath.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
    if (lock_ < 0) {
        if (!error && errno == ENOENT && !fs::exists(path_))
            return false;
        throw Error(ErrorKind::kResource, "cannot make the folder " + path_ +
                                              " for unfinished work: " +
                                              (error ? error.message() : std::strerror(errno)) +
                                              "; choose another place for the output");
    }
    // The lock ends with the process that holds it, in whatever way that ends.
    if (::flock(lock_, LOCK_EX | LOCK_NB) != 0) {
        ::close(lock_);
        throw Error(ErrorKind::kResource, path_ + " is in use by another process that builds the "
                                                  "same file; wait for it or stop it");
    }
    // Its last holder may have removed it between the two calls above.
    struct stat held, there;
    if (::fstat(lock_, &held) == 0 && ::stat(lockPath.c_str(), &there) == 0 &&
        held.st_dev == there.st_dev && held.st_ino == there.st_ino)
        return true;
    ::close(lock_);
    lock_ = -1;
    return false;
}

ScratchFolder::~ScratchFolder() {
    if (!resume_ || std::uncaught_exceptions() == exceptionCount_) {
        empty(true);
        // Last, and while it is held: a process that has opened it by then sees that it is gone.
        std::error_code ignored;
        fs::remove(*this / kLockName, ignored);
        fs::remove(path_, ignored);
    }
    ::close(lock_);
}

void ScratchFolder::refuseForeign() const {
    std::error_code ignored; // the folder may be gone by now
    for (fs::directory_iterator entry(path_, ignored), end; entry != end; entry.increment(ignored))
        if (!isOwn(entry->path().filename().string()))
            throw Error(ErrorKind::kUsage, path_ + " is for unfinished work, but contains '" +
                                               entry->path().filename().string() +
                                               "', which no build wrote; move it or choose "
                                               "another name for the output");
}

void ScratchFolder::empty(bool withParts) const {
    std::error_code ignored;
    std::vector<fs::path> own;
    for (fs::directory_iterator entry(path_, ignored), end; entry != end; entry.increment(ignored))
        if (const std::string name = entry->path().filename().string();
            isOwn(name) && name != kLockName && (withParts || !name.ends_with(kPartExtension)))
            own.push_back(entry->path());
    for (const fs::path& path : own)
        fs::remove(path, ignored);
}

std::vector<std::string> ScratchFolder::files(const std::string& extension) const {
    std::vector<std::string> paths;
    for (const fs::directory_entry& entry : fs::directory_iterator(path_))
        if (entry.path().string().ends_with(extension))
            paths.push_back(entry.path().string());
    std::sort(paths.begin(), paths.end());
    return paths;
}

ScratchFile::ScratchFile(const std::string& path)
    : path_(path), out_(path, std::ios::binary | std::ios::trunc) {
    if (!out_)
        fail();
}

void ScratchFile::fail() const {
    throw Error(ErrorKind::kResource,
                "cannot write '" + path_ + "': " + std::strerror(errno) + "; free some disk space");
}

void ScratchFile::write(const void* data, size_t byteCount) {
    if (!out_.write(static_cast<const char*>(data), std::streamsize(byteCount)))
        fail();
}

void ScratchFile::close() {
    out_.close();
    if (!out_)
        fail();
}

} // namespace shadowdag
