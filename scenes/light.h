// SPDX-License-Identifier: Apache-2.0
// Punctual lights in world space, and the light that one sends to a point without shadows. A sun is
// a directional light: its rays are parallel. Other code uses the functions here and does not
// distinguish it.
#pragma once

#include "cuda/macros.h"

#include <glm/glm.hpp>

#include <cstdint>

namespace shadowdag {

/// A point or spot light in world space with a finite range (sphere of influence), or a sun, which
/// has neither place nor range: its sphere is one that holds the whole scene (World sees to it), so
/// that whoever asks which light's sphere reaches what needs not know suns. Metres.
struct Light {
    enum Kind : uint32_t { kPoint = 0, kSpot = 1, kSun = 2 };

    glm::vec3 positionWorld{0.0f};
    float rangeWorld = 0.0f;   ///< > 0; the light is exactly zero from here on
    glm::vec3 intensity{1.0f}; ///< colour times intensity, candela; of a sun lux
    Kind kind = kPoint;
    glm::vec3 directionWorld{0, 0, -1}; ///< unit; where a spot points, where a sun's light goes
    float cosInner = 1.0f;              ///< cosine of the cone of full light, > cosOuter
    float cosOuter = -1.0f;             ///< cosine of the cone outside which a spot is dark
    uint32_t isMoving = 0;              ///< 1 when an animation moves it
    float sunDistanceWorld = 0.0f;      ///< of a sun: see pointAtLight; a power of two
};

/// Returns the point from which a light shines on a point: its place, or, of a sun, a point
/// straight towards it beyond the whole scene, sunDistanceWorld away. What shadows the point blocks
/// the segment between the two. A sun's is rounded to float, which turns the segment by less than
/// 2^-23.
SDAG_HD inline glm::vec3 pointAtLight(const Light& light, const glm::vec3& pointWorld) {
    return light.kind == Light::kSun ? pointWorld - light.directionWorld * light.sunDistanceWorld
                                     : light.positionWorld;
}

/// Returns a vector from a point towards the light, of any length.
SDAG_HD inline glm::vec3 towardsLight(const Light& light, const glm::vec3& pointWorld) {
    return light.kind == Light::kSun ? -light.directionWorld : light.positionWorld - pointWorld;
}

/// Returns whether the light reaches a point at all, shadows and normals aside: nearer than the
/// range (half open: a point at the range exactly is out), not at the light itself, and inside a
/// spot's outer cone. A sun reaches every point.
SDAG_HD inline bool lightReaches(const Light& light, const glm::vec3& pointWorld) {
    if (light.kind == Light::kSun)
        return true;
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
/// the squared distance, windowed to reach zero at the range, times the spot's cone; a sun's is the
/// same everywhere. Source: Khronos, KHR_lights_punctual, "Range Property" and "Inner and Outer
/// Cone Angles".
SDAG_HD inline glm::vec3 lightIrradiance(const Light& light, const glm::vec3& pointWorld) {
    if (!lightReaches(light, pointWorld))
        return glm::vec3(0.0f);
    if (light.kind == Light::kSun)
        return light.intensity;
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
