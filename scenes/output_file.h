// SPDX-License-Identifier: Apache-2.0
// A file that appears complete or not at all.
#pragma once

#include <cstddef>
#include <fstream>
#include <mutex>
#include <string>
#include <string_view>

namespace shadowdag {

/// Writes next to the file that the name leads to (outputTarget) and renames on commit(); destroyed
/// without commit, it removes its file and leaves an old file of that name unchanged. First it
/// removes what killed processes left of the same output. Throws Error kResource naming path and
/// reason.
class OutputFile {
public:
    explicit OutputFile(const std::string& path);
    ~OutputFile();
    OutputFile(const OutputFile&) = delete;
    OutputFile& operator=(const OutputFile&) = delete;

    void write(const void* data, size_t byteCount);
    void write(const std::string& text) { write(text.data(), text.size()); }
    /// Returns the temporary path, for libraries that open files by name themselves.
    const std::string& temporaryPath() const { return temporaryPath_; }
    /// Flushes to disk and renames. Call once, last. Throws the exceptions of pollCpu.
    void commit();

private:
    std::string path_;
    std::string temporaryPath_;
    std::ofstream stream_;
    bool committed_ = false;
};

/// Returns whether a file name is one that OutputFile gives to a file that is not yet complete.
bool isTemporaryName(std::string_view name);

/// Removes the unfinished files that killed processes left in a folder and the folders in it. Only
/// for a folder that no other process writes to.
void removeAbandonedFiles(const std::string& folder);

/// Removes the temporary files of all OutputFiles of the process, just before it ends itself: from
/// then on every thread that creates, commits or destroys one waits forever.
void removeUnfinishedFiles();

/// While the result is held, removeUnfinishedFiles waits: for renames that belong together. The
/// thread that holds it must not create, commit or destroy an OutputFile.
std::unique_lock<std::mutex> delayRemovalOfUnfinishedFiles();

} // namespace shadowdag
