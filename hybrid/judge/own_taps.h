// SPDX-License-Identifier: Apache-2.0
// The taps of a lookup in a cube map or in a directional light's window, made in double from the
// documented geometry of maps (shadowmap/shadow_map_lookup.h, shadowmap/cube_face_leaf.h,
// shadowmap/directional_window.h, shadowmap/directional_filter.h) without any of the method's code,
// so that a fault of its geometry cannot excuse itself.
#pragma once

#include "scenes/light_leaf.h"
#include "shadowmap/shadow_map_lookup.h"

#include <functional>
#include <vector>

namespace shadowdag {

/// One tap. A surface at light + centre / w, w > limit, makes it dark; in a window one at (centre,
/// w).
struct OwnTap {
    uint32_t face, x, y; ///< the texel
    /// Light to the texel's centre, world axes, 1 along the face's axis; in a window its u and v,
    /// and 0.
    glm::dvec3 centre;
    double weight; ///< of all taps: 1
    double limit;  ///< 1/z, or w, at the receiver's planes, with the bias
    double slack;  ///< a depth within this of the limit may lie on either side: rounding decides
    bool isLow;    ///< omitted: it tests another place
};

/// The taps of a receiver.
struct OwnTaps {
    std::vector<OwnTap> taps; ///< empty for a receiver at the light
    /// Whether rounding may choose other texels: the receiver is within 2^-12 texels of where the
    /// filter moves on, or of another face.
    bool isAtBorder = false;

    /// Returns the weighted share of taps that are not dark, 0 to 1; omitted taps count only if all
    /// are omitted, or if they are on a page without memory: these are dark.
    /// @param isDark of a tap @param isMissing whether its page has no memory
    double visibility(
        const std::function<bool(const OwnTap&)>& isDark,
        const std::function<bool(const OwnTap&)>& isMissing = [](const OwnTap&) {
            return false;
        }) const;
};

/// Returns whether a map is one of a light: about its position, with its range; a directional
/// light's window looks along it. Taps in the map of another light say nothing about a pair.
bool isMapOf(const ShadowMapInfo& map, const Light& light);

/// Returns the taps of a receiver. @param positionWorld finite; all as lookupVisibility has them
OwnTaps makeOwnTaps(const ShadowMapInfo& map, const glm::vec3& positionWorld,
                    const glm::vec3& normalWorld, const ShadowMapBias& bias);

/// A tap's ray, in the world: from the light, or from before the near end of a window's depths, to
/// the receiver's planes.
struct OwnTapRay {
    glm::vec3 startWorld, endWorld;
};

/// Returns the ray of a tap. @param map that it is a tap of
OwnTapRay ownTapRay(const ShadowMapInfo& map, const OwnTap& tap);

/// Returns what makes a receiver dark by a map's stored depths: the nearest of the blocking texels,
/// its side there, and how many taps are on pages without memory. texelWorld is 0 where no stored
/// depth blocks. @param taps of that map
ShadowMapTrace ownTrace(const ShadowMapView& maps, uint32_t mapIndex, const OwnTaps& taps);

/// Returns the least and the greatest visibility, 0 to 1, that a map's stored depths give; they
/// differ where a depth is within rounding of a limit. Taps on pages without memory are dark.
glm::dvec2 ownVisibility(const ShadowMapView& maps, uint32_t mapIndex, const OwnTaps& taps);

} // namespace shadowdag
