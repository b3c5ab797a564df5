// SPDX-License-Identifier: Apache-2.0
// The CPU's own kernel of gbuffer_raster.h: batches front to back; the vertices of a batch are
// projected once, and triangles are drawn in lanes (gbuffer_lanes.h). Batches, triangles and parts
// of them behind what all their pixels see are left out: they could not change a pixel.
#include "hybrid/gbuffer/rasterize_cpu.h"

#include "cuda/backend.h"
#include "cuda/mutant.h"
#include "cuda/parallel_for.h"
#include "hybrid/gbuffer/gbuffer_lanes.h"

#include <algorithm>
#include <bit>
#include <memory>
#include <vector>

namespace shadowdag {

namespace {

/// A batch that may be seen.
struct SeenBatch {
    float nearest; ///< no depth of its triangles, by SeenTriangle::depthAt, is less
    uint32_t batch;
    PixelRect rect; ///< no pixel beyond it sees one of them
};

/// Returns the pixels that may see a box: one more than boundPixels would give its triangles.
PixelRect pixelsOf(const Box& box, float nearest, const ViewRays& view) {
    if (!(double(nearest) > view.znear))
        return {0, 0, int(view.width) - 1, int(view.height) - 1};
    double minX = 1e30, minY = 1e30, maxX = -1e30, maxY = -1e30;
    for (int c = 0; c < 8; ++c) {
        const glm::vec3 corner(c & 1 ? box.max.x : box.min.x, c & 2 ? box.max.y : box.min.y,
                               c & 4 ? box.max.z : box.min.z);
        const glm::dvec3 p = glm::dvec3(corner) - view.origin;
        const double perZ = 1.0 / glm::dot(p, view.forward);
        const double x = glm::dot(p, view.right) * perZ, y = glm::dot(p, view.up) * perZ;
        minX = std::min(minX, x);
        maxX = std::max(maxX, x);
        minY = std::min(minY, y);
        maxY = std::max(maxY, y);
    }
    const double scale = 1.0 / view.pixelSize;
    const auto pixel = [](double at, uint32_t count) {
        return int(glm::clamp(at, 0.0, double(count - 1)));
    };
    return {pixel((minX - view.firstX) * scale - 1.0, view.width),
            pixel((view.firstY - maxY) * scale - 1.0, view.height),
            pixel((maxX - view.firstX) * scale + 1.0, view.width),
            pixel((view.firstY - minY) * scale + 1.0, view.height)};
}

/// Returns the batches that may be seen, the nearest first: what they hide is then not written.
std::vector<SeenBatch> seenBatches(const BatchesInView& work) {
    std::vector<SeenBatch> seen(work.batches.count);
    parallelFor<CpuTag>(
        seen.size(),
        [&](size_t b) {
            const Box& box = work.batchBoxes[b];
            const glm::dvec3 center = (glm::dvec3(box.min) + glm::dvec3(box.max)) * 0.5,
                             half = (glm::dvec3(box.max) - glm::dvec3(box.min)) * 0.5;
            const double nearest = glm::dot(work.view.forward, center - work.view.origin) -
                                   glm::dot(glm::abs(work.view.forward), half);
            // Corners' depths are rounded to 2^-52 of these coordinates, and to floats.
            const glm::dvec3 largest = glm::abs(center) + half + glm::abs(work.view.origin);
            const double below =
                nearest - 0x1p-40 * glm::max(largest.x, glm::max(largest.y, largest.z));
            const auto nearestBelow = float(below - 0x1p-20 * glm::abs(below));
            seen[b] = mayBeSeen(box, work.view) ? SeenBatch{nearestBelow, uint32_t(b),
                                                            pixelsOf(box, nearestBelow, work.view)}
                                                : SeenBatch{3e38f, uint32_t(b), {}};
        },
        256);
    std::erase_if(seen, [](const SeenBatch& batch) { return !(batch.nearest < 3e38f); });
    std::sort(seen.begin(), seen.end(), [](const SeenBatch& a, const SeenBatch& b) {
        return a.nearest != b.nearest ? a.nearest < b.nearest : a.batch < b.batch;
    });
    return seen;
}

#if defined(SDAG_DOUBLE_LANES)

using namespace avx2;

/// Draws batches one by one: one for each thread, about 37 KB.
class BatchDrawer {
public:
    BatchDrawer(const BatchesInView& work, const BatchVerticesView& vertices, const Band& band,
                TileDepths& tiles)
        : work_(work), vertices_(vertices), band_(band), tiles_(tiles) {}

