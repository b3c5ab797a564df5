// SPDX-License-Identifier: Apache-2.0
// One writer a directory: a lock that dies with its process and leaves no file.
#pragma once

#include <string>

namespace shadowdag {

/// Holds a directory for this process (flock on the directory itself) from construction to
/// destruction. Those that do not ask for the lock are not kept out.
class DirectoryLock {
public:
    /// Throws Error kUsage when another holds the directory, naming `option`; kResource when it
    /// cannot be opened or locked.
    DirectoryLock(const std::string& option, const std::string& directory);
    ~DirectoryLock();
    DirectoryLock(DirectoryLock&& other) noexcept;
    DirectoryLock& operator=(DirectoryLock&&) = delete;

private:
    int descriptor_;
};

} // namespace shadowdag
