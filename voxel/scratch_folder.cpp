// SPDX-License-Identifier: Apache-2.0
#include "voxel/scratch_folder.h"

#include "cuda/error.h"
#include "scenes/input_file.h"
#include "scenes/write_remedy.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <exception>
#include <filesystem>
#include <new>
#include <string_view>
#include <utility>

namespace shadowdag {

namespace fs = std::filesystem;

namespace {

constexpr std::string_view kFolderSuffix = ".scratch";
constexpr std::string_view kPartExtension = ".svpart";
constexpr size_t kPartDigits = 8;
static_assert(kFolderSuffix.size() <= kTemporarySuffixBytes &&
                  kFolderSuffix.size() + 1 + kPartDigits + kPartExtension.size() ==
                      kScratchPathBytes,
              "outputTarget leaves room for names");

const char* const kLockName = "lock";

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
    std::string_view level = name, map = name;
    if (name == kLockName || (take(level, "level-") && takeNumber(level) && level == ".nodes") ||
        (take(map, "map-") && takeNumber(map) && take(map, "-") && takeNumber(map) && map.empty()))
        return true;
    std::string_view part =
        name.substr(0, isTemporaryName(name) ? name.rfind(kTemporaryMark) : name.npos);
    return takeNumber(part) && part == kPartExtension;
}

/// Calls visit(name) for each entry of a folder, without memory of its own; null: of none.
template <class Visit> void forEntries(DIR* listing, const Visit& visit) {
    if (!listing)
        return;
    ::rewinddir(listing);
    while (const dirent* const entry = ::readdir(listing))
        if (const std::string_view name = entry->d_name; name != "." && name != "..")
            visit(entry->d_name);
}

} // namespace

ScratchFolder::ScratchFolder(const std::string& outputPath, bool resume, const PartHeader* own)
    : path_(outputPath + std::string(kFolderSuffix)), lockPath_(path_ + "/lock"), resume_(resume),
      exceptionCount_(std::uncaught_exceptions()) {
    try {
        while (!tryLock()) {
        }
        listing_ = list();
        refuseForeign(listing_.get());
        refuseParts(own);
        empty(false);
        if (!resume)
            atEnd_.emplace([this] { remove(); });
    } catch (...) {
        if (isNew_ && lock_ >= 0)
            ::unlink(lockPath_.c_str());
        if (isNew_)
            ::rmdir(path_.c_str()); // another process may use it by now: then it is not empty
        if (lock_ >= 0)
            ::close(lock_);
        throw;
    }
}

void ScratchFolder::refuseParts(const PartHeader* own) const {
    bool hasOwn = false;
    for (const std::string& path : files(kPartExtension)) {
        if (own)
            try {
                PartHeader same = *own;
                const PartHeader found = PartReader(path).header();
                same.taskCount = found.taskCount; // which follows from the rest
                refuseOtherBuild(found, same);
                hasOwn = true;
            } catch (const Error& error) {
                if (error.kind() != ErrorKind::kInput) // a damaged one is reported where it is read
                    throw;
            }
        if (!resume_)
            throw Error(ErrorKind::kUsage,
                        path_ + " holds the files of an unfinished voxelize; continue it with "
                                "voxelize --resume, or remove the folder");
    }
    if (hasOwn)
        noteFinishedPart();
}

void ScratchFolder::refuseOtherBuild(const PartHeader& found, const PartHeader& own) const {
    if (const std::string other = otherBuildOf(found, own); !other.empty())
        throw Error(ErrorKind::kUsage,
                    path_ + " holds the files of an unfinished voxelize, " + other +
                        "; delete the folder, or choose another output to keep that build "
                        "resumable");
}

std::string ScratchFolder::partPath(uint32_t number) const {
    std::string digits = std::to_string(number);
    digits.insert(0, kPartDigits - std::min(kPartDigits, digits.size()), '0');
    return *this / digits.append(kPartExtension);
}

void ScratchFolder::noteFinishedPart() const {
    if (resume_)
        noteFinishedParts();
}

