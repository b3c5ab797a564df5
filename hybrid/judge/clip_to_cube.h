// SPDX-License-Identifier: Apache-2.0
// The part of a polygon that lies in a box.
#pragma once

#include <glm/glm.hpp>

#include <vector>

namespace shadowdag {

/// Returns the part of a convex polygon that lies in the closed box; empty when none does.
/// Source: Sutherland, Hodgman, Reentrant Polygon Clipping, CACM 1974.
std::vector<glm::dvec3> clipToCube(std::vector<glm::dvec3> polygon, const glm::dvec3& least,
                                   const glm::dvec3& most);

} // namespace shadowdag
