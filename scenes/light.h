// SPDX-License-Identifier: Apache-2.0
// Punctual lights in world space, and the light that one sends to a point without shadows.
#pragma once

#include "cuda/macros.h"

#include <glm/glm.hpp>

#include <cstdint>

namespace shadowdag {

/// A point or spot light in world space with a finite range (sphere of influence). Metres.
struct Light {
    enum Kind : uint32_t { kPoint = 0, kSpot = 1 };

    glm::vec3 positionWorld{0.0f};
    float rangeWorld = 0.0f;   ///< > 0; the light is exactly zero from here on
    glm::vec3 intensity{1.0f}; ///< colour times intensity, candela
    Kind kind = kPoint;
    glm::vec3 directionWorld{0, 0, -1}; ///< unit; where a spot points
    float cosInner = 1.0f;              ///< cosine of the cone of full light, > cosOuter
    float cosOuter = -1.0f;             ///< cosine of the cone outside which a spot is dark
    uint32_t isMoving = 0;              ///< 1 when an animation moves it
};

/// Returns whether the light reaches a point at all, shadows and normals aside: nearer than the
/// range (half open: a point at the range exactly is out), not at the light itself, and inside a
/// spot's outer cone.
SDAG_HD inline bool lightReaches(const Light& light, const glm::vec3& pointWorld) {
    const glm::vec3 toLight = light.positionWorld - pointWorld;
    const float d2 = glm::dot(toLight, toLight);
    if (!(d2 < light.rangeWorld * light.rangeWorld) || d2 == 0.0f)
        return false;
    if (light.kind == Light::kSpot) {
        const float along = -glm::dot(toLight, light.directionWorld);
        const float limit = light.cosOuter; // along > cosOuter * |toLight|, without the root
        const float s = along * along - limit * limit * d2;
        if (limit >= 0.0f ? !(along > 0.0f && s > 0.0f) : (along < 0.0f && s >= 0.0f))
            return false;
    }
    return true;
}

/// Returns the unshadowed irradiance per unit n.l that the light sends to a point: intensity over
/// the squared distance, windowed to reach zero at the range, times the spot's cone. Source:
/// Khronos, KHR_lights_punctual, "Range Property" and "Inner and Outer Cone Angles".
SDAG_HD inline glm::vec3 lightIrradiance(const Light& light, const glm::vec3& pointWorld) {
    if (!lightReaches(light, pointWorld))
        return glm::vec3(0.0f);
    const glm::vec3 toLight = light.positionWorld - pointWorld;
    const float d2 = glm::dot(toLight, toLight);
    const float q2 = d2 / (light.rangeWorld * light.rangeWorld);
    const float window = 1.0f - q2 * q2;
    float scale = window / d2;
    if (light.kind == Light::kSpot) {
        const float c = -glm::dot(toLight, light.directionWorld) / glm::sqrt(d2);
        const float t = glm::clamp(
            (c - light.cosOuter) / glm::max(light.cosInner - light.cosOuter, 1e-4f), 0.0f, 1.0f);
        scale *= t * t;
    }
    return light.intensity * scale;
}

} // namespace shadowdag
