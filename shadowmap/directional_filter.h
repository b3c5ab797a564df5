// SPDX-License-Identifier: Apache-2.0
// The filter of lookupVisibility (shadow_map_lookup.h) for windows of directional lights. Included
// by it only.
#pragma once

#include "shadowmap/filter_taps.h"
#include "shadowmap/shadow_map_info.h"

namespace shadowdag {

/// Returns the receiver. Derivation: the receiver's plane holds the points P + a with n.a = 0. A
/// texel along u moves a by a texel's side t along the unit u axis e, so w changes by -t (n.e) /
/// (n.s) |W|, s being the unit vector to the light and |W| the growth of w per unit of the world
/// along it; likewise along v. Positions are floats of the world, off their plane by up to r =
/// 2^-20 (|P| + |L| + R): the plane is lifted by r, which is r / (n.s) along the light, and depths
/// by r and the rounding of w. n.s is taken as at least 2^-10, because nearer to grazing the lift
/// would ignore whole blockers. The surfaces of a map at a polygon level of detail are up to
/// map.lodTexels texels above the plane, which is lifted by as much; n.s is then taken as at least
/// 1/16 (86 degrees). @param map a directional light's; the rest as lookupVisibility has them
SDAG_HD inline DirectionalReceiver makeDirectionalReceiver(const ShadowMapInfo& map,
                                                           const glm::vec3& positionWorld,
                                                           const glm::vec3& normalWorld,
                                                           float constantTexels) {
    const DirectionalWindow& window = map.window;
    return makeWindowReceiver(window.windowFromWorld(glm::dvec3(positionWorld)), window.u, window.v,
                              window.w, map.lightPositionWorld, map.rangeWorld, map.faceTexels,
                              map.lodTexels, positionWorld, normalWorld, constantTexels);
}

/// See shadow_map_lookup.h. Taps outside of the window, which only a degraded resolution has, read
/// the texel at its border.
template <class Taps>
SDAG_HD inline uint8_t
filterDirectionalVisibility(const ShadowMapInfo& map, const glm::vec3& positionWorld,
                            const glm::vec3& normalWorld, const ShadowMapBias& bias, Taps& taps) {
    const DirectionalReceiver r =
        makeDirectionalReceiver(map, positionWorld, normalWorld, bias.constantTexels);
    if (!r.isValid)
        return 0;
    const int32_t n = int32_t(map.faceTexels);
    const int32_t side = int32_t(filterSide(bias.taps));
    float fx, fy;
    int32_t x0 = windowTexel(r.x, n, fx), y0 = windowTexel(r.y, n, fy);
    moveToFirstTap(side, x0, fx);
    moveToFirstTap(side, y0, fy);
    float low = side > 1 ? kLowTapTexels * r.texelDepth : kNoLowTap;
    for (;;) {
        taps.begin(kDirectionalFace, x0, y0, side);
        float lit = 0.0f, leftOut = 0.0f;
        for (int32_t j = 0; j < side; ++j) {
            for (int32_t i = 0; i < side; ++i) {
                const float weighted = tapWeight(side, i, fx) * tapWeight(side, j, fy);
                const int32_t x = glm::clamp(x0 + i, 0, n - 1), y = glm::clamp(y0 + j, 0, n - 1);
                bool isLow;
                const float limit = windowTapLimit(r, x, y, low, isLow);
                const TapResult answer = taps.ask({kDirectionalFace, uint32_t(x), uint32_t(y)},
                                                  faceCellCentre(x, uint32_t(n)),
                                                  faceCellCentre(y, uint32_t(n)), limit, !isLow);
                if (isLow && answer != TapResult::kMissing)
                    leftOut += weighted;
                else if (answer == TapResult::kLit)
                    lit += weighted;
            }
        }
        uint32_t visibility;
        if (endsFilter(lit, leftOut, filterTotal(side), visibility))
            return uint8_t(visibility);
        low = kNoLowTap;
    }
}

} // namespace shadowdag
