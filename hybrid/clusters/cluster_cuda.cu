// SPDX-License-Identifier: Apache-2.0
// The cluster passes on CUDA: a thread an item, a warp where an item has many samples.
#include "hybrid/clusters/cluster_pass.h"

#include "cuda/parallel_for.h"

namespace shadowdag::cuda {

namespace {

constexpr unsigned kBlockSize = 128, kAllLanes = 0xffffffffu;
static_assert(kGroupLanes == 32);

/// Returns the number of this thread's warp in the grid.
__device__ size_t warpOfGrid() {
    return (blockIdx.x * size_t(blockDim.x) + threadIdx.x) / kGroupLanes;
}
unsigned blocksOfWarps(size_t warpCount) {
    constexpr size_t kWarpsPerBlock = kBlockSize / kGroupLanes;
    return unsigned((warpCount + kWarpsPerBlock - 1) / kWarpsPerBlock);
}

// A warp a tile: what one lane counts the others read after the barrier.
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

// A warp a cluster.
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

void countCellSamples(const CountCellSamples& work) {
    parallelFor<CudaTag>(work.gbuffer.count(), work);
}
void markOccupiedCells(const MarkOccupiedCells& work) {
    parallelFor<CudaTag>(work.cellSamples.count, work);
}
void compactCells(const CompactCells& work) {
    parallelFor<CudaTag>(work.cellSamples.count, work);
}
void fillTiles(const FillTile& work) {
    fillTilesKernel<<<blocksOfWarps(work.grid.tileCount()), kBlockSize>>>(work);
    CUDA_CHECK(cudaGetLastError());
}
void countNormalCells(const CountNormalCells& work) {
    parallelFor<CudaTag>(work.clusters.count(), work);
}
void splitByNormals(const SplitByNormals& work) {
    parallelFor<CudaTag>(work.clusters.count(), work);
}
void boundByCell(const BoundByCell& work) {
    parallelFor<CudaTag>(work.cell.count, work);
}
void boundBySamples(const BoundBySamples& work) {
    if (work.clusters.count() == 0)
        return;
    boundBySamplesKernel<<<blocksOfWarps(work.clusters.count()), kBlockSize>>>(work);
    CUDA_CHECK(cudaGetLastError());
}
void joinTenths(const JoinTenths& work) {
    parallelFor<CudaTag>(work.clusters.samples.count, work);
}
void shrinkBounds(const ShrinkBounds& work) {
    parallelFor<CudaTag>(work.boxesWorld.count, work);
}

} // namespace shadowdag::cuda
