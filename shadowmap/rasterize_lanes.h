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
#include "shadowmap/face_pages.h"

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

/// Returns four points of the world relative to the light, in the frame of a face.
inline Lanes3 faceFromWorld(const Lanes3& vertex, const ShadowMapInfo& map, uint32_t face) {
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

/// texelSpan in lanes; returns the lanes that are not empty.
inline Lanes texelSpans(Lanes lo, Lanes hi, Lanes half, Lanes end, int32_t* first, int32_t* last) {
    const Lanes a = (lo + all(1.0)) * half - all(0.5) - all(1e-6);
    const Lanes b = (hi + all(1.0)) * half - all(0.5) + all(1e-6);
    return wholeSpans(a, b, end, first, last);
}

/// setUpTriangle in lanes. Returns the lanes (bit i = lane i) that can cover texels and are set up
/// in `of`; those in `crossing` reach the near plane or behind the light and are left to
/// setUpTriangle. @param wanted lanes that hold a triangle; the others may hold any finite numbers
/// @param of four
inline uint32_t setUpTriangles(const Lanes3& a, const Lanes3& b, const Lanes3& c,
                               const ShadowMapInfo& map, uint32_t wanted, uint32_t& crossing,
                               FaceTriangle* of) {
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
    alignas(16) int32_t x0[4], x1[4], y0[4], y1[4];
    kept &= bitsOf(texelSpans(least(ua, least(ub, uc)), most(ua, most(ub, uc)), half, end, x0, x1));
    const Lanes va = a.y * ra, vb = b.y * rb, vc = c.y * rc;
    kept &= bitsOf(texelSpans(least(va, least(vb, vc)), most(va, most(vb, vc)), half, end, y0, y1));
    if (!kept)
        return 0;
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
    Lanes x[4], y[4], o[4], tolerance[4];
    const auto edge = [&](int i, const Lanes3& p, const Lanes3& q, Lanes sizes) {
        const Lanes3 e = cross(p, q);
        x[i] = _mm256_xor_pd(turn, e.x);
        y[i] = _mm256_xor_pd(turn, e.y);
        o[i] = _mm256_xor_pd(turn, e.z * count);
        tolerance[i] = all(kDeterminantRounding) * sizes * count;
    };
    edge(0, a, b, sizeA * sizeB);
    edge(1, b, c, sizeB * sizeC);
    edge(2, c, a, sizeC * sizeA);
    const Lanes scale = one / (k * count);
    x[3] = normal.x * scale;
    y[3] = normal.y * scale;
    o[3] = normal.z / k;
    tolerance[3] = o[3]; // anything
    transpose(x[0], x[1], x[2], x[3]);
    transpose(y[0], y[1], y[2], y[3]);
    transpose(o[0], o[1], o[2], o[3]);
    transpose(tolerance[0], tolerance[1], tolerance[2], tolerance[3]);
    // Division is monotone: the greatest of the reciprocals is that of the least depth.
    alignas(16) float wMin[4], wMax[4];
    _mm_store_ps(wMin, _mm256_cvtpd_ps(least(ra, least(rb, rc))));
    _mm_store_ps(wMax, _mm256_cvtpd_ps(most(ra, most(rb, rc))));
    for (int lane = 0; lane < 4; ++lane) {
        FaceTriangle& t = of[lane];
        _mm256_storeu_pd(t.ex, x[lane]);
        _mm256_storeu_pd(t.ey, y[lane]);
        _mm256_storeu_pd(t.e0, o[lane]);
        _mm256_maskstore_pd(t.tolerance, _mm256_setr_epi64x(-1, -1, -1, 0), tolerance[lane]);
        t.wMin = wMin[lane];
        t.wMax = t.wNear = wMax[lane]; // all of it is behind the near plane
        t.x0 = x0[lane];
        t.x1 = x1[lane];
        t.y0 = y0[lane];
        t.y1 = y1[lane];
    }
    return kept;
}

/// Eight stored depths become the greater ones of them and of a triangle's.
/// @param low,high 1/z of four columns each @param columns the eight; those outside of [from, to]
/// are left
inline void fillEight(uint32_t* texels, Lanes low, Lanes high, __m256 wMin, __m256 wMax,
                      __m256i columns, __m256i from, __m256i to) {
    const __m256 w = _mm256_set_m128(_mm256_cvtpd_ps(high), _mm256_cvtpd_ps(low));
    const __m256i depth = _mm256_castps_si256(_mm256_min_ps(wMax, _mm256_max_ps(wMin, w)));
    const __m256i isOutside =
        _mm256_or_si256(_mm256_cmpgt_epi32(from, columns), _mm256_cmpgt_epi32(columns, to));
    __m256i* const stored = reinterpret_cast<__m256i*>(texels);
    _mm256_storeu_si256(stored, _mm256_max_epu32(_mm256_loadu_si256(stored),
                                                 _mm256_andnot_si256(isOutside, depth)));
}

/// Fills rows of a page of 16 texels: what they have in common is computed once.
class ShortRows {
public:
    static constexpr int32_t kTexels = 16; // no page has fewer

    /// @param start the page's first column, of the face @param first,last columns that are filled
    ShortRows(const FaceTriangle& t, int32_t start, int32_t n, int32_t first, int32_t last)
        : wMin_(_mm256_set1_ps(t.wMin)), wMax_(_mm256_set1_ps(t.wMax)),
          low_(_mm256_add_epi32(_mm256_set1_epi32(start),
                                _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7))),
          isLow_(first < start + 8), isHigh_(last >= start + 8) {
        const Lanes X = all(double(2 * start + 1 - n)) + _mm256_setr_pd(0, 2, 4, 6);
        for (int i = 0; i < 4; ++i)
            along_[i] = all(t.wx()) * (X + all(8.0 * i));
    }

    /// Fills columns [first, last]. @param row the row's texels in its page @param w wy Y + w0
    void operator()(uint32_t* row, int32_t first, int32_t last, double w) const {
        const __m256i from = _mm256_set1_epi32(first), to = _mm256_set1_epi32(last);
        const Lanes rw = all(w);
        if (isLow_)
            fillEight(row, along_[0] + rw, along_[1] + rw, wMin_, wMax_, low_, from, to);
        if (isHigh_)
            fillEight(row + 8, along_[2] + rw, along_[3] + rw, wMin_, wMax_,
                      _mm256_add_epi32(low_, _mm256_set1_epi32(8)), from, to);
    }

private:
    Lanes along_[4]; ///< wx X, four columns each
    __m256 wMin_, wMax_;
    __m256i low_; ///< the first eight columns
    bool isLow_, isHigh_;
};

