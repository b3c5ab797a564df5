// SPDX-License-Identifier: Apache-2.0
// The CPU's own rasterization kernel: the setup and fill of rasterize.h, one face of a map at a
// time, so that texels need no atomics; batches front to back, so that what they hide is not drawn.
#include "cuda/mutant.h"
#include "shadowmap/rasterize_pass.h"

#include "cuda/parallel_for.h"
#include "shadowmap/rasterize_lanes.h"

#include <algorithm>
#include <numeric>

namespace shadowdag {
namespace {

/// Covers the texels of a triangle that a mask cuts, by the shared code.
void coverCut(const RasterView& view, uint32_t triangle, const ShadowMapInfo& map, uint32_t face,
              const FaceTriangle& t) {
    coverTexels(view, map, face, t, maskedTriangle(view, map, t, triangle), t.y0, t.y1,
                StoreGreater{view.depths.data});
}

/// Draws one triangle that is set up by the shared code.
void drawTriangle(const RasterView& view, uint32_t triangle, const ShadowMapInfo& map,
                  uint32_t face, [[maybe_unused]] PageFloors& floors) {
    glm::dvec3 corners[3];
    for (int corner = 0; corner < 3; ++corner)
        corners[corner] =
            faceFromLight(face, cornerFromLight(view.geometry, triangle, corner, map));
    FaceTriangle t;
    if (!setUpTriangle(corners[0], corners[1], corners[2], map, t))
        return;
    if (view.geometry.masks.isCut(triangle)) {
        coverCut(view, triangle, map, face, t);
        return;
    }
#if defined(SDAG_RASTERIZE_AVX2)
    avx2::coverTexels(view, map, face, t, floors);
#else
    coverTexels(view, map, face, t, SolidTriangle{}, t.y0, t.y1, StoreGreater{view.depths.data});
#endif
}

/// Draws a batch into one face of a map; no other thread writes the face's pages.
/// @param next the batch that may be drawn after this one, or this one
void drawBatch(const RasterView& view, const Batch& batch, [[maybe_unused]] const Batch& next,
               const ShadowMapInfo& map, uint32_t face, [[maybe_unused]] PageFloors& floors) {
    const uint32_t* const triangles = &view.batchTriangles[batch.first];
#if defined(SDAG_RASTERIZE_AVX2)
    const avx2::RequestedFours fours(view.geometry, triangles, batch.count,
                                     &view.batchTriangles[next.first], next.count);
    for (uint32_t first = 0; first < batch.count; first += 4) {
        const uint32_t count = fours.take(first);
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
        if (crossing != 0 && isMutant(Mutant::kRasterNearLost))
            crossing = 0;
        if (ready >> 3 != 0 && isMutant(Mutant::kRasterLaneLost))
            ready &= 7u;
        for (; ready; ready &= ready - 1) {
            const int lane = __builtin_ctz(ready);
            if (view.geometry.masks.isCut(four[lane]))
                coverCut(view, four[lane], map, face, t.at(lane));
            else
                avx2::coverTexels(view, map, face, t.at(lane), floors);
        }
        for (; crossing; crossing &= crossing - 1)
            drawTriangle(view, four[__builtin_ctz(crossing)], map, face, floors);
    }
#else
    for (uint32_t i = 0; i < batch.count; ++i)
        drawTriangle(view, triangles[i], map, face, floors);
#endif
}

/// A batch to draw into a face, and where it lies there.
struct FaceDraw {
    uint32_t batch;
    FaceRect rect;
};

/// Returns whether every page with memory that a batch may touch holds nothing but nearer surfaces.
bool isHidden(const RasterView& view, const ShadowMapInfo& map, uint32_t face, const FaceRect& rect,
              PageFloors& floors) {
    if (!(rect.depthMin > 0.0f))
        return false;
    // More than what rounding differs by between a box and its triangles.
    constexpr float kRounding = 1.0f + 1e-6f;
    const uint32_t bits = floatBits(1.0f / rect.depthMin * kRounding);
    const int32_t n = int32_t(map.faceTexels), side = 1 << view.pageTexelsLog2;
    const auto pageOf = [&](float u, int32_t beyond) { // with a texel more
        const int32_t x = int32_t(faceCell(u, map.faceTexels)) + beyond;
        return std::clamp(x, 0, n - 1) >> view.pageTexelsLog2;
    };
    const int32_t x0 = pageOf(rect.uMin, -1), x1 = pageOf(rect.uMax, 1);
    const int32_t y0 = pageOf(rect.vMin, -1), y1 = pageOf(rect.vMax, 1);
    for (int32_t y = y0; y <= y1; ++y)
        for (int32_t x = x0; x <= x1; ++x) {
            const uint32_t page =
                view.pageTable[pageTableIndex(map, face, uint32_t(x), uint32_t(y))];
            if (page != kNoPage &&
                !floors.refreshed(page, bits,
                                  view.depths.data + (size_t(page) << (2 * view.pageTexelsLog2)),
                                  side, std::min(side, n - x * side), std::min(side, n - y * side)))
                return false;
        }
    return true;
}

/// Draws batches into one face of a map, the nearest first.
void drawFace(const RasterView& view, View<const BatchDraw> draws, const ShadowMapInfo& map,
              uint32_t face, View<const Box> boxesWorld, PageFloors& floors) {
    std::vector<FaceDraw> ordered;
    for (const BatchDraw& draw : draws) {
        FaceDraw item{draw.batch, {}};
        if ((draw.faces >> face & 1u) &&
            projectOnMap(map, boxesWorld[draw.batch], face, 0.0f, item.rect))
            ordered.push_back(item);
    }
    std::stable_sort(ordered.begin(), ordered.end(), [](const FaceDraw& a, const FaceDraw& b) {
        return a.rect.depthMin < b.rect.depthMin;
    });
    for (size_t i = 0; i < ordered.size(); ++i)
        if (!isHidden(view, map, face, ordered[i].rect, floors))
            drawBatch(view, view.batches[ordered[i].batch],
                      view.batches[ordered[std::min(i + 1, ordered.size() - 1)].batch], map, face,
                      floors);
}

/// Clears the new pages of one face of a map.
void clearFace(const RasterView& view, const ShadowMapInfo& map, uint32_t face,
               const PagesToClear& toClear) {
    if (isMutant(Mutant::kPagesNotCleared))
        return;
    const uint32_t* entry = std::lower_bound(toClear.entries.begin(), toClear.entries.end(),
                                             pageTableIndex(map, face, 0, 0));
    const uint32_t pageTexels = 1u << (2 * view.pageTexelsLog2);
    for (const uint32_t end = pageTableIndex(map, face + 1, 0, 0);
         entry != toClear.entries.end() && *entry < end; ++entry)
        std::fill_n(view.depths.data + size_t(toClear.pageTable[*entry]) * pageTexels, pageTexels,
                    0u);
}

} // namespace

void rasterizeByFace(const RasterView& view, const std::vector<uint32_t>& drawStart,
                     View<const Box> boxesWorld, View<PageFloor> pageFloors,
                     const PagesToClear& toClear) {
    const size_t mapCount = view.maps.count;
    SDAG_ASSERT(drawStart.size() == mapCount + 1);
    // Longest first, so that no thread is left with a big one at the end.
    std::vector<uint32_t> order(mapCount);
    std::iota(order.begin(), order.end(), 0u);
    std::stable_sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) {
        return drawStart[a + 1] - drawStart[a] > drawStart[b + 1] - drawStart[b];
    });
    cpuParallelRanges(mapCount * kFaceCount, 1, [&](size_t begin, size_t end) {
        PageFloors floors(pageFloors);
        for (size_t item = begin; item < end; ++item) {
            const uint32_t mapIndex = order[item / kFaceCount];
            const uint32_t face = uint32_t(item % kFaceCount);
            clearFace(view, view.maps[mapIndex], face, toClear);
            if (face == 3 && isMutant(Mutant::kFaceSkipped))
                continue;
            const uint32_t first = drawStart[mapIndex];
            drawFace(view, {view.draws.data + first, drawStart[mapIndex + 1] - first},
                     view.maps[mapIndex], face, boxesWorld, floors);
        }
    });
}

} // namespace shadowdag
