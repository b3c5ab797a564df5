// SPDX-License-Identifier: Apache-2.0
// The list of split_work_view.h on a backend, and the pass over its parts.
#pragma once

#include "cuda/buffer.h"
#include "cuda/parallel_for.h"
#include "cuda/split_work_view.h"
#include "cuda/warp.h"

namespace shadowdag {

/// The list on one backend.
class SplitWork {
public:
    /// @param capacity initial items of the list, kMaxSplitItems at most; memory is allocated at
    /// first use
    SplitWork(Backend backend, const std::string& name, size_t capacity)
        : items_(backend, name), taken_(backend, name + " counts"), capacity_(capacity) {
        SDAG_ASSERT(capacity <= kMaxSplitItems);
    }

    /// Empties the list and returns it.
    SplitWorkView begin() {
        items_.resize(capacity_);
        taken_.resize(2);
        taken_.fill(0);
        return {items_.view(), taken_.view()};
    }
    /// Makes space for the items that the last use refused, up to kMaxSplitItems, for the next. A
    /// round trip on CUDA. Returns how many items were refused; their threads did all of their
    /// work.
    uint64_t grow() {
        if (taken_.size() == 0)
            return 0;
        const uint64_t refused = taken_.at(1);
        if (refused == 0)
            return 0;
        taken_.fill(0); // queried once
        const uint64_t wanted = capacity_ + refused;
        capacity_ = wanted < kMaxSplitItems ? size_t(wanted) : kMaxSplitItems;
        return refused;
    }
    size_t capacity() const { return capacity_; }

private:
    Buffer<SplitItem> items_;
    Buffer<uint64_t> taken_;
    size_t capacity_;
};

#if defined(__CUDACC__)
/// A warp takes up to 32 parts at a time, far apart from each other: consecutive parts of one
/// triangle go to different warps. Only the device knows how many there are. Each lane
/// asks about one of them; those that are wanted are done by all lanes together.
template <class Tag, class F>
__global__ void __launch_bounds__(kBlockThreads, kBlocksPerProcessor)
    sharePartsKernel(SplitWorkView work, F functor) {
    static_assert(std::is_same_v<Tag, CudaTag>);
    const uint64_t warpCount = uint64_t(gridDim.x) * (blockDim.x / kGroupLanes);
    const uint64_t partCount = work.partCount();
    for (uint64_t first = warpOfGrid(); first < partCount; first += warpCount * kGroupLanes) {
        const uint64_t asked = first + laneOfWarp() * warpCount;
        uint32_t index = 0, part = 0;
        bool isWanted = false;
        if (asked < partCount) {
            const SplitItem item = work.itemOf(asked);
            index = item.index;
            part = uint32_t(asked - item.firstPart);
            isWanted = functor.wants(item, part);
        }
        for (uint32_t wanted = __ballot_sync(kAllLanes, isWanted); wanted != 0;
             wanted &= wanted - 1) {
            const int lane = __ffs(int(wanted)) - 1;
            const uint32_t itsIndex = __shfl_sync(kAllLanes, index, lane),
                           itsPart = __shfl_sync(kAllLanes, part, lane);
            functor(work.items[itsIndex], itsPart, laneOfWarp());
        }
    }
}
#endif

/// Runs functor(item, part of the item, lane) for every lane in [0, kGroupLanes) of every part of
/// `work` for which functor.wants(item, part of the item) is true, under the terms of parallelFor;
/// lanes of one part may run at once.
template <class Tag, class F> void parallelForParts(const SplitWorkView& work, const F& functor) {
    if constexpr (std::is_same_v<Tag, CpuTag>) {
        parallelFor<CpuTag>(
            work.partCount(),
            [&](size_t part) {
                const SplitItem item = work.itemOf(part);
                if (!functor.wants(item, uint32_t(part - item.firstPart)))
                    return;
                for (uint32_t lane = 0; lane < kGroupLanes; ++lane)
                    functor(item, uint32_t(part - item.firstPart), lane);
            },
            1);
    } else {
#if defined(__CUDACC__)
        launch(sharePartsKernel<Tag, F>, fillingBlocks(), work, functor);
#else
        static_assert(std::is_same_v<Tag, CpuTag>,
                      "CUDA passes are instantiated in .cu files only");
#endif
    }
}

} // namespace shadowdag
