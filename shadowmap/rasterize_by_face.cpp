// SPDX-License-Identifier: Apache-2.0
// The CPU's own rasterization kernel: the setup and fill of rasterize.h, one face of a map at a
// time, so that texels need no atomics; batches front to back, so that what they hide is not drawn.
#include "cuda/mutant.h"
#include "shadowmap/rasterize_pass.h"

#include "cuda/parallel_for.h"
#include "shadowmap/face_vertices_lanes.h"

#include <algorithm>
#include <bit>
#include <memory>
#include <numeric>

namespace shadowdag {
namespace {

/// Covers the texels of a triangle that a mask cuts, by the shared code.
void coverCut(const FacePages& pages, uint32_t triangle, const FaceTriangle& t) {
    coverTexels(pages.view, *pages.map, pages.face, t,
                maskedTriangle(pages.view, *pages.map, t, triangle), t.y0, t.y1,
                StoreGreater{pages.view.depths.data});
}

/// Draws one triangle that is set up by the shared code.
void drawTriangle(const FacePages& pages, uint32_t triangle) {
    const TriangleView& geometry = pages.view.geometry;
    glm::dvec3 corners[3];
    for (int corner = 0; corner < 3; ++corner)
        corners[corner] =
            faceFromLight(pages.face, cornerFromLight(geometry, triangle, corner, *pages.map));
    FaceTriangle t;
    if (!setUpTriangle(corners[0], corners[1], corners[2], *pages.map, t))
        return;
    if (geometry.masks.isCut(triangle)) {
        coverCut(pages, triangle, t);
        return;
    }
#if defined(SDAG_RASTERIZE_AVX2)
    avx2::coverTexels(pages, t);
#else
    coverTexels(pages.view, *pages.map, pages.face, t, SolidTriangle{}, t.y0, t.y1,
                StoreGreater{pages.view.depths.data});
#endif
}

#if defined(SDAG_RASTERIZE_AVX2)

/// Draws batches one by one into the face that `pages` are of: one for each thread, about 25 KB.
class BatchDrawer {
public:
    BatchDrawer(const FacePages& pages, const BatchVerticesView& vertices)
        : pages_(pages), view_(pages.view), vertices_(vertices) {}

    /// @param next the batch that may be drawn after this one, whose data are requested, or this
    void draw(uint32_t batchIndex, uint32_t next) {
        avx2::requestBatch(view_.batches, vertices_, view_.batchTriangles, next);
        const Batch& batch = view_.batches[batchIndex];
        const BatchCorners* const corners = &vertices_.corners[batch.first];
        const glm::vec3* const positions = &vertices_.positions[vertices_.first[batchIndex]];
        avx2::projectOnFace(positions, vertices_.count(batchIndex), *pages_.map, pages_.face,
                            seen_);
        avx2::TexelBounds bounded[8];
        uint32_t four[4], filled = 0; // numbers in the batch
        for (uint32_t first = 0; first < batch.count; first += 8) {
            const uint32_t count = avx2::boundTexelsOfEight(
                seen_, corners, first, std::min(batch.count - first, 8u), pages_, bounded);
            for (uint32_t i = 0; i < count; ++i) {
                if (avx2::isHidden(pages_, bounded[i]))
                    continue;
                four[filled++] = bounded[i].inBatch;
                if (filled == 4) {
                    drawFour(batch, positions, four, filled);
                    filled = 0;
                }
            }
        }
        if (filled > 0)
            drawFour(batch, positions, four, filled);
    }

private:
    /// Draws triangles four[0..count) of a batch. @param positions of the batch
    void drawFour(const Batch& batch, const glm::vec3* positions, const uint32_t* four,
                  uint32_t count) {
        const BatchCorners* corners[4];
        uint32_t triangles[4];
        for (uint32_t lane = 0; lane < 4; ++lane) {
            const uint32_t inOrder = batch.first + four[std::min(lane, count - 1)];
            corners[lane] = &vertices_.corners[inOrder];
            triangles[lane] = view_.batchTriangles[inOrder];
        }
        const auto corner = [&](int c) {
            return avx2::faceFromWorld(avx2::cornersOfFour(positions, corners, c), *pages_.map,
                                       pages_.face);
        };
        FaceTriangle t[4];
        uint32_t crossing;
        uint32_t ready = avx2::setUpTriangles(corner(0), corner(1), corner(2), *pages_.map,
                                              (1u << count) - 1u, crossing, t);
        if (crossing != 0 && isMutant(Mutant::kRasterNearLost))
            crossing = 0;
        if (ready >> 3 != 0 && isMutant(Mutant::kRasterLaneLost))
            ready &= 7u;
        for (; ready; ready &= ready - 1) {
            const int lane = std::countr_zero(ready);
            if (view_.geometry.masks.isCut(triangles[lane]))
                coverCut(pages_, triangles[lane], t[lane]);
            else
                avx2::coverTexels(pages_, t[lane]);
        }
        for (; crossing; crossing &= crossing - 1)
            drawTriangle(pages_, triangles[std::countr_zero(crossing)]);
    }

