// SPDX-License-Identifier: Apache-2.0
// Triangles to depth texels of a cube map's face.
//
// Fill rule: a texel is covered when the ray from the light through its centre meets the closed
// triangle; triangles that share an edge or a corner leave no gap between them. Both sides block. A
// triangle whose plane contains the light (to double rounding) has no area as seen from there and
// covers nothing, like a degenerate one. Near plane: surfaces nearer to the light than
// nearDepth(map), along the face's axis, do not block. Depth convention: see ShadowMapView. The
// greatest bits win, so the order of triangles does not matter. Alpha masks are sampled at the same
// point (scenes/alpha_mask.h), so holes smaller than a texel may be missed.
#pragma once

#include "cuda/atomics.h"
#include "cuda/pass.h"
#include "cuda/split_work_view.h"
#include "scenes/batches.h"
#include "shadowmap/cull.h"
#include "shadowmap/face_plane_leaf.h"
#include "shadowmap/shadow_map_lookup.h"

namespace shadowdag {

/// The data that rasterization reads and writes.
struct RasterView {
    View<const ShadowMapInfo> maps;
    View<const uint32_t> pageTable;
    View<uint32_t> depths; ///< starts at 0
    uint32_t pageTexelsLog2;
    TriangleView geometry;
    View<const Batch> batches;
    View<const uint32_t> batchTriangles;
    View<const BatchDraw> draws;
    uint32_t slotsPerDraw; ///< no batch holds more triangles
};

/// A triangle set up for one face: functions of the texel coordinates X = 2 x + 1 - N, Y = 2 y + 1
/// - N.
struct FaceTriangle {
    /// Edge k < 3 is inside where ex[k] X + ey[k] Y + e0[k] >= -tolerance[k]; 1/z = ex[3] X + ey[3]
    /// Y + e0[3].
    double ex[4], ey[4], e0[4];
    double tolerance[3];
    float wMin, wMax;       ///< the range of 1/z over the part of the triangle in front
    float wNear;            ///< greater 1/z are nearer than the near plane
    int32_t x0, x1, y0, y1; ///< texels whose centres can lie inside, clipped to the face