    /// @param next the batch that is probably drawn next, whose data are requested, or this one
    void draw(uint32_t batchIndex, uint32_t next) {
        requestBatch(work_.batches, vertices_, work_.batchTriangles, next);
        const Batch& batch = work_.batches[batchIndex];
        const BatchCorners* const corners = &vertices_.corners[batch.first];
        positions_ = &vertices_.positions[vertices_.first[batchIndex]];
        projectOnPicture(positions_, vertices_.count(batchIndex), work_.view, seen_);
        uint32_t count = 0;
        for (uint32_t first = 0; first < batch.count; first += 8) {
            uint32_t crossing;
            count += boundPixelsOfEight(seen_, corners, first, std::min(batch.count - first, 8u),
                                        work_.view, band_, crossing, &bound_[count]);
            for (; crossing; crossing &= crossing - 1)
                drawCrossing(batch.first + first + uint32_t(std::countr_zero(crossing)));
        }
        PixelBounds four[4];
        uint32_t filled = 0;
        for (uint32_t i = 0; i < count; ++i) {
            if (!isTriangleHidden(bound_[i]))
                four[filled++] = bound_[i];
            if (filled == 4 || (i + 1 == count && filled > 0)) {
                drawFour(batch, four, filled);
                filled = 0;
            }
        }
    }

private:
    /// @param four those from `count` on, which may be anything, are written
    void drawFour(const Batch& batch, PixelBounds* four, uint32_t count) {
        const BatchCorners* corners[4];
        uint32_t triangles[4];
        for (uint32_t i = 0; i < 4; ++i) {
            if (i >= count)
                four[i] = four[0];
            const uint32_t inOrder = batch.first + four[i].inBatch;
            corners[i] = &vertices_.corners[inOrder];
            triangles[i] = work_.batchTriangles[inOrder];
        }
        const FourCorners relative(positions_, corners, work_.view.origin);
        SeenTriangles t;
        uint32_t ready = ((1u << count) - 1u) &
                         avx2::boundPixels(relative, work_.view, band_, four) &
                         setUpSeenLanes(relative, work_.view, t);
        uint32_t tiny = 0, empty = 0;
        for (uint32_t i = 0; i < 4; ++i) {
            const PixelRect& rect = four[i].rect;
            empty |= uint32_t(rect.minY > rect.maxY) << i;
            tiny |= uint32_t(rect.maxX - rect.minX < kTinyPixels &&
                             rect.maxY - rect.minY < kTinyPixels &&
                             !work_.triangles.masks.isCut(triangles[i]))
                    << i;
        }
        ready &= ~empty;
        tiny &= ready;
        if (tiny)
            coverTiny(t, four, triangles, tiny, work_.view, work_.visibility, tiles_);
        for (uint32_t others = ready & ~tiny; others; others &= others - 1) {
            const int i = std::countr_zero(others);
            drawTriangle(t.at(i, triangles[i], four[i]));
        }
    }

    /// Returns whether all pixels of a triangle's rectangle see something nearer, as far as that is
    /// found quickly.
    bool isTriangleHidden(const PixelBounds& triangle) {
        constexpr int kFewPixels = 4;
        const PixelRect& rect = triangle.rect;
        const auto nearest = std::bit_cast<uint32_t>(triangle.nearest);
        if (rect.maxX - rect.minX >= kFewPixels || rect.maxY - rect.minY >= kFewPixels)
            return tiles_.isRectHidden(rect, nearest);
        for (int y = rect.minY; y <= rect.maxY; ++y)
            for (int x = rect.minX; x <= rect.maxX; ++x) {
                const size_t pixel = size_t(y) * work_.view.width + size_t(x);
                if (depthSeen(work_.visibility[pixel]) >= nearest)
                    return false;
            }
        return true;
    }

