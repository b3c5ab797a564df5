// SPDX-License-Identifier: Apache-2.0
#include "voxel/scratch_folder.h"

#include "cuda/error.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <exception>
#include <filesystem>

namespace shadowdag {

namespace fs = std::filesystem;

namespace {

const char* const kLockName = "lock";

} // namespace

ScratchFolder::ScratchFolder(const std::string& outputPath, bool resume)
    : path_(outputPath + ".scratch"), resume_(resume), exceptionCount_(std::uncaught_exceptions()) {
    std::error_code error;
    const bool isNew = fs::create_directory(path_, error);
    const std::string lockPath = path_ + "/" + kLockName;
    if (!error)
        lock_ = ::open(lockPath.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
    if (lock_ < 0)
        throw Error(ErrorKind::kResource, "cannot make the folder " + path_ +
                                              " for unfinished work: " +
                                              (error ? error.message() : std::strerror(errno)) +
                                              "; choose another place for the output");
    // The lock goes with the process that holds it, however that ends.
    if (::flock(lock_, LOCK_EX | LOCK_NB) != 0) {
        ::close(lock_);
        throw Error(ErrorKind::kResource, path_ + " is in use by another process that builds the "
                                                  "same file; wait for it or end it");
    }
    if (!isNew && !resume && files("").size() > 1) {
        ::close(lock_);
        throw Error(ErrorKind::kUsage,
                    path_ + " holds what an unfinished build left; go on from it with --resume, "
                            "or remove the folder");
    }
}

ScratchFolder::~ScratchFolder() {
    std::error_code ignored;
    if (!resume_ || std::uncaught_exceptions() == exceptionCount_)
        fs::remove_all(path_, ignored);
    ::close(lock_);
}

std::vector<std::string> ScratchFolder::files(const std::string& extension) const {
    std::vector<std::string> paths;
    for (const fs::directory_entry& entry : fs::directory_iterator(path_))
        if (entry.path().string().ends_with(extension))
            paths.push_back(entry.path().string());
    std::sort(paths.begin(), paths.end());
    return paths;
}

void ScratchFolder::removeOthers(const std::string& extension) const {
    std::error_code ignored;
    for (const std::string& path : files(""))
        if (!path.ends_with(extension) && fs::path(path).filename() != kLockName)
            fs::remove(path, ignored);
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
