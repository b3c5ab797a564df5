// SPDX-License-Identifier: Apache-2.0
// The CPU's own rasterization kernel: the setup and fill of rasterize.h, one face of a map at a
// time, so that texels need no atomics.
#include "shadowmap/rasterize_pass.h"

#include "cuda/parallel_for.h"
#include "shadowmap/rasterize_lanes.h"

#include <algorithm>
#include <numeric>

namespace shadowdag {
namespace {

/// Keeps the greater depth, without atomics. It always writes, so that the compiler may vectorize
/// it.
struct StoreGreater {
    uint32_t* depths;
    void operator()(size_t texel, uint32_t bits) const {
        depths[texel] = depths[texel] > bits ? depths[texel] : bits;
    }
};

/// Covers the texels of a triangle that a mask cuts, by the shared code.
void coverCut(const RasterView& view, uint32_t triangle, const ShadowMapInfo& map, uint32_t face,
              const FaceTriangle& t) {
    coverTexels(view, map, face, t, maskedTriangle(view, map, t, triangle), t.y0, t.y1,
                StoreGreater{view.depths.data});
}

/// Draws one triangle by the shared code. This function covers solid ones only; otherwise the
/// compiler keeps their fill out of line, which takes 40 % more instructions.
void drawTriangle(const RasterView& view, uint32_t triangle, const ShadowMapInfo& map,
                  uint32_t face) {
    glm::dvec3 corners[3];
    for (int corner = 0; corner < 3; ++corner)
        corners[corner] =
            faceFromLight(face, cornerFromLight(view.geometry, triangle, corner, map));
    FaceTriangle t;
    if (!setUpTriangle(corners[0], corners[1], corners[2], map, t))
        return;
    if (view.geometry.masks.isCut(triangle))
        coverCut(view, triangle, map, face, t);
    else
        coverTexels(view, map, face, t, SolidTriangle{}, t.y0, t.y1,
                    StoreGreater{view.depths.data});
}

/// Draws a batch into one face of a map; no other thread writes the face's pages.
void drawBatch(const RasterView& view, const Batch& batch, const ShadowMapInfo& map,
               uint32_t face) {
    const uint32_t* const triangles = &view.batchTriangles[batch.first];
#if defined(SDAG_RASTERIZE_AVX2)
    for (uint32_t first = 0; first < batch.count; first += 4) {
        const uint32_t count = std::min(batch.count - first, 4u);
        uint32_t four[4];
        for (uint32_t lane = 0; lane < 4; ++lane)
            four[lane] = triangles[first + std::min(lane, count - 1)];
        const auto corners = [&](int corner) {
            return avx2::cornersFromLight(view.geometry, four, corner, map, face);
        };
        avx2::FaceTriangles t;
        uint32_t crossing;
        uint32_t ready = avx2::setUpTriangles(corners(0), corners(1), corners(2), map,
                                              (1u << count) - 1u, crossing, t);
        for (; ready; ready &= ready - 1) {
            const int lane = __builtin_ctz(ready);
            if (view.geometry.masks.isCut(four[lane]))
                coverCut(view, four[lane], map, face, t.at(lane));
            else
                avx2::coverTexels(view, map, face, t.at(lane));
        }
        for (; crossing; crossing &= crossing - 1)
            drawTriangle(view, four[__builtin_ctz(crossing)], map, face);
    }
#else
    for (uint32_t i = 0; i < batch.count; ++i)
        drawTriangle(view, triangles[i], map, face);
#endif
}

} // namespace

void rasterizeByFace(const RasterView& view, const std::vector<uint32_t>& drawStart) {
    const size_t mapCount = view.maps.count;
    SDAG_ASSERT(drawStart.size() == mapCount + 1);
    // Longest first, so that no thread is left with a big one at the end.
    std::vector<uint32_t> order(mapCount);
    std::iota(order.begin(), order.end(), 0u);
    std::stable_sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) {
        return drawStart[a + 1] - drawStart[a] > drawStart[b + 1] - drawStart[b];
    });
    cpuParallelRanges(mapCount * kFaceCount, 1, [&](size_t begin, size_t end) {
        for (size_t item = begin; item < end; ++item) {
            const uint32_t mapIndex = order[item / kFaceCount];
            const uint32_t face = uint32_t(item % kFaceCount);
            for (uint32_t i = drawStart[mapIndex]; i < drawStart[mapIndex + 1]; ++i)
                if (view.draws[i].faces >> face & 1u)
                    drawBatch(view, view.batches[view.draws[i].batch], view.maps[mapIndex], face);
        }
    });
}

} // namespace shadowdag
