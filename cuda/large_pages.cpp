// SPDX-License-Identifier: Apache-2.0
#include "cuda/large_pages.h"

#include <cstdint>

#if defined(__linux__)
#include <sys/mman.h>
#endif

namespace shadowdag {

void useLargePages([[maybe_unused]] void* data, [[maybe_unused]] size_t bytes) {
#if defined(__linux__)
    const uintptr_t first = reinterpret_cast<uintptr_t>(data);
    const uintptr_t begin = (first + kLargePageBytes - 1) / kLargePageBytes * kLargePageBytes;
    const uintptr_t end = (first + bytes) / kLargePageBytes * kLargePageBytes;
    if (begin < end)
        madvise(reinterpret_cast<void*>(begin), end - begin, MADV_HUGEPAGE); // advice only
#endif
}

} // namespace shadowdag
