// SPDX-License-Identifier: Apache-2.0
// The six faces of a cube map: their frames, their texels, and the rectangles that boxes cover on
// them. Source: Olsson et al. 2015, appendix A, Listing 1; as printed it rejects no box, so two
// rejections come first here.
#pragma once

#include "scenes/box.h"

#include <cstdint>

namespace shadowdag {

constexpr uint32_t kFaceCount = 6;

/// Returns a light-relative vector in the frame of a face: (u axis, v axis, depth). Face 2 a looks
/// along +axis a and face 2 a + 1 along -axis a; u runs along axis a + 1 and v along axis a + 2,
/// modulo 3, on both. So half of the faces are mirrored, which nothing here minds: both sides of a
/// triangle block.
template <class Vec> SDAG_HD inline Vec faceFromLight(uint32_t face, const Vec& p) {
    const Vec q = face < 2 ? Vec(p.y, p.z, p.x) : face < 4 ? Vec(p.z, p.x, p.y) : p;
    return (face & 1u) ? Vec(q.x, q.y, -q.z) : q;
}

/// Inverts faceFromLight.
template <class Vec> SDAG_HD inline Vec lightFromFace(uint32_t face, const Vec& q) {
    const Vec p = (face & 1u) ? Vec(q.x, q.y, -q.z) : q;
    return face < 2 ? Vec(p.z, p.x, p.y) : face < 4 ? Vec(p.y, p.z, p.x) : p;
}

/// Returns the face that a direction points through: the axis of largest magnitude, x before y
/// before z when equal, so every direction belongs to one face.
SDAG_HD inline uint32_t faceOf(const glm::vec3& d) {
    const glm::vec3 a = glm::abs(d);
    if (a.x >= a.y && a.x >= a.z)
        return d.x < 0.0f ? 1 : 0;
    if (a.y >= a.z)
        return d.y < 0.0f ? 3 : 2;
    return d.z < 0.0f ? 5 : 4;
}

/// Returns the texel (or page, or cell) that holds face coordinate u in [-1, 1] when `count` of
/// them divide the face; clamped. Half open: a border belongs to the upper one. Monotone in u,
/// which the conservative masks rely on.
SDAG_HD inline uint32_t faceCell(float u, uint32_t count) {
    const float s = (u + 1.0f) * (0.5f * float(count));
    if (!(s > 0.0f)) // NaN as well
        return 0;
    const uint32_t cell = s < float(count) ? uint32_t(s) : count - 1;
    return cell < count ? cell : count - 1;
}

/// Returns the face coordinate of a texel's centre.
SDAG_HD inline float faceCellCentre(int32_t cell, uint32_t count) {
    return float(2 * cell + 1 - int32_t(count)) / float(count);
}

/// Where a box lies on a face: a rectangle within [-1, 1]^2 and the depths along the face's axis,
/// in world units.
struct FaceRect {
    float uMin, uMax, vMin, vMax;
    float depthMin, depthMax; ///< depthMin >= 0
};

/// Covers what float division rounds: 2 units in the last place of 1.
constexpr float kProjectionSlack = 1e-6f;

/// Returns whether a box reaches a face, and its rectangle there: every point of the box that
/// projects on the face lies in the rectangle (conservative; a box across the edge of the face's
/// pyramid may be told to reach it when it does not). A box that holds the light reaches every
/// face, whole.
/// @param boxLight relative to the light, world axes and units
/// @param margin grows the unclamped rectangle on all sides, in face coordinates, before it is held
/// against the face
SDAG_HD inline bool projectBox(const Box& boxLight, uint32_t face, float margin, FaceRect& rect) {
    const glm::vec3 a = faceFromLight(face, boxLight.min);
    const glm::vec3 b = faceFromLight(face, boxLight.max);
    const glm::vec3 lo = glm::min(a, b);
    const glm::vec3 hi = glm::max(a, b);
    if (!(hi.z > 0.0f) || boxLight.empty())
        return false;
    const float rFar = 1.0f / hi.z;
    // u = x / z is least for the least x, at the near side when x < 0 and at the far side
    // otherwise. A near side at or behind the light leaves it unbounded; on the face it still is at
    // least -1.
    constexpr float kLeastDepth = 1e-30f; // below, 1 / z would overflow
    if (lo.z > kLeastDepth) {
        const float rNear = 1.0f / lo.z;
        rect.uMin = lo.x * (lo.x < 0.0f ? rNear : rFar);
        rect.vMin = lo.y * (lo.y < 0.0f ? rNear : rFar);
        rect.uMax = hi.x * (hi.x > 0.0f ? rNear : rFar);
        rect.vMax = hi.y * (hi.y > 0.0f ? rNear : rFar);
    } else {
        rect.uMin = lo.x < 0.0f ? -1.0f : lo.x * rFar;
        rect.vMin = lo.y < 0.0f ? -1.0f : lo.y * rFar;
        rect.uMax = hi.x > 0.0f ? 1.0f : hi.x * rFar;
        rect.vMax = hi.y > 0.0f ? 1.0f : hi.y * rFar;
    }
    const float grow = margin + kProjectionSlack;
    rect.uMin -= grow;
    rect.vMin -= grow;
    rect.uMax += grow;
    rect.vMax += grow;
    if (rect.uMin > 1.0f || rect.vMin > 1.0f || rect.uMax < -1.0f || rect.vMax < -1.0f)
        return false;
    rect.uMin = glm::max(rect.uMin, -1.0f);
    rect.vMin = glm::max(rect.vMin, -1.0f);
    rect.uMax = glm::min(rect.uMax, 1.0f);
    rect.vMax = glm::min(rect.vMax, 1.0f);
    rect.depthMin = glm::max(lo.z, 0.0f);
    rect.depthMax = hi.z;
    return true;
}

} // namespace shadowdag
