// SPDX-License-Identifier: Apache-2.0
// Shadow rays: shadow_rays.h at level 0, and where rays to a directional light end (directional_rays.h). Part of shade.comp.

#include "hybrid/gl/mover_rays.glsl"

vec3 rayEnd(Light light, vec3 point) {
    vec3 end = pointAtLight(light, point);
    if (light.kind != kDirectionalLight)
        return end;
    precise double beyond = 4.0LF + 2.0LF * double(rayOffset);
    dvec3 voxel = endWithinCube(1u << dagResolutionLog2, voxelFromWorld(dvec3(point)),
                                voxelFromWorld(dvec3(end)), beyond);
    return vec3(worldAt(voxel, gridOrigin, voxelSize));
}

bool isDarkByRays(Light light, uint lightIndex, uint receiver, vec3 point, vec3 normal, inout uint moverTests) {
    if (occluded(shadowSegment(point, normal, rayEnd(light, point), rayOffset)))
        return true;
    if (!mayShadow(lightIndex))
        return false;
    ++moverTests;
    return isDarkByMovers(truthPairRay(point, normal, receiver, pointAtLight(light, point)));
}
