// SPDX-License-Identifier: Apache-2.0
// The cluster passes whose items have many samples, on CUDA: one warp per item.
#include "hybrid/clusters/cluster_pass.h"

#include "cuda/launch.h"

namespace shadowdag {

namespace {

constexpr unsigned kAllLanes = 0xffffffffu;
static_assert(kGroupLanes == 32);

/// Returns the number of this thread's warp in the grid.
__device__ size_t warpOfGrid() {
    return (blockIdx.x * size_t(blockDim.x) + threadIdx.x) / kGroupLanes;
}
size_t blocksOfWarps(size_t warpCount) {
    constexpr size_t kWarpsPerBlock = kBlockThreads / kGroupLanes;
    return (warpCount + kWarpsPerBlock - 1) / kWarpsPerBlock;
}

// One warp per tile: the other lanes read what one lane counts after the barrier.
__global__ void fillTilesKernel(FillTile work) {
    const size_t tile = warpOfGrid();
    if (tile >= work.grid.tileCount())
        return;
    for (uint32_t block = 0; block < FillTile::kBlockCount; ++block) {
        const FillTile::Placed placed = work.place(tile, block, threadIdx.x % kGroupLanes);
        __syncwarp();
        work.advance(placed);
        __syncwarp();
    }
}

// One warp per cluster.
__global__ void boundBySamplesKernel(BoundBySamples work) {
    const size_t cluster = warpOfGrid();
    if (cluster >= work.clusters.count())
        return;
    const uint32_t lane = threadIdx.x % kGroupLanes;
    Box box = work.part(cluster, lane, kGroupLanes);
    for (unsigned apart = kGroupLanes / 2; apart > 0; apart /= 2) {
        Box other;
        for (int axis = 0; axis < 3; ++axis) {
            other.min[axis] = __shfl_xor_sync(kAllLanes, box.min[axis], int(apart));
            other.max[axis] = __shfl_xor_sync(kAllLanes, box.max[axis], int(apart));
        }
        box.add(other);
    }
    if (lane == 0)
        work.store(cluster, box);
}

} // namespace

void launchPass(CudaTag, const FillTile& work) {
    launch(fillTilesKernel, blocksOfWarps(work.itemCount()), work);
}

void launchPass(CudaTag, const BoundBySamples& work) {
    launch(boundBySamplesKernel, blocksOfWarps(work.itemCount()), work);
}

} // namespace shadowdag