/// Fills rows of a larger page.
class LongRows {
public:
    LongRows(const FaceTriangle& t, int32_t start, int32_t n) : t_(t), start_(start), n_(n) {}

    /// As ShortRows.
    void operator()(uint32_t* row, int32_t first, int32_t last, double w) const {
        const __m256 wMin = _mm256_set1_ps(t_.wMin), wMax = _mm256_set1_ps(t_.wMax);
        const Lanes slope = all(t_.wx()), rw = all(w), step = all(16.0);
        // Eights that start at a multiple of eight of the page never leave it.
        int32_t column = start_ + ((first - start_) & ~7);
        const Lanes X = all(double(2 * column + 1 - n_));
        Lanes low = X + _mm256_setr_pd(0, 2, 4, 6), high = X + _mm256_setr_pd(8, 10, 12, 14);
        const __m256i from = _mm256_set1_epi32(first), to = _mm256_set1_epi32(last);
        for (; column <= last; column += 8, low += step, high += step)
            fillEight(row + (column - start_), slope * low + rw, slope * high + rw, wMin, wMax,
                      _mm256_add_epi32(_mm256_set1_epi32(column),
                                       _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7)),
                      from, to);
    }

private:
    const FaceTriangle& t_;
    int32_t start_, n_;
};

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
    _mm256_store_pd(spans.rw, all(t.wy()) * Y + all(t.w0()));
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

/// Four columns of a page, of which a triangle that is no wider has some.
struct FourColumns {
    int32_t first; ///< of the face
    __m128i isIn;  ///< the triangle's

    /// @param px the page's place in its row @param x0,x1 the triangle's columns, at most four
    FourColumns(int32_t px, int32_t side, int32_t x0, int32_t x1)
        : first(glm::min(glm::max(x0, px * side), px * side + side - 4)) {
        const __m128i column = _mm_add_epi32(_mm_set1_epi32(first), _mm_setr_epi32(0, 1, 2, 3));
        isIn = _mm_and_si128(_mm_cmpgt_epi32(column, _mm_set1_epi32(x0 - 1)),
                             _mm_cmpgt_epi32(_mm_set1_epi32(x1 + 1), column));
    }
};

