// SPDX-License-Identifier: Apache-2.0
// Kernels in which a warp takes an item. Where the compiler is not CUDA's only what needs no lanes.
#pragma once

#include "cuda/split_work_view.h"

namespace shadowdag {

/// Returns the first of 32 ascending numbers that is above `value`; the last one is.
SDAG_HD inline uint32_t firstAbove(const uint32_t* ascending, uint32_t value) {
    uint32_t at = 0;
    for (uint32_t step = kGroupLanes / 2; step > 0; step /= 2)
        if (ascending[at + step - 1] <= value)
            at += step;
    return at;
}

/// Returns the row that holds element `i` < 1024 of rows of up to 1024 elements.
/// @param inverseWidth 1 / their number, rounded
SDAG_HD inline int32_t rowOf(uint32_t i, float inverseWidth) {
    // Half an element keeps the quotient 1 / 2048 clear of whole numbers; it rounds by 2^-14 at
    // most.
    return int32_t((float(i) + 0.5f) * inverseWidth);
}

} // namespace shadowdag

#if defined(__CUDACC__)
#include "cuda/launch.h"

namespace shadowdag {

constexpr unsigned kAllLanes = 0xffffffffu;
static_assert(kGroupLanes == 32);

/// Returns the number of this thread's warp in the grid.
__device__ inline size_t warpOfGrid() {
    return (blockIdx.x * size_t(blockDim.x) + threadIdx.x) / kGroupLanes;
}

/// Returns the number of this thread in its warp.
__device__ inline uint32_t laneOfWarp() {
    return threadIdx.x % kGroupLanes;
}

/// Returns the blocks of kBlockThreads threads that hold so many warps.
inline size_t blocksOfWarps(size_t warpCount) {
    constexpr size_t kWarpsPerBlock = kBlockThreads / kGroupLanes;
    return (warpCount + kWarpsPerBlock - 1) / kWarpsPerBlock;
}

/// Returns the warps that take so many items, an item a lane.
__host__ __device__ inline uint32_t warpsOf(uint32_t itemCount) {
    return (itemCount + kGroupLanes - 1) / kGroupLanes;
}

/// Returns the sum over the lanes of a warp, in all of them; all lanes call it.
__device__ inline uint32_t sumOfWarp(uint32_t value) {
    for (unsigned apart = kGroupLanes / 2; apart > 0; apart /= 2)
        value += __shfl_xor_sync(kAllLanes, value, int(apart));
    return value;
}

/// Returns the greatest value of the lanes of a warp, in all of them; all lanes call it.
__device__ inline uint32_t greatestOfWarp(uint32_t value) {
    for (unsigned apart = kGroupLanes / 2; apart > 0; apart /= 2) {
        const uint32_t other = __shfl_xor_sync(kAllLanes, value, int(apart));
        value = other > value ? other : value;
    }
    return value;
}

/// Returns the sum over this lane and those before it; all lanes of a warp call it.
__device__ inline uint32_t sumUpToLane(uint32_t value) {
    for (unsigned apart = 1; apart < kGroupLanes; apart *= 2) {
        const uint32_t before =
            __shfl_sync(kAllLanes, value, int((laneOfWarp() - apart) % kGroupLanes));
        value += laneOfWarp() >= apart ? before : 0;
    }
    return value;
}

/// Returns how many lanes before this one have their bit set.
__device__ inline uint32_t lanesBefore(uint32_t bits) {
    return uint32_t(__popc(bits & ((1u << laneOfWarp()) - 1)));
}

/// Returns the lanes that have the same value as this one, itself included; all lanes of a warp
/// call it.
__device__ inline uint32_t lanesWithSame(uint32_t value) {
    uint32_t same = 0;
    for (uint32_t rest = kAllLanes; rest != 0;) {
        const uint32_t other = __shfl_sync(kAllLanes, value, __ffs(int(rest)) - 1);
        const uint32_t having = __ballot_sync(kAllLanes, value == other);
        if (value == other)
            same = having;
        rest &= ~having;
    }
    return same;
}

/// Calls process(lane, i) for each of the elements [0, count) that every lane has, by all lanes of
/// a warp, an element a lane at a time. All of them call it; each sees what the others wrote before
/// to memory that they share, which may be overwritten after a __syncwarp().
/// @param upTo 32 numbers that the lanes share; written
template <class Process>
__device__ void shareElements(uint32_t count, uint32_t* upTo, const Process& process) {
    const uint32_t sum = sumUpToLane(count);
    upTo[laneOfWarp()] = sum;
    const uint32_t all = __shfl_sync(kAllLanes, sum, int(kGroupLanes) - 1);
    __syncwarp();
    for (uint32_t i = laneOfWarp(); i < all; i += kGroupLanes) {
        const uint32_t lane = firstAbove(upTo, i);
        process(lane, i - (lane == 0 ? 0 : upTo[lane - 1]));
    }
}

/// Sorts `count` numbers, ascending, in place; all lanes of a warp call it, and see the result.
/// Source: Batcher, Sorting Networks and Their Applications, AFIPS 1968 (odd-even merge sort).
__device__ inline void sortByWarp(uint32_t* list, uint32_t count) {
    __syncwarp();
    for (uint32_t run = 1; run < count; run *= 2) // lists that are merged
        for (uint32_t apart = run; apart > 0; apart /= 2) {
            const uint32_t begin = apart == run ? 0 : apart;
            for (uint32_t i = begin + laneOfWarp(); i + apart < count; i += kGroupLanes) {
                const bool isCompared =
                    (i - begin) / apart % 2 == 0 && i / (2 * run) == (i + apart) / (2 * run);
                if (isCompared && list[i] > list[i + apart]) {
                    const uint32_t greater = list[i];
                    list[i] = list[i + apart];
                    list[i + apart] = greater;
                }
            }
            __syncwarp();
        }
}

} // namespace shadowdag
#endif
