// SPDX-License-Identifier: Apache-2.0
// The directory of a report: what may be replaced in it, and how a new report takes the place of an
// older one. Everything unfinished lives in its folder `partial`, so that a compare that dies harms
// no older report.
#pragma once

#include "tools/workspace/directory_lock.h"

#include <optional>
#include <string>
#include <vector>

namespace shadowdag {

/// Takes away at its end, of the directories that were not there when it was made, those that are
/// empty: the one that is named and those above it.
class DirectoryGuard {
public:
    explicit DirectoryGuard(const std::string& directory);
    ~DirectoryGuard();
    DirectoryGuard(const DirectoryGuard&) = delete;
    DirectoryGuard& operator=(const DirectoryGuard&) = delete;

private:
    std::vector<std::string> fresh_; ///< the innermost first
};

/// Makes the directory and proves that it can be written to, before any work. Unless it is resumed,
/// `partial` is emptied. Returns the lock that keeps other compares out. Throws Error kUsage when
/// another compare is at work there, when the directory holds anything of a report's names that no
/// compare made, or a report where a part is to come or the reverse; kResource when it cannot be
/// made.
[[nodiscard]] DirectoryLock prepareDirectory(const std::string& directory, bool resume,
                                             bool isPart);

/// A directory that was prepared, held to its end; then a `partial` without a finished part, of
/// which nothing could be resumed, is taken away, as DirectoryGuard does with the rest.
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

/// Puts the finished parts in `partial` into the place of an older report, by renaming alone; the
/// older one is deleted only when the new one stands. Throws Error kResource, the older one back in
/// its place.
void swapReport(const std::string& directory);

} // namespace shadowdag
