// SPDX-License-Identifier: Apache-2.0
// What both memory meters count with: from within malloc, so it allocates nothing.
#pragma once

#include "tests/fuzz/memory_meter.h"

#include <atomic>
#include <cstddef>

namespace shadowdag::fuzz {

struct MemoryCount {
    std::atomic<int64_t> held{0}, peak{0}, start{0};

    void add(size_t bytes) {
        const int64_t now = held += int64_t(bytes);
        int64_t most = peak;
        while (now > most && !peak.compare_exchange_weak(most, now)) {
        }
    }
    void remove(size_t bytes) { held -= int64_t(bytes); }
};

inline constinit MemoryCount memoryCount;

inline void startMemoryCount() {
    memoryCount.start = memoryCount.held.load();
    memoryCount.peak = memoryCount.held.load();
}

inline uint64_t countedPeakBytes() {
    return uint64_t(memoryCount.peak - memoryCount.start);
}

} // namespace shadowdag::fuzz
