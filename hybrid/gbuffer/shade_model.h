// SPDX-License-Identifier: Apache-2.0
// The light that a view sample sends to the camera: the sum that the shading pass computes, and
// pictures made from other visibilities. Lambert's diffuse reflection, because nothing else matters
// to shadows.
#pragma once

#include "scenes/light.h"

namespace shadowdag {

/// The properties of a material that pictures use.
struct SurfaceColor {
    glm::vec3 baseColor{0.8f}; ///< diffuse albedo
    glm::vec3 emission{0.0f};  ///< radiance
};

/// Returns the radiance of a sample without any light: emission and the ambient constant.
SDAG_HD inline glm::vec3 unlitRadiance(const SurfaceColor& surface) {
    return surface.emission + surface.baseColor * kAmbientRadiance;
}

/// Returns the radiance that one light adds to a sample: irradiance * n.l * visibility * albedo /
/// pi. Call it for pairs only (pairs.h); lights are added in ascending order, so that sums are
/// equal bit for bit.
/// @param positionWorld,normalWorld the sample and its unit normal on the light's side
/// @param visibility 255 lit .. 0 dark
SDAG_HD inline glm::vec3 reflectedRadiance(const Light& light, const glm::vec3& positionWorld,
                                           const glm::vec3& normalWorld,
                                           const SurfaceColor& surface, uint8_t visibility) {
    return reflectedLight(lightIrradiance(light, positionWorld), towardsLight(light, positionWorld),
                          normalWorld, surface.baseColor, visibility);
}

} // namespace shadowdag
