// SPDX-License-Identifier: Apache-2.0
// Replaces glibc's malloc by one that counts. Source: The GNU C Library, Replacing malloc.
#include "tests/fuzz/memory_count.h"

#include <malloc.h>

#include <cerrno>

extern "C" {
void* __libc_malloc(size_t bytes);
void* __libc_calloc(size_t count, size_t bytes);
void* __libc_realloc(void* data, size_t bytes);
void* __libc_memalign(size_t alignment, size_t bytes);
void __libc_free(void* data);
}

namespace {

using shadowdag::fuzz::memoryCount;

void* counted(void* data) {
    if (data)
        memoryCount.add(malloc_usable_size(data));
    return data;
}

} // namespace

extern "C" {

void* malloc(size_t bytes) {
    return counted(__libc_malloc(bytes));
}
void* calloc(size_t count, size_t bytes) {
    return counted(__libc_calloc(count, bytes));
}
void* realloc(void* data, size_t bytes) {
    const size_t before = data ? malloc_usable_size(data) : 0;
    void* const moved = __libc_realloc(data, bytes);
    if (moved || bytes == 0)
        memoryCount.remove(before);
    return counted(moved);
}
void* memalign(size_t alignment, size_t bytes) {
    return counted(__libc_memalign(alignment, bytes));
}
void* aligned_alloc(size_t alignment, size_t bytes) {
    return counted(__libc_memalign(alignment, bytes));
}
int posix_memalign(void** data, size_t alignment, size_t bytes) {
    *data = counted(__libc_memalign(alignment, bytes));
    return *data ? 0 : ENOMEM;
}
void free(void* data) {
    if (data)
        memoryCount.remove(malloc_usable_size(data));
    __libc_free(data);
}
}

namespace shadowdag::fuzz {

void startMemoryMeter() {
    startMemoryCount();
}

uint64_t meteredPeakBytes() {
    return countedPeakBytes();
}

} // namespace shadowdag::fuzz