    SDAG_HD double wx() const { return ex[3]; }
    SDAG_HD double wy() const { return ey[3]; }
    SDAG_HD double w0() const { return e0[3]; }
};
static_assert(sizeof(FaceTriangle) ==
              152); // half a million wait for memory in a list of large ones

/// Returns the first and last texel whose centres lie in face coordinates [lo, hi], clipped to the
/// face; empty when first > last. A millionth of a texel is added on both sides for rounding.
SDAG_HD inline void texelSpan(double lo, double hi, uint32_t faceTexels, int32_t& first,
                              int32_t& last) {
    const double half = 0.5 * double(faceTexels);
    const double a = (lo + 1.0) * half - 0.5 - 1e-6;
    const double b = (hi + 1.0) * half - 0.5 + 1e-6;
    const double end = double(faceTexels) - 1.0;
    if (!(a <= end) || !(b >= 0.0)) {
        first = 0;
        last = -1;
        return;
    }
    const int32_t down = a > 0.0 ? int32_t(a) : 0;
    first = a > double(down) ? down + 1 : down; // ceiling
    last = b < end ? int32_t(b) : int32_t(end); // floor
}

/// Bounds, in face coordinates, of the part of a triangle within the face's pyramid |x| <= z, |y|
/// <= z: for triangles that reach behind the light, which have no projection of their own. Returns
/// false when nothing is within. Source: Sutherland and Hodgman, Reentrant Polygon Clipping, 1974.
SDAG_HD inline bool clippedBounds(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c,
                                  glm::dvec2& lo, glm::dvec2& hi) {
    glm::dvec3 from[7] = {a, b, c}, to[7];
    int count = 3;
    for (int plane = 0; plane < 4; ++plane) {
        const auto inside = [plane](const glm::dvec3& p) {
            const double s = plane < 2 ? p.x : p.y;
            return p.z + (plane & 1 ? -s : s);
        };
        int kept = 0;
        for (int i = 0; i < count; ++i) {
            const glm::dvec3& p = from[i];
            const glm::dvec3& q = from[i + 1 < count ? i + 1 : 0];
            const double dp = inside(p), dq = inside(q);
            if (dp >= 0.0)
                to[kept++] = p;
            if ((dp < 0.0) != (dq < 0.0))
                to[kept++] = p + (q - p) * (dp / (dp - dq));
        }
        count = kept;
        for (int i = 0; i < count; ++i)
            from[i] = to[i];
    }
    lo = glm::dvec2(1.0);
    hi = glm::dvec2(-1.0);
    for (int i = 0; i < count; ++i) {
        // At the light itself every direction is possible.
        const bool isPoint = from[i].z > 0.0;
        const glm::dvec2 uv =
            isPoint ? glm::dvec2(from[i].x, from[i].y) / from[i].z : glm::dvec2(0.0);
        lo = glm::min(lo, isPoint ? uv : glm::dvec2(-1.0));
        hi = glm::max(hi, isPoint ? uv : glm::dvec2(1.0));
    }
    return count > 0;
}

/// Returns whether a triangle can cover a texel of a face as far as its rectangle tells, which it
/// writes to `t` with the range of 1/z; the rest of `t` is for setUpEdges.
/// @param a,b,c corners in the face's frame (faceFromLight)
SDAG_HD inline bool boundTriangle(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c,
                                  const ShadowMapInfo& map, FaceTriangle& t) {
    // Outside of the face's pyramid |x| <= z, |y| <= z by one of its planes.
    if ((a.x > a.z && b.x > b.z && c.x > c.z) || (-a.x > a.z && -b.x > b.z && -c.x > c.z) ||
        (a.y > a.z && b.y > b.z && c.y > c.z) || (-a.y > a.z && -b.y > b.z && -c.y > c.z))
        return false;
    const uint32_t n = map.faceTexels;
    const double zMin = glm::min(a.z, glm::min(b.z, c.z));
    const double zMax = glm::max(a.z, glm::max(b.z, c.z));
    if (!(zMax > 0.0))
        return false;
    const double zNear = nearDepth(map);
    t.wNear = float(1.0 / zNear);
    t.wMin = float(1.0 / zMax);
    if (zMin > zNear) {
        const double ra = 1.0 / a.z, rb = 1.0 / b.z, rc = 1.0 / c.z;
        const double ua = a.x * ra, ub = b.x * rb, uc = c.x * rc;
        texelSpan(glm::min(ua, glm::min(ub, uc)), glm::max(ua, glm::max(ub, uc)), n, t.x0, t.x1);
        if (t.x0 > t.x1)
            return false;
        const double va = a.y * ra, vb = b.y * rb, vc = c.y * rc;
        texelSpan(glm::min(va, glm::min(vb, vc)), glm::max(va, glm::max(vb, vc)), n, t.y0, t.y1);
        if (t.y0 > t.y1)
            return false;
        t.wMax = float(1.0 / zMin);
    } else {
        glm::dvec2 lo, hi;
        if (!clippedBounds(a, b, c, lo, hi))
            return false;
        const double texel = 2.0 / double(n); // more than the rounding of clipping
        texelSpan(lo.x - texel, hi.x + texel, n, t.x0, t.x1);
        texelSpan(lo.y - texel, hi.y + texel, n, t.y0, t.y1);
        if (t.x0 > t.x1 || t.y0 > t.y1)
            return false;
        t.wMax = kLargestInverseDepth;
    }
    return true;
}

/// Returns whether a triangle has an area as seen from the light, and writes its edges and its
/// plane to `t`.
///
/// Edges are evaluated homogeneously: the ray c = (u, v, 1) meets the cone of a, b, c when (a x
/// b).c, (b x c).c and (c x a).c all have the sign of the determinant, whatever lies behind the
/// light, so nothing is clipped. Products and differences round alike when a and b are exchanged,
/// so two triangles see their common edge as the same number with opposite sign. Each edge takes
/// its rounding (about 24 2^-53 |a| |b|) as inside: a ray that meets a triangle in exact arithmetic
/// is never lost, at edges and at corners; the price is an overlap of about 1e-14 of a face.
/// @param a,b,c corners in the face's frame (faceFromLight)
SDAG_HD inline bool setUpEdges(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c,
                               uint32_t n, FaceTriangle& t) {
    glm::dvec3 w;
    double k;
    if (!facePlane(a, b, c, n, w, k))
        return false;
    const double sizeA = largestOf(a), sizeB = largestOf(b), sizeC = largestOf(c);
    const double sign = k > 0.0 ? 1.0 : -1.0;
    const double count = double(n);
    const auto edge = [&](int i, const glm::dvec3& p, const glm::dvec3& q, double sizes) {
        const glm::dvec3 e = glm::cross(p, q);
        t.ex[i] = sign * e.x;
        t.ey[i] = sign * e.y;
        t.e0[i] = sign * (e.z * count);
        t.tolerance[i] = kDeterminantRounding * sizes * count;
    };
    edge(0, a, b, sizeA * sizeB);
    edge(1, b, c, sizeB * sizeC);
    edge(2, c, a, sizeC * sizeA);
    t.ex[3] = w.x;
    t.ey[3] = w.y;
    t.e0[3] = w.z;
    return true;
}

/// Returns whether a triangle can cover a texel of a face, and its setup.
/// @param a,b,c corners in the face's frame (faceFromLight)
SDAG_HD inline bool setUpTriangle(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c,
                                  const ShadowMapInfo& map, FaceTriangle& t) {
    return boundTriangle(a, b, c, map, t) && setUpEdges(a, b, c, map.faceTexels, t);
}

/// Narrows the columns [first, last] of a row to those inside of an edge. In this form ex X + r is
/// monotone, so the columns inside are one run, whose end is estimated by its quotient and then
/// decided by the edge function itself.
SDAG_HD inline void narrowSpan(double ex, double r, double tolerance, double rEx, int32_t n,
                               int32_t& first, int32_t& last) {
    if (first > last) // deciding an end could otherwise fill an empty run again
        return;
    const auto inside = [&](int32_t x) { return ex * double(2 * x + 1 - n) + r >= -tolerance; };
    if (ex == 0.0) {
        if (!(r >= -tolerance))
            last = first - 1;
        return;
    }
    const double end = 0.5 * ((-tolerance - r) * rEx + double(n) - 1.0);
    // The comparisons send a NaN (0 times infinity) to one end, from which the loops start.
    int32_t x = end > double(first) ? end < double(last) ? int32_t(end) : last : first;
    if (ex > 0.0) {
        while (x > first && inside(x - 1))
            --x;
        while (x <= last && !inside(x))
            ++x;
        first = x;
    } else {
        while (x < last && inside(x + 1))
            ++x;
        while (x >= first && !inside(x))
            --x;
        last = x;
    }
}

/// Triangles narrower than this are tested texel by texel: cheaper than finding where rows begin
/// and end.
constexpr int32_t kNarrowTexels = 4;

/// A triangle without holes.
struct SolidTriangle {
    SDAG_HD bool isOpaque(double, double) const { return true; }
};

/// A triangle that an alpha mask cuts.
struct MaskedTriangle {
    const AlphaMaskView& masks;
    const FaceTriangle& t;
    uint32_t triangle;     ///< of the world
    glm::dvec3 scale{1.0}; ///< of a corner's weight; for directional lights the corner's depth

