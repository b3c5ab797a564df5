// SPDX-License-Identifier: Apache-2.0
// The triangles of a draw on CUDA, by a warp. Most of them cover no texel that has memory: first a
// lane bounds a triangle; those that are left wait until there is one for each lane, are set up
// together, and then the lanes share the texels of all their rectangles, a texel a lane at a time.
#include "shadowmap/rasterize.h"

#include "cuda/warp.h"

namespace shadowdag {

namespace {

/// What the lanes of a warp share.
struct WarpTriangles {
    uint32_t waiting[2 * kGroupLanes]; ///< the triangle within its batch, times 8, and the face
    FaceTriangle setups[kGroupLanes];
    uint32_t code[kGroupLanes];        ///< of a setup, as in `waiting`
    uint32_t texelsUpTo[kGroupLanes];  ///< of a setup and those before it
    float inverseWidth[kGroupLanes];   ///< of its rectangle
};

/// One draw, as the lanes of a warp see it.
struct WarpDraw {
    const RasterizeTriangle& work;
    uint32_t drawIndex;
    const ShadowMapInfo& map;
    Batch batch;
    WarpTriangles& shared;

    __device__ uint32_t triangleOf(uint32_t inBatch) const {
        return work.view.batchTriangles[batch.first + inBatch];
    }
    __device__ void load(uint32_t inBatch, glm::dvec3 (&fromLight)[3]) const {
        for (int corner = 0; corner < 3; ++corner)
            fromLight[corner] =
                cornerFromLight(work.view.geometry, triangleOf(inBatch), corner, map);
    }

    /// Returns whether a triangle may cover a texel that has memory; rectangles of many pages are
    /// not looked up.
    __device__ bool mayCover(const glm::dvec3 (&fromLight)[3], uint32_t face) const {
        constexpr uint32_t kMostPages = 16;
        FaceTriangle t;
        if (!boundTriangle(faceFromLight(face, fromLight[0]), faceFromLight(face, fromLight[1]),
                           faceFromLight(face, fromLight[2]), map, t))
            return false;
        const PageRect pages = pagesOf(t, work.view.pageTexelsLog2);
        if (pages.count() > kMostPages)
            return true;
        for (int32_t y = pages.y0; y <= pages.y1; ++y)
            for (int32_t x = pages.x0; x <= pages.x1; ++x)
                if (work.view.pageTable[pageTableIndex(map, face, uint32_t(x), uint32_t(y))] !=
                    kNoPage)
                    return true;
        return false;
    }

    /// Draws waiting triangles [first, first + count), one for each lane at most.
    __device__ void draw(uint32_t first, uint32_t count) const {
        const uint32_t lane = laneOfWarp();
        __syncwarp();
        uint32_t texels = 0;
        if (lane < count)
            texels = setUp(shared.waiting[first + lane], shared.setups[lane]);
        const uint32_t upTo = sumUpToLane(texels);
        shared.texelsUpTo[lane] = upTo;
        const uint32_t all = __shfl_sync(kAllLanes, upTo, int(kGroupLanes) - 1);
        __syncwarp();
        for (uint32_t i = lane; i < all; i += kGroupLanes) {
            uint32_t at = 0; // the first setup that ends behind texel i
            for (uint32_t step = kGroupLanes / 2; step > 0; step /= 2)
                if (shared.texelsUpTo[at + step - 1] <= i)
                    at += step;
            cover(at, i - (at == 0 ? 0 : shared.texelsUpTo[at - 1]));
        }
        __syncwarp();
    }

private:
    /// Sets up a triangle of the list for this lane; returns how many texels its rectangle has. A
    /// large one is put on the list of large ones, and has none here.
    __device__ uint32_t setUp(uint32_t code, FaceTriangle& shared_) const {
        const uint32_t face = code & 7u;
        glm::dvec3 corners[3];
        load(code >> 3, corners);
        FaceTriangle t;
        if (!setUpTriangle(faceFromLight(face, corners[0]), faceFromLight(face, corners[1]),
                           faceFromLight(face, corners[2]), map, t))
            return 0;
        const int64_t width = t.x1 - t.x0 + 1, texels = width * (t.y1 - t.y0 + 1);
        if (texels > kSmallTriangleTexels) {
            uint32_t index;
            if (work.large.add(drawIndex, code, pagesOf(t, work.view.pageTexelsLog2).count(),
                               index))
                work.setups[index] = t;
            else
                coverTexels(work.view, map, face, t, triangleOf(code >> 3),
                            StoreGreaterAtomically{work.view.depths});
            return 0;
        }
        shared_ = t;
        shared.code[laneOfWarp()] = code;
        shared.inverseWidth[laneOfWarp()] = 1.0f / float(width);
        return uint32_t(texels);
    }

