// SPDX-License-Identifier: Apache-2.0
// The triangles of a draw on CUDA: a warp takes 32 of them. A lane sets up a triangle; then the
// lanes share the texels of all their rectangles, a texel a lane at a time, so that none waits for
// the one that got the largest.
#include "shadowmap/rasterize.h"

#include "cuda/warp.h"

namespace shadowdag {

namespace {

/// The triangles of a warp, in shared memory.
struct WarpTriangles {
    FaceTriangle setups[kGroupLanes];
    uint32_t triangle[kGroupLanes];   ///< of the world
    uint32_t texelsUpTo[kGroupLanes]; ///< of a rectangle and those before it
    float inverseWidth[kGroupLanes];  ///< of a rectangle
};

/// Returns whether a page of a triangle's rectangle has memory; true without a look for many pages,
/// as large triangles have, which are looked up part by part.
__device__ bool hasMemory(const RasterView& view, const ShadowMapInfo& map, uint32_t face,
                          const FaceTriangle& t) {
    constexpr uint32_t kMostPages = 16;
    const PageRect pages = pagesOf(t, view.pageTexelsLog2);
    if (pages.count() > kMostPages)
        return true;
    for (int32_t y = pages.y0; y <= pages.y1; ++y)
        for (int32_t x = pages.x0; x <= pages.x1; ++x)
            if (view.pageTable[pageTableIndex(map, face, uint32_t(x), uint32_t(y))] != kNoPage)
                return true;
    return false;
}

/// Draws a triangle that found no space in the list. Rare, and not inlined: its registers would
/// count for the whole kernel.
__device__ __attribute__((noinline)) void coverAlone(const RasterView& view,
                                                     const ShadowMapInfo& map, uint32_t face,
                                                     const FaceTriangle& t, uint32_t triangle) {
    coverTexels(view, map, face, t, triangle, StoreGreaterAtomically{view.depths});
}

/// Returns whether a triangle that a mask cuts is opaque at a texel.
__device__ __attribute__((noinline)) bool isOpaqueAt(const RasterView& view,
                                                     const ShadowMapInfo& map,
                                                     const FaceTriangle& t, uint32_t triangle,
                                                     double X, double Y) {
    return maskedTriangle(view, map, t, triangle).isOpaque(X, Y);
}

/// Draws a texel of a triangle's rectangle: see coverTexels, the same tests of the same numbers.
__device__ void coverTexel(const RasterView& view, const ShadowMapInfo& map, uint32_t face,
                           const FaceTriangle& t, uint32_t triangle, int32_t x, int32_t y) {
    const double X = double(2 * x + 1 - int32_t(map.faceTexels)),
                 Y = double(2 * y + 1 - int32_t(map.faceTexels));
    for (int k = 0; k < 3; ++k)
        if (!(t.ex[k] * X + (t.ey[k] * Y + t.e0[k]) >= -t.tolerance[k]))
            return;
    const float w = glm::min(glm::max(float(t.wx() * X + (t.wy() * Y + t.w0())), t.wMin), t.wMax);
    if (!(w <= t.wNear))
        return;
    const uint32_t log2 = view.pageTexelsLog2;
    const uint32_t page =
        view.pageTable[pageTableIndex(map, face, uint32_t(x) >> log2, uint32_t(y) >> log2)];
    if (page == kNoPage ||
        (view.geometry.masks.isCut(triangle) && !isOpaqueAt(view, map, t, triangle, X, Y)))
        return;
    atomicMaxRelaxed(
        &view.depths[(size_t(page) << (2 * log2)) + texelInPage(uint32_t(x), uint32_t(y), log2)],
        floatBits(w));
}

/// Sets up a triangle of a draw for a face; returns how many texels its rectangle has, 0 if it
/// covers none that has memory. A large one is put on the list of large ones, and has none here.
/// @param code the triangle within its batch, times 8, and the face
__device__ uint32_t setUpSmall(const RasterizeTriangle& work, uint32_t drawIndex,
                               const ShadowMapInfo& map, uint32_t triangle, uint32_t code,
                               FaceTriangle& t) {
    const uint32_t face = code & 7u;
    const auto corner = [&](int i) {
        return faceFromLight(face, cornerFromLight(work.view.geometry, triangle, i, map));
    };
    const glm::dvec3 a = corner(0), b = corner(1), c = corner(2);
    if (!boundTriangle(a, b, c, map, t) || !hasMemory(work.view, map, face, t) ||
        !setUpEdges(a, b, c, map.faceTexels, t))
        return 0;
    const int64_t texels = int64_t(t.x1 - t.x0 + 1) * (t.y1 - t.y0 + 1);
    if (texels <= kSmallTriangleTexels)
        return uint32_t(texels);
    uint32_t index;
    if (work.large.add(drawIndex, code, pagesOf(t, work.view.pageTexelsLog2).count(), index))
        work.setups[index] = t;
    else
        coverAlone(work.view, map, face, t, triangle);
    return 0;
}

// One warp per 32 slots of a draw. More warps outweigh spilled registers: docs/results.md.
__global__ void __launch_bounds__(kBlockThreads, 8)
    rasterizeTriangleKernel(const __grid_constant__ RasterizeTriangle work) {
    __shared__ WarpTriangles space[kBlockThreads / kGroupLanes];
    const uint32_t lane = laneOfWarp(), runs = warpsOf(work.view.slotsPerDraw);
    const size_t drawIndex = warpOfGrid() / runs;
    if (drawIndex >= work.view.draws.count)
        return;
    const BatchDraw draw = work.view.draws[drawIndex];
    const Batch batch = work.view.batches[draw.batch];
    const uint32_t inBatch = uint32_t(warpOfGrid() % runs) * kGroupLanes + lane;
    if (inBatch - lane >= batch.count)
        return;
    const ShadowMapInfo& map = work.view.maps[draw.map];
    WarpTriangles& shared = space[threadIdx.x / kGroupLanes];
    if (inBatch < batch.count)
        shared.triangle[lane] = work.view.batchTriangles[batch.first + inBatch];
    for (uint32_t faces = draw.faces; faces != 0; faces &= faces - 1) {
        const uint32_t face = uint32_t(__ffs(int(faces))) - 1;
        FaceTriangle& own = shared.setups[lane];
        uint32_t texels = 0;
        if (inBatch < batch.count)
            texels = setUpSmall(work, uint32_t(drawIndex), map, shared.triangle[lane],
                                inBatch << 3 | face, own);
        if (texels != 0)
            shared.inverseWidth[lane] = 1.0f / float(own.x1 - own.x0 + 1);
        shareElements(texels, shared.texelsUpTo, [&](uint32_t at, uint32_t texel) {
            const FaceTriangle& t = shared.setups[at];
            const int32_t row = rowOf(texel, shared.inverseWidth[at]);
            coverTexel(work.view, map, face, t, shared.triangle[at],
                       t.x0 + int32_t(texel) - row * (t.x1 - t.x0 + 1), t.y0 + row);
        });
        __syncwarp();
    }
}

} // namespace

void launchPass(CudaTag, const RasterizeTriangle& work) {
    const size_t blocks = blocksOfWarps(work.view.draws.count * (warpsOf(work.view.slotsPerDraw)));
    launch(rasterizeTriangleKernel, blocks, work);
}

} // namespace shadowdag
