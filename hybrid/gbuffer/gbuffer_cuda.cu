// SPDX-License-Identifier: Apache-2.0
// The triangles of a batch on CUDA, by warps: see shadowmap/rasterize_cuda.cu, which draws so too.
#include "hybrid/gbuffer/gbuffer_raster.h"

#include "cuda/warp.h"

namespace shadowdag {

namespace {

/// The triangles of a warp, in shared memory.
struct WarpTriangles {
    SeenTriangle setups[kGroupLanes];
    uint32_t pixelsUpTo[kGroupLanes]; ///< of a rectangle and those before it
    float inverseWidth[kGroupLanes];  ///< of a rectangle
};

/// Sets up a triangle; returns how many pixels may see it. A large one is put on the list of large
/// ones, and has none here.
__device__ uint32_t setUpSmall(const RasterizeSlots& work, uint32_t triangle, SeenTriangle& seen) {
    const BatchesInView& batches = work.batches;
    if (!setUpSeen(batches.triangles, triangle, batches.view, seen))
        return 0;
    const int width = seen.rect.maxX - seen.rect.minX + 1,
              height = seen.rect.maxY - seen.rect.minY + 1;
    if (int64_t(width) * height <= kSmallTrianglePixels)
        return uint32_t(width * height);
    uint32_t index;
    if (work.large.add(triangle, 0,
                       RasterizeSlots::partsOf(width) * RasterizeSlots::partsOf(height), index))
        work.setups[index] = seen;
    else
        coverPixels(batches.triangles, seen, seen.rect, batches.view, batches.visibility);
    return 0;
}

// One warp per 32 slots of a batch.
__global__ void __launch_bounds__(kBlockThreads, 8) rasterizeSlotsKernel(RasterizeSlots work) {
    __shared__ WarpTriangles space[kBlockThreads / kGroupLanes];
    const BatchesInView& batches = work.batches;
    const uint32_t lane = laneOfWarp(), runs = warpsOf(work.slotsPerBatch);
    const size_t b = warpOfGrid() / runs;
    if (b >= batches.batches.count)
        return;
    const Batch batch = batches.batches[b];
    const uint32_t slot = uint32_t(warpOfGrid() % runs) * kGroupLanes + lane;
    if (slot - lane >= batch.count || !mayBeSeen(batches.batchBoxes[b], batches.view))
        return;
    WarpTriangles& shared = space[threadIdx.x / kGroupLanes];
    SeenTriangle& own = shared.setups[lane];
    uint32_t pixels = 0;
    if (slot < batch.count)
        pixels = setUpSmall(work, batches.batchTriangles[batch.first + slot], own);
    if (pixels != 0)
        shared.inverseWidth[lane] = 1.0f / float(own.rect.maxX - own.rect.minX + 1);
    shareElements(pixels, shared.pixelsUpTo, [&](uint32_t at, uint32_t pixel) {
        const SeenTriangle& seen = shared.setups[at];
        const int row = rowOf(pixel, shared.inverseWidth[at]);
        const int y = seen.rect.minY + row,
                  x = seen.rect.minX + int(pixel) - row * (seen.rect.maxX - seen.rect.minX + 1);
        coverPixels(batches.triangles, seen, PixelRect{x, y, x, y}, batches.view,
                    batches.visibility);
    });
}

} // namespace

void launchPass(CudaTag, const RasterizeSlots& work) {
    const size_t blocks = blocksOfWarps(work.batches.batches.count * (warpsOf(work.slotsPerBatch)));
    launch(rasterizeSlotsKernel, blocks, work);
}

} // namespace shadowdag
