// SPDX-License-Identifier: Apache-2.0
#include "tests/voxel/failing_allocation.h"

#include <atomic>
#include <cstdlib>
#include <new>

namespace {

std::atomic<long> gCount{0}, gFailing{0};

} // namespace

void* operator new(size_t bytes) {
    if (++gCount == gFailing)
        throw std::bad_alloc();
    if (void* const data = std::malloc(bytes ? bytes : 1))
        return data;
    throw std::bad_alloc();
}
void operator delete(void* data) noexcept {
    std::free(data);
}
void operator delete(void* data, size_t) noexcept {
    std::free(data);
}

namespace shadowdag::test {

void failAllocation(long number) {
    gCount = 0;
    gFailing = number;
}

long allocationCount() {
    return gCount;
}

} // namespace shadowdag::test