    /// Returns whether it is opaque at texel coordinates X, Y. A corner's weight is the function of
    /// the edge opposite to it: edge 0 joins corners 0 and 1. For a directional light the corners
    /// were scaled by their depths (directional_window.h), which removes these from the weights.
    SDAG_HD bool isOpaque(double X, double Y) const {
        const auto edge = [&](int k) { return t.ex[k] * X + (t.ey[k] * Y + t.e0[k]); };
        return masks.isOpaque(triangle, edge(1) * scale.x, edge(2) * scale.y, edge(0) * scale.z);
    }
};

/// Calls store(index, bits) for the texels of a triangle in rows [row0, row1] of the face that have
/// memory and where the surface is opaque; `index` is into RasterView::depths.
/// @param surface SolidTriangle or MaskedTriangle
template <class Surface, class Store>
SDAG_HD inline void coverTexels(const RasterView& view, const ShadowMapInfo& map, uint32_t face,
                                const FaceTriangle& t, const Surface& surface, int32_t row0,
                                int32_t row1, const Store& store) {
    const uint32_t log2 = view.pageTexelsLog2;
    const int32_t side = 1 << log2;
    const int32_t n = int32_t(map.faceTexels);
    const bool isNarrow = t.x1 - t.x0 < kNarrowTexels;
    const bool isClearOfNear = t.wMax <= t.wNear;
    const double rEx[3] = {isNarrow ? 0.0 : 1.0 / t.ex[0], isNarrow ? 0.0 : 1.0 / t.ex[1],
                           isNarrow ? 0.0 : 1.0 / t.ex[2]};
    const double wx = t.wx();
    const float wMin = t.wMin, wMax = t.wMax, wNear = t.wNear;
    for (int32_t py = row0 >> log2; py <= row1 >> log2; ++py) {
        for (int32_t px = t.x0 >> log2; px <= t.x1 >> log2; ++px) {
            const uint32_t page =
                view.pageTable[pageTableIndex(map, face, uint32_t(px), uint32_t(py))];
            if (page == kNoPage)
                continue;
            const int32_t xFirst = glm::max(t.x0, px * side);
            const int32_t xLast = glm::min(t.x1, px * side + side - 1);
            const int32_t yFirst = glm::max(row0, py * side);
            const int32_t yLast = glm::min(row1, py * side + side - 1);
            for (int32_t y = yFirst; y <= yLast; ++y) {
                const double Y = double(2 * y + 1 - n);
                const double r0 = t.ey[0] * Y + t.e0[0], r1 = t.ey[1] * Y + t.e0[1],
                             r2 = t.ey[2] * Y + t.e0[2], rw = t.wy() * Y + t.w0();
                const size_t row = (size_t(page) << (2 * log2)) + (size_t(y - py * side) << log2) -
                                   size_t(px * side);
                const auto depth = [=](int32_t x) {
                    const float w = float(wx * double(2 * x + 1 - n) + rw);
                    return glm::min(glm::max(w, wMin), wMax);
                };
                int32_t first = xFirst, last = xLast;
                if (isNarrow) {
                    for (int32_t x = first; x <= last; ++x) {
                        const double X = double(2 * x + 1 - n);
                        if (t.ex[0] * X + r0 >= -t.tolerance[0] &&
                            t.ex[1] * X + r1 >= -t.tolerance[1] &&
                            t.ex[2] * X + r2 >= -t.tolerance[2] && depth(x) <= wNear &&
                            surface.isOpaque(X, Y))
                            store(row + size_t(x), floatBits(depth(x)));
                    }
                    continue;
                }
                narrowSpan(t.ex[0], r0, t.tolerance[0], rEx[0], n, first, last);
                narrowSpan(t.ex[1], r1, t.tolerance[1], rEx[1], n, first, last);
                narrowSpan(t.ex[2], r2, t.tolerance[2], rEx[2], n, first, last);
                const auto isOpaque = [&](int32_t x) {
                    return surface.isOpaque(double(2 * x + 1 - n), Y);
                };
                if (isClearOfNear) {
                    for (int32_t x = first; x <= last; ++x)
                        if (isOpaque(x))
                            store(row + size_t(x), floatBits(depth(x)));
                } else {
                    for (int32_t x = first; x <= last; ++x)
                        if (depth(x) <= wNear && isOpaque(x))
                            store(row + size_t(x), floatBits(depth(x)));
                }
            }
        }
    }
}

/// Returns a corner relative to the light (lightFromWorld).
SDAG_HD inline glm::dvec3 cornerFromLight(const TriangleView& geometry, uint32_t triangle,
                                          int corner, const ShadowMapInfo& map) {
    return lightFromWorld(map, geometry.vertex(triangle, corner));
}

/// Returns the surface of a triangle of the world that a mask cuts. @param t its setup
SDAG_HD inline MaskedTriangle maskedTriangle(const RasterView& view, const ShadowMapInfo& map,
                                             const FaceTriangle& t, uint32_t triangle) {
    MaskedTriangle surface{view.geometry.masks, t, triangle};
    if (map.window.isDirectional())
        for (int corner = 0; corner < 3; ++corner)
            surface.scale[corner] = cornerFromLight(view.geometry, triangle, corner, map).z;
    return surface;
}

/// Calls store(index, bits) for all texels of a triangle of the world, cut or not.
template <class Store>
SDAG_HD inline void coverTexels(const RasterView& view, const ShadowMapInfo& map, uint32_t face,
                                const FaceTriangle& t, uint32_t triangle, const Store& store) {
    if (view.geometry.masks.isCut(triangle))
        coverTexels(view, map, face, t, maskedTriangle(view, map, t, triangle), t.y0, t.y1, store);
    else
        coverTexels(view, map, face, t, SolidTriangle{}, t.y0, t.y1, store);
}

/// Keeps the greater depth; other threads may write the same texel.
struct StoreGreaterAtomically {
    View<uint32_t> depths;
    SDAG_HD void operator()(size_t texel, uint32_t bits) const {
        atomicMaxRelaxed(&depths[texel], bits);
    }
};

/// Triangles whose rectangle of a face has more texels than this are split by the pages that they
/// touch, and the lanes share each page's texels.
constexpr int64_t kSmallTriangleTexels = 256;

/// Pages [x0, x1] x [y0, y1] of a face that a triangle's rectangle touches.
struct PageRect {
    int32_t x0, y0, x1, y1;