    void drawTriangle(const SeenTriangle& seen) {
        if (work_.triangles.masks.isCut(seen.triangle))
            coverPixels(work_.triangles, seen, seen.rect, work_.view, work_.visibility);
        else
            coverTiles(seen, work_.view, work_.visibility, tiles_);
    }

    void drawCrossing(uint32_t inOrder) {
        SeenTriangle seen;
        if (!setUpSeen(work_.triangles, work_.batchTriangles[inOrder], work_.view, seen))
            return;
        seen.rect = band_.clip(seen.rect);
        if (seen.rect.minY <= seen.rect.maxY)
            drawTriangle(seen);
    }

    BatchesInView work_;
    BatchVerticesView vertices_;
    Band band_;
    TileDepths& tiles_;
    const glm::vec3* positions_ = nullptr; ///< of the batch
    BatchVertices seen_;
    PixelBounds bound_[kMaxBatchTriangleCount];
};

/// Draws batches into a band of the picture, in order.
void drawBand(const BatchesInView& work, const BatchVerticesView& vertices,
              View<const SeenBatch> seen, const Band& band, TileDepths& tiles) {
    std::vector<SeenBatch> inBand;
    for (const SeenBatch& batch : seen)
        if (batch.rect.maxY >= band.first && batch.rect.minY <= band.last)
            inBand.push_back(batch);
    const auto drawer = std::make_unique<BatchDrawer>(work, vertices, band, tiles);
    for (size_t i = 0; i < inBand.size(); ++i) {
        const SeenBatch& batch = inBand[i];
        if (batch.batch % 8 == 7 && isMutant(Mutant::kSeenBatchLost))
            continue;
        const auto nearest = std::bit_cast<uint32_t>(batch.nearest);
        const bool isHidden = double(batch.nearest) > work.view.znear &&
                              tiles.isRectHidden(band.clip(batch.rect), nearest);
        if (!isHidden)
            drawer->draw(batch.batch, inBand[std::min(i + 1, inBand.size() - 1)].batch);
    }
}

/// Draws batches in bands of the picture, each by one thread: what a pixel sees is then replaced
/// without atomic operations, four pixels at once. Batches over several bands are bounded in each.
void drawBatches(const BatchesInView& work, const BatchVerticesView& vertices,
                 const std::vector<SeenBatch>& seen, size_t batchesPerRound) {
    constexpr int kBandsPerThread = 4; // so that threads end together
    constexpr int kLeastTiles = 2;     // rows of tiles of a band
    constexpr int kSide = TileDepths::kSide;
    const int height = int(work.view.height), tileRows = (height + kSide - 1) / kSide;
    const int bands =
        std::clamp(kBandsPerThread * threadCount(), 1, std::max(1, tileRows / kLeastTiles));
    const int rows = (tileRows + bands - 1) / bands * kSide;
    TileDepths tiles(work.view, {work.visibility.data, work.visibility.count});
    for (size_t begin = 0; begin < seen.size(); begin += batchesPerRound) {
        const View<const SeenBatch> round{seen.data() + begin,
                                          std::min(batchesPerRound, seen.size() - begin)};
        parallelFor<CpuTag>(
            size_t((height + rows - 1) / rows),
            [&](size_t band) {
                const int first = int(band) * rows;
                drawBand(work, vertices, round, {first, std::min(first + rows, height) - 1}, tiles);
            },
            1);
    }
}

#else

void drawBatches(const BatchesInView& work, const BatchVerticesView&,
                 const std::vector<SeenBatch>& seen, size_t) {
    parallelFor<CpuTag>(
        seen.size(),
        [&](size_t i) {
            const Batch& batch = work.batches[seen[i].batch];
            for (uint32_t t = batch.first; t < batch.first + batch.count; ++t)
                rasterizeTriangle(work.triangles, work.batchTriangles[t], work.view,
                                  work.visibility);
        },
        8);
}

#endif

} // namespace

void rasterizeFrontToBack(const BatchesInView& work, const BatchVerticesView& vertices,
                          size_t batchesPerRound) {
    SDAG_ASSERT(vertices.first.count == work.batches.count + 1);
    drawBatches(work, vertices, seenBatches(work), batchesPerRound);
}

} // namespace shadowdag
