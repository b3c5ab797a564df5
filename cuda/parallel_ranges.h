// SPDX-License-Identifier: Apache-2.0
// How [0, count) is split into ranges for the CPU threads; used by both backends. Internal to this
// folder.
#pragma once

#include <algorithm>
#include <cstddef>

namespace shadowdag {

/// Cuts [0, count) into equal ranges, the last one shorter. The cut depends on count and grain
/// only, never on the number of threads, so that sums taken range by range are the same everywhere.
struct RangeCut {
    /// Enough for balance on any machine of today, few enough that a range is worth its start.
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

} // namespace shadowdag