    const FacePages& pages_;
    const RasterView& view_;
    BatchVerticesView vertices_;
    avx2::BatchVertices seen_;
};

#else

/// Draws batches one by one, by the shared code.
class BatchDrawer {
public:
    BatchDrawer(const FacePages& pages, const BatchVerticesView&) : pages_(pages) {}

    void draw(uint32_t batchIndex, uint32_t) {
        const Batch& batch = pages_.view.batches[batchIndex];
        for (uint32_t i = batch.first; i < batch.first + batch.count; ++i)
            drawTriangle(pages_, pages_.view.batchTriangles[i]);
    }

private:
    const FacePages& pages_;
};

#endif

/// A batch to draw into a face, and where it lies there.
struct FaceDraw {
    uint32_t batch;
    FaceRect rect;
};

/// Returns whether every page with memory that a batch may touch holds nothing but nearer surfaces.
bool isHidden(const FacePages& pages, const FaceRect& rect) {
    if (!(rect.depthMin > 0.0f))
        return false;
    // More than what rounding differs by between a box and its triangles.
    constexpr float kRounding = 1.0f + 1e-6f;
    const uint32_t bits = floatBits(1.0f / rect.depthMin * kRounding),
                   log2 = pages.view.pageTexelsLog2;
    const int32_t n = int32_t(pages.map->faceTexels), side = 1 << log2;
    const auto pageOf = [&](float u, int32_t beyond) { // with a texel more
        const int32_t x = int32_t(faceCell(u, pages.map->faceTexels)) + beyond;
        return std::clamp(x, 0, n - 1) >> log2;
    };
    const int32_t x0 = pageOf(rect.uMin, -1), x1 = pageOf(rect.uMax, 1);
    const int32_t y0 = pageOf(rect.vMin, -1), y1 = pageOf(rect.vMax, 1);
    for (int32_t y = y0; y <= y1; ++y) {
        const bool isRowHidden = pages.forPresentWhile(y, x0, x1, [&](int32_t x, uint32_t page) {
            return pages.floors.refreshed(
                page, bits, pages.view.depths.data + (size_t(page) << (2 * log2)), side,
                std::min(side, n - x * side), std::min(side, n - y * side));
        });
        if (!isRowHidden)
            return false;
    }
    return true;
}

/// Draws batches into a face, the nearest first. @param pages set to that face
void drawFace(FacePages& pages, const ShadowMapInfo& map, uint32_t face,
              View<const BatchDraw> draws, View<const Box> boxesWorld, BatchDrawer& drawer) {
    std::vector<FaceDraw> ordered;
    for (const BatchDraw& draw : draws) {
        FaceDraw item{draw.batch, {}};
        if ((draw.faces >> face & 1u) &&
            projectOnMap(map, boxesWorld[draw.batch], face, 0.0f, item.rect))
            ordered.push_back(item);
    }
    if (ordered.empty())
        return;
    pages.set(map, face);
    std::stable_sort(ordered.begin(), ordered.end(), [](const FaceDraw& a, const FaceDraw& b) {
        return a.rect.depthMin < b.rect.depthMin;
    });
    for (size_t i = 0; i < ordered.size(); ++i)
        if (!isHidden(pages, ordered[i].rect))
            drawer.draw(ordered[i].batch, ordered[std::min(i + 1, ordered.size() - 1)].batch);
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

void rasterizeByFace(const RasterView& view, const BatchVerticesView& vertices,
                     const std::vector<uint32_t>& drawStart, View<const Box> boxesWorld,
                     View<PageFloor> pageFloors, const PagesToClear& toClear) {
    const size_t mapCount = view.maps.count;
    SDAG_ASSERT(drawStart.size() == mapCount + 1);
    SDAG_ASSERT(vertices.first.count == view.batches.count + 1);
    // Longest first, so that no thread is left with a big one at the end.
    std::vector<uint32_t> order(mapCount);
    std::iota(order.begin(), order.end(), 0u);
    std::stable_sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) {
        return drawStart[a + 1] - drawStart[a] > drawStart[b + 1] - drawStart[b];
    });
    cpuParallelRanges(mapCount * kFaceCount, 1, [&](size_t begin, size_t end) {
        PageFloors floors(pageFloors);
        FacePages pages(view, floors);
        const auto drawer = std::make_unique<BatchDrawer>(pages, vertices);
        for (size_t item = begin; item < end; ++item) {
            const uint32_t mapIndex = order[item / kFaceCount];
            const uint32_t face = uint32_t(item % kFaceCount);
            clearFace(view, view.maps[mapIndex], face, toClear);
            if (face == 3 && isMutant(Mutant::kFaceSkipped))
                continue;
            const uint32_t first = drawStart[mapIndex];
            drawFace(pages, view.maps[mapIndex], face,
                     {view.draws.data + first, drawStart[mapIndex + 1] - first}, boxesWorld,
                     *drawer);
        }
    });
}

} // namespace shadowdag
