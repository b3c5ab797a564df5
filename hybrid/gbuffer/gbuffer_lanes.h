// SPDX-License-Identifier: Apache-2.0
// gbuffer_raster.h in lanes of doubles: four triangles are bounded and set up at once, and four
// pixels are covered at once, by the same operations in the same order, so that the visibility
// buffer has the same bits. Only the rectangle of pixels that may see a triangle is computed
// otherwise: in doubles with other rounding, far less than its margin, after one in floats has
// found that it has a pixel.
#pragma once

#include "hybrid/gbuffer/tile_depths.h"
#include "scenes/batch_lanes.h"

#include <algorithm>
#include <bit>
#include <limits>

#if defined(SDAG_DOUBLE_LANES)

namespace shadowdag::avx2 {

/// Rows of the picture that one thread draws: whole tiles.
struct Band {
    int first, last;

    /// Returns the part of a rectangle within; empty (minY > maxY) where there is none.
    PixelRect clip(const PixelRect& rect) const {
        return {rect.minX, std::max(rect.minY, first), rect.maxX, std::min(rect.maxY, last)};
    }
};

constexpr float kUnknown = -1.0f, kBehind = -2.0f; // see projectOnPicture

/// Sets `count` vertices of a batch as a view sees them: x and y in pixels; a depth that is not
/// more than its own; and how far x and y may be off, kPixelMargin with it, or a negative number
/// where they are of no use: kBehind behind the camera, kUnknown near the near plane or where they
/// are off by too much.
///
/// Rounding. p - origin is rounded once, by 2^-24 of itself, and its products with unit vectors by
/// less than e = 2^-21 (|px| + |py| + |pz|) in all. So a quotient q by the depth z is off by less
/// than 2 e / z (1 + |q|) where 2 e <= z, and pixels by as much times their number at distance 1,
/// and by the rounding of their own, 2^-22 of the picture's side.
/// @param positions world space; may be read up to the next multiple of eight
/// @param view its origin is one of floats, as makeViewRays has it
inline void projectOnPicture(const glm::vec3* positions, uint32_t count, const ViewRays& view,
                             BatchVertices& vertices) {
    SDAG_ASSERT(view.origin == glm::dvec3(glm::vec3(view.origin)));
    const auto all = [](double value) { return _mm256_set1_ps(float(value)); };
    const auto magnitude = [](__m256 v) { return _mm256_andnot_ps(_mm256_set1_ps(-0.0f), v); };
    const auto plus = [](__m256 a, __m256 b) { return _mm256_add_ps(a, b); };
    const auto times = [](__m256 a, __m256 b) { return _mm256_mul_ps(a, b); };
    const auto minus = [](__m256 a, __m256 b) { return _mm256_sub_ps(a, b); };
    __m256 origin[3], right[3], up[3], forward[3];
    for (int axis = 0; axis < 3; ++axis) {
        origin[axis] = all(view.origin[axis]);
        right[axis] = all(view.right[axis]);
        up[axis] = all(view.up[axis]);
        forward[axis] = all(view.forward[axis]);
    }
    const double scale = 1.0 / view.pixelSize;
    const double side = glm::max(double(view.width), double(view.height));
    for (uint32_t v = 0; v < count; v += 8) {
        Floats3 p = eightVectors(&positions[v].x);
        for (int axis = 0; axis < 3; ++axis)
            p.of[axis] = minus(p.of[axis], origin[axis]);
        const auto dot = [&](const __m256(&n)[3]) {
            return plus(plus(times(p.of[0], n[0]), times(p.of[1], n[1])), times(p.of[2], n[2]));
        };
        const __m256 z = dot(forward), perZ = _mm256_div_ps(all(1.0), z);
        const __m256 x = times(dot(right), perZ), y = times(dot(up), perZ);
        const __m256 error = times(
            plus(plus(magnitude(p.of[0]), magnitude(p.of[1])), magnitude(p.of[2])), all(0x1p-21));
        const __m256 depth = minus(z, error);
        const __m256 offAxis = plus(plus(all(1.0), magnitude(x)), magnitude(y));
        const __m256 margin = plus(times(times(error, perZ), times(offAxis, all(2.0 * scale))),
                                   all(kPixelMargin + side * 0x1p-22));
        const auto isAtMost = [](__m256 a, __m256 b) { return _mm256_cmp_ps(a, b, _CMP_LE_OQ); };
        const __m256 isUsable =
            _mm256_and_ps(_mm256_and_ps(isAtMost(all(view.znear * (1.0 + 0x1p-20)), depth),
                                        isAtMost(error, times(z, all(0.5)))),
                          isAtMost(margin, all(1e6)));
        const __m256 isBehind = _mm256_cmp_ps(plus(z, error), all(0.0), _CMP_LT_OQ);
        __m256 rows[4] = {times(minus(x, all(view.firstX)), all(scale)),
                          times(minus(all(view.firstY), y), all(scale)), depth,
                          _mm256_blendv_ps(_mm256_blendv_ps(all(kUnknown), all(kBehind), isBehind),
                                           margin, isUsable)};
        vertices.set(v, rows);
    }
}

/// A triangle of a batch that may have pixels.
struct PixelBounds {
    PixelRect rect;   ///< holds that of boundPixels
    float nearest;    ///< not more than SeenTriangle::nearest
    uint32_t inBatch; ///< its number
};

/// Bounds eight triangles. Writes those that lie in front of the near plane and may have a pixel in
/// the band to `bound`, and returns their number; those in `crossing` (bit i) may reach the near
/// plane.
/// @param vertices by projectOnPicture @param count of triangles, 1..8 @param bound holds eight
inline uint32_t boundPixelsOfEight(const BatchVertices& vertices, const BatchCorners* corners,
                                   uint32_t inBatch, uint32_t count, const ViewRays& view,
                                   const Band& band, uint32_t& crossing, PixelBounds* bound) {
    const EightTriangles eight(vertices, corners, inBatch, count);
    const auto bitsOf = [](__m256 lanes) { return uint32_t(_mm256_movemask_ps(lanes)); };
    const uint32_t isWanted = (1u << count) - 1u, isUnknown = bitsOf(eight.least(3));
    const __m256 isBehind = _mm256_cmp_ps(eight.most(3), _mm256_set1_ps(kBehind), _CMP_EQ_OQ);
    crossing = isWanted & isUnknown & ~bitsOf(isBehind);
    const __m256 margin = eight.most(3);
    const auto spansOf = [&](int i, uint32_t pixels) {
        return WholeSpans(_mm256_sub_ps(eight.least(i), margin),
                          _mm256_add_ps(eight.most(i), margin), float(pixels - 1));
    };
    const WholeSpans x = spansOf(0, view.width), y = spansOf(1, view.height);
    uint32_t kept = isWanted & ~isUnknown & bitsOf(_mm256_and_ps(x.isAny(), y.isAny()));
    if (!kept)
        return 0;
    alignas(32) int32_t minX[8], minY[8], maxX[8], maxY[8];
    alignas(32) float nearest[8];
    storeWhole(minX, _mm256_cvttps_epi32(x.first));
    storeWhole(minY, _mm256_cvttps_epi32(y.first));
    storeWhole(maxX, _mm256_cvttps_epi32(x.last));
    storeWhole(maxY, _mm256_cvttps_epi32(y.last));
    _mm256_store_ps(nearest, eight.least(2));
    uint32_t written = 0;
    for (; kept; kept &= kept - 1) {
        const int i = std::countr_zero(kept);
        const PixelRect rect = band.clip({minX[i], minY[i], maxX[i], maxY[i]});
        if (rect.minY <= rect.maxY)
            bound[written++] = {rect, nearest[i], inBatch + uint32_t(i)};
    }
    return written;
}

/// SeenTriangle, four of them.
struct SeenTriangles {
    Lanes start[4], perX[4], perY[4], plane;

