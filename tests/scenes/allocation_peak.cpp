// SPDX-License-Identifier: Apache-2.0
#include "tests/scenes/allocation_peak.h"

#include <malloc.h>

#include <atomic>
#include <cstdlib>
#include <new>

namespace {

std::atomic<long long> gHeld{0}, gPeak{0}, gStart{0};

void* allocate(size_t bytes) {
    void* data = std::malloc(bytes ? bytes : 1);
    if (!data)
        throw std::bad_alloc();
    const long long held = gHeld += (long long)malloc_usable_size(data);
    long long peak = gPeak;
    while (held > peak && !gPeak.compare_exchange_weak(peak, held)) {
    }
    return data;
}

void release(void* data) {
    if (data)
        gHeld -= (long long)malloc_usable_size(data);
    std::free(data);
}

} // namespace

void* operator new(size_t bytes) {
    return allocate(bytes);
}
void* operator new[](size_t bytes) {
    return allocate(bytes);
}
void operator delete(void* data) noexcept {
    release(data);
}
void operator delete[](void* data) noexcept {
    release(data);
}
void operator delete(void* data, size_t) noexcept {
    release(data);
}
void operator delete[](void* data, size_t) noexcept {
    release(data);
}

namespace shadowdag::test {

void resetAllocationPeak() {
    gStart = gHeld.load();
    gPeak = gHeld.load();
}

size_t allocationPeakBytes() {
    return size_t(gPeak - gStart);
}

} // namespace shadowdag::test
