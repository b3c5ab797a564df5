// SPDX-License-Identifier: Apache-2.0
// How [0, count) is split into ranges for the CPU threads; used by both backends. Internal to this
// folder.
#pragma once

#include "cuda/cancel.h"

#include <algorithm>
#include <atomic>
#include <cstddef>

namespace shadowdag {

/// Cuts [0, count) into equal ranges, the last one shorter. The cut depends on count and grain
/// only, never on the number of threads, so that sums taken range by range are the same everywhere.
struct RangeCut {
    /// Enough ranges for load balance on any machine of today, few enough to make the overhead of a
    /// range small.
    static constexpr size_t kMaxRangeCount = 1024;

    RangeCut(size_t count, size_t grain)
        : count_(count),
          size_(std::max({grain, size_t(1), (count + kMaxRangeCount - 1) / kMaxRangeCount})) {}

    size_t rangeCount() const { return (count_ + size_ - 1) / size_; }
    size_t begin(size_t range) const { return range * size_; }
    size_t end(size_t range) const { return std::min(count_, (range + 1) * size_); }

private:
    size_t count_;
    size_t size_;
};

/// Polls before each range of one loop (cuda/cancel.h).
class RangePoll {
public:
    explicit RangePoll(size_t rangeCount) : rangeCount_(nesting() > 0 ? 0 : rangeCount) {}

    /// Runs one range: calls the poll function, then range(). Throws what they throw.
    template <class F> void run(const F& range) {
        pollCpu(rangeCount_ > 0 ? double(begunCount_++) / double(rangeCount_) : -1);
        struct Inside {
            Inside() { ++nesting(); }
            ~Inside() { --nesting(); }
        } const inside;
        range();
    }

private:
    /// Returns how many ranges this thread is inside of.
    static int& nesting() {
        thread_local int depth = 0;
        return depth;
    }

    const size_t rangeCount_; ///< 0: inside of another loop
    std::atomic<size_t> begunCount_{0};
};

} // namespace shadowdag