    SeenTriangle at(int lane, uint32_t triangle, const PixelBounds& bound) const {
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

/// Corners of four triangles relative to the camera.
struct FourCorners {
    Lanes3 of[3];

    /// @param positions of the batch, world space
    FourCorners(const glm::vec3* positions, const BatchCorners* const* four,
                const glm::dvec3& origin) {
        for (int i = 0; i < 3; ++i)
            of[i] = difference(cornersOfFour(positions, four, i), all(origin));
    }
};

/// Sets the rectangles of four triangles to those of boundPixels in a band, which may be empty
/// there, and their nearest depths; returns the lanes (bits) that have a pixel of the picture.
inline uint32_t boundPixels(const FourCorners& corners, const ViewRays& view, const Band& band,
                            PixelBounds* bound) {
    const Lanes3 right = all(view.right), up = all(view.up), forward = all(view.forward);
    const Lanes scale = all(1.0 / view.pixelSize);
    Lanes x[3], y[3], z[3];
    for (int i = 0; i < 3; ++i) {
        const Lanes3& p = corners.of[i];
        z[i] = dot(p, forward);
        const Lanes perZ = all(1.0) / z[i];
        x[i] = (dot(p, right) * perZ - all(view.firstX)) * scale;
        y[i] = (all(view.firstY) - dot(p, up) * perZ) * scale;
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
    alignas(16) float nearest[4]; // rounding is monotone
    _mm_store_ps(nearest, _mm256_cvtpd_ps(least(z[0], least(z[1], z[2]))));
    for (int i = 0; i < 4; ++i) {
        bound[i].rect = band.clip({minX[i], minY[i], maxX[i], maxY[i]});
        bound[i].nearest = nearest[i];
    }
    return bitsOf(isSeen);
}

/// setUpSeen in lanes, without bounds. Returns the lanes (bit i = lane i) that have an area.
inline uint32_t setUpSeenLanes(const FourCorners& corners, const ViewRays& view, SeenTriangles& t) {
    const Lanes3(&corner)[3] = corners.of;
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
        if (now < pixel) {
            pixel = now;
            changed |= 1u << lane;
        }
    }
    return changed;
}

/// A triangle without a mask, and where it is drawn: pixels of a row, four at once.
class RowCover {
public:
    RowCover(const SeenTriangle& seen, const ViewRays& view, View<uint64_t> visibility)
        : seen_(seen), visibility_(visibility), width_(int(view.width)), znear_(all(view.znear)),
          zfar_(all(view.zfar)), plane_(all(seen.plane)), nearest_(all(double(seen.nearest))),
          start_(_mm256_loadu_pd(seen.start)), perY_(_mm256_loadu_pd(seen.perY)) {
        for (int i = 0; i < 4; ++i)
            perX_[i] = all(seen.perX[i]);
    }

    /// coverPixels of columns [minX, maxX] of a row. Returns how many pixels changed.
    /// @param isWithin all of them are inside
    uint32_t cover(int y, int minX, int maxX, bool isWithin) const {
        const Lanes row = start_ + all(double(y)) * perY_;
        const Lanes edge[3] = {_mm256_permute4x64_pd(row, 0x00), _mm256_permute4x64_pd(row, 0x55),
                               _mm256_permute4x64_pd(row, 0xaa)};
        const Lanes along = _mm256_permute4x64_pd(row, 0xff), last = all(double(maxX));
        uint64_t* const pixels = &visibility_[size_t(y) * size_t(width_)];
        uint32_t changed = 0;
        for (int x = minX; x <= maxX; x += 4) {
            const Lanes X = all(double(x)) + _mm256_setr_pd(0, 1, 2, 3);
            Lanes covered = atLeast(last, X);
            if (!isWithin) {
                const Lanes e[3] = {edge[0] + X * perX_[0], edge[1] + X * perX_[1],
                                    edge[2] + X * perX_[2]};
                covered = _mm256_and_pd(covered, insideOf(e));
                if (!bitsOf(covered))
                    continue;
            }
            const Lanes depth = most(plane_ / (along + X * perX_[3]), nearest_);
            covered = _mm256_and_pd(covered,
                                    _mm256_and_pd(atLeast(depth, znear_), atLeast(zfar_, depth)));
            changed += x + 4 <= width_ ? store(depth, covered, pixels + x)
                                       : storeNearer(depth, bitsOf(covered), pixels + x);
        }
        return changed;
    }

private:
    /// Keeps the nearer of what four pixels see and of the triangle. Returns how many changed.
    uint32_t store(Lanes depth, Lanes covered, uint64_t* pixels) const {
        const __m256i bits = _mm256_cvtepu32_epi64(_mm_castps_si128(_mm256_cvtpd_ps(depth)));
        const __m256i now = _mm256_or_si256(_mm256_slli_epi64(bits, 32),
                                            _mm256_set1_epi64x(int64_t(seen_.triangle)));
        __m256i* const at = reinterpret_cast<__m256i*>(pixels);
        const __m256i before = _mm256_loadu_si256(at);
        // Both are below 2^63, but for kNothingSeen, whose sign says so.
        const Lanes isNearer = _mm256_and_pd(
            covered, _mm256_castsi256_pd(_mm256_or_si256(_mm256_cmpgt_epi64(before, now), before)));
        _mm256_storeu_si256(
            at, _mm256_castpd_si256(_mm256_blendv_pd(_mm256_castsi256_pd(before),
                                                     _mm256_castsi256_pd(now), isNearer)));
        return uint32_t(std::popcount(bitsOf(isNearer)));
    }
    uint32_t storeNearer(Lanes depth, uint32_t covered, uint64_t* pixels) const {
        return uint32_t(std::popcount(avx2::storeNearer(
            depth, covered, [&](int lane) -> uint64_t& { return pixels[lane]; },
            [&](int) { return seen_.triangle; })));
    }

    const SeenTriangle& seen_;
    View<uint64_t> visibility_;
    int width_;
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
inline void coverTiny(const SeenTriangles& seen, const PixelBounds* bound,
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
