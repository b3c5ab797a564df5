// SPDX-License-Identifier: Apache-2.0
// rasterize.h in AVX2 lanes: sets up four triangles at once, then fills the texels of one triangle
// page by page, four or eight at once. The same operations in the same order give the same bits;
// cases that a lane cannot handle use the shared code. Texels are written without atomics: each
// page has one writer.
//
// Edge functions and depth are monotone in X and in Y as they are rounded, so their values at the
// corners of a page bound those at its texels exactly: a page outside of an edge is skipped, an
// edge that a page is inside of is not tested, and a page whose stored depths are all at least the
// triangle's greatest there is left alone. Coarse depths that hide what is drawn later: Greene,
// Kass, Miller, Hierarchical Z-Buffer Visibility, SIGGRAPH 1993.
#pragma once

#include "scenes/double_lanes.h"
#include "shadowmap/page_floors.h"
#include "shadowmap/rasterize.h"

namespace shadowdag {

/// Keeps the greater depth, without atomics. It always writes, so that the compiler may vectorize
/// it.
struct StoreGreater {
    uint32_t* depths;
    void operator()(size_t texel, uint32_t bits) const {
        depths[texel] = depths[texel] > bits ? depths[texel] : bits;
    }
};

} // namespace shadowdag

#if defined(SDAG_DOUBLE_LANES)
#define SDAG_RASTERIZE_AVX2 1

namespace shadowdag::avx2 {

inline Lanes sizeOf(const Lanes3& p) {
    return most(magnitude(p.x), most(magnitude(p.y), magnitude(p.z)));
}

/// Returns corner `corner` of four triangles relative to the light, in the frame of a face.
inline Lanes3 cornersFromLight(const TriangleView& geometry, const uint32_t* triangles, int corner,
                               const ShadowMapInfo& map, uint32_t face) {
    const Lanes3 vertex = vertices(geometry, triangles, corner);
    if (map.window.isDirectional()) { // as DirectionalWindow::lightFromWorld; face kDirectionalFace
        const auto& [x, y, z] = vertex;
        const auto row = [&](const glm::dvec3& r, double offset) {
            return all(r.x) * x + all(r.y) * y + all(r.z) * z - all(offset);
        };
        const DirectionalWindow& window = map.window;
        const Lanes depth = all(1.0) / row(window.w, window.w0);
        return {row(window.u, window.u0) * depth, row(window.v, window.v0) * depth, depth};
    }
    const glm::vec3& lightWorld = map.lightPositionWorld;
    const Lanes world[3] = {vertex.x - all(double(lightWorld.x)),
                            vertex.y - all(double(lightWorld.y)),
                            vertex.z - all(double(lightWorld.z))};
    // As faceFromLight: the face's axis comes last.
    const uint32_t axis = face / 2;
    const Lanes z = world[axis];
    return {world[axis == 2 ? 0 : axis + 1], world[axis == 0 ? 2 : axis - 1],
            (face & 1u) ? negative(z) : z};
}

/// FaceTriangle, four of them.
struct alignas(32) FaceTriangles {
    double ex[3][4], ey[3][4], e0[3][4], tolerance[3][4];
    double wx[4], wy[4], w0[4];
    float wMin[4], wMax[4];
    int32_t x0[4], x1[4], y0[4], y1[4];

