// SPDX-License-Identifier: Apache-2.0
#include "voxel/memory_limit.h"

#include "cuda/error.h"
#include "scenes/input_file.h"

#include <unistd.h>
#if defined(__GLIBC__)
#include <malloc.h>
#endif

#include <fstream>
#include <utility>

namespace shadowdag {
namespace {

// Stacks of threads, buffers of files, code pages not yet touched, blocks too small to be returned.
constexpr uint64_t kReserveBytes = uint64_t(12) << 20;

std::string mebibytes(uint64_t bytes) {
    return std::to_string((bytes + (1 << 20) - 1) >> 20) + "M";
}

} // namespace

uint64_t residentBytes() {
    std::ifstream file = openInput("/proc/self/statm");
    uint64_t total = 0, resident = 0;
    if (!(file >> total >> resident))
        throw Error(ErrorKind::kResource, "/proc/self/statm cannot be read, so no memory limit can "
                                          "be kept; run without --memory-limit");
    return resident * uint64_t(::sysconf(_SC_PAGESIZE));
}

MemoryLimit::MemoryLimit(uint64_t bytes, std::string doing)
    : bytes_(bytes), doing_(std::move(doing)) {
#if defined(__GLIBC__)
    // By default the C library raises this threshold with every large block that is freed, and
    // keeps the blocks below it.
    ::mallopt(M_MMAP_THRESHOLD, 128 << 10);
    ::mallopt(M_TRIM_THRESHOLD, 1 << 20);
    ::malloc_trim(0);
#endif
    require(0);
}

uint64_t MemoryLimit::available() const {
    if (bytes_ == 0)
        return uint64_t(1) << 62;
    const uint64_t used = residentBytes() + kReserveBytes;
    return used < bytes_ ? bytes_ - used : 0;
}

void MemoryLimit::require(uint64_t bytes) const {
    require(bytes, false);
}

void MemoryLimit::requireLast(uint64_t bytes) const {
    require(bytes, true);
}

void MemoryLimit::require(uint64_t bytes, bool isLast) const {
    if (bytes_ == 0)
        return;
    const uint64_t used = residentBytes() + kReserveBytes;
    if (used + bytes > bytes_)
        fail(used + bytes - bytes_, isLast);
}

void MemoryLimit::fail(uint64_t missingBytes, bool isLast) const {
    throw Error(ErrorKind::kResource, doing_ + " under --memory-limit " + mebibytes(bytes_) +
                                          (isLast ? " needs about " : " needs more than ") +
                                          mebibytes(bytes_ + missingBytes) +
                                          "; allow more, build a part of it with --part, or choose "
                                          "a lower resolution");
}

} // namespace shadowdag
