// SPDX-License-Identifier: Apache-2.0
// The folder next to its output where a build keeps what does not fit into memory.
#pragma once

#include <cstddef>
#include <fstream>
#include <string>
#include <vector>

namespace shadowdag {

/// The folder OUTPUT.scratch, held by one process at a time. It is removed in the end, be it by an
/// exception; a process that is killed leaves it. With `resume` it may hold finished parts (.svpart
/// files) already, and stays when an exception ends the build, so that the next one can go on.
/// What a killed process left unfinished is removed at once. Only files with names that builds give
/// theirs are ever removed.
class ScratchFolder {
public:
    /// Throws Error kUsage when the folder holds another file than builds write, or a finished part
    /// and `resume` is false; kResource when another process uses it or it cannot be made.
    ScratchFolder(const std::string& outputPath, bool resume);
    ~ScratchFolder();
    ScratchFolder(const ScratchFolder&) = delete;
    ScratchFolder& operator=(const ScratchFolder&) = delete;

    std::string operator/(const std::string& name) const { return path_ + "/" + name; }
    /// Returns the paths of the files in it whose names end in `extension`, sorted.
    std::vector<std::string> files(const std::string& extension) const;

private:
    void refuseForeign() const;
    /// Returns whether the folder is held now; false when its holder removed it meanwhile.
    bool tryLock();
    /// Removes the files of builds but the lock, finished parts only if `withParts`.
    void empty(bool withParts) const;

    std::string path_;
    bool resume_;
    int exceptionCount_;
    int lock_ = -1;
};

/// A file that is written anew and read back by the same process: not synced, not renamed. Throws
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
