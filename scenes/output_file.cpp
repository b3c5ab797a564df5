// SPDX-License-Identifier: Apache-2.0
#include "scenes/output_file.h"

#include "cuda/cancel.h"
#include "cuda/error.h"
#include "cuda/macros.h"
#include "scenes/input_file.h"
#include "scenes/output_target.h"
#include "scenes/write_remedy.h"

#include <dirent.h>
#include <fcntl.h>
#include <ftw.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <new>
#include <set>
#include <thread>
#include <utility>
#include <vector>

namespace shadowdag {

namespace {

std::atomic<unsigned> gFileCounter{0};
std::atomic<bool> gHasFinishedParts{false};

/// The temporary files of the process, each with an open file that holds its lock; and what else is
/// removed when the process ends.
struct Unfinished {
    std::mutex mutex;
    std::map<std::string, int> locks;
    std::set<const std::function<void()>*> removals;

    /// With the mutex held.
    void erase(const std::string& path) {
        const auto found = locks.find(path);
        ::close(found->second);
        locks.erase(found);
    }
};

Unfinished& unfinished() {
    static Unfinished& all = *new Unfinished; // a thread that ends the process may outlive main
    return all;
}

[[noreturn]] void fail(const std::string& what, const std::string& path, int error) {
    refuseTooManyFiles(path, error);
    throw Error(ErrorKind::kResource,
                what + " '" + path + "': " + (error ? std::strerror(error) : "unknown reason") +
                    "; " + writeRemedy(error));
}

// Returns whether the writer of a temporary file is gone: no process of this machine has the number
// in its name.
bool isWriterGone(std::string_view name) {
    const size_t mark = name.rfind(kTemporaryMark) + kTemporaryMark.size();
    pid_t process = 0;
    const auto [end, error] =
        std::from_chars(name.data() + mark, name.data() + name.size(), process);
    return error == std::errc() && *end == '-' && process > 0 && ::kill(process, 0) != 0 &&
           errno == ESRCH;
}

// Takes the lock of a file and removes it. A file that another process has locked stays: its writer
// may run in another container or on another machine. So does one whose file system has no locks.
void removeUnlessLocked(const std::string& path) {
    const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK);
    struct stat status {};
    if (file >= 0 && ::fstat(file, &status) == 0 && S_ISREG(status.st_mode) &&
        ::flock(file, LOCK_EX | LOCK_NB) == 0)
        ::unlink(path.c_str());
    if (file >= 0)
        ::close(file);
}

// Creates a file that did not exist and locks it for as long as the result is open: -1 with errno
// if it cannot be created. A file system without locks is accepted.
int createLocked(const std::string& path, mode_t mode) {
    const int file = ::open(path.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, mode);
    struct stat status {};
    if (file < 0 || ::flock(file, LOCK_EX | LOCK_NB) != 0 || ::fstat(file, &status) != 0 ||
        status.st_nlink > 0)
        return file;
    ::close(file); // it was removed before it was locked
    errno = EEXIST;
    return -1;
}

// Flushes the file at `path` to disk, so that it survives a power failure; a file system that
// cannot sync (EINVAL) is accepted.
void syncToDisk(const std::string& path) {
    const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
    if (fd < 0)
        fail("cannot reopen", path, errno);
    const int result = ::fsync(fd);
    const int error = errno;
    ::close(fd);
    if (result != 0 && error != EINVAL)
        fail("cannot flush", path, error);
}

} // namespace

OutputFile::OutputFile(const std::string& path) : path_(outputTarget(path)) {
    if (path_.empty())
        throw Error(ErrorKind::kResource, "cannot write a file with an empty name; give a name");
    std::error_code ignored;
    if (std::filesystem::is_directory(path_, ignored))
        throw Error(ErrorKind::kResource,
                    "cannot write '" + path_ + "': it is a folder; name a file in it");
    removeAbandonedFilesOf(path_);
    old_ = attributesOf(path_);
    // Until it has the rights of the file that it replaces, which others may not read.
    const mode_t mode = old_ ? S_IRUSR | S_IWUSR : 0666;
    const std::lock_guard lock(unfinished().mutex);
    for (;;) {
        // The process id and a counter distinguish two writers of one name; the same folder keeps
        // the rename atomic.
        temporaryPath_ = path_ + std::string(kTemporaryMark) + std::to_string(::getpid()) + "-" +
                         std::to_string(gFileCounter.fetch_add(1));
        const auto entry = unfinished().locks.try_emplace(temporaryPath_, -1).first;
        errno = 0;
        entry->second = createLocked(temporaryPath_, mode);
        if (entry->second >= 0)
            break;
        const int error = errno;
        unfinished().locks.erase(entry);
        if (error != EEXIST) // of an earlier process of this number
            fail("cannot create", temporaryPath_, error);
    }
    stream_.open(temporaryPath_, std::ios::binary | std::ios::trunc);
    if (!stream_) {
        const int error = errno;
        std::remove(temporaryPath_.c_str());
        unfinished().erase(temporaryPath_);
        fail("cannot create", temporaryPath_, error);
    }
}

