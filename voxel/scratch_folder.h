// SPDX-License-Identifier: Apache-2.0
// The folder next to the output for data of a build that do not fit into memory.
#pragma once

#include "scenes/output_file.h"
#include "voxel/part_file.h"

#include <dirent.h>

#include <cstddef>
#include <cstdint>
#include <fstream>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace shadowdag {

/// The folder OUTPUT.scratch, held by one process at a time. It is removed at the end, also by an
/// exception or by removeUnfinishedFiles; a process that is killed leaves it. With `resume` it may
/// already hold finished parts (.svpart files), and it stays after both, so that the next build can
/// continue. Unfinished files of a killed process are removed at once. Only files with names that
/// builds use are ever removed. If its constructor throws, a folder that this made is removed, and
/// any other stays as it was.
class ScratchFolder {
public:
    /// Throws Error kUsage if the folder holds a file that no build writes, a finished part of
    /// another build than `own`, which the message describes, or a finished part and `resume` is
    /// false; kResource if another process uses it or it cannot be made.
    /// @param own this build, as far as it is known: only its scene hash, grid, version, options
    /// and share are read; null: of any build
    ScratchFolder(const std::string& outputPath, bool resume, const PartHeader* own = nullptr);
    ~ScratchFolder();
    ScratchFolder(const ScratchFolder&) = delete;
    ScratchFolder& operator=(const ScratchFolder&) = delete;

    std::string operator/(const std::string& name) const { return path_ + "/" + name; }
    /// Returns the paths of the files in it whose names end in `extension`, sorted.
    std::vector<std::string> files(std::string_view extension) const;
    /// Returns the path of a finished part: eight digits, or more, and .svpart.
    std::string partPath(uint32_t number) const;
    /// Throws Error kUsage, with what to do, if a part in it is of another build.
    void refuseOtherBuild(const PartHeader& found, const PartHeader& own) const;
    /// Remembers that a build which resumes this one would use a finished part (hasFinishedParts).
    void noteFinishedPart() const;

private:
    struct Close {
        void operator()(DIR* listing) const { ::closedir(listing); }
    };
    using Listing = std::unique_ptr<DIR, Close>;

    /// Returns null if the folder does not exist.
    Listing list() const;
    void refuseForeign(DIR* listing) const;
    void refuseParts(const PartHeader* own) const;
    /// Returns whether the folder is held now; false if its holder has removed it meanwhile.
    bool tryLock();
    /// Removes the files of builds except the lock, finished parts only if `withParts`.
    void empty(bool withParts) const;
    /// Removes the folder unless it is removed.
    void remove();

    std::string path_, lockPath_;
    bool resume_;
    int exceptionCount_;
    bool isNew_ = false; ///< made by this
    int lock_ = -1;      ///< an open file; -1: not held
    Listing listing_;    ///< open from the start, as memory and files may be short at the end
    std::optional<EndRemoval> atEnd_;
};

/// Removes the folder that a killed build of the same output left; for builds that need none.
/// Returns why it stays, for a warning, if it holds finished parts or a file that no build writes,
/// or if another process uses it; else "". @param own as ScratchFolder takes it
std::string removeAbandonedScratch(const std::string& outputPath, const PartHeader& own);

/// A file of a ScratchFolder, which the same process reads back: not synced, not renamed. Throws
/// Error kResource.
class ScratchFile {
public:
    explicit ScratchFile(const std::string& path);
    void write(const void* data, size_t byteCount);
    /// Call once, last.
    void close();

private:
    [[noreturn]] void fail() const;
    std::string path_;
    std::ofstream out_;
};

} // namespace shadowdag
