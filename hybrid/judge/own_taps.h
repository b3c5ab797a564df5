// SPDX-License-Identifier: Apache-2.0
// The taps of a lookup in a cube map, made in double from the documented geometry of maps
// (shadowmap/shadow_map_lookup.h, shadowmap/cube_face_leaf.h) without any of the method's code, so
// that a fault of its geometry cannot excuse itself.
#pragma once

#include "shadowmap/shadow_map_lookup.h"

#include <functional>
#include <vector>

namespace shadowdag {

/// One tap. A surface at light + centre / w, w > limit, makes it dark.
struct OwnTap {
    uint32_t face, x, y; ///< the texel
    glm::dvec3 centre;   ///< light to the texel's centre, world axes, 1 along the face's axis
    double weight;       ///< of all taps: 1
    double limit;        ///< 1/z at the receiver's planes, with the bias
    bool isLow;          ///< omitted: it tests another place
};

/// The taps of a receiver.
struct OwnTaps {
    std::vector<OwnTap> taps; ///< empty for a receiver at the light
    /// Whether rounding may choose other texels: the receiver is within 2^-12 texels of where the
    /// filter moves on, or of another face.
    bool isAtBorder = false;

    /// Returns the weighted share of taps that are not dark, 0 to 1; omitted taps count only if all
    /// are omitted. @param isDark of a tap
    double visibility(const std::function<bool(const OwnTap&)>& isDark) const;
};

/// Returns the taps of a receiver. @param map not directional; the rest as lookupVisibility has
/// them
OwnTaps makeOwnTaps(const ShadowMapInfo& map, const glm::vec3& positionWorld,
                    const glm::vec3& normalWorld, const ShadowMapBias& bias);

/// Returns the least and the greatest visibility, 0 to 1, that a map's stored depths give; they
/// differ where a depth is within rounding of a limit. Taps on pages without memory are dark.
glm::dvec2 ownVisibility(const ShadowMapView& maps, uint32_t mapIndex, const OwnTaps& taps);

} // namespace shadowdag
