// SPDX-License-Identifier: Apache-2.0
// The triangles of a batch on CUDA, by a warp: see shadowmap/rasterize_cuda.cu, which draws so too.
#include "hybrid/gbuffer/gbuffer_raster.h"

#include "cuda/warp.h"

namespace shadowdag {

namespace {

/// What the lanes of a warp share.
struct WarpPixels {
    uint32_t waiting[2 * kGroupLanes]; ///< triangles of the world
    SeenTriangle setups[kGroupLanes];
    uint32_t pixelsUpTo[kGroupLanes];  ///< of a setup and those before it
    float inverseWidth[kGroupLanes];   ///< of its rectangle
};

/// Sets up a triangle for this lane; returns how many pixels may see it. A large one is put on the
/// list of large ones, and has none here.
__device__ uint32_t setUpSmall(const RasterizeSlots& work, uint32_t triangle, SeenTriangle& small,
                               float& inverseWidth) {
    const RasterizeBatches& batches = work.batches;
    SeenTriangle seen;
    if (!setUpSeen(batches.triangles, triangle, batches.view, seen))
        return 0;
    const int width = seen.rect.maxX - seen.rect.minX + 1,
              height = seen.rect.maxY - seen.rect.minY + 1;
    if (int64_t(width) * height > kSmallTrianglePixels) {
        uint32_t index;
        if (work.large.add(triangle, 0,
                           RasterizeSlots::partsOf(width) * RasterizeSlots::partsOf(height),
                           index))
            work.setups[index] = seen;
        else
            coverPixels(batches.triangles, seen, seen.rect, batches.view, batches.visibility);
        return 0;
    }
    small = seen;
    inverseWidth = 1.0f / float(width);
    return uint32_t(width * height);
}

/// Draws waiting triangles [first, first + count), one for each lane at most.
__device__ void drawWaiting(const RasterizeSlots& work, WarpPixels& shared, uint32_t first,
                            uint32_t count) {
    const uint32_t lane = laneOfWarp();
    __syncwarp();
    uint32_t pixels = 0;
    if (lane < count)
        pixels = setUpSmall(work, shared.waiting[first + lane], shared.setups[lane],
                            shared.inverseWidth[lane]);
    const uint32_t upTo = sumUpToLane(pixels);
    shared.pixelsUpTo[lane] = upTo;
    const uint32_t all = __shfl_sync(kAllLanes, upTo, int(kGroupLanes) - 1);
    __syncwarp();
    for (uint32_t i = lane; i < all; i += kGroupLanes) {
        uint32_t at = 0; // the first setup that ends behind pixel i
        for (uint32_t step = kGroupLanes / 2; step > 0; step /= 2)
            if (shared.pixelsUpTo[at + step - 1] <= i)
                at += step;
        const SeenTriangle& seen = shared.setups[at];
        const uint32_t pixel = i - (at == 0 ? 0 : shared.pixelsUpTo[at - 1]);
        // Half a pixel keeps the quotient clear of whole numbers by far more than it rounds.
        const int row = int((float(pixel) + 0.5f) * shared.inverseWidth[at]);
        const int y = seen.rect.minY + row,
                  x = seen.rect.minX + int(pixel) - row * (seen.rect.maxX - seen.rect.minX + 1);
        coverPixels(work.batches.triangles, seen, PixelRect{x, y, x, y}, work.batches.view,
                    work.batches.visibility);
    }
    __syncwarp();
}

// One warp per batch.
__global__ void rasterizeSlotsKernel(RasterizeSlots work) {
    __shared__ WarpPixels space[kBlockThreads / kGroupLanes];
    const RasterizeBatches& batches = work.batches;
    const size_t b = warpOfGrid();
    if (b >= batches.batches.count || !mayBeSeen(batches.batchBoxes[b], batches.view))
        return;
    const Batch batch = batches.batches[b];
    WarpPixels& shared = space[threadIdx.x / kGroupLanes];
    uint32_t waiting = 0;
    for (uint32_t first = 0; first < batch.count; first += kGroupLanes) {
        const uint32_t slot = first + laneOfWarp();
        uint32_t triangle = 0;
        bool waits = slot < batch.count;
        if (waits) {
            triangle = batches.batchTriangles[batch.first + slot];
            PixelRect rect;
            waits = boundSeen(loadViewTriangle(batches.triangles, triangle, batches.view.origin),
                              batches.view, rect);
        }
        const uint32_t lanes = __ballot_sync(kAllLanes, waits);
        if (waits)
            shared.waiting[waiting + __popc(lanes & ((1u << laneOfWarp()) - 1))] = triangle;
        waiting += __popc(lanes);
        if (waiting >= kGroupLanes) {
            waiting -= kGroupLanes;
            drawWaiting(work, shared, waiting, kGroupLanes);
        }
    }
    if (waiting > 0)
        drawWaiting(work, shared, 0, waiting);
}

} // namespace

void launchPass(CudaTag, const RasterizeSlots& work) {
    launch(rasterizeSlotsKernel, blocksOfWarps(work.batches.batches.count), work);
}

} // namespace shadowdag
