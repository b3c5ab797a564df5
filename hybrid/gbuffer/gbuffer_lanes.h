// SPDX-License-Identifier: Apache-2.0
// gbuffer_raster.h in lanes of doubles: four triangles are bounded and set up at once, and four
// pixels are covered at once, by the same operations in the same order, so that the visibility
// buffer has the same bits. Only the rectangle of pixels that may see a triangle is computed
// otherwise: in doubles with other rounding, far less than its margin, after one in floats has
// found that it has a pixel.
#pragma once

#include "hybrid/gbuffer/tile_depths.h"
#include "scenes/double_lanes.h"

#include <algorithm>
#include <bit>
#include <limits>

#if defined(SDAG_DOUBLE_LANES)

namespace shadowdag::avx2 {

/// The vertices of a batch, as a view sees them.
struct SeenVertices {
    /// Relative to the camera.
    struct alignas(32) Position {
        double x, y, z, unused;
    };
    /// Where it lies in the picture, in pixels.
    struct alignas(16) Projected {
        double x, y;
    };
    /// The same, rounded, and its depth: negative nearer than the near plane, where the others are
    /// of no use.
    struct alignas(16) Rounded {
        float x, y, depth, unused;
    };
    static constexpr uint32_t kMaxCount = 3 * kMaxBatchTriangleCount + BatchVerticesView::kPadding;
    Position positions[kMaxCount];
    Projected projected[kMaxCount];
    Rounded rounded[kMaxCount];
};

/// Sets `count` vertices. @param positions world space; may be read up to the next multiple of four
inline void projectVertices(const glm::vec3* positions, uint32_t count, const ViewRays& view,
                            SeenVertices& vertices) {
    const Lanes3 origin = all(view.origin), right = all(view.right), up = all(view.up),
                 forward = all(view.forward);
    const Lanes scale = all(1.0 / view.pixelSize);
    for (uint32_t v = 0; v < count; v += 4) {
        const Lanes3 p = difference(fourVectors(&positions[v].x), origin);
        const Lanes z = dot(p, forward), perZ = all(1.0) / z;
        const Lanes x = (dot(p, right) * perZ - all(view.firstX)) * scale,
                    y = (all(view.firstY) - dot(p, up) * perZ) * scale;
        const Lanes even = _mm256_unpacklo_pd(x, y), odd = _mm256_unpackhi_pd(x, y);
        _mm256_storeu_pd(&vertices.projected[v].x, _mm256_permute2f128_pd(even, odd, 0x20));
        _mm256_storeu_pd(&vertices.projected[v + 2].x, _mm256_permute2f128_pd(even, odd, 0x31));
        __m128 floats[4] = {
            _mm256_cvtpd_ps(x), _mm256_cvtpd_ps(y),
            _mm256_cvtpd_ps(_mm256_blendv_pd(all(-1.0), z, atLeast(z, all(view.znear)))),
            _mm_setzero_ps()};
        _MM_TRANSPOSE4_PS(floats[0], floats[1], floats[2], floats[3]);
        for (uint32_t i = 0; i < 4; ++i)
            _mm_store_ps(&vertices.rounded[v + i].x, floats[i]);
        Lanes rows[4] = {p.x, p.y, p.z, _mm256_setzero_pd()};
        transpose(rows[0], rows[1], rows[2], rows[3]);
        for (uint32_t i = 0; i < 4; ++i)
            _mm256_store_pd(&vertices.positions[v + i].x, rows[i]);
    }
}

/// A triangle of a batch that may have pixels.
struct BoundTriangle {
    PixelRect rect;   ///< holds that of boundPixels
    float nearest;    ///< SeenTriangle::nearest
    uint32_t inBatch; ///< its number
};

/// Bounds four triangles. Writes those that lie in front of the near plane and may have a pixel to
/// `bound`, and returns their number; those in `crossing` (bit i) reach the near plane.
/// @param wanted how many there are, 1..4
inline uint32_t boundFour(const SeenVertices& vertices, const BatchCorners* corners,
                          uint32_t inBatch, uint32_t wanted, const ViewRays& view,
                          uint32_t& crossing, BoundTriangle* bound) {
    __m128 x[3], y[3], depth[3];
    for (int corner = 0; corner < 3; ++corner) {
        __m128 rows[4];
        for (uint32_t i = 0; i < 4; ++i)
            rows[i] = _mm_load_ps(
                &vertices.rounded[corners[inBatch + std::min(i, wanted - 1)].of[corner]].x);
        _MM_TRANSPOSE4_PS(rows[0], rows[1], rows[2], rows[3]);
        x[corner] = rows[0];
        y[corner] = rows[1];
        depth[corner] = rows[2];
    }
    const auto behind = [&](int corner) { return uint32_t(_mm_movemask_ps(depth[corner])); };
    const uint32_t isWanted = (1u << wanted) - 1u, anyBehind = behind(0) | behind(1) | behind(2);
    crossing = isWanted & anyBehind & ~(behind(0) & behind(1) & behind(2));
    const auto span = [](const __m128* v, uint32_t pixels, int32_t* first, int32_t* last) {
        // A float is off by 0.001 pixels at 16384, and so is a sum.
        const __m128 margin = _mm_set1_ps(float(kPixelMargin) + 0.01f),
                     end = _mm_set1_ps(float(pixels - 1)), zero = _mm_setzero_ps();
        const __m128 from = _mm_sub_ps(_mm_min_ps(v[0], _mm_min_ps(v[1], v[2])), margin),
                     to = _mm_add_ps(_mm_max_ps(v[0], _mm_max_ps(v[1], v[2])), margin);
        const __m128 lo = _mm_ceil_ps(_mm_max_ps(from, zero)),
                     hi = _mm_floor_ps(_mm_min_ps(to, end));
        _mm_store_si128(reinterpret_cast<__m128i*>(first), _mm_cvttps_epi32(lo));
        _mm_store_si128(reinterpret_cast<__m128i*>(last), _mm_cvttps_epi32(hi));
        return _mm_and_ps(_mm_and_ps(_mm_cmpge_ps(end, from), _mm_cmpge_ps(to, zero)),
                          _mm_cmpge_ps(hi, lo));
    };
    alignas(16) int32_t minX[4], minY[4], maxX[4], maxY[4];
    alignas(16) float nearest[4];
    const __m128 isSeen =
        _mm_and_ps(span(x, view.width, minX, maxX), span(y, view.height, minY, maxY));
    _mm_store_ps(nearest, _mm_min_ps(depth[0], _mm_min_ps(depth[1], depth[2])));
    uint32_t count = 0;
    for (uint32_t kept = isWanted & ~anyBehind & uint32_t(_mm_movemask_ps(isSeen)); kept;
         kept &= kept - 1) {
        const int i = std::countr_zero(kept);
        bound[count++] = {{minX[i], minY[i], maxX[i], maxY[i]}, nearest[i], inBatch + uint32_t(i)};
    }
    return count;
}

/// SeenTriangle, four of them.
struct SeenTriangles {
    Lanes start[4], perX[4], perY[4], plane;

