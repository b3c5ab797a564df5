// SPDX-License-Identifier: Apache-2.0
#include "voxel/scratch_folder.h"

#include "cuda/error.h"
#include "scenes/input_file.h"

#include <dirent.h>
#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <exception>
#include <filesystem>
#include <memory>
#include <string_view>
#include <utility>

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
    : path_(outputPath + ".scratch"), lockPath_(path_ + "/lock"), resume_(resume),
      exceptionCount_(std::uncaught_exceptions()) {
    while (!tryLock()) {
    }
    try {
        refuseForeign();
        if (!resume && !files(kPartExtension).empty())
            throw Error(ErrorKind::kUsage,
                        path_ + " holds the files of an unfinished voxelize; continue it with "
                                "voxelize --resume, or remove the folder");
        empty(false);
        if (!resume)
            atEnd_.emplace([this] { remove(); });
    } catch (...) {
        ::close(lock_);
        throw;
    }
}

bool ScratchFolder::tryLock() {
    std::error_code error;
    if (!fs::create_directory(path_, error) && !error)
        refuseForeign(); // before a lock is put into a folder of something else
    if (!error)
        lock_ = ::open(lockPath_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
    if (lock_ < 0) {
        if (!error && errno == ENOENT && !fs::exists(path_))
            return false;
        if (!error)
            refuseTooManyFiles(lockPath_, errno);
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
    if (::fstat(lock_, &held) == 0 && ::stat(lockPath_.c_str(), &there) == 0 &&
        held.st_dev == there.st_dev && held.st_ino == there.st_ino)
        return true;
    ::close(lock_);
    lock_ = -1;
    return false;
}

ScratchFolder::~ScratchFolder() {
    const auto held = delayRemovalOfUnfinishedFiles();
    if (!resume_ || std::uncaught_exceptions() == exceptionCount_)
        remove();
    else
        ::close(lock_);
}

void ScratchFolder::remove() {
    if (lock_ < 0)
        return;
    empty(true);
    // Last, and while it is held: a process that has opened it by then sees that it is gone.
    ::unlink(lockPath_.c_str());
    ::rmdir(path_.c_str());
    ::close(std::exchange(lock_, -1));
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
    // Without memory of its own, as the end of the process may be that there is none.
    const auto close = [](DIR* open) { ::closedir(open); };
    const std::unique_ptr<DIR, decltype(close)> listed(::opendir(path_.c_str()), close);
    while (const dirent* const entry = listed ? ::readdir(listed.get()) : nullptr)
        if (const std::string_view name = entry->d_name;
            isOwn(name) && name != kLockName && (withParts || !name.ends_with(kPartExtension)))
            ::unlinkat(::dirfd(listed.get()), entry->d_name, 0);
}

std::vector<std::string> ScratchFolder::files(const std::string& extension) const {
    std::vector<std::string> paths;
    for (const fs::directory_entry& entry : fs::directory_iterator(path_))
        if (entry.path().string().ends_with(extension))
            paths.push_back(entry.path().string());
    std::sort(paths.begin(), paths.end());
    return paths;
}

ScratchFile::ScratchFile(const std::string& path) : path_(path) {
    const auto held = delayRemovalOfUnfinishedFiles(); // which removes the folder
    out_.open(path, std::ios::binary | std::ios::trunc);
    if (!out_)
        fail();
}

void ScratchFile::fail() const {
    refuseTooManyFiles(path_, errno);
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
