// SPDX-License-Identifier: Apache-2.0
// The one shading pass: rays through the DAG and lookups in the maps, sample by sample (shade.h).
layout(local_size_x = SDAG_GROUP_SIZE) in;
#include "gl/groups.glsl"
#include "gl/numerics.glsl"
#include "shadowmap/lookup.glsl"
#include "voxel/dag_trace.glsl"

struct Sample { // GlSample of shade_gl.cpp
    float x, y, z;
    uint triangle;
    float normalX, normalY, normalZ;
    uint material;
    uint pixel, cluster, firstPair, endPair;
};
struct Light { // scenes/light.h
    float x, y, z, range;
    float red, green, blue;
    uint kind;
    float directionX, directionY, directionZ;
    float cosInner, cosOuter;
    uint isMoving;
    float sunDistance;
};
struct Surface {
    float red, green, blue, emissionRed, emissionGreen, emissionBlue;
};
layout(std430, binding = 0) readonly buffer Samples { Sample samples[]; };
layout(std430, binding = 2) readonly buffer Lights { Light lights[]; };
layout(std430, binding = 3) readonly buffer Surfaces { Surface surfaces[]; };
layout(std430, binding = 4) readonly buffer ClusterStarts { uint clusterStarts[]; };
layout(std430, binding = 7) readonly buffer ClusterLights { uvec2 clusterLights[]; }; // light, PairServer
layout(std430, binding = 8) writeonly buffer Colors { float colors[]; };    // three a pixel
layout(std430, binding = 9) buffer Counts { uint counts[]; }; // SDAG_COUNTS_PER_CLUSTER each
// By pair: its light before; SDAG_ANSWERED, its PairServer and its visibility after.
layout(std430, binding = 10) buffer Pairs { uint pairs[]; };
uniform uint sampleCount, isRecording;
uniform float rayOffset;

const uint kPoint = 0u, kSpot = 1u, kSun = 2u;
const uint kRayCount = 0u, kLookupCount = 1u, kProvenCount = 2u, kMissingTapCount = 3u,
           kMoverTestCount = 4u;

vec3 position(Light light) { return vec3(light.x, light.y, light.z); }
vec3 direction(Light light) { return vec3(light.directionX, light.directionY, light.directionZ); }

vec3 towardsLight(Light light, vec3 point) {
    precise vec3 way = position(light) - point;
    return light.kind == kSun ? -direction(light) : way;
}

bool lightReaches(Light light, vec3 point) {
    if (light.kind == kSun)
        return true;
    precise vec3 toLight = position(light) - point;
    float d2 = dotInOrder(toLight, toLight);
    precise float range2 = light.range * light.range;
    if (!(d2 < range2) || d2 == 0.0)
        return false;
    if (light.kind == kSpot) {
        float along = -dotInOrder(toLight, direction(light));
        float limit = light.cosOuter;
        precise float s = along * along - limit * limit * d2;
        if (limit >= 0.0 ? !(along > 0.0 && s > 0.0) : (along < 0.0 && s >= 0.0))
            return false;
    }
    return true;
}

bool isPair(Light light, vec3 point, vec3 normal) {
    return lightReaches(light, point) && dotInOrder(towardsLight(light, point), normal) > 0.0;
}

vec3 irradiance(Light light, vec3 point) {
    vec3 intensity = vec3(light.red, light.green, light.blue);
    if (light.kind == kSun)
        return intensity;
    precise vec3 toLight = position(light) - point;
    float d2 = dotInOrder(toLight, toLight);
    float q2 = quotient(d2, light.range * light.range);
    precise float window = 1.0 - q2 * q2;
    float scale = quotient(window, d2);
    if (light.kind == kSpot) {
        float c = quotient(-dotInOrder(toLight, direction(light)), sqrt(d2));
        float t = clamp(quotient(c - light.cosOuter, max(light.cosInner - light.cosOuter, 1e-4)), 0.0, 1.0);
        scale *= t * t;
    }
    return intensity * scale;
}

vec3 reflectedRadiance(Light light, vec3 point, vec3 normal, vec3 albedo, uint visibility) {
    const float kInversePi = 0.318309886;
    vec3 toLight = towardsLight(light, point);
    float cosine = quotient(dotInOrder(toLight, normal), sqrt(dotInOrder(toLight, toLight)));
    precise float scale = cosine * (float(visibility) * (1.0 / 255.0)) * kInversePi;
    return irradiance(light, point) * albedo * scale;
}

#include "hybrid/gl/shadow_rays.glsl"

void main() {
    uint item = itemIndex();
    if (item >= sampleCount)
        return;
    Sample s = samples[item];
    vec3 point = vec3(s.x, s.y, s.z), normal = vec3(s.normalX, s.normalY, s.normalZ);
    Surface surface = surfaces[s.material];
    vec3 albedo = vec3(surface.red, surface.green, surface.blue);
    const float kAmbientRadiance = 0.02;
    precise vec3 sum = vec3(surface.emissionRed, surface.emissionGreen, surface.emissionBlue) +
                       albedo * kAmbientRadiance;
    uint counted[SDAG_COUNTS_PER_CLUSTER];
    for (uint i = 0u; i < SDAG_COUNTS_PER_CLUSTER; ++i)
        counted[i] = 0u;
    uint nextPair = s.firstPair;
    for (uint l = clusterStarts[s.cluster]; l < clusterStarts[s.cluster + 1u]; ++l) {
        uint lightIndex = clusterLights[l].x, server = clusterLights[l].y;
        uint servedBy = server & ((1u << SDAG_SERVER_METHOD_BITS) - 1u);
        Light light = lights[lightIndex];
        // What the processor listed decides when it listed, so that answers stand where it looks.
        bool isAsked = isRecording != 0u
                           ? nextPair < s.endPair && pairs[nextPair] == lightIndex
                           : isPair(light, point, normal);
        if (!isAsked)
            continue;
        uint visibility = 255u;
        if (servedBy == SDAG_SERVED_BY_PROOF) {
            ++counted[kProvenCount];
        } else if (servedBy == SDAG_SERVED_BY_RAYS) {
            ++counted[kRayCount];
            visibility = isDarkByRays(light, lightIndex, s.triangle, point, normal, counted[kMoverTestCount])
                             ? 0u
                             : 255u;
        } else {
            ++counted[kLookupCount];
            visibility = lookupVisibility(server >> SDAG_SERVER_METHOD_BITS, point, normal);
            counted[kMissingTapCount] += missingTapCount;
        }
        if (isRecording != 0u)
            pairs[nextPair++] = SDAG_ANSWERED | server << SDAG_VISIBILITY_BITS | visibility;
        if (visibility != 0u)
            sum += reflectedRadiance(light, point, normal, albedo, visibility);
    }
    colors[3u * s.pixel] = sum.r;
    colors[3u * s.pixel + 1u] = sum.g;
    colors[3u * s.pixel + 2u] = sum.b;
    for (uint i = 0u; i < SDAG_COUNTS_PER_CLUSTER; ++i)
        if (counted[i] != 0u)
            atomicAdd(counts[SDAG_COUNTS_PER_CLUSTER * s.cluster + i], counted[i]);
}