/// Draws a triangle at most four columns wide, a row at a time.
inline void coverNarrow(const FacePages& pages, const FaceTriangle& t) {
    const RasterView& view = pages.view;
    const uint32_t log2 = view.pageTexelsLog2;
    const int32_t side = 1 << log2;
    const int32_t n = int32_t(pages.map->faceTexels);
    const Lanes ey = _mm256_loadu_pd(t.ey), e0 = _mm256_loadu_pd(t.e0);
    const __m128 wMin = _mm_set1_ps(t.wMin), wMax = _mm_set1_ps(t.wMax);
    for (int32_t px = t.x0 >> log2; px <= t.x1 >> log2; ++px) {
        const FourColumns columns(px, side, t.x0, t.x1);
        const Lanes X = all(double(2 * columns.first + 1 - n)) + _mm256_setr_pd(0, 2, 4, 6);
        const Lanes x0 = all(t.ex[0]) * X, x1 = all(t.ex[1]) * X, x2 = all(t.ex[2]) * X,
                    xw = all(t.wx()) * X;
        for (int32_t py = t.y0 >> log2; py <= t.y1 >> log2; ++py) {
            const uint32_t page = pages.table[py * pages.across + px];
            if (page == kNoPage || pages.floors.hides(page, floatBits(t.wMax)))
                continue;
            const int32_t yLast = glm::min(t.y1, py * side + side - 1);
            int32_t y = glm::max(t.y0, py * side);
            pages.floors.noteRows(page, yLast - y + 1);
            uint32_t* row = view.depths.data + (size_t(page) << (2 * log2)) +
                            (size_t(y - py * side) << log2) + size_t(columns.first - px * side);
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
                const __m128i mask = _mm_and_si128(columns.isIn, _mm_castps_si128(isInside));
                __m128i* const stored = reinterpret_cast<__m128i*>(row);
                _mm_storeu_si128(stored,
                                 _mm_max_epu32(_mm_loadu_si128(stored),
                                               _mm_and_si128(_mm_castps_si128(depth), mask)));
            }
        }
    }
}

/// coverTexels for a triangle that is wider, and solid.
class WideTriangle {
public:
    WideTriangle(const FacePages& pages, const FaceTriangle& t)
        : pages_(pages), t_(t), log2_(pages.view.pageTexelsLog2), side_(1 << log2_),
          n_(int32_t(pages.map->faceTexels)), rEx_{1.0 / t.ex[0], 1.0 / t.ex[1], 1.0 / t.ex[2]},
          ex_(_mm256_loadu_pd(t.ex)), ey_(_mm256_loadu_pd(t.ey)), e0_(_mm256_loadu_pd(t.e0)),
          bound_(negative(_mm256_setr_pd(t.tolerance[0], t.tolerance[1], t.tolerance[2], 0))) {}

    void cover() const {
        for (int32_t py = t_.y0 >> log2_; py <= t_.y1 >> log2_; ++py) {
            const int32_t yFirst = glm::max(t_.y0, py * side_),
                          yLast = glm::min(t_.y1, py * side_ + side_ - 1);
            const Rows rows = rowsOf(yFirst, yLast);
            pages_.forPresentWhile(py, t_.x0 >> log2_, t_.x1 >> log2_,
                                   [&](int32_t px, uint32_t page) {
                                       coverPage(page, px, py, yFirst, yLast, rows);
                                       return true;
                                   });
        }
    }

private:
    /// What rows contribute to the edge functions and the depth's, at least and at most.
    struct Rows {
        Lanes smallest, greatest;
    };
    /// The least and the greatest of the edge functions, and of the depth's, in columns [xFirst,
    /// xLast].
    struct Range {
        Lanes smallest, greatest;

        /// Returns whether all texels are outside of an edge.
        bool isOutside(Lanes bound) const { return (~bitsOf(atLeast(greatest, bound)) & 7u) != 0; }
        /// Returns the edges that some texels may be outside of.
        uint32_t edges(Lanes bound) const { return ~bitsOf(atLeast(smallest, bound)) & 7u; }
    };
    double centre(int32_t x) const { return double(2 * x + 1 - n_); }
    Rows rowsOf(int32_t yFirst, int32_t yLast) const {
        const Lanes top = ey_ * all(centre(yFirst)) + e0_, bottom = ey_ * all(centre(yLast)) + e0_;
        return {least(top, bottom), most(top, bottom)};
    }
    Range rangeOf(int32_t xFirst, int32_t xLast, const Rows& rows) const {
        const Lanes left = ex_ * all(centre(xFirst)), right = ex_ * all(centre(xLast));
        return {least(left, right) + rows.smallest, most(left, right) + rows.greatest};
    }
    /// Returns the bits of a depth as a texel has it. @param w lane 3 counts
    uint32_t depthBitsOf(Lanes w) const {
        const float depth = float(_mm256_extractf128_pd(w, 1)[1]);
        return floatBits(glm::min(glm::max(depth, t_.wMin), t_.wMax));
    }

