// SPDX-License-Identifier: Apache-2.0
// Punctual lights in world space, and the light that one sends to a point without shadows. The rays
// of a directional light are parallel. Other code uses the functions here and does not distinguish
// the kinds. A leaf text (gl/leaf.h).
#pragma once

#include "gl/leaf.h"

SDAG_LEAF_BEGIN

SDAG_CONST uint kPointLight = 0u, kSpotLight = 1u, kDirectionalLight = 2u;

/// A point or spot light in world space with a finite range (sphere of influence), or a directional
/// light, which has neither position nor range: its sphere is one that contains the whole scene
/// (World sets it), so that tests of spheres need not distinguish it. Metres.
struct Light {
#ifdef __cplusplus
    enum Kind : uint32_t { kPoint = kPointLight, kSpot = kSpotLight, kSun = kDirectionalLight };

    glm::vec3 positionWorld{0.0f};
    float rangeWorld = 0.0f;   ///< > 0; the light is exactly zero from here on
    glm::vec3 intensity{1.0f}; ///< colour times intensity, candela; lux for directional lights
    Kind kind = kPoint;
    glm::vec3 directionWorld{0, 0, -1};    ///< unit; direction of a spot or directional light
    float cosInner = 1.0f;                 ///< cosine of the cone of full light, > cosOuter
    float cosOuter = -1.0f;                ///< cosine of the cone outside which a spot is dark
    uint32_t isMoving = 0;                 ///< 1 when an animation moves it
    float directionalDistanceWorld = 0.0f; ///< directional lights: see pointAtLight; a power of two
#else
    vec3 positionWorld;
    float rangeWorld;
    vec3 intensity;
    uint kind;
    vec3 directionWorld;
    float cosInner, cosOuter;
    uint isMoving;
    float directionalDistanceWorld;
#endif
};

/// Returns the point from which a light shines on a point: its position, or, for a directional
/// light, a point towards it beyond the whole scene, directionalDistanceWorld away. A surface
/// shadows the point if it blocks the segment between the two. A directional light's point is
/// rounded to float, which turns the segment by less than 2^-23.
SDAG_LEAF vec3 pointAtLight(SDAG_IN(Light) light, SDAG_IN(vec3) pointWorld) {
    SDAG_EXACT vec3 beyond = pointWorld - light.directionWorld * light.directionalDistanceWorld;
    return light.kind == kDirectionalLight ? beyond : light.positionWorld;
}

/// Returns a vector from a point towards the light, of any length.
SDAG_LEAF vec3 towardsLight(SDAG_IN(Light) light, SDAG_IN(vec3) pointWorld) {
    SDAG_EXACT vec3 way = light.positionWorld - pointWorld;
    return light.kind == kDirectionalLight ? -light.directionWorld : way;
}

/// Returns whether the light reaches a point at all, ignoring shadows and normals: nearer than the
/// range (half open: a point at exactly the range is out), not at the light itself, and inside a
/// spot's outer cone. A directional light reaches every point.
SDAG_LEAF bool lightReaches(SDAG_IN(Light) light, SDAG_IN(vec3) pointWorld) {
    if (light.kind == kDirectionalLight)
        return true;
    SDAG_EXACT vec3 toLight = light.positionWorld - pointWorld;
    float d2 = dotInOrder(toLight, toLight);
    SDAG_EXACT float range2 = light.rangeWorld * light.rangeWorld;
    if (!(d2 < range2) || d2 == 0.0f)
        return false;
    if (light.kind == kSpotLight) {
        float along = -dotInOrder(toLight, light.directionWorld);
        float limit = light.cosOuter; // along > cosOuter * |toLight|, without the root
        SDAG_EXACT float s = along * along - limit * limit * d2;
        if (limit >= 0.0f ? !(along > 0.0f && s > 0.0f) : (along < 0.0f && s >= 0.0f))
            return false;
    }
    return true;
}

/// Returns whether the light would light a sample without occluders.
/// @param normalWorld on the visible side
SDAG_LEAF bool lightsSample(SDAG_IN(Light) light, SDAG_IN(vec3) pointWorld,
                            SDAG_IN(vec3) normalWorld) {
    return lightReaches(light, pointWorld) &&
           dotInOrder(towardsLight(light, pointWorld), normalWorld) > 0.0f;
}

/// Returns the unshadowed irradiance per unit n.l that the light sends to a point that it reaches:
/// intensity over the squared distance, windowed to reach zero at the range, times the spot's cone;
/// constant for a directional light. Source: Khronos, KHR_lights_punctual, "Range Property" and
/// "Inner and Outer Cone Angles".
SDAG_LEAF vec3 irradianceAt(SDAG_IN(Light) light, SDAG_IN(vec3) pointWorld) {
    if (light.kind == kDirectionalLight)
        return light.intensity;
    SDAG_EXACT vec3 toLight = light.positionWorld - pointWorld;
    float d2 = dotInOrder(toLight, toLight);
    SDAG_EXACT float range2 = light.rangeWorld * light.rangeWorld;
    float q2 = quotient(d2, range2);
    SDAG_EXACT float window = 1.0f - q2 * q2;
    SDAG_EXACT float scale = quotient(window, d2);
    if (light.kind == kSpotLight) {
        float c = quotient(-dotInOrder(toLight, light.directionWorld), squareRoot(d2));
        SDAG_EXACT float past = c - light.cosOuter;
        SDAG_EXACT float width = greater(light.cosInner - light.cosOuter, 1e-4f);
        SDAG_EXACT float t = lesser(greater(quotient(past, width), 0.0f), 1.0f);
        scale *= t * t;
    }
    SDAG_EXACT vec3 irradiance = light.intensity * scale;
    return irradiance;
}

/// Returns irradianceAt, and black where the light does not reach the point.
SDAG_LEAF vec3 lightIrradiance(SDAG_IN(Light) light, SDAG_IN(vec3) pointWorld) {
    return lightReaches(light, pointWorld) ? irradianceAt(light, pointWorld) : vec3(0.0f);
}

/// Radiance that every surface of albedo 1 has in full shadow, so that a picture shows dark areas.
/// Not light transport: a constant.
SDAG_CONST float kAmbientRadiance = 0.02f;
SDAG_CONST float kInversePi = 0.318309886f;

/// Returns the radiance that one light adds to a sample: irradiance * n.l * visibility * albedo /
/// pi.
/// @param toLight towardsLight @param normalWorld unit, on the light's side
/// @param visibility 255 lit .. 0 dark
SDAG_LEAF vec3 reflectedLight(SDAG_IN(vec3) irradiance, SDAG_IN(vec3) toLight,
                              SDAG_IN(vec3) normalWorld, SDAG_IN(vec3) albedo, uint visibility) {
    float cosine =
        quotient(dotInOrder(toLight, normalWorld), squareRoot(dotInOrder(toLight, toLight)));
    SDAG_EXACT float scale = cosine * (float(visibility) * (1.0f / 255.0f)) * kInversePi;
    SDAG_EXACT vec3 radiance = irradiance * albedo * scale;
    return radiance;
}

SDAG_LEAF_END
