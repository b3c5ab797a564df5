// SPDX-License-Identifier: Apache-2.0
// One writer per directory: a lock that ends with its process and leaves no file.
#pragma once

#include <string>

namespace shadowdag {

/// Holds a directory for this process (flock on the directory itself) from construction to
/// destruction. The lock is advisory: it excludes only processes that use it.
class DirectoryLock {
public:
    /// Throws Error kResource when another holds the directory, naming `option`, or when it cannot
    /// be opened or locked.
    DirectoryLock(const std::string& option, const std::string& directory);
    ~DirectoryLock();
    DirectoryLock(DirectoryLock&& other) noexcept;
    DirectoryLock& operator=(DirectoryLock&&) = delete;

private:
    int descriptor_;
};

} // namespace shadowdag