    SDAG_HD uint32_t across() const { return uint32_t(x1 - x0 + 1); }
    SDAG_HD uint32_t count() const { return across() * uint32_t(y1 - y0 + 1); }
};
SDAG_HD inline PageRect pagesOf(const FaceTriangle& t, uint32_t pageTexelsLog2) {
    return {t.x0 >> pageTexelsLog2, t.y0 >> pageTexelsLog2, t.x1 >> pageTexelsLog2,
            t.y1 >> pageTexelsLog2};
}

/// Draws triangle i % slotsPerDraw of draw i / slotsPerDraw, except into faces in which it is
/// large: those are put on the list.
struct RasterizeTriangle {
    RasterView view;
    SplitWorkView large; ///< a: the draw; b: the triangle within its batch, times 8, and the face
    View<FaceTriangle> setups; ///< by item of the list, as long as it

    size_t itemCount() const { return view.draws.count * view.slotsPerDraw; }
    size_t grain() const { return 4 * view.slotsPerDraw; }
    SDAG_HD void operator()(size_t i) const {
        const size_t drawIndex = i / view.slotsPerDraw;
        const BatchDraw draw = view.draws[drawIndex];
        const Batch batch = view.batches[draw.batch];
        const uint32_t inBatch = uint32_t(i % view.slotsPerDraw);
        if (inBatch >= batch.count || draw.faces == 0)
            return;
        const ShadowMapInfo map = view.maps[draw.map];
        const uint32_t triangle = view.batchTriangles[batch.first + inBatch];
        glm::dvec3 corners[3];
        for (int corner = 0; corner < 3; ++corner)
            corners[corner] = cornerFromLight(view.geometry, triangle, corner, map);
        for (uint32_t face = 0; face < kFaceCount; ++face) {
            FaceTriangle t;
            if (!(draw.faces >> face & 1u) ||
                !setUpTriangle(faceFromLight(face, corners[0]), faceFromLight(face, corners[1]),
                               faceFromLight(face, corners[2]), map, t))
                continue;
            const bool isLarge =
                int64_t(t.x1 - t.x0 + 1) * (t.y1 - t.y0 + 1) > kSmallTriangleTexels;
            uint32_t index;
            if (isLarge && large.add(uint32_t(drawIndex), inBatch << 3 | face,
                                     pagesOf(t, view.pageTexelsLog2).count(), index)) {
                setups[index] = t;
                continue;
            }
            coverTexels(view, map, face, t, triangle, StoreGreaterAtomically{view.depths});
        }
    }
};
void launchPass(CudaTag, const RasterizeTriangle& work); ///< by warps

/// Texels [x0, x1] x [y0, y1] of a face.
struct TexelRect {
    int32_t x0, y0, x1, y1;
};

/// Trivial rejection and acceptance of a rectangle of texels. Source: Abrash, Rasterization on
/// Larrabee, 2009.
struct TileCoverage {
    bool isRejected;       ///< all texels are outside of an edge
    uint32_t partialEdges; ///< bit k: edge k is tested texel by texel; all are inside of the others
};

/// Returns the coverage. An edge function is rounded alike for all texels and each operation is
/// monotone, so its values at the corners of the rectangle bound the others, exactly as they are
/// computed.
SDAG_HD inline TileCoverage coverTile(const FaceTriangle& t, const TexelRect& rect, int32_t n) {
    const double left = double(2 * rect.x0 + 1 - n), right = double(2 * rect.x1 + 1 - n),
                 top = double(2 * rect.y0 + 1 - n), bottom = double(2 * rect.y1 + 1 - n);
    TileCoverage tile{false, 0};
    for (int k = 0; k < 3; ++k) {
        const double a = t.ey[k] * top, b = t.ey[k] * bottom, c = t.ex[k] * left,
                     d = t.ex[k] * right;
        tile.isRejected |= glm::max(c, d) + (glm::max(a, b) + t.e0[k]) < -t.tolerance[k];
        // Not <: an edge function that is not a number is tested.
        if (!(glm::min(c, d) + (glm::min(a, b) + t.e0[k]) >= -t.tolerance[k]))
            tile.partialEdges |= 1u << k;
    }
    return tile;
}

/// Returns the greatest 1/z that drawing a triangle stores in a rectangle, or more: bounded by the
/// corners as coverTile is.
SDAG_HD inline float nearestIn(const FaceTriangle& t, const TexelRect& rect, int32_t n) {
    const double X = double(2 * (t.wx() > 0.0 ? rect.x1 : rect.x0) + 1 - n),
                 Y = double(2 * (t.wy() > 0.0 ? rect.y1 : rect.y0) + 1 - n);
    return glm::min(glm::max(float(t.wx() * X + (t.wy() * Y + t.w0())), t.wMin), t.wMax);
}

/// Draws a lane's share of one page of a triangle that RasterizeTriangle put on the list: of every
/// row every kGroupLanes-th texel, or, of pages with shorter rows, one texel of several rows. So
/// neighbouring lanes write neighbouring texels.
struct RasterizeLargeTriangle {
    RasterView view;
    SplitWorkView parts;
    View<const FaceTriangle> setups; ///< of RasterizeTriangle