    SeenTriangle at(int lane, uint32_t triangle, const BoundTriangle& bound) const {
        SeenTriangle t;
        for (int k = 0; k < 4; ++k) {
            t.start[k] = start[k][lane];
            t.perX[k] = perX[k][lane];
            t.perY[k] = perY[k][lane];
        }
        t.plane = plane[lane];
        t.triangle = triangle;
        t.rect = bound.rect;
        t.nearest = bound.nearest;
        return t;
    }
};

/// Sets the rectangles of four triangles to those of boundPixels; returns the lanes (bits) that
/// have a pixel.
inline uint32_t rectsOf(const SeenVertices& vertices, const BatchCorners* const* four,
                        const ViewRays& view, BoundTriangle* bound) {
    Lanes x[3], y[3];
    for (int i = 0; i < 3; ++i) {
        const auto corner = [&](int lane) {
            return _mm_load_pd(&vertices.projected[four[lane]->of[i]].x);
        };
        const Lanes a = _mm256_set_m128d(corner(2), corner(0)),
                    b = _mm256_set_m128d(corner(3), corner(1));
        x[i] = _mm256_unpacklo_pd(a, b);
        y[i] = _mm256_unpackhi_pd(a, b);
    }
    alignas(16) int32_t minX[4], minY[4], maxX[4], maxY[4];
    const auto span = [](const Lanes* v, uint32_t pixels, int32_t* first, int32_t* last) {
        const Lanes margin = all(kPixelMargin);
        return wholeSpans(least(v[0], least(v[1], v[2])) - margin,
                          most(v[0], most(v[1], v[2])) + margin, all(double(pixels) - 1.0), first,
                          last);
    };
    const Lanes isSeen =
        _mm256_and_pd(span(x, view.width, minX, maxX), span(y, view.height, minY, maxY));
    for (int i = 0; i < 4; ++i)
        bound[i].rect = {minX[i], minY[i], maxX[i], maxY[i]};
    return bitsOf(isSeen);
}

/// setUpSeen in lanes, without bounds. Returns the lanes (bit i = lane i) that have an area.
inline uint32_t setUpSeenLanes(const SeenVertices& vertices, const BatchCorners* const* four,
                               const ViewRays& view, SeenTriangles& t) {
    Lanes3 corner[3];
    for (int i = 0; i < 3; ++i) {
        Lanes rows[4];
        for (int lane = 0; lane < 4; ++lane)
            rows[lane] = _mm256_load_pd(&vertices.positions[four[lane]->of[i]].x);
        transpose(rows[0], rows[1], rows[2], rows[3]);
        corner[i] = {rows[0], rows[1], rows[2]};
    }
    const Lanes3 a = difference(corner[1], corner[0]), b = difference(corner[2], corner[0]);
    const Lanes3 normal = cross(a, b);
    const uint32_t kept =
        bitsOf(above(dot(normal, normal), all(kParallelSides) * dot(a, a) * dot(b, b)));
    if (!kept)
        return 0;
    const Lanes3 first = all(view.first), stepX = all(view.stepX), stepY = all(view.stepY);
    for (int i = 0; i < 4; ++i) {
        const Lanes3 n = i == 3 ? normal : cross(corner[i], corner[i == 2 ? 0 : i + 1]);
        t.start[i] = dot(n, first);
        t.perX[i] = dot(n, stepX);
        t.perY[i] = dot(n, stepY);
    }
    t.plane = dot(normal, corner[0]);
    return kept;
}

/// Returns the lanes inside of a triangle: edges none of which is negative, or none positive.
inline Lanes insideOf(const Lanes (&e)[3]) {
    const Lanes zero = _mm256_setzero_pd();
    const auto allOf = [](Lanes a, Lanes b, Lanes c) {
        return _mm256_and_pd(a, _mm256_and_pd(b, c));
    };
    return _mm256_or_pd(allOf(atLeast(e[0], zero), atLeast(e[1], zero), atLeast(e[2], zero)),
                        allOf(atLeast(zero, e[0]), atLeast(zero, e[1]), atLeast(zero, e[2])));
}

/// Keeps the nearer of what pixels see and of a triangle, for the lanes of `covered` (bits).
/// Returns those that changed.
/// @param pixelOf(lane) the pixel @param triangleOf(lane) the triangle
template <class PixelOf, class TriangleOf>
inline uint32_t storeNearer(Lanes depth, uint32_t covered, const PixelOf& pixelOf,
                            const TriangleOf& triangleOf) {
    alignas(16) uint32_t bits[4];
    _mm_store_si128(reinterpret_cast<__m128i*>(bits), _mm_castps_si128(_mm256_cvtpd_ps(depth)));
    uint32_t changed = 0;
    for (; covered; covered &= covered - 1) {
        const int lane = std::countr_zero(covered);
        const uint64_t now = uint64_t(bits[lane]) << 32 | triangleOf(lane);
        uint64_t& pixel = pixelOf(lane);
        if (now < loadPast(&pixel)) {
            atomicMinRelaxed(&pixel, now);
            changed |= 1u << lane;
        }
    }
    return changed;
}

/// A triangle without a mask, and where it is drawn: up to eight pixels of a row at once.
class RowCover {
public:
    RowCover(const SeenTriangle& seen, const ViewRays& view, View<uint64_t> visibility)
        : seen_(seen), visibility_(visibility), width_(view.width), znear_(all(view.znear)),
          zfar_(all(view.zfar)), plane_(all(seen.plane)), nearest_(all(double(seen.nearest))),
          start_(_mm256_loadu_pd(seen.start)), perY_(_mm256_loadu_pd(seen.perY)) {
        for (int i = 0; i < 4; ++i)
            perX_[i] = all(seen.perX[i]);
    }

