// SPDX-License-Identifier: Apache-2.0
// How much more memory a build may take.
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
    /// From now on, large blocks that are freed are returned to the system at once (a setting of
    /// the C library, for the whole process). Throws Error kResource if the process is over the
    /// limit already.
    /// @param bytes above 0
    /// @param doing for messages, as in "voxelizing at 4096^3"
    MemoryLimit(uint64_t bytes, std::string doing);

    bool isSet() const { return bytes_ != 0; }
    /// Returns the bytes that may be allocated now, less a reserve for small allocations; 2^62
    /// without a limit.
    uint64_t available() const;
    /// Throws Error kResource unless `bytes` more fit into the limit. The message states what
    /// exceeds the limit, not the need of the whole build, which is not known yet.
    void require(uint64_t bytes) const;
    /// The same if nothing later takes more, so that the message can state a sufficient limit.
    void requireLast(uint64_t bytes) const;
    /// Throws that Error.
    [[noreturn]] void fail(uint64_t missingBytes, bool isLast) const;

private:
    void require(uint64_t bytes, bool isLast) const;

    uint64_t bytes_ = 0;
    std::string doing_;
};

} // namespace shadowdag
