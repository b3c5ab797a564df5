// SPDX-License-Identifier: Apache-2.0
// The directory of a report: the files that may be replaced, and how a new report replaces an older
// one. Unfinished files are in its folder `partial`, so that a run that is killed does not damage
// an older report.
#pragma once

#include "tools/workspace/directory_lock.h"

#include <optional>
#include <string>
#include <vector>

namespace shadowdag {

/// Removes at its end those directories that did not exist when it was created and are empty: the
/// given one and those above it.
class DirectoryGuard {
public:
    explicit DirectoryGuard(const std::string& directory);
    ~DirectoryGuard();
    DirectoryGuard(const DirectoryGuard&) = delete;
    DirectoryGuard& operator=(const DirectoryGuard&) = delete;

private:
    std::vector<std::string> fresh_; ///< the innermost first
};

/// Creates a directory and those above it, and tests that a file can be created in it. Throws Error
/// kResource if it cannot be created, if something else is there, if its path leaves no room for
/// the files of a report, or if this user may not write into it.
void createDirectory(const std::string& path);

/// Creates the directory and tests that it can be written to, before any work. Unless resumed,
/// `partial` is emptied. Returns the lock that excludes other runs. Throws Error kUsage if the
/// directory contains a file with a report's name, or in a report's folder, that this program did
/// not write, a report where a part is to be written or the reverse, or, unless resumed, finished
/// parts of an interrupted run; kInput if a JSON file of its report or the journal of its finished
/// parts is damaged; kResource if another run is at work there, if createDirectory fails, or if a
/// file or a folder of its report may not be replaced or moved.
[[nodiscard]] DirectoryLock prepareDirectory(const std::string& directory, bool resume,
                                             bool isPart);

/// A prepared directory, locked until the end; then a `partial` without a finished part, which
/// could not be resumed, is removed, as DirectoryGuard does with the rest.
class ReportDirectory {
public:
    /// Throws as prepareDirectory does.
    ReportDirectory(const std::string& directory, bool resume, bool isPart);
    ~ReportDirectory();

private:
    std::string partial_;
    std::optional<DirectoryLock> lock_; ///< outlives the guard
    DirectoryGuard guard_;
};

/// Replaces an older report by the finished parts in `partial`, by renaming alone; the older one is
/// deleted only after the new one is in place. Files and folders of the same names keep their
/// attributes (FileAttributes). Throws Error kUsage as prepareDirectory does if files that this
/// program did not write have come since, and kResource, with the older one restored.
void swapReport(const std::string& directory);

/// Returns whether a directory contains a report, or a part of one, of this program.
bool holdsReport(const std::string& directory);

/// Returns whether a directory contains the rows of tracers that `rays` writes.
bool holdsTracerRows(const std::string& directory);

} // namespace shadowdag