    /// coverPixels of columns [minX, maxX] of a row, at most eight. Returns how many pixels
    /// changed.
    /// @param isWithin all of them are inside
    uint32_t cover(int y, int minX, int maxX, bool isWithin) const {
        const Lanes row = start_ + all(double(y)) * perY_;
        const Lanes edge[3] = {_mm256_permute4x64_pd(row, 0x00), _mm256_permute4x64_pd(row, 0x55),
                               _mm256_permute4x64_pd(row, 0xaa)};
        const Lanes X = all(double(minX)) + _mm256_setr_pd(0, 1, 2, 3), next = X + all(4.0);
        const bool isWide = maxX - minX > 3;
        uint32_t covered = (2u << (maxX - minX)) - 1u;
        if (!isWithin)
            covered &= bitsOf(inside(edge, X)) | (isWide ? bitsOf(inside(edge, next)) << 4 : 0u);
        if (!covered)
            return 0;
        const Lanes along = _mm256_permute4x64_pd(row, 0xff);
        uint64_t* const pixels = &visibility_[size_t(y) * width_ + size_t(minX)];
        uint32_t changed = 0;
        if (covered & 15u)
            changed += store(along, X, covered & 15u, pixels);
        if (covered >> 4)
            changed += store(along, next, covered >> 4, pixels + 4);
        return changed;
    }

private:
    Lanes inside(const Lanes (&edge)[3], Lanes X) const {
        const Lanes e[3] = {edge[0] + X * perX_[0], edge[1] + X * perX_[1], edge[2] + X * perX_[2]};
        return insideOf(e);
    }
    uint32_t store(Lanes along, Lanes X, uint32_t covered, uint64_t* pixels) const {
        const Lanes depth = most(plane_ / (along + X * perX_[3]), nearest_);
        covered &= bitsOf(_mm256_and_pd(atLeast(depth, znear_), atLeast(zfar_, depth)));
        return uint32_t(std::popcount(storeNearer(
            depth, covered, [&](int lane) -> uint64_t& { return pixels[lane]; },
            [&](int) { return seen_.triangle; })));
    }