    FaceTriangle at(int lane) const {
        FaceTriangle t;
        for (int k = 0; k < 3; ++k) {
            t.ex[k] = ex[k][lane];
            t.ey[k] = ey[k][lane];
            t.e0[k] = e0[k][lane];
            t.tolerance[k] = tolerance[k][lane];
        }
        t.wx = wx[lane];
        t.wy = wy[lane];
        t.w0 = w0[lane];
        t.wMin = wMin[lane];
        t.wMax = wMax[lane];
        t.wNear = t.wMax; // all of it is behind the near plane
        t.x0 = x0[lane];
        t.x1 = x1[lane];
        t.y0 = y0[lane];
        t.y1 = y1[lane];
        return t;
    }
};

/// texelSpan in lanes; returns the lanes that are not empty.
inline Lanes texelSpans(Lanes lo, Lanes hi, Lanes half, Lanes end, int32_t* first, int32_t* last) {
    const Lanes a = (lo + all(1.0)) * half - all(0.5) - all(1e-6);
    const Lanes b = (hi + all(1.0)) * half - all(0.5) + all(1e-6);
    return wholeSpans(a, b, end, first, last);
}

/// setUpTriangle in lanes. Returns the lanes (bit i = lane i) that can cover texels and are set up
/// in `t`; those in `crossing` reach the near plane or behind the light and are left to
/// setUpTriangle. @param wanted lanes that hold a triangle; the others may hold any finite numbers
inline uint32_t setUpTriangles(const Lanes3& a, const Lanes3& b, const Lanes3& c,
                               const ShadowMapInfo& map, uint32_t wanted, uint32_t& crossing,
                               FaceTriangles& t) {
    const auto allOutside = [](Lanes p, Lanes pz, Lanes q, Lanes qz, Lanes r, Lanes rz) {
        return _mm256_and_pd(_mm256_and_pd(above(p, pz), above(q, qz)), above(r, rz));
    };
    const Lanes outside = _mm256_or_pd(
        _mm256_or_pd(allOutside(a.x, a.z, b.x, b.z, c.x, c.z),
                     allOutside(negative(a.x), a.z, negative(b.x), b.z, negative(c.x), c.z)),
        _mm256_or_pd(allOutside(a.y, a.z, b.y, b.z, c.y, c.z),
                     allOutside(negative(a.y), a.z, negative(b.y), b.z, negative(c.y), c.z)));
    const Lanes zMin = least(a.z, least(b.z, c.z));
    const Lanes zMax = most(a.z, most(b.z, c.z));
    uint32_t kept = wanted & ~bitsOf(outside) & bitsOf(above(zMax, _mm256_setzero_pd()));
    const double zNear = nearDepth(map);
    crossing = kept & ~bitsOf(above(zMin, all(zNear)));
    kept &= ~crossing;
    if (!kept)
        return 0;
    const double n = double(map.faceTexels);
    const Lanes half = all(0.5 * n), end = all(n - 1.0), one = all(1.0);
    const Lanes ra = one / a.z, rb = one / b.z, rc = one / c.z;
    const Lanes ua = a.x * ra, ub = b.x * rb, uc = c.x * rc;
    kept &=
        bitsOf(texelSpans(least(ua, least(ub, uc)), most(ua, most(ub, uc)), half, end, t.x0, t.x1));
    const Lanes va = a.y * ra, vb = b.y * rb, vc = c.y * rc;
    kept &=
        bitsOf(texelSpans(least(va, least(vb, vc)), most(va, most(vb, vc)), half, end, t.y0, t.y1));
    if (!kept)
        return 0;
    // Division is monotone: the greatest of the reciprocals is that of the least depth.
    _mm_store_ps(t.wMin, _mm256_cvtpd_ps(least(ra, least(rb, rc))));
    _mm_store_ps(t.wMax, _mm256_cvtpd_ps(most(ra, most(rb, rc))));

    const Lanes3 ab = difference(b, a), ac = difference(c, a);
    const Lanes3 normal = cross(ab, ac);
    const Lanes k = normal.x * a.x + normal.y * a.y + normal.z * a.z;
    const Lanes sizeA = sizeOf(a), sizeB = sizeOf(b), sizeC = sizeOf(c);
    kept &=
        bitsOf(above(magnitude(k), all(kDeterminantRounding) * sizeOf(ab) * sizeOf(ac) * sizeA));
    if (!kept)
        return 0;
    // sign * x is x with its sign turned where k is negative.
    const Lanes turn = _mm256_andnot_pd(above(k, _mm256_setzero_pd()), all(-0.0));
    const Lanes count = all(n);
    const auto edge = [&](int i, const Lanes3& p, const Lanes3& q, Lanes sizes) {
        const Lanes3 e = cross(p, q);
        _mm256_store_pd(t.ex[i], _mm256_xor_pd(turn, e.x));
        _mm256_store_pd(t.ey[i], _mm256_xor_pd(turn, e.y));
        _mm256_store_pd(t.e0[i], _mm256_xor_pd(turn, e.z * count));
        _mm256_store_pd(t.tolerance[i], all(kDeterminantRounding) * sizes * count);
    };
    edge(0, a, b, sizeA * sizeB);
    edge(1, b, c, sizeB * sizeC);
    edge(2, c, a, sizeC * sizeA);
    const Lanes scale = one / (k * count);
    _mm256_store_pd(t.wx, normal.x * scale);
    _mm256_store_pd(t.wy, normal.y * scale);
    _mm256_store_pd(t.w0, normal.z / k);
    return kept;
}

/// Stored depths of columns [first, last] of one row of a page become the greater ones.
/// @param row the row's texels in its page, a multiple of 16 of them
/// @param firstColumn of the face, of the page; @param first,last columns of the face, in the page
inline void fillRow(uint32_t* row, int32_t firstColumn, int32_t first, int32_t last, int32_t n,
                    double wx, double rw, const FaceTriangle& t) {
    const __m256 wMin = _mm256_set1_ps(t.wMin), wMax = _mm256_set1_ps(t.wMax);
    const Lanes slope = all(wx), offset = all(rw), step = all(16.0);
    // Eights that start at a multiple of eight of the page never leave it.
    int32_t column = (first - firstColumn) & ~7;
    const int32_t end = last - firstColumn;
    const Lanes start = all(double(2 * (firstColumn + column) + 1 - n));
    Lanes lo = start + _mm256_setr_pd(0, 2, 4, 6), hi = start + _mm256_setr_pd(8, 10, 12, 14);
    const __m256i inEight = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
    const __m256i before = _mm256_set1_epi32(first - firstColumn - 1),
                  after = _mm256_set1_epi32(end + 1);
    for (; column <= end; column += 8, lo += step, hi += step) {
        const __m256 w = _mm256_set_m128(_mm256_cvtpd_ps(slope * hi + offset),
                                         _mm256_cvtpd_ps(slope * lo + offset));
        const __m256 depth = _mm256_min_ps(wMax, _mm256_max_ps(wMin, w));
        const __m256i index = _mm256_add_epi32(inEight, _mm256_set1_epi32(column));
        const __m256i mask =
            _mm256_and_si256(_mm256_cmpgt_epi32(index, before), _mm256_cmpgt_epi32(after, index));
        __m256i* const stored = reinterpret_cast<__m256i*>(row + column);
        _mm256_storeu_si256(stored,
                            _mm256_max_epu32(_mm256_loadu_si256(stored),
                                             _mm256_and_si256(_mm256_castps_si256(depth), mask)));
    }
}

/// The columns of four rows inside of all edges.
struct RowSpans {
    alignas(32) double rw[4];
    alignas(16) int32_t first[4], last[4];
};

/// narrowSpan for four rows at once, from row `y` on, over columns [xFirst, xLast]. Each end is
/// estimated by its quotient and verified by the monotone edge function on both sides of it; a row
/// with a wrong estimate is done by narrowSpan.
/// @param edges bit k: edge k is tested; the columns are inside of the others
inline void spanRows(const FaceTriangle& t, const double* rEx, int32_t y, int32_t n, int32_t xFirst,
                     int32_t xLast, uint32_t edges, RowSpans& spans) {
    const Lanes Y = all(double(2 * y + 1 - n)) + _mm256_setr_pd(0, 2, 4, 6);
    const Lanes one = all(1.0), two = all(2.0), centre = one - all(double(n));
    const Lanes x0 = all(double(xFirst)), x1 = all(double(xLast));
    Lanes first = x0, last = x1;
    Lanes isWrong = _mm256_setzero_pd();
    for (uint32_t left = edges; left; left &= left - 1) {
        const int k = __builtin_ctz(left);
        const Lanes r = all(t.ey[k]) * Y + all(t.e0[k]);
        const Lanes bound = all(-t.tolerance[k]);
        if (t.ex[k] == 0.0) {
            last = _mm256_blendv_pd(x0 - one, last, atLeast(r, bound));
            continue;
        }
        const Lanes ex = all(t.ex[k]);
        const auto inside = [&](Lanes x) { return atLeast(ex * (two * x + centre) + r, bound); };
        const Lanes end = all(0.5) * ((bound - r) * all(rEx[k]) - centre);
        // For a NaN, max and min return their second operand: an end, which the verification then
        // rejects.
        if (t.ex[k] > 0.0) {
            const Lanes x = _mm256_min_pd(_mm256_max_pd(_mm256_ceil_pd(end), x0), x1 + one);
            const Lanes isProven = _mm256_and_pd(
                _mm256_or_pd(inside(x), above(x, x1)),
                _mm256_or_pd(_mm256_andnot_pd(inside(x - one), all(-0.0)), atLeast(x0, x)));
            isWrong = _mm256_or_pd(isWrong, _mm256_andnot_pd(isProven, all(-0.0)));
            first = _mm256_max_pd(first, x);
        } else {
            const Lanes x = _mm256_max_pd(_mm256_min_pd(_mm256_floor_pd(end), x1), x0 - one);
            const Lanes isProven = _mm256_and_pd(
                _mm256_or_pd(inside(x), above(x0, x)),
                _mm256_or_pd(_mm256_andnot_pd(inside(x + one), all(-0.0)), atLeast(x, x1)));
            isWrong = _mm256_or_pd(isWrong, _mm256_andnot_pd(isProven, all(-0.0)));
            last = _mm256_min_pd(last, x);
        }
    }
    _mm_store_si128(reinterpret_cast<__m128i*>(spans.first), _mm256_cvttpd_epi32(first));
    _mm_store_si128(reinterpret_cast<__m128i*>(spans.last), _mm256_cvttpd_epi32(last));
    _mm256_store_pd(spans.rw, all(t.wy) * Y + all(t.w0));
    for (int wrong = _mm256_movemask_pd(isWrong); wrong; wrong &= wrong - 1) {
        const int i = __builtin_ctz(unsigned(wrong));
        const double rowY = double(2 * (y + i) + 1 - n);
        spans.first[i] = xFirst;
        spans.last[i] = xLast;
        for (uint32_t left = edges; left; left &= left - 1) {
            const int k = __builtin_ctz(left);
            narrowSpan(t.ex[k], t.ey[k] * rowY + t.e0[k], t.tolerance[k], rEx[k], n, spans.first[i],
                       spans.last[i]);
        }
    }
}

/// Draws a triangle at most four columns wide, a row at a time.
inline void coverNarrow(const RasterView& view, const ShadowMapInfo& map, uint32_t face,
                        const FaceTriangle& t, PageFloors& floors) {
    const uint32_t log2 = view.pageTexelsLog2;
    const int32_t side = 1 << log2;
    const int32_t n = int32_t(map.faceTexels);
    const Lanes ey = _mm256_setr_pd(t.ey[0], t.ey[1], t.ey[2], t.wy);
    const Lanes e0 = _mm256_setr_pd(t.e0[0], t.e0[1], t.e0[2], t.w0);
    const __m128 wMin = _mm_set1_ps(t.wMin), wMax = _mm_set1_ps(t.wMax);
    for (int32_t px = t.x0 >> log2; px <= t.x1 >> log2; ++px) {
        // Four columns that do not leave the page.
        const int32_t base = glm::min(glm::max(t.x0, px * side), px * side + side - 4);
        const __m128i column = _mm_add_epi32(_mm_set1_epi32(base), _mm_setr_epi32(0, 1, 2, 3));
        const __m128i inBounds = _mm_and_si128(_mm_cmpgt_epi32(column, _mm_set1_epi32(t.x0 - 1)),
                                               _mm_cmpgt_epi32(_mm_set1_epi32(t.x1 + 1), column));
        const Lanes X = all(double(2 * base + 1 - n)) + _mm256_setr_pd(0, 2, 4, 6);
        const Lanes x0 = all(t.ex[0]) * X, x1 = all(t.ex[1]) * X, x2 = all(t.ex[2]) * X,
                    xw = all(t.wx) * X;
        for (int32_t py = t.y0 >> log2; py <= t.y1 >> log2; ++py) {
            const uint32_t page =
                view.pageTable[pageTableIndex(map, face, uint32_t(px), uint32_t(py))];
            if (page == kNoPage || floors.hides(page, floatBits(t.wMax)))
                continue;
            const int32_t yLast = glm::min(t.y1, py * side + side - 1);
            int32_t y = glm::max(t.y0, py * side);
            floors.noteRows(page, yLast - y + 1);
            uint32_t* row = view.depths.data + (size_t(page) << (2 * log2)) +
                            (size_t(y - py * side) << log2) + size_t(base - px * side);
            for (; y <= yLast; ++y, row += side) {
                const Lanes r = ey * all(double(2 * y + 1 - n)) + e0;
                const Lanes inside = _mm256_and_pd(
                    _mm256_and_pd(
                        atLeast(x0 + _mm256_permute4x64_pd(r, 0x00), all(-t.tolerance[0])),
                        atLeast(x1 + _mm256_permute4x64_pd(r, 0x55), all(-t.tolerance[1]))),
                    atLeast(x2 + _mm256_permute4x64_pd(r, 0xaa), all(-t.tolerance[2])));
                const __m128 w = _mm256_cvtpd_ps(xw + _mm256_permute4x64_pd(r, 0xff));
                const __m128 depth = _mm_min_ps(wMax, _mm_max_ps(wMin, w));
                const __m128 isInside =
                    _mm_shuffle_ps(_mm_castpd_ps(_mm256_castpd256_pd128(inside)),
                                   _mm_castpd_ps(_mm256_extractf128_pd(inside, 1)), 0x88);
                const __m128i mask = _mm_and_si128(inBounds, _mm_castps_si128(isInside));
                __m128i* const stored = reinterpret_cast<__m128i*>(row);
                _mm_storeu_si128(stored,
                                 _mm_max_epu32(_mm_loadu_si128(stored),
                                               _mm_and_si128(_mm_castps_si128(depth), mask)));
            }
        }
    }
}

/// coverTexels for all rows of a solid triangle, storing the greater depth. Pages that reach the
/// near plane, and narrow triangles that do, are left to the shared code.
/// @param floors of the view's pages; a page that is drawn into is noted there
inline void coverTexels(const RasterView& view, const ShadowMapInfo& map, uint32_t face,
                        const FaceTriangle& t, PageFloors& floors) {
    const StoreGreater store{view.depths.data};
    if (t.x1 - t.x0 < 4) {
        if (t.wMax <= t.wNear)
            coverNarrow(view, map, face, t, floors);
        else
            shadowdag::coverTexels(view, map, face, t, SolidTriangle{}, t.y0, t.y1, store);
        return;
    }
    const uint32_t log2 = view.pageTexelsLog2;
    const int32_t side = 1 << log2;
    const int32_t n = int32_t(map.faceTexels);
    const double rEx[3] = {1.0 / t.ex[0], 1.0 / t.ex[1], 1.0 / t.ex[2]};
    // Three edges and the depth; the depth's bound is never met.
    const Lanes ex = _mm256_setr_pd(t.ex[0], t.ex[1], t.ex[2], t.wx),
                ey = _mm256_setr_pd(t.ey[0], t.ey[1], t.ey[2], t.wy),
                e0 = _mm256_setr_pd(t.e0[0], t.e0[1], t.e0[2], t.w0),
                bound = negative(_mm256_setr_pd(t.tolerance[0], t.tolerance[1], t.tolerance[2], 0));
    const auto centre = [n](int32_t x) { return double(2 * x + 1 - n); };
    for (int32_t py = t.y0 >> log2; py <= t.y1 >> log2; ++py) {
        const uint32_t* const pages = &view.pageTable[pageTableIndex(map, face, 0, uint32_t(py))];
        const int32_t yFirst = glm::max(t.y0, py * side),
                      yLast = glm::min(t.y1, py * side + side - 1);
        const Lanes top = ey * all(centre(yFirst)) + e0, bottom = ey * all(centre(yLast)) + e0;
        const Lanes rMin = least(top, bottom), rMax = most(top, bottom);
        for (int32_t px = t.x0 >> log2; px <= t.x1 >> log2; ++px) {
            const uint32_t page = pages[px];
            if (page == kNoPage)
                continue;
            const int32_t xFirst = glm::max(t.x0, px * side),
                          xLast = glm::min(t.x1, px * side + side - 1);
            const Lanes left = ex * all(centre(xFirst)), right = ex * all(centre(xLast));
            const Lanes greatest = most(left, right) + rMax, smallest = least(left, right) + rMin;
            if (~_mm256_movemask_pd(atLeast(greatest, bound)) & 7)
                continue;                           // outside of an edge
            const auto depthBitsOf = [&](Lanes w) { // of lane 3, as a texel's
                const float depth = float(_mm256_extractf128_pd(w, 1)[1]);
                return floatBits(glm::min(glm::max(depth, t.wMin), t.wMax));
            };
            uint32_t* const texels = view.depths.data + (size_t(page) << (2 * log2));
            const int32_t columns = glm::min(side, n - px * side),
                          rows = glm::min(side, n - py * side);
            if (floors.refreshed(page, depthBitsOf(greatest), texels, side, columns, rows))
                continue; // hidden
            const uint32_t edges = ~uint32_t(_mm256_movemask_pd(atLeast(smallest, bound))) & 7u;
            const bool isNear = depthBitsOf(greatest) > floatBits(t.wNear);
            if (edges == 0 && !isNear && xLast - xFirst + 1 == columns &&
                yLast - yFirst + 1 == rows)
                floors.raise(page, depthBitsOf(mutated(Mutant::kFloorTooHigh, smallest, greatest)));
            floors.noteRows(page, yLast - yFirst + 1);
            if (isNear) {
                FaceTriangle part = t;
                part.x0 = xFirst;
                part.x1 = xLast;
                shadowdag::coverTexels(view, map, face, part, SolidTriangle{}, yFirst, yLast,
                                       store);
                continue;
            }
            uint32_t* row = texels + (size_t(yFirst - py * side) << log2);
            if (edges == 0) {
                for (int32_t y = yFirst; y <= yLast; ++y, row += side)
                    fillRow(row, px * side, xFirst, xLast, n, t.wx, t.wy * centre(y) + t.w0, t);
                continue;
            }
            for (int32_t y = yFirst; y <= yLast; y += 4) {
                RowSpans spans;
                spanRows(t, rEx, y, n, xFirst, xLast, edges, spans);
                for (int32_t i = 0; i < 4 && y + i <= yLast; ++i, row += side)
                    if (spans.first[i] <= spans.last[i])
                        fillRow(row, px * side, spans.first[i], spans.last[i], n, t.wx, spans.rw[i],
                                t);
            }
        }
    }
}

} // namespace shadowdag::avx2

#endif
