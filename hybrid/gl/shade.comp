// SPDX-License-Identifier: Apache-2.0
// The one shading pass: rays through the DAG and lookups in the maps, sample by sample (shade.h).
layout(local_size_x = SDAG_GROUP_SIZE) in;
#include "gl/groups.glsl"
#include "scenes/light_leaf.h"
#include "shadowmap/lookup.glsl"
#include "voxel/dag_trace.glsl"

struct Sample { // GlSample of shade_gl.cpp
    float x, y, z;
    uint triangle;
    float normalX, normalY, normalZ;
    uint material;
    uint pixel, cluster, firstPair, endPair;
};
struct LightWords { // Light of scenes/light_leaf.h, without a vec3's padding
    float x, y, z, range, red, green, blue;
    uint kind;
    float directionX, directionY, directionZ, cosInner, cosOuter;
    uint isMoving;
    float directionalDistance;
};
struct Surface {
    float red, green, blue, emissionRed, emissionGreen, emissionBlue;
};
layout(std430, binding = 0) readonly buffer Samples { Sample samples[]; };
layout(std430, binding = 2) readonly buffer Lights { LightWords lights[]; };
layout(std430, binding = 3) readonly buffer Surfaces { Surface surfaces[]; };
layout(std430, binding = 4) readonly buffer ClusterStarts { uint clusterStarts[]; };
layout(std430, binding = 7) readonly buffer ClusterLights { uvec2 clusterLights[]; }; // light, PairServer
layout(std430, binding = 8) writeonly buffer Colors { float colors[]; };    // three a pixel
layout(std430, binding = 9) buffer Counts { uint counts[]; }; // SDAG_COUNTS_PER_CLUSTER each
// By pair: its light before; SDAG_ANSWERED, its PairServer and its visibility after.
layout(std430, binding = 10) buffer Pairs { uint pairs[]; };
uniform uint sampleCount, isRecording;
uniform float rayOffset;

const uint kRayCount = 0u, kLookupCount = 1u, kProvenCount = 2u, kMissingTapCount = 3u,
           kMoverTestCount = 4u;

Light lightAt(uint index) {
    LightWords w = lights[index];
    return Light(vec3(w.x, w.y, w.z), w.range, vec3(w.red, w.green, w.blue), w.kind,
                 vec3(w.directionX, w.directionY, w.directionZ), w.cosInner, w.cosOuter, w.isMoving,
                 w.directionalDistance);
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
    precise vec3 sum = vec3(surface.emissionRed, surface.emissionGreen, surface.emissionBlue) +
                       albedo * kAmbientRadiance;
    uint counted[SDAG_COUNTS_PER_CLUSTER];
    for (uint i = 0u; i < SDAG_COUNTS_PER_CLUSTER; ++i)
        counted[i] = 0u;
    uint nextPair = s.firstPair;
    for (uint l = clusterStarts[s.cluster]; l < clusterStarts[s.cluster + 1u]; ++l) {
        uint lightIndex = clusterLights[l].x, server = clusterLights[l].y;
        uint servedBy = server & ((1u << SDAG_SERVER_METHOD_BITS) - 1u);
        Light light = lightAt(lightIndex);
        // What the processor listed decides when it listed, so that answers stand where it looks.
        bool isAsked = isRecording != 0u
                           ? nextPair < s.endPair && pairs[nextPair] == lightIndex
                           : lightsSample(light, point, normal);
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
            sum += reflectedLight(irradianceAt(light, point), towardsLight(light, point), normal, albedo,
                                  visibility);
    }
    colors[3u * s.pixel] = sum.r;
    colors[3u * s.pixel + 1u] = sum.g;
    colors[3u * s.pixel + 2u] = sum.b;
    for (uint i = 0u; i < SDAG_COUNTS_PER_CLUSTER; ++i)
        if (counted[i] != 0u)
            atomicAdd(counts[SDAG_COUNTS_PER_CLUSTER * s.cluster + i], counted[i]);
}