    const SeenTriangle& seen_;
    View<uint64_t> visibility_;
    uint32_t width_;
    Lanes znear_, zfar_, plane_, nearest_, start_, perY_, perX_[4];
};

/// Covers a triangle without a mask, tile by tile. Edges and the function of the plane are monotone
/// along rows and columns, as they are rounded, so their values at the corners of a part bound
/// those within: a part outside is skipped, one within is not tested, one whose pixels all see
/// something nearer is left alone.
inline void coverTiles(const SeenTriangle& seen, const ViewRays& view, View<uint64_t> visibility,
                       TileDepths& tiles) {
    constexpr uint32_t kEdges = 7; // lanes; the last one has the function of the plane
    constexpr int kSide = TileDepths::kSide, kSideLog2 = TileDepths::kSideLog2;
    const RowCover rows(seen, view, visibility);
    const PixelRect& rect = seen.rect;
    if (rect.maxX - rect.minX < kSide &&
        rect.maxY - rect.minY < kSide) { // bounds would take longer
        uint32_t changedCount = 0;
        for (int y = rect.minY; y <= rect.maxY; ++y)
            changedCount += rows.cover(y, rect.minX, rect.maxX, false);
        tiles.note(rect.minX >> kSideLog2, rect.minY >> kSideLog2, changedCount);
        return;
    }
    const Lanes start = _mm256_loadu_pd(seen.start), perX = _mm256_loadu_pd(seen.perX),
                perY = _mm256_loadu_pd(seen.perY), zero = _mm256_setzero_pd();
    const int width = int(view.width), height = int(view.height);
    for (int tileY = rect.minY >> kSideLog2; tileY <= rect.maxY >> kSideLog2; ++tileY) {
        const int top = tileY << kSideLog2, minY = std::max(rect.minY, top),
                  bottom = std::min(top + kSide, height) - 1, maxY = std::min(rect.maxY, bottom);
        const Lanes atTop = start + all(double(minY)) * perY,
                    atBottom = start + all(double(maxY)) * perY;
        const Lanes leastOfRow = least(atTop, atBottom), mostOfRow = most(atTop, atBottom);
        for (int tileX = rect.minX >> kSideLog2; tileX <= rect.maxX >> kSideLog2; ++tileX) {
            const int left = tileX << kSideLog2, minX = std::max(rect.minX, left),
                      right = std::min(left + kSide, width) - 1, maxX = std::min(rect.maxX, right);
            const Lanes atLeft = all(double(minX)) * perX, atRight = all(double(maxX)) * perX;
            const Lanes smallest = leastOfRow + least(atLeft, atRight),
                        greatest = mostOfRow + most(atLeft, atRight);
            if ((bitsOf(above(zero, greatest)) & kEdges) &&
                (bitsOf(above(smallest, zero)) & kEdges))
                continue; // outside
            double nearest = glm::max(double(seen.nearest), view.znear),
                   farthest = std::numeric_limits<double>::infinity();
            if (smallest[3] > 0.0 || greatest[3] < 0.0) {
                const double a = seen.plane / smallest[3], b = seen.plane / greatest[3];
                farthest = glm::max(glm::max(a, b), nearest);
                nearest = glm::max(glm::min(a, b), nearest);
            }
            if (tiles.isTileHidden(tileX, tileY, std::bit_cast<uint32_t>(float(nearest))))
                continue;
            const bool isWithin = (~bitsOf(atLeast(smallest, zero)) & kEdges) == 0 ||
                                  (~bitsOf(atLeast(zero, greatest)) & kEdges) == 0;
            uint32_t changedCount = 0;
            for (int y = minY; y <= maxY; ++y)
                changedCount += rows.cover(y, minX, maxX, isWithin);
            tiles.note(tileX, tileY, changedCount);
            if (isWithin && minX == left && maxX == right && minY == top && maxY == bottom &&
                nearest > view.znear && farthest <= view.zfar)
                tiles.lowerTo(tileX, tileY, std::bit_cast<uint32_t>(float(farthest)));
        }
    }
}

/// Triangles whose rectangles are no wider and no higher are covered side by side.
constexpr int kTinyPixels = 2;

/// coverPixels of four triangles at once, of those lanes of `tiny` at most kTinyPixels across and
/// high, without masks.
inline void coverTiny(const SeenTriangles& seen, const BoundTriangle* bound,
                      const uint32_t* triangles, uint32_t tiny, const ViewRays& view,
                      View<uint64_t> visibility, TileDepths& tiles) {
    const auto each = [&](const auto& of) {
        return _mm256_setr_pd(double(of(0)), double(of(1)), double(of(2)), double(of(3)));
    };
    const Lanes minX = each([&](int i) { return bound[i].rect.minX; }),
                minY = each([&](int i) { return bound[i].rect.minY; }),
                nearest = each([&](int i) { return bound[i].nearest; });
    uint32_t across = 0, down = 0; // lanes with a second column, with a second row
    for (int i = 0; i < 4; ++i) {
        across |= uint32_t(bound[i].rect.maxX > bound[i].rect.minX) << i;
        down |= uint32_t(bound[i].rect.maxY > bound[i].rect.minY) << i;
    }
    for (int dy = 0; dy < kTinyPixels; ++dy) {
        const uint32_t inRow = dy == 0 ? tiny : tiny & down;
        if (!inRow)
            break;
        const Lanes Y = minY + all(double(dy));
        Lanes row[4];
        for (int i = 0; i < 4; ++i)
            row[i] = seen.start[i] + Y * seen.perY[i];
        for (int dx = 0; dx < kTinyPixels; ++dx) {
            const uint32_t lanes = dx == 0 ? inRow : inRow & across;
            if (!lanes)
                break;
            const Lanes X = minX + all(double(dx));
            const Lanes e[3] = {row[0] + X * seen.perX[0], row[1] + X * seen.perX[1],
                                row[2] + X * seen.perX[2]};
            uint32_t covered = lanes & bitsOf(insideOf(e));
            if (!covered)
                continue;
            const Lanes depth = most(seen.plane / (row[3] + X * seen.perX[3]), nearest);
            covered &= bitsOf(
                _mm256_and_pd(atLeast(depth, all(view.znear)), atLeast(all(view.zfar), depth)));
            const auto columnOf = [&](int i) { return bound[i].rect.minX + dx; };
            const auto rowOf = [&](int i) { return bound[i].rect.minY + dy; };
            uint32_t changed = storeNearer(
                depth, covered,
                [&](int i) -> uint64_t& {
                    return visibility[size_t(rowOf(i)) * view.width + size_t(columnOf(i))];
                },
                [&](int i) { return triangles[i]; });
            for (; changed; changed &= changed - 1) {
                const int i = std::countr_zero(changed);
                tiles.note(columnOf(i) >> TileDepths::kSideLog2, rowOf(i) >> TileDepths::kSideLog2,
                           1);
            }
        }
    }
}

} // namespace shadowdag::avx2

#endif
