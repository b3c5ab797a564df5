// SPDX-License-Identifier: Apache-2.0
// The rectangles that boxes cover on the six faces of a cube map (cube_face_leaf.h). Source: Olsson
// et al. 2015, appendix A, Listing 1; as printed it rejects no box, so two rejections come first
// here.
#pragma once

#include "scenes/box.h"
#include "shadowmap/cube_face_leaf.h"

#include <cstdint>

namespace shadowdag {

/// The part of a face that a box covers: a rectangle within [-1, 1]^2 and the depths along the
/// face's axis, in world units.
struct FaceRect {
    float uMin, uMax, vMin, vMax;
    float depthMin, depthMax; ///< depthMin >= 0
};

/// Covers the rounding of float division: 2 units in the last place of 1.
constexpr float kProjectionSlack = 1e-6f;

/// Returns whether a box reaches a face, and its rectangle there: every point of the box that
/// projects on the face lies in the rectangle. Conservative: the result may be true for a box
/// across the edge of the face's pyramid that misses the face. A box that contains the light
/// reaches every face completely.
/// @param boxLight relative to the light, world axes and units
/// @param margin grows the unclamped rectangle on all sides, in face coordinates, before it is
/// clamped to the face
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
    constexpr float kLeastDepth = 1e-30f; // below this, 1 / z would overflow
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
