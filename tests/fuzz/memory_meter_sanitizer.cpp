// SPDX-License-Identifier: Apache-2.0
// Counts by the hooks of AddressSanitizer's malloc.
#include "tests/fuzz/memory_count.h"

#include <sanitizer/allocator_interface.h>

namespace shadowdag::fuzz {

namespace {

void onMalloc(const volatile void*, size_t bytes) {
    memoryCount.add(bytes);
}

void onFree(const volatile void* data) {
    if (data)
        memoryCount.remove(__sanitizer_get_allocated_size(const_cast<const void*>(data)));
}

const bool areHooksSet = __sanitizer_install_malloc_and_free_hooks(onMalloc, onFree) != 0;

} // namespace

void startMemoryMeter() {
    if (!areHooksSet)
        __builtin_trap();
    startMemoryCount();
}

uint64_t meteredPeakBytes() {
    return countedPeakBytes();
}

} // namespace shadowdag::fuzz
