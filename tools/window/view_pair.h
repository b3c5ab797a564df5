// SPDX-License-Identifier: Apache-2.0
// One pair of the selected pixel as lines in a picture: its ray, and what blocks it by each method.
#pragma once

#include "hybrid/gbuffer/view_rays.h"
#include "shadowmap/shadow_map_info.h"
#include "tools/window/view_request.h"

#include <array>
#include <vector>

namespace shadowdag {

/// The parts of a pair, by index into kPairParts; later ones are drawn over earlier ones.
enum class PairPart : uint8_t { kTriangle, kVoxel, kTexel, kRay };

/// How a part is drawn: a line on a wider one.
struct PairPartStyle {
    const char* name;
    glm::vec3 color;  ///< distinct from the others' for colour-blind readers, too
    glm::vec3 casing; ///< of the wider line, so that the part is seen on any surface
};
extern const std::array<PairPartStyle, 4> kPairParts;

/// A line in pixels of the picture; 0 is the centre of the first.
struct PairLine {
    PairPart part;
    glm::dvec2 from, to;
};

/// Returns a pair's lines as a camera sees them, hidden or not, cut at the near plane and at the
/// picture's border.
std::vector<PairLine> pairLines(const ViewRays& view, const PairGeometry& pair);

/// Returns the corners, in order, of the texel of a map that a point's ray from the light crosses,
/// at the point's depth.
std::array<glm::vec3, 4> texelCorners(const ShadowMapInfo& map, const glm::vec3& pointWorld);

/// Returns the index of the pair that is drawn: that of a light or, if the pixel has no pair with
/// it, the first that the truth finds dark, or the first; -1 if there is none.
int drawnPair(const PixelReport& pixel, int light);

} // namespace shadowdag
