// SPDX-License-Identifier: Apache-2.0
#include "scenes/output_file.h"

#include "cuda/cancel.h"
#include "cuda/error.h"
#include "cuda/macros.h"

#include <fcntl.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <mutex>
#include <set>
#include <utility>
#include <vector>

namespace shadowdag {

namespace {

std::atomic<unsigned> gFileCounter{0};

constexpr std::string_view kTemporaryMark = ".tmp-"; // then the process, '-' and a number

/// The temporary files of the process.
struct Unfinished {
    std::mutex mutex;
    std::set<std::string> paths;
};

Unfinished& unfinished() {
    static Unfinished all;
    return all;
}

[[noreturn]] void fail(const std::string& what, const std::string& path, int error) {
    throw Error(ErrorKind::kResource,
                what + " '" + path + "': " + (error ? std::strerror(error) : "unknown reason") +
                    "; choose another place or free some disk space");
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

OutputFile::OutputFile(std::string path) : path_(std::move(path)) {
    if (path_.empty())
        throw Error(ErrorKind::kResource, "cannot write a file with an empty name; give a name");
    std::error_code ignored;
    if (std::filesystem::is_directory(path_, ignored))
        throw Error(ErrorKind::kResource,
                    "cannot write '" + path_ + "': it is a folder; name a file in it");
    // The process id and a counter distinguish two writers of one name; the same folder keeps the
    // rename atomic.
    temporaryPath_ = path_ + std::string(kTemporaryMark) + std::to_string(::getpid()) + "-" +
                     std::to_string(gFileCounter.fetch_add(1));
    const std::lock_guard lock(unfinished().mutex);
    unfinished().paths.insert(temporaryPath_);
    errno = 0;
    stream_.open(temporaryPath_, std::ios::binary | std::ios::trunc);
    if (!stream_) {
        unfinished().paths.erase(temporaryPath_);
        fail("cannot create", temporaryPath_, errno);
    }
}

OutputFile::~OutputFile() {
    if (committed_)
        return;
    stream_.close();
    const std::lock_guard lock(unfinished().mutex);
    std::remove(temporaryPath_.c_str());
    unfinished().paths.erase(temporaryPath_);
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
    if (std::rename(temporaryPath_.c_str(), path_.c_str()) != 0)
        fail("cannot rename the finished file to", path_, errno);
    unfinished().paths.erase(temporaryPath_);
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
    namespace fs = std::filesystem;
    std::error_code ignored;
    std::vector<fs::path> abandoned;
    for (fs::recursive_directory_iterator entry(folder, ignored), end; entry != end;
         entry.increment(ignored))
        if (entry->is_regular_file(ignored) && isTemporaryName(entry->path().filename().string()))
            abandoned.push_back(entry->path());
    for (const fs::path& path : abandoned)
        fs::remove(path, ignored);
}

void removeUnfinishedFiles() {
    unfinished().mutex.lock(); // for good: no file is created or renamed from here on
    for (const std::string& path : unfinished().paths)
        std::remove(path.c_str());
}

} // namespace shadowdag