    /// Covers rows [yFirst, yLast] of page (px, py). @param ofRows of these rows
    void coverPage(uint32_t page, int32_t px, int32_t py, int32_t yFirst, int32_t yLast,
                   const Rows& ofRows) const {
        const int32_t xFirst = glm::max(t_.x0, px * side_),
                      xLast = glm::min(t_.x1, px * side_ + side_ - 1);
        const Range range = rangeOf(xFirst, xLast, ofRows);
        if (range.isOutside(bound_))
            return;
        uint32_t* const texels = pages_.view.depths.data + (size_t(page) << (2 * log2_));
        const int32_t columns = glm::min(side_, n_ - px * side_),
                      rows = glm::min(side_, n_ - py * side_);
        PageFloors& floors = pages_.floors;
        if (floors.refreshed(page, depthBitsOf(range.greatest), texels, side_, columns, rows))
            return; // hidden
        const uint32_t edges = range.edges(bound_);
        const bool isNear = depthBitsOf(range.greatest) > floatBits(t_.wNear);
        if (edges == 0 && !isNear && xLast - xFirst + 1 == columns && yLast - yFirst + 1 == rows)
            floors.raise(
                page, depthBitsOf(mutated(Mutant::kFloorTooHigh, range.smallest, range.greatest)));
        floors.noteRows(page, yLast - yFirst + 1);
        if (isNear) {
            FaceTriangle part = t_;
            part.x0 = xFirst;
            part.x1 = xLast;
            shadowdag::coverTexels(pages_.view, *pages_.map, pages_.face, part, SolidTriangle{},
                                   yFirst, yLast, StoreGreater{pages_.view.depths.data});
            return;
        }
        uint32_t* const row = texels + (size_t(yFirst - py * side_) << log2_);
        if (side_ == ShortRows::kTexels) {
            const ShortRows fill(t_, px * side_, n_, xFirst, xLast);
            coverRows(fill, row, xFirst, xLast, yFirst, yLast, edges);
        } else
            coverRows(LongRows(t_, px * side_, n_), row, xFirst, xLast, yFirst, yLast, edges);
    }

    /// Covers columns [xFirst, xLast] of rows [yFirst, yLast] of a page.
    /// @param fill a row, as ShortRows do @param row of the page, row yFirst
    /// @param edges those that need testing
    template <class Fill>
    void coverRows(const Fill& fill, uint32_t* row, int32_t xFirst, int32_t xLast, int32_t yFirst,
                   int32_t yLast, uint32_t edges) const {
        if (edges == 0) {
            for (int32_t y = yFirst; y <= yLast; ++y, row += side_)
                fill(row, xFirst, xLast, t_.wy() * centre(y) + t_.w0());
            return;
        }
        for (int32_t y = yFirst; y <= yLast; y += 4) {
            RowSpans spans;
            spanRows(t_, rEx_, y, n_, xFirst, xLast, edges, spans);
            for (int32_t i = 0; i < 4 && y + i <= yLast; ++i, row += side_)
                if (spans.first[i] <= spans.last[i])
                    fill(row, spans.first[i], spans.last[i], spans.rw[i]);
        }
    }

    const FacePages& pages_;
    const FaceTriangle& t_;
    uint32_t log2_;
    int32_t side_, n_;
    double rEx_[3];
    Lanes ex_, ey_, e0_, bound_; ///< three edges and the depth, whose bound is of no use
};

/// coverTexels for all rows of a solid triangle, storing the greater depth. Pages that reach the
/// near plane, and narrow triangles that do, are left to the shared code.
inline void coverTexels(const FacePages& pages, const FaceTriangle& t) {
    if (t.x1 - t.x0 >= kNarrowTexels)
        WideTriangle(pages, t).cover();
    else if (t.wMax <= t.wNear)
        coverNarrow(pages, t);
    else
        shadowdag::coverTexels(pages.view, *pages.map, pages.face, t, SolidTriangle{}, t.y0, t.y1,
                               StoreGreater{pages.view.depths.data});
}

} // namespace shadowdag::avx2

#endif
