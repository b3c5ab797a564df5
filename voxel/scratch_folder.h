// SPDX-License-Identifier: Apache-2.0
// Where a build keeps what does not fit into memory: a folder beside its output.
#pragma once

#include <cstddef>
#include <fstream>
#include <string>
#include <vector>

namespace shadowdag {

/// The folder OUTPUT.scratch, held by one process at a time. It is removed with all in it in the
/// end, be it by an exception; a process that is killed leaves it. With `resume` it may be there
/// already, and stays when an exception ends the build, so that the next one can go on.
class ScratchFolder {
public:
    /// Throws Error kUsage when the folder holds something and `resume` is false, kResource when
    /// another process uses it or it cannot be made.
    ScratchFolder(const std::string& outputPath, bool resume);
    ~ScratchFolder();
    ScratchFolder(const ScratchFolder&) = delete;
    ScratchFolder& operator=(const ScratchFolder&) = delete;

    std::string operator/(const std::string& name) const { return path_ + "/" + name; }
    /// Returns the paths of the files in it whose names end in `extension`, sorted.
    std::vector<std::string> files(const std::string& extension) const;
    /// Removes the files in it whose names do not end in `extension`: what a killed process left
    /// unfinished.
    void removeOthers(const std::string& extension) const;

private:
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
