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
    const BvhParts parts = partsOf(cull.batches.bvh, cull.maps.count);
    const uint32_t part = uint32_t(i % parts.count);
    const ShadowMapInfo& map = cull.maps[i / parts.count];
    const BatchView& batches = cull.batches;
    traverseByWarp(
        batches.bvh, parts.level, part, part + 1,
        [&](const Box& box) { return reachesMap(map, box); },
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
            work.reached[next + lanesBefore(drawn)] = {uint32_t(i / work.cull.parts()), batch, 0};
        next += __popc(drawn);
    });
}

/// Returns whether test(cell, depth) holds for a cell of a rectangle that is at least `depth` deep,
/// as CellDepthView::any; by all lanes of a warp, for the same rectangle.
template <class Test>
__device__ bool anyByWarp(const CellDepthView& view, uint32_t map, uint32_t face,
                          const CellRect& rect, uint32_t depth, const Test& test) {
    const uint32_t u0 = rect.u0 >> kBlockCellsLog2, v0 = rect.v0 >> kBlockCellsLog2;
    const uint32_t across = (rect.u1 >> kBlockCellsLog2) - u0 + 1,
                   count = across * ((rect.v1 >> kBlockCellsLog2) - v0 + 1);
    bool found = false;
    for (uint32_t block = laneOfWarp(); block < count && !found; block += kGroupLanes)
        found =
            view.anyOfBlock(map, face, rect, depth, u0 + block % across, v0 + block / across, test);
    return __ballot_sync(kAllLanes, found) != 0;
}

// A lane per entry and face: lanes take neighbouring entries and one face. Rectangles of kept maps
// differ in size by a hundred times, so the whole warp tests one after another.
__global__ void countDrawsKernel(CountDraws work) {
    const CullView& cull = work.cull;
    const size_t entryCount = work.reached.count;
    const size_t i = blockIdx.x * size_t(blockDim.x) + threadIdx.x;
    const size_t at = i % entryCount;
    const uint32_t face = uint32_t(i / entryCount);
    const size_t item = face < kFaceCount ? work.itemOf(at) : CountDraws::kNoItem;
    BatchDraw draw{}; // not its faces, which other lanes set meanwhile
    if (item != CountDraws::kNoItem) {
        draw.map = work.reached[at].map;
        draw.batch = work.reached[at].batch;
    }
    BatchFaces faces{};
    KeptTest own{};
    bool isTested = false;
    if (item != CountDraws::kNoItem) {
        if (cull.kept.drawnCells.empty())
            faces = cull.faceToDraw(draw.map, draw.batch, face);
        else
            isTested = cull.testOf(draw.map, draw.batch, face, own);
    }
    const uint32_t packed =
        own.cells.u0 | own.cells.u1 << 5 | own.cells.v0 << 10 | own.cells.v1 << 15;
    for (uint32_t rest = __ballot_sync(kAllLanes, isTested); rest != 0; rest &= rest - 1) {
        const int lane = __ffs(int(rest)) - 1;
        const uint32_t cells = __shfl_sync(kAllLanes, packed, lane);
        const CellRect rect{cells & 31u, cells >> 5 & 31u, cells >> 10 & 31u, cells >> 15};
        const uint32_t depth = __shfl_sync(kAllLanes, own.depth, lane),
                       map = __shfl_sync(kAllLanes, draw.map, lane),
                       itsFace = __shfl_sync(kAllLanes, face, lane),
                       isMoved = __shfl_sync(kAllLanes, uint32_t(own.isMoved), lane);
        if (!anyByWarp(cull.cells, map, itsFace, rect, depth,
                       [](uint32_t, uint32_t) { return true; }))
            continue;
        const bool isDrawn = isMoved || anyByWarp(cull.openCells(), map, itsFace, rect, depth,
                                                  [&](uint32_t cell, uint32_t) {
                                                      return cull.isUndrawn(map, cell, depth);
                                                  });
        if (int(laneOfWarp()) == lane)
            faces = {1u << face, uint32_t(isDrawn) << face};
    }
    if (item != CountDraws::kNoItem)
        work.note(item, at, faces);
}

// One warp per word of the page table.
__global__ void sortOutPagesKernel(SortOutPages work) {
    const size_t word = warpOfGrid();
    if (word >= work.pageTable.count / 32)
        return;
    const SortOutPages::Page page = work.sortOut(word, laneOfWarp());
    uint32_t found[kKeptPageCounts];
    for (uint32_t k = 0; k < kKeptPageCounts; ++k)
        found[k] = __popc(__ballot_sync(kAllLanes, page.counts(KeptPageCount(k))));
    if (laneOfWarp() == 0)
        work.note(word, found);
}

// One warp per word of the page table.
__global__ void assignPagesKernel(AssignPages work) {
    const size_t word = warpOfGrid();
    if (word >= work.needed.count)
        return;
    const bool isMissing = work.isMissing(word, laneOfWarp());
    const uint32_t missing = __ballot_sync(kAllLanes, isMissing);
    if (isMissing)
        work.assign(uint32_t(word * 32 + laneOfWarp()),
                    work.firstPage[word] + lanesBefore(missing));
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

// Only the device knows how many items there are.
template <class Work> __global__ void shareItemsKernel(Work work) {
    const size_t count = work.itemCount(), threadCount = gridDim.x * size_t(blockDim.x);
    for (size_t i = blockIdx.x * size_t(blockDim.x) + threadIdx.x; i < count; i += threadCount)
        work(i);
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

void launchPass(CudaTag, const CountDraws& work) {
    const size_t count = work.reached.count * kFaceCount;
    launch(countDrawsKernel, (count + kBlockThreads - 1) / kBlockThreads, work);
}

void launchPass(CudaTag, const SortOutPages& work) {
    launch(sortOutPagesKernel, blocksOfWarps(work.itemCount()), work);
}

void launchPass(CudaTag, const AssignPages& work) {
    launch(assignPagesKernel, blocksOfWarps(work.itemCount()), work);
}

void launchPass(CudaTag, const ClearPages& work) {
    launch(shareItemsKernel<ClearTexels>, fillingBlocks(), ClearTexels{work});
}

void launchPass(CudaTag, const ResetCells& work) {
    launch(shareItemsKernel<ResetRow>, fillingBlocks(), ResetRow{work});
}

void launchPass(CudaTag, const CountPagesOfMaps& work) {
    launch(countPagesOfMapsKernel, blocksOfWarps(work.itemCount()), work);
}

} // namespace shadowdag