    /// Draws texel `texel` of the rectangle of a setup: see coverTexels, the same tests of the same
    /// numbers.
    __device__ void cover(uint32_t at, uint32_t texel) const {
        const FaceTriangle& t = shared.setups[at];
        // Half a texel keeps the quotient clear of whole numbers by far more than it rounds.
        const int32_t row = int32_t((float(texel) + 0.5f) * shared.inverseWidth[at]);
        const int32_t y = t.y0 + row, x = t.x0 + int32_t(texel) - row * (t.x1 - t.x0 + 1);
        const double X = double(2 * x + 1 - int32_t(map.faceTexels)),
                     Y = double(2 * y + 1 - int32_t(map.faceTexels));
        for (int k = 0; k < 3; ++k)
            if (!(t.ex[k] * X + (t.ey[k] * Y + t.e0[k]) >= -t.tolerance[k]))
                return;
        const float w = glm::min(glm::max(float(t.wx * X + (t.wy * Y + t.w0)), t.wMin), t.wMax);
        if (!(w <= t.wNear))
            return;
        const uint32_t log2 = work.view.pageTexelsLog2, code = shared.code[at];
        const uint32_t page = work.view.pageTable[pageTableIndex(
            map, code & 7u, uint32_t(x) >> log2, uint32_t(y) >> log2)];
        if (page == kNoPage)
            return;
        const uint32_t triangle = triangleOf(code >> 3);
        if (work.view.geometry.masks.isCut(triangle) &&
            !maskedTriangle(work.view, map, t, triangle).isOpaque(X, Y))
            return;
        const uint32_t inPage = (1u << log2) - 1;
        atomicMaxRelaxed(&work.view.depths[(size_t(page) << (2 * log2)) +
                                           ((uint32_t(y) & inPage) << log2) +
                                           (uint32_t(x) & inPage)],
                         floatBits(w));
    }
};

// One warp per draw.
__global__ void rasterizeTriangleKernel(RasterizeTriangle work) {
    __shared__ WarpTriangles shared[kBlockThreads / kGroupLanes];
    const size_t drawIndex = warpOfGrid();
    if (drawIndex >= work.view.draws.count)
        return;
    const BatchDraw item = work.view.draws[drawIndex];
    if (item.faces == 0)
        return;
    const WarpDraw draw{work, uint32_t(drawIndex), work.view.maps[item.map],
                        work.view.batches[item.batch], shared[threadIdx.x / kGroupLanes]};
    uint32_t waiting = 0;
    for (uint32_t first = 0; first < draw.batch.count; first += kGroupLanes) {
        const uint32_t inBatch = first + laneOfWarp();
        glm::dvec3 fromLight[3];
        if (inBatch < draw.batch.count)
            draw.load(inBatch, fromLight);
        for (uint32_t faces = item.faces; faces != 0; faces &= faces - 1) {
            const uint32_t face = uint32_t(__ffs(int(faces))) - 1;
            const bool waits = inBatch < draw.batch.count && draw.mayCover(fromLight, face);
            const uint32_t lanes = __ballot_sync(kAllLanes, waits);
            if (waits)
                draw.shared.waiting[waiting + __popc(lanes & ((1u << laneOfWarp()) - 1))] =
                    inBatch << 3 | face;
            waiting += __popc(lanes);
            if (waiting >= kGroupLanes) {
                waiting -= kGroupLanes;
                draw.draw(waiting, kGroupLanes);
            }
        }
    }
    if (waiting > 0)
        draw.draw(0, waiting);
}

} // namespace

void launchPass(CudaTag, const RasterizeTriangle& work) {
    launch(rasterizeTriangleKernel, blocksOfWarps(work.view.draws.count), work);
}

} // namespace shadowdag
