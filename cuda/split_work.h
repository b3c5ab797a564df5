// SPDX-License-Identifier: Apache-2.0
// Items of very unequal size: what is too large for one thread goes, in parts, on a list, and a
// second pass gives every part to a group of lanes. So a triangle that covers the picture keeps no
// thread of a GPU busy while all others wait. Source: the split of small and large triangles in
// Laine, Karras, High-Performance Software Rasterization on GPUs, HPG 2011, sec. 4.
#pragma once

#include "cuda/atomics.h"
#include "cuda/buffer.h"
#include "cuda/parallel_for.h"

namespace shadowdag {

/// Lanes that take a part together: a warp of a GPU.
constexpr uint32_t kGroupLanes = 32;

/// Limits of a list, so that its counts fit one word: items, and parts of an item.
constexpr size_t kMaxSplitItems = size_t(1) << 20;
constexpr uint32_t kMaxSplitParts = 1u << 19;

/// An item that was split; `a` and `b` say which, in the terms of whoever added it.
struct SplitItem {
    uint64_t firstPart; ///< number of its first part in the whole list
    uint32_t partCount;
    uint32_t a, b;
};

/// The list as passes see it.
struct SplitWorkView {
    View<SplitItem> items;
    View<uint64_t> taken; ///< [0]: items from bit kPartBits on, their parts below; [1]: refused

    static constexpr uint32_t kPartBits = 40;

    /// Adds an item of 1..kMaxSplitParts parts; returns false, and counts, when the list has no
    /// room: the caller then does all of it by itself. Which items find room depends on the order
    /// of threads, what the parts are does not.
    SDAG_HD bool add(uint32_t a, uint32_t b, uint32_t partCount) const {
        // Asked first, so that the counts exceed the list by no more than the threads that run at
        // once; added in one step, so that items and their parts ascend together.
        if (loadRelaxed(&taken[0]) >> kPartBits < items.count) {
            const uint64_t seen =
                atomicAddRelaxed(&taken[0], (uint64_t(1) << kPartBits) + partCount);
            if (seen >> kPartBits < items.count) {
                items[seen >> kPartBits] = {seen & ((uint64_t(1) << kPartBits) - 1), partCount, a,
                                            b};
                return true;
            }
        }
        atomicAddRelaxed(&taken[1], 1);
        return false;
    }
    /// Return how many items the list holds, and their parts. For passes after the one that adds.
    SDAG_HD size_t itemCount() const {
        const size_t asked = size_t(taken[0] >> kPartBits);
        return asked < items.count ? asked : items.count;
    }
    SDAG_HD uint64_t partCount() const {
        const size_t count = itemCount();
        return count == 0 ? 0 : items[count - 1].firstPart + items[count - 1].partCount;
    }
    /// Returns the item that a part is of.
    SDAG_HD SplitItem itemOf(uint64_t part) const {
        size_t first = 0, end = itemCount();
        while (end - first > 1) {
            const size_t middle = first + (end - first) / 2;
            (items[middle].firstPart <= part ? first : end) = middle;
        }
        return items[first];
    }
};

/// The list on one backend.
class SplitWork {
public:
    /// @param capacity items that the list holds at first, kMaxSplitItems at most; memory is taken
    /// when it is used
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
    /// Makes room for what the last use refused, as far as kMaxSplitItems, for the next. A round
    /// trip on CUDA. Returns how many items were refused; their threads did all of them.
    uint64_t grow() {
        if (taken_.size() == 0)
            return 0;
        const uint64_t refused = taken_.at(1);
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
/// A warp takes every so manieth part: how many there are, only the device knows.
template <class Tag, class F> __global__ void sharePartsKernel(SplitWorkView work, F functor) {
    static_assert(std::is_same_v<Tag, CudaTag>);
    const uint64_t groupCount = uint64_t(gridDim.x) * (blockDim.x / kGroupLanes);
    const uint64_t partCount = work.partCount();
    const uint64_t thread = blockIdx.x * uint64_t(blockDim.x) + threadIdx.x;
    for (uint64_t part = thread / kGroupLanes; part < partCount; part += groupCount) {
        const SplitItem item = work.itemOf(part);
        functor(item, uint32_t(part - item.firstPart), threadIdx.x % kGroupLanes);
    }
}
#endif

/// Runs functor(item, part of the item, lane) for every lane in [0, kGroupLanes) of every part of
/// `work`, under the terms of parallelFor; lanes of one part may run at once.
template <class Tag, class F> void parallelForParts(const SplitWorkView& work, const F& functor) {
    if constexpr (std::is_same_v<Tag, CpuTag>) {
        parallelFor<CpuTag>(
            work.partCount(),
            [&](size_t part) {
                const SplitItem item = work.itemOf(part);
                for (uint32_t lane = 0; lane < kGroupLanes; ++lane)
                    functor(item, uint32_t(part - item.firstPart), lane);
            },
            1);
    } else {
#if defined(__CUDACC__)
        // Enough warps to hide what one waits for; more only take turns.
        constexpr unsigned kBlockSize = 128, kBlocksPerProcessor = 8;
        int device = 0, processorCount = 0;
        CUDA_CHECK(cudaGetDevice(&device));
        CUDA_CHECK(cudaDeviceGetAttribute(&processorCount, cudaDevAttrMultiProcessorCount, device));
        sharePartsKernel<Tag>
            <<<unsigned(processorCount) * kBlocksPerProcessor, kBlockSize>>>(work, functor);
        CUDA_CHECK(cudaGetLastError());
#else
        static_assert(std::is_same_v<Tag, CpuTag>,
                      "CUDA passes are instantiated in .cu files only");
#endif
    }
}

} // namespace shadowdag
