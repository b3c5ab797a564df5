// SPDX-License-Identifier: Apache-2.0
// A file that appears complete or not at all.
#pragma once

#include "scenes/file_attributes.h"

#include <cstddef>
#include <fstream>
#include <functional>
#include <limits>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>

namespace shadowdag {

/// The name of an unfinished file is that of its output, this, the number of the process, '-' and a
/// number.
constexpr std::string_view kTemporaryMark = ".tmp-";

/// The most bytes that it adds to the output's.
constexpr size_t kTemporarySuffixBytes = kTemporaryMark.size() +
                                         size_t(std::numeric_limits<pid_t>::digits10) + 1 + 1 +
                                         size_t(std::numeric_limits<unsigned>::digits10) + 1;

/// The most bytes that the path of a file with finished work (ScratchFolder) adds to the output's.
constexpr size_t kScratchPathBytes = std::string_view(".scratch/00000000.svpart").size();

/// Writes next to the file that the name leads to (outputTarget) and renames on commit(); the new
/// file has the attributes of the old one (FileAttributes). Destroyed without commit, it removes
/// its file and leaves an old file of that name unchanged. First it removes what killed processes
/// left of the same output. Throws Error kResource naming path and reason.
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
    std::optional<FileAttributes> old_; ///< of the file that is replaced, should it vanish
    bool committed_ = false;
};

/// Returns whether a file name is one that OutputFile gives to a file that is not yet complete.
bool isTemporaryName(std::string_view name);

/// Removes the unfinished files that killed processes left in a folder and the folders in it. Only
/// for a folder that no other process writes to.
void removeAbandonedFiles(const std::string& folder);

/// Removes what killed processes left of one output, as the constructor of OutputFile does. Lists
/// each folder once in the life of the process, so files that were left there later stay.
/// @param path of the output itself (outputTarget), not a link to it
void removeAbandonedFilesOf(const std::string& path);

/// Removes the temporary files of all OutputFiles of the process and calls the functions of
/// EndRemovals, just before it ends itself: from then on every thread that creates, commits or
/// destroys one of them waits forever. Removes and calls nothing if a thread that creates, renames
/// or removes such a file does not finish within a fraction of the half second that a signal may
/// take, as on a disk that does not answer; the files then stay, as after SIGKILL.
void removeUnfinishedFiles();

/// While it exists, removeUnfinishedFiles also calls a function, which removes unfinished files of
/// another kind.
class EndRemoval {
public:
    /// @param remove runs on the thread that ends the process, while others run, and with the lock
    /// of delayRemovalOfUnfinishedFiles held: it must not use an OutputFile, and must end soon. If
    /// it throws, what it has not removed stays
    explicit EndRemoval(std::function<void()> remove);
    ~EndRemoval();
    EndRemoval(const EndRemoval&) = delete;
    EndRemoval& operator=(const EndRemoval&) = delete;

private:
    std::function<void()> remove_;
};

/// While the result is held, removeUnfinishedFiles waits: for renames that belong together, and for
/// what its functions use. The thread that holds it must not create, commit or destroy an
/// OutputFile or an EndRemoval, create a ScratchFile, nor create, list or destroy a ScratchFolder.
std::unique_lock<std::mutex> delayRemovalOfUnfinishedFiles();

/// Returns whether finished parts of the process's unfinished work stay when it ends, so that the
/// same command with --resume would go on after them.
bool hasFinishedParts();

/// Says that they stay: for who has written the first of them, or has found it.
void noteFinishedParts();

/// Says that none stays: for who has removed them, or has made a complete output of them.
void clearFinishedParts();

} // namespace shadowdag
