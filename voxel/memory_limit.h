// SPDX-License-Identifier: Apache-2.0
// How much memory a build may still take.
#pragma once

#include <cstdint>
#include <string>

namespace shadowdag {

/// Returns the bytes of memory that the process has resident.
uint64_t residentBytes();

/// A bound on the resident size of the whole process.
class MemoryLimit {
public:
    /// Without a limit.
    MemoryLimit() = default;
    /// From now on, memory that is freed goes back to the system at once where it comes in large
    /// blocks (a setting of the C library, for the whole process). Throws Error kResource when the
    /// process is over the limit already.
    /// @param bytes above 0
    /// @param doing for messages, as in "voxelizing at 4096^3"
    MemoryLimit(uint64_t bytes, std::string doing);

    bool isSet() const { return bytes_ != 0; }
    /// Returns the bytes that may be allocated now, a reserve for small things left out; 2^62
    /// without a limit.
    uint64_t available() const;
    /// Throws Error kResource unless `bytes` more can be held. It says what takes more than the
    /// limit, not what the build does: what comes later is not known yet.
    void require(uint64_t bytes) const;
    /// The same where nothing later takes more, so that the message can name what is enough.
    void requireLast(uint64_t bytes) const;
    /// Throws that Error.
    [[noreturn]] void fail(uint64_t missingBytes, bool isLast) const;

private:
    void require(uint64_t bytes, bool isLast) const;

    uint64_t bytes_ = 0;
    std::string doing_;
};

} // namespace shadowdag