    /// Returns whether the page has memory and may have covered texels.
    SDAG_HD bool wants(const SplitItem& item, uint32_t part) const {
        const FaceTriangle& t = setups[item.index];
        const ShadowMapInfo& map = view.maps[view.draws[item.a].map];
        const TexelRect rect = rectOf(t, part);
        return pageAt(map, item.b & 7u, rect) != kNoPage &&
               !coverTile(t, rect, int32_t(map.faceTexels)).isRejected;
    }
    SDAG_HD void operator()(const SplitItem& item, uint32_t part, uint32_t lane) const {
        const BatchDraw draw = view.draws[item.a];
        const ShadowMapInfo& map = view.maps[draw.map];
        const FaceTriangle& t = setups[item.index];
        const TexelRect rect = rectOf(t, part);
        const uint32_t triangle =
            view.batchTriangles[view.batches[draw.batch].first + (item.b >> 3)];
        const size_t pageStart = size_t(pageAt(map, item.b & 7u, rect))
                                 << (2 * view.pageTexelsLog2);
        if (view.geometry.masks.isCut(triangle))
            cover(t, maskedTriangle(view, map, t, triangle), rect, int32_t(map.faceTexels),
                  pageStart, lane);
        else
            cover(t, SolidTriangle{}, rect, int32_t(map.faceTexels), pageStart, lane);
    }

private:
    /// Returns the texels of the triangle's rectangle in a page.
    SDAG_HD TexelRect rectOf(const FaceTriangle& t, uint32_t part) const {
        const PageRect pages = pagesOf(t, view.pageTexelsLog2);
        const int32_t side = 1 << view.pageTexelsLog2;
        const int32_t x = (pages.x0 + int32_t(part % pages.across())) * side,
                      y = (pages.y0 + int32_t(part / pages.across())) * side;
        return {glm::max(t.x0, x), glm::max(t.y0, y), glm::min(t.x1, x + side - 1),
                glm::min(t.y1, y + side - 1)};
    }
    SDAG_HD uint32_t pageAt(const ShadowMapInfo& map, uint32_t face, const TexelRect& rect) const {
        return view.pageTable[pageTableIndex(map, face, uint32_t(rect.x0) >> view.pageTexelsLog2,
                                             uint32_t(rect.y0) >> view.pageTexelsLog2)];
    }

