// SPDX-License-Identifier: Apache-2.0
#include "voxel/cut_voxels.h"

namespace shadowdag {

CutSetup setupCut(const TriangleSetup& s, const glm::vec2 uv[3], const MaskPyramid& mask) {
    CutSetup cut;
    const double e1u = s.p[0][1] - s.p[0][0], e1v = s.p[1][1] - s.p[1][0];
    const double e2u = s.p[0][2] - s.p[0][0], e2v = s.p[1][2] - s.p[1][0];
    const double e1d = s.p[2][1] - s.p[2][0], e2d = s.p[2][2] - s.p[2][0];
    double edge = 0.0;
    for (const double e : {e1u, e1v, e1d, e2u, e2v, e2d})
        edge = greater(edge, fabs(e));
    const double det = e1u * e2v - e1v * e2u;
    if (!(fabs(det) > 1e-6 * edge * edge) || !(s.slackPlane < INFINITY))
        return cut;
    const glm::dvec2 size = mask.size();
    const glm::dvec2 t0 = glm::dvec2(uv[0]) * size, t1 = glm::dvec2(uv[1]) * size,
                     t2 = glm::dvec2(uv[2]) * size;
    cut.mask = &mask;
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

MaskCover coverOfColumn(const TriangleSetup& s, const CutSetup& cut, double u, double v) {
    if (!cut.mask)
        return MaskCover::kAll;
    const glm::dvec2 middle = cut.at(s, u + 0.5, v + 0.5);
    const glm::dvec2 reach = 0.5 * (glm::abs(cut.perU) + glm::abs(cut.perV));
    return cut.cover(middle - reach, middle + reach);
}

namespace {

struct Polygon {
    glm::dvec3 corner[9]; ///< u, v, d; a triangle clipped by six planes
    int count;
};

/// Keeps the part with sign * (p[axis] - limit) <= 0.
void clip(Polygon& polygon, int axis, double limit, double sign) {
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

} // namespace

bool isOpaqueInVoxel(const TriangleSetup& s, const CutSetup& cut, double u, double v, double d) {
    if (!cut.mask)
        return true;
    Polygon polygon;
    polygon.count = 3;
    for (int i = 0; i < 3; ++i)
        polygon.corner[i] = {s.p[0][i], s.p[1][i], s.p[2][i]};
    const double least[3] = {u, v, d};
    // What lies beyond a face by rounding is inside; d is known to slackPlane.
    const double slack[3] = {s.slack, s.slack, s.slack + s.slackPlane};
    for (int axis = 0; axis < 3 && polygon.count > 0; ++axis) {
        clip(polygon, axis, least[axis] - slack[axis], -1.0);
        clip(polygon, axis, least[axis] + 1.0 + slack[axis], 1.0);
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
