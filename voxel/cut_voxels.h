// SPDX-License-Identifier: Apache-2.0
// The voxels of a triangle with an alpha mask: those of its voxels in which the mask is opaque
// somewhere. The triangle is clipped to the voxel, its texture coordinates there are bounded by a
// rectangle, and the voxel is kept if the rectangle contains an opaque texel. A voxel may thus be
// kept although the opaque part misses it, by less than the rectangle exceeds the clipped part and
// never by more than one voxel; no voxel that an opaque point touches is lost.
#pragma once

#include "voxel/mask_pyramid.h"
#include "voxel/triangle_voxels.h"

namespace shadowdag {

/// A cut triangle prepared for the test: its texture coordinates, in texels, as affine functions of
/// voxel coordinates along the setup's axes u and v.
///
/// Error: with det the doubled area seen along d, and E the longest edge, a derivative is off by
/// 16 eps E T / |det| (T the extent of the coordinates) and det by 8 eps E^2. Triangles with |det|
/// < 1e-6 E^2 are taken as opaque. For the others a derivative G is off by 2e-9 |G|, over a lever
/// of E + 3 voxels; positions are off by slack and slackPlane (triangle_voxels.h). Rectangles are
/// grown by |G| (1e-8 (E + 3) + 4 slack).
struct CutSetup {
    MaskPyramidView mask; ///< empty: opaque
    glm::dvec2 origin{0.0}, perU{0.0}, perV{0.0};
    glm::dvec2 least{0.0}, most{0.0}; ///< of the texels that its points lie in (TexelSpan)
    glm::dvec2 grow{0.0};

    SDAG_HD glm::dvec2 at(const TriangleSetup& s, double u, double v) const {
        return origin + perU * (u - s.p[0][0]) + perV * (v - s.p[1][0]);
    }
    /// Returns the cover of the mask over the part of a rectangle in which the triangle may have
    /// points.
    SDAG_HD MaskCover cover(const glm::dvec2& lo, const glm::dvec2& hi) const {
        return mask.cover(glm::clamp(lo - grow, least, most), glm::clamp(hi + grow, least, most));
    }
};

/// @param uv texture coordinates of the setup's corners
SDAG_HD inline CutSetup setupCut(const TriangleSetup& s, const glm::vec2 uv[3],
                                 const MaskPyramidView& mask) {
    CutSetup cut;
    const double e1u = s.p[0][1] - s.p[0][0], e1v = s.p[1][1] - s.p[1][0];
    const double e2u = s.p[0][2] - s.p[0][0], e2v = s.p[1][2] - s.p[1][0];
    const double e1d = s.p[2][1] - s.p[2][0], e2d = s.p[2][2] - s.p[2][0];
    double edge = 0.0;
    const double parts[] = {e1u, e1v, e1d, e2u, e2v, e2d};
    for (const double e : parts)
        edge = greater(edge, fabs(e));
    const double det = e1u * e2v - e1v * e2u;
    if (!(fabs(det) > 1e-6 * edge * edge) || !(s.slackPlane < INFINITY))
        return cut;
    const glm::dvec2 size = mask.size();
    const glm::dvec2 t0 = glm::dvec2(uv[0]) * size, t1 = glm::dvec2(uv[1]) * size,
                     t2 = glm::dvec2(uv[2]) * size;
    cut.mask = mask;
    cut.origin = t0;
    cut.perU = ((t1 - t0) * e2v - (t2 - t0) * e1v) / det;
    cut.perV = ((t2 - t0) * e1u - (t1 - t0) * e2u) / det;
    cut.grow = (glm::abs(cut.perU) + glm::abs(cut.perV)) * (1e-8 * (edge + 3.0) + 4.0 * s.slack) +
               glm::max(glm::abs(t0), glm::max(glm::abs(t1), glm::abs(t2))) * 1e-14;
    for (int axis = 0; axis < 2; ++axis) {
        const TexelSpan span =
            texelSpanOf(uv[0][axis], uv[1][axis], uv[2][axis], uint32_t(size[axis]));
        cut.least[axis] = span.first;
        cut.most[axis] = span.last + 0.5; // within the last
    }
    return cut;
}

/// Returns the cover of the mask over the part of the triangle within column (u, v), over its whole
/// depth.
SDAG_HD inline MaskCover coverOfColumn(const TriangleSetup& s, const CutSetup& cut, double u,
                                       double v) {
    if (cut.mask.empty())
        return MaskCover::kAll;
    const glm::dvec2 middle = cut.at(s, u + 0.5, v + 0.5);
    const glm::dvec2 reach = 0.5 * (glm::abs(cut.perU) + glm::abs(cut.perV));
    return cut.cover(middle - reach, middle + reach);
}

namespace detail {

struct Polygon {
    glm::dvec3 corner[9]; ///< u, v, d; a triangle clipped by six planes
    int count;
};

/// Keeps the part with sign * (p[axis] - limit) <= 0.
SDAG_HD inline void clip(Polygon& polygon, int axis, double limit, double sign) {
    Polygon kept;
    kept.count = 0;
    for (int i = 0; i < polygon.count; ++i) {
        const glm::dvec3& p = polygon.corner[i];
        const glm::dvec3& q = polygon.corner[i + 1 < polygon.count ? i + 1 : 0];
        const double dp = sign * (p[axis] - limit), dq = sign * (q[axis] - limit);
        if (dp <= 0.0)
            kept.corner[kept.count++] = p;
        if ((dp < 0.0 && dq > 0.0) || (dp > 0.0 && dq < 0.0))
            kept.corner[kept.count++] = p + (q - p) * (dp / (dp - dq));
    }
    polygon = kept;
}

} // namespace detail

/// Returns whether the mask may be opaque somewhere on the part of the triangle within the closed
/// voxel whose least corner is (u, v, d) along the setup's axes.
SDAG_HD inline bool isOpaqueInVoxel(const TriangleSetup& s, const CutSetup& cut, double u, double v,
                                    double d) {
    if (cut.mask.empty())
        return true;
    detail::Polygon polygon;
    polygon.count = 3;
    for (int i = 0; i < 3; ++i)
        polygon.corner[i] = {s.p[0][i], s.p[1][i], s.p[2][i]};
    const double least[3] = {u, v, d};
    // What lies beyond a face by rounding is inside; d is known to slackPlane.
    const double slack[3] = {s.slack, s.slack, s.slack + s.slackPlane};
    for (int axis = 0; axis < 3 && polygon.count > 0; ++axis) {
        detail::clip(polygon, axis, least[axis] - slack[axis], -1.0);
        detail::clip(polygon, axis, least[axis] + 1.0 + slack[axis], 1.0);
    }
    if (polygon.count == 0) // within rounding of the voxel
        return coverOfColumn(s, cut, u, v) != MaskCover::kNone;
    glm::dvec2 lo(INFINITY), hi(-INFINITY);
    for (int i = 0; i < polygon.count; ++i) {
        const glm::dvec2 t = cut.at(s, polygon.corner[i].x, polygon.corner[i].y);
        lo = glm::min(lo, t);
        hi = glm::max(hi, t);
    }
    return cut.cover(lo, hi) != MaskCover::kNone;
}

} // namespace shadowdag