    /// See coverTexels: the same tests of the same numbers.
    template <class Surface>
    SDAG_HD void cover(const FaceTriangle& t, const Surface& surface, const TexelRect& rect,
                       int32_t n, size_t pageStart, uint32_t lane) const {
        const uint32_t log2 = view.pageTexelsLog2, partial = coverTile(t, rect, n).partialEdges;
        const int32_t inPage = (1 << log2) - 1;
        const int32_t columns = glm::min(1 << log2, int32_t(kGroupLanes)),
                      rows = int32_t(kGroupLanes) / columns;
        const int32_t xFirst = rect.x0 + int32_t(lane) % columns,
                      yFirst = rect.y0 + int32_t(lane) / columns;
        const auto startOf = [&](int32_t y) { return pageStart + (size_t(y & inPage) << log2); };
        // Most pages of a scene in rooms lie behind what other triangles drew before. Depths only
        // get nearer meanwhile, so one that is no longer current hides less.
        const uint32_t nearest = floatBits(nearestIn(t, rect, n));
        bool isHidden = true;
        for (int32_t y = yFirst; y <= rect.y1; y += rows)
            for (int32_t x = xFirst; x <= rect.x1; x += columns)
                isHidden &= loadPast(&view.depths[startOf(y) + size_t(x & inPage)]) >= nearest;
        if (isHidden)
            return;
        const auto isIn = [&](int k, double X, double Y) {
            return !(partial >> k & 1u) || t.ex[k] * X + (t.ey[k] * Y + t.e0[k]) >= -t.tolerance[k];
        };
        for (int32_t y = yFirst; y <= rect.y1; y += rows) {
            const double Y = double(2 * y + 1 - n), rw = t.wy() * Y + t.w0();
            const size_t row = startOf(y);
            for (int32_t x = xFirst; x <= rect.x1; x += columns) {
                const double X = double(2 * x + 1 - n);
                if (!(isIn(0, X, Y) && isIn(1, X, Y) && isIn(2, X, Y)))
                    continue;
                const float w = glm::min(glm::max(float(t.wx() * X + rw), t.wMin), t.wMax);
                if (w <= t.wNear && surface.isOpaque(X, Y))
                    atomicMaxRelaxed(&view.depths[row + size_t(x & inPage)], floatBits(w));
            }
        }
    }
};

} // namespace shadowdag
