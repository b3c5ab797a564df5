// SPDX-License-Identifier: Apache-2.0
// The one shading formula of frames, of pictures of the truth and of reports: diffuse surfaces under point and spot lights.
#pragma once

#include "hybrid/pairs.h"

#include <glm/gtc/constants.hpp>

namespace shadowdag {

/// Radiance that a white surface shows where no light reaches it, so that shadows are dark in pictures and not black.
constexpr float kAmbientRadiance = 0.01f;

/// Surface of a view sample as pictures see it; shadows ignore it.
struct SurfaceColor {
    glm::vec3 albedo{0.0f};   ///< diffuse reflectance, [0, 1]
    glm::vec3 emission{0.0f}; ///< radiance
};

/// Returns the irradiance that one light of a pair adds to a sample, shadowed: irradiance * n.l * visibility / 255.
/// @param normalWorld unit geometric normal on the camera's side
/// @param visibility kLit .. 0
SDAG_HD inline glm::vec3 pairIrradiance(const Light& light, const glm::vec3& positionWorld,
                                        const glm::vec3& normalWorld, uint8_t visibility) {
    const glm::vec3 toLight = light.positionWorld - positionWorld;
    const float distance = glm::sqrt(glm::dot(toLight, toLight));
    const float cosine = glm::max(glm::dot(toLight, normalWorld) / distance, 0.0f);
    return lightIrradiance(light, positionWorld) * (cosine * (float(visibility) * (1.0f / float(kLit))));
}

/// Returns the radiance of a sample: albedo / pi * irradiance + emission + ambient.
/// @param irradiance sum of pairIrradiance over the sample's lights, ascending (the order decides the last bits)
SDAG_HD inline glm::vec3 sampleRadiance(const SurfaceColor& surface, const glm::vec3& irradiance) {
    return surface.albedo * (irradiance * glm::one_over_pi<float>() + kAmbientRadiance) + surface.emission;
}

} // namespace shadowdag