bool ScratchFolder::tryLock() {
    std::error_code error;
    isNew_ = fs::create_directory(path_, error);
    if (!isNew_ && !error) // before a lock is put into a folder of something else
        refuseForeign(list().get());
    if (!error)
        lock_ = ::open(lockPath_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0666);
    if (lock_ < 0) {
        if (!error && errno == ENOENT && !fs::exists(path_))
            return false;
        const int failure = error ? error.value() : errno;
        if (!error)
            refuseTooManyFiles(lockPath_, failure);
        throw Error(ErrorKind::kResource, "cannot make the folder " + path_ +
                                              " for unfinished work: " + std::strerror(failure) +
                                              "; " + writeRemedy(failure));
    }
    // The lock ends with the process that holds it, in whatever way that ends.
    if (::flock(lock_, LOCK_EX | LOCK_NB) != 0) {
        ::close(std::exchange(lock_, -1));
        throw Error(ErrorKind::kResource, path_ + " is in use by another process that builds the "
                                                  "same file; wait for it or stop it");
    }
    // Its last holder may have removed it between the two calls above.
    struct stat held, there;
    if (::fstat(lock_, &held) == 0 && ::stat(lockPath_.c_str(), &there) == 0 &&
        held.st_dev == there.st_dev && held.st_ino == there.st_ino)
        return true;
    ::close(std::exchange(lock_, -1));
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
    clearFinishedParts();
    empty(true);
    // Last, and while it is held: a process that has opened it by then sees that it is gone.
    ::unlink(lockPath_.c_str());
    ::rmdir(path_.c_str());
    ::close(std::exchange(lock_, -1));
}

ScratchFolder::Listing ScratchFolder::list() const {
    Listing listing(::opendir(path_.c_str()));
    const int error = errno;
    if (listing || error == ENOENT)
        return listing;
    refuseTooManyFiles(path_, error);
    if (error == ENOMEM)
        throw std::bad_alloc();
    throw Error(ErrorKind::kResource, "cannot list " + path_ + ": " + std::strerror(error) +
                                          "; choose another place for the output");
}

void ScratchFolder::refuseForeign(DIR* listing) const {
    forEntries(listing, [&](const char* name) {
        if (!isOwn(name))
            throw Error(ErrorKind::kUsage, path_ + " is for unfinished work, but contains '" +
                                               name +
                                               "', which no build wrote; move it or choose "
                                               "another name for the output");
    });
}

void ScratchFolder::empty(bool withParts) const {
    // Without memory or files of its own, as the process may end because they are short.
    forEntries(listing_.get(), [&](const char* entry) {
        const std::string_view name = entry;
        if (isOwn(name) && name != kLockName && (withParts || !name.ends_with(kPartExtension)))
            ::unlinkat(::dirfd(listing_.get()), entry, 0);
    });
}

std::vector<std::string> ScratchFolder::files(std::string_view extension) const {
    const auto held = delayRemovalOfUnfinishedFiles(); // which reads the same listing
    std::vector<std::string> paths;
    forEntries(listing_.get(), [&](const char* name) {
        if (std::string_view(name).ends_with(extension))
            paths.push_back(*this / name);
    });
    std::sort(paths.begin(), paths.end());
    return paths;
}

std::string removeAbandonedScratch(const std::string& outputPath, const PartHeader& own) {
    std::error_code ignored;
    if (!fs::is_directory(outputPath + std::string(kFolderSuffix), ignored))
        return "";
    try {
        const ScratchFolder removed(outputPath, false, &own);
        return "";
    } catch (const Error& error) {
        return error.what();
    }
}

ScratchFile::ScratchFile(const std::string& path) : path_(path) {
    const auto held = delayRemovalOfUnfinishedFiles(); // which removes the folder
    out_.open(path, std::ios::binary | std::ios::trunc);
    if (!out_)
        fail();
}

void ScratchFile::fail() const {
    const int error = errno;
    refuseTooManyFiles(path_, error);
    throw Error(ErrorKind::kResource, "cannot write '" + path_ + "': " + std::strerror(error) +
                                          "; " + writeRemedy(error));
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
