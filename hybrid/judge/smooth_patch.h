// SPDX-License-Identifier: Apache-2.0
// The surface that continues a receiver smoothly: what shadows it there is the receiver itself.
#pragma once

#include "hybrid/judge/truth.h"

#include <vector>

namespace shadowdag {

/// The cosine of 45 degrees: the largest angle between the planes of two triangles of one smooth
/// surface. The sides of a box are at 90 degrees; of a round column of eight sides, at 45.
constexpr double kSmoothCosine = 0.70710678;

/// Returns the triangles, with the receiver's first, that come within `radiusWorld` of a sample,
/// whose planes are within 45 degrees of the receiver's, and that a chain of such triangles
/// connects with the receiver, consecutive ones sharing a vertex (the same three floats: meshes
/// repeat vertices along seams of their attributes). Cost: n log n of the triangles within the
/// radius.
/// @param receiver a triangle, not kBackground
std::vector<uint32_t> smoothPatch(const Truth& truth, const TriangleView& triangles,
                                  uint32_t receiver, const glm::vec3& sampleWorld,
                                  double radiusWorld);

} // namespace shadowdag