OutputFile::~OutputFile() {
    if (committed_)
        return;
    stream_.close();
    const std::lock_guard lock(unfinished().mutex);
    std::remove(temporaryPath_.c_str());
    unfinished().erase(temporaryPath_);
}

void OutputFile::write(const void* data, size_t byteCount) {
    errno = 0;
    stream_.write(static_cast<const char*>(data), std::streamsize(byteCount));
    if (!stream_)
        fail("cannot write", path_, errno);
}

void OutputFile::commit() {
    SDAG_ASSERT(!committed_);
    pollCpu(); // nothing appears once the work was cancelled
    errno = 0;
    stream_.close();
    if (!stream_)
        fail("cannot write", path_, errno);
    syncToDisk(temporaryPath_);
    const std::lock_guard lock(unfinished().mutex);
    if (auto now = attributesOf(path_)) // they may have changed meanwhile
        old_ = std::move(now);
    if (old_ && !old_->giveTo(temporaryPath_))
        fail("cannot set the permissions of", temporaryPath_, errno);
    if (std::rename(temporaryPath_.c_str(), path_.c_str()) != 0)
        fail("cannot rename the finished file to", path_, errno);
    unfinished().erase(temporaryPath_);
    committed_ = true;
}

bool isTemporaryName(std::string_view name) {
    const size_t mark = name.rfind(kTemporaryMark);
    if (mark == std::string_view::npos || mark == 0)
        return false;
    const std::string_view rest = name.substr(mark + kTemporaryMark.size());
    const size_t dash = rest.find('-');
    const auto isNumber = [](std::string_view text) {
        return !text.empty() && text.find_first_not_of("0123456789") == std::string_view::npos;
    };
    return dash != std::string_view::npos && isNumber(rest.substr(0, dash)) &&
           isNumber(rest.substr(dash + 1));
}

void removeAbandonedFiles(const std::string& folder) {
    constexpr int kOpenFolders = 8;
    const auto removeOne = [](const char* path, const struct stat* status, int type, FTW* found) {
        // FTW_F is also said of pipes and devices.
        if (type == FTW_F && S_ISREG(status->st_mode) && isTemporaryName(path + found->base))
            ::unlink(path);
        return 0;
    };
    if (::nftw(folder.c_str(), removeOne, kOpenFolders, FTW_PHYS) != 0 && errno == ENOMEM)
        throw std::bad_alloc();
}

// Temporary files whose process is gone and that nobody has locked, as each writer locks its own.
// Lists each folder once, as a run may write thousands of files into it. Not by
// std::filesystem::directory_iterator, which ends the program when memory is short.
void removeAbandonedFilesOf(const std::string& path) {
    const std::filesystem::path output = path;
    static std::mutex mutex;
    static std::map<std::filesystem::path, std::vector<std::string>> abandonedNames;
    const std::lock_guard lock(mutex);
    const std::filesystem::path folder = output.has_parent_path() ? output.parent_path() : ".";
    const auto [found, isNew] = abandonedNames.try_emplace(folder);
    if (isNew) {
        const auto close = [](DIR* open) { ::closedir(open); };
        const std::unique_ptr<DIR, decltype(close)> listed(::opendir(folder.c_str()), close);
        while (const dirent* const entry = listed ? ::readdir(listed.get()) : nullptr)
            if (isTemporaryName(entry->d_name) && isWriterGone(entry->d_name))
                found->second.emplace_back(entry->d_name);
    }
    const std::string start = output.filename().string() + std::string(kTemporaryMark);
    for (const std::string& name : found->second)
        if (name.starts_with(start))
            removeUnlessLocked((folder / name).string());
}

std::unique_lock<std::mutex> delayRemovalOfUnfinishedFiles() {
    return std::unique_lock(unfinished().mutex);
}

void removeUnfinishedFiles() {
    static thread_local bool isRemoving = false;
    if (std::exchange(isRemoving, true))
        return; // one of the functions has failed
    // Not for longer: a thread may hold it that waits for a disk that does not answer.
    constexpr int kMaxTries = 50;
    for (int i = 0; !unfinished().mutex.try_lock(); ++i) {
        if (i == kMaxTries)
            return;
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    // For good: no file is created or renamed from here on.
    for (const auto& [path, lock] : unfinished().locks)
        std::remove(path.c_str());
    for (const std::function<void()>* const remove : unfinished().removals)
        try {
            (*remove)();
        } catch (...) { // what it did not remove stays, as after SIGKILL
        }
}

bool hasFinishedParts() {
    return gHasFinishedParts;
}

void noteFinishedParts() {
    gHasFinishedParts = true;
}

void clearFinishedParts() {
    gHasFinishedParts = false;
}

EndRemoval::EndRemoval(std::function<void()> remove) : remove_(std::move(remove)) {
    const std::lock_guard lock(unfinished().mutex);
    unfinished().removals.insert(&remove_);
}

EndRemoval::~EndRemoval() {
    const std::lock_guard lock(unfinished().mutex);
    unfinished().removals.erase(&remove_);
}

} // namespace shadowdag
