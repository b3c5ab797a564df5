// SPDX-License-Identifier: Apache-2.0
// The passes over maps on CUDA: a warp takes what one thread would take too long for.
#include "shadowmap/cull.h"
#include "shadowmap/drawn_cells.h"
#include "shadowmap/page_mask.h"

#include "scenes/wide_bvh_warp.h"

namespace shadowdag {

namespace {

/// Calls reach(batch, level, isDrawn, isReached) by all lanes for groups of batches, as
/// CullView::query; what a lane gets counts where isReached.
template <class Reach>
__device__ void queryByWarp(const CullView& cull, size_t i, const Reach& reach) {
    const uint32_t part = uint32_t(i % cull.parts());
    const ShadowMapInfo& map = cull.maps[i / cull.parts()];
    const BatchView& batches = cull.batches;
    traverseByWarp(
        batches.bvh, part, part + 1, [&](const Box& box) { return reachesMap(map, box); },
        [&](uint32_t first, uint32_t bits) {
            const uint32_t batch =
                bits >> laneOfWarp() & 1u ? batches.bvh.items[first + laneOfWarp()] : kNoBvhItem;
            const bool isReached = batch != kNoBvhItem;
            uint32_t level = 0;
            bool isDrawn = false;
            if (isReached) {
                const uint32_t instance = batches.batches[batch].instance;
                level = levelOf(batches.levels, instance);
                isDrawn = level == levelFor(batches.levels, map, instance);
            }
            reach(batch, level, isDrawn, isReached);
        });
}

__global__ void countReachedKernel(CountReached work) {
    const size_t i = warpOfGrid();
    if (i >= work.reachedCounts.count)
        return;
    CullCounts found{};
    uint32_t reached = 0;
    queryByWarp(work.cull, i, [&](uint32_t batch, uint32_t level, bool isDrawn, bool isReached) {
        if (isReached && level == 0) {
            ++found.sphereBatches;
            found.sphereTriangles += work.cull.batches.batches[batch].count;
        }
        reached += isDrawn;
    });
    reached = sumOfWarp(reached);
    found.sphereBatches = sumOfWarp(found.sphereBatches);
    found.sphereTriangles = sumOfWarp(found.sphereTriangles);
    if (laneOfWarp() == 0) {
        work.reachedCounts[i] = reached;
        work.counts[i] = found;
    }
}

__global__ void listReachedKernel(ListReached work) {
    const size_t i = warpOfGrid();
    if (i >= work.firstReached.count - 1)
        return;
    const ItemRange range = rangeOf(work.firstReached, i, work.reached.count);
    if (range.begin == range.end)
        return;
    size_t next = range.begin;
    queryByWarp(work.cull, i, [&](uint32_t batch, uint32_t, bool isDrawn, bool) {
        const uint32_t drawn = __ballot_sync(kAllLanes, isDrawn);
        if (isDrawn)
            work.reached[next + __popc(drawn & ((1u << laneOfWarp()) - 1))] = {
                uint32_t(i / work.cull.parts()), batch, 0};
        next += __popc(drawn);
    });
}

__global__ void countPagesOfMapsKernel(CountPagesOfMaps work) {
    const size_t m = warpOfGrid();
    if (m >= work.maps.count)
        return;
    const ShadowMapInfo& map = work.maps[m];
    const uint32_t first = map.pageTableStart / 32;
    const uint32_t words = (kFaceCount * map.facePages * map.facePages + 31) / 32;
    uint32_t count = 0;
    for (uint32_t w = first + laneOfWarp(); w < first + words; w += kGroupLanes)
        count += __popc(work.pages[w]);
    count = sumOfWarp(count);
    if (laneOfWarp() == 0)
        work.counts[m] = count;
}

static_assert(kProjectionMapSize == kGroupLanes); // a lane a cell of a row

// One warp per row of cells.
__global__ void listOpenCellsKernel(ListOpenCells work) {
    const size_t row = warpOfGrid();
    if (row >= work.openRows.count)
        return;
    const uint32_t open = __ballot_sync(kAllLanes, work.isOpen(row, laneOfWarp()));
    if (laneOfWarp() == 0)
        work.openRows[row] = open;
}

// One warp per row of cells.
__global__ void raiseDrawnKernel(RaiseDrawn work) {
    const size_t row = warpOfGrid();
    if (row >= work.cells.count / kProjectionMapSize)
        return;
    const uint32_t greatest = greatestOfWarp(work.raise(row, laneOfWarp()));
    if (greatest != 0 && laneOfWarp() == 0)
        work.noteGreatest(row, greatest);
}

} // namespace

void launchPass(CudaTag, const ListOpenCells& work) {
    launch(listOpenCellsKernel, blocksOfWarps(work.itemCount()), work);
}

void launchPass(CudaTag, const RaiseDrawn& work) {
    launch(raiseDrawnKernel, blocksOfWarps(work.itemCount()), work);
}

void launchPass(CudaTag, const CountReached& work) {
    launch(countReachedKernel, blocksOfWarps(work.itemCount()), work);
}

void launchPass(CudaTag, const ListReached& work) {
    launch(listReachedKernel, blocksOfWarps(work.itemCount()), work);
}

void launchPass(CudaTag, const CountPagesOfMaps& work) {
    launch(countPagesOfMapsKernel, blocksOfWarps(work.itemCount()), work);
}

} // namespace shadowdag
