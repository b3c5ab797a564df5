// SPDX-License-Identifier: Apache-2.0
// Kernels in which a warp takes an item; empty where the compiler is not CUDA's.
#pragma once

#if defined(__CUDACC__)
#include "cuda/launch.h"
#include "cuda/split_work_view.h"

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

/// Returns the sum over the lanes of a warp, in all of them; all lanes call it.
__device__ inline uint32_t sumOfWarp(uint32_t value) {
    for (unsigned apart = kGroupLanes / 2; apart > 0; apart /= 2)
        value += __shfl_xor_sync(kAllLanes, value, int(apart));
    return value;
}

} // namespace shadowdag
#endif
