// SPDX-License-Identifier: Apache-2.0
// The filter of lookupVisibility (shadow_map_lookup.h) for windows of a sun. Not used by itself.
#pragma once

#include "shadowmap/filter_taps.h"
#include "shadowmap/shadow_map_info.h"

namespace shadowdag {

/// A receiver in a window of a sun, as the filter's taps are compared with it: places in texels,
/// depths as w relative to the receiver's.
///
/// Derivation. The receiver's plane holds the points P + a with n.a = 0. A texel along u moves a by
/// a texel's side t along the unit u axis e, so w changes by -t (n.e) / (n.s) |W|, s being the unit
/// vector to the sun and |W| what w grows by in a unit of the world along it; likewise along v.
/// Positions are floats of the world, off their plane by up to r = 2^-20 (|P| + |L| + R): the
/// plane is lifted by r, which is r / (n.s) along the light, and depths by r and what w rounds.
/// n.s is taken as 2^-10 at least: nearer to grazing the lift would forgive whole blockers. What a
/// map at a polygon level of detail holds stands up to map.lodTexels texels above the plane, which
/// is lifted by as much; n.s is then taken as 1/16 at least (86 degrees).
struct SunReceiver {
    double x, y;          ///< place in texels
    float w;              ///< depth
    float slopeX, slopeY; ///< of the receiver's plane: w a texel; 0 when it does not face the sun
    float own, across;    ///< what the plane and the depth are lifted by
    float forgiven;       ///< nearer blockers count: the bias
    float texelDepth;     ///< w a texel
    bool isValid;         ///< the position is a number
};

/// Returns the receiver. @param map a sun's; the rest as lookupVisibility has them
SDAG_HD inline SunReceiver makeSunReceiver(const ShadowMapInfo& map, const glm::vec3& positionWorld,
                                           const glm::vec3& normalWorld, float constantTexels) {
    const SunWindow& window = map.window;
    const glm::dvec3 q = window.windowFromWorld(glm::dvec3(positionWorld));
    const double half = 0.5 * double(map.faceTexels);
    const double perWorld = glm::sqrt(glm::dot(window.w, window.w)); // |W|
    const double perWindow = glm::sqrt(glm::dot(window.u, window.u));
    const double texel = 1.0 / (perWindow * half);

    SunReceiver r;
    r.isValid = q.x == q.x && q.y == q.y && q.z == q.z;
    r.x = (q.x + 1.0) * half;
    r.y = (q.y + 1.0) * half;
    r.w = float(q.z);
    r.texelDepth = float(texel * perWorld);
    r.forgiven = constantTexels * r.texelDepth;
    const glm::vec3 largest = glm::abs(positionWorld) + glm::abs(map.lightPositionWorld);
    constexpr double kRounding = 1.0 / double(1 << 20);
    const double rounding =
        kRounding *
        (double(glm::max(largest.x, glm::max(largest.y, largest.z))) + double(map.rangeWorld)) *
        perWorld;
    constexpr float kDepthRounding = 1.0f / float(1 << 22); // two halves of an ulp of w, and again
    r.across = float(rounding) + kDepthRounding;
    const glm::dvec3 n(normalWorld);
    const double facing = glm::dot(n, window.w) / perWorld;
    const bool faces = facing > 0.0;
    const double steep = faces ? -texel * perWorld / (facing * perWindow) : 0.0;
    r.slopeX = float(steep * glm::dot(n, window.u));
    r.slopeY = float(steep * glm::dot(n, window.v));
    constexpr double kLeastFacing = 1.0 / 1024.0;
    r.own = faces ? float(rounding / glm::max(facing, kLeastFacing)) + kDepthRounding : r.across;
    if (faces && map.lodTexels > 0.0f)
        r.own += map.lodTexels * r.texelDepth / glm::max(float(facing), kLeastFacingOfLevels);
    return r;
}

/// See shadow_map_lookup.h. Taps outside of the window, which only a degraded resolution has, are
/// answered by the texel at its border.
template <class Taps>
SDAG_HD inline uint8_t filterSunVisibility(const ShadowMapInfo& map, const glm::vec3& positionWorld,
                                           const glm::vec3& normalWorld, const ShadowMapBias& bias,
                                           Taps& taps) {
    const SunReceiver r = makeSunReceiver(map, positionWorld, normalWorld, bias.constantTexels);
    if (!r.isValid)
        return 0;
    const int32_t n = int32_t(map.faceTexels);
    // The first texel and the place in it, as for cubes. The double keeps its fraction far out,
    // too.
    const int32_t side = int32_t(filterSide(bias.taps));
    const double xIn = glm::clamp(r.x, 0.0, double(n)), yIn = glm::clamp(r.y, 0.0, double(n));
    int32_t x0 = int32_t(xIn) < n ? int32_t(xIn) : n - 1;
    int32_t y0 = int32_t(yIn) < n ? int32_t(yIn) : n - 1;
    float fx = float(xIn - double(x0)), fy = float(yIn - double(y0));
    if (side == 3) {
        --x0;
        --y0;
    } else if (side == 2) {
        const int32_t left = fx < 0.5f ? 1 : 0, below = fy < 0.5f ? 1 : 0;
        x0 -= left;
        y0 -= below;
        fx += float(left) - 0.5f;
        fy += float(below) - 0.5f;
    }
    const auto weight = [side](int32_t i, float f) {
        return side == 1 || i + i + 1 == side ? 1.0f : i == 0 ? 1.0f - f : f;
    };
    const float total = side == 3 ? 4.0f : 1.0f;
    float low = side > 1 ? kLowTapTexels * r.texelDepth : 1e30f;
    for (;;) {
        taps.begin(kSunFace, x0, y0, side);
        float lit = 0.0f, leftOut = 0.0f;
        for (int32_t j = 0; j < side; ++j) {
            for (int32_t i = 0; i < side; ++i) {
                const float weighted = weight(i, fx) * weight(j, fy);
                const int32_t x = glm::clamp(x0 + i, 0, n - 1), y = glm::clamp(y0 + j, 0, n - 1);
                const float dx = float(double(x) + 0.5 - r.x), dy = float(double(y) + 0.5 - r.y);
                const float own = r.slopeX * dx + r.slopeY * dy;
                const bool isLow = own > low;
                const float limit = glm::max(own + r.own, r.across) + r.forgiven;
                const TapAnswer answer =
                    taps.ask({kSunFace, uint32_t(x), uint32_t(y)}, faceCellCentre(x, uint32_t(n)),
                             faceCellCentre(y, uint32_t(n)), r.w + limit, !isLow);
                if (isLow && answer != TapAnswer::kMissing)
                    leftOut += weighted;
                else if (answer == TapAnswer::kLit)
                    lit += weighted;
            }
        }
        if (leftOut == 0.0f)
            return uint8_t(lit * (255.0f / total) + 0.5f);
        if (leftOut < 0.99f * total)
            return uint8_t(lit * (255.0f / (total - leftOut)) + 0.5f);
        low = 1e30f;
    }
}

} // namespace shadowdag
