// SPDX-License-Identifier: Apache-2.0
// Shadow rays: shadow_rays.h at level 0, and where rays to a directional light end (directional_rays.h). Part of shade.comp.

#include "hybrid/gl/mover_rays.glsl"

// Where a segment leaves the grid grown by `beyond` voxels, or its end.
dvec3 endWithinGrid(dvec3 from, dvec3 to, double beyond) {
    precise dvec3 way = to - from;
    double far = double(1u << dagResolutionLog2) + beyond;
    precise double t = 1.0LF;
    for (int axis = 0; axis < 3; ++axis) {
        if (way[axis] == 0.0LF)
            continue;
        precise double leaves = ((way[axis] > 0.0LF ? far : -beyond) - from[axis]) / way[axis];
        t = leaves < t ? leaves : t;
    }
    precise dvec3 end = from + way * (t > 0.0LF ? t : 0.0LF);
    return t < 1.0LF ? end : to;
}

vec3 pointAtLight(Light light, vec3 point) {
    precise vec3 beyond = point - direction(light) * light.sunDistance;
    return light.kind == kSun ? beyond : position(light);
}

vec3 rayEnd(Light light, vec3 point) {
    vec3 end = pointAtLight(light, point);
    if (light.kind != kSun)
        return end;
    precise double beyond = 4.0LF + 2.0LF * double(rayOffset);
    dvec3 voxel = endWithinGrid(voxelFromWorld(dvec3(point)), voxelFromWorld(dvec3(end)), beyond);
    precise dvec3 world = gridOrigin + voxel * voxelSize;
    return vec3(world);
}

bool isDarkByRays(Light light, uint lightIndex, uint receiver, vec3 point, vec3 normal, inout uint moverTests) {
    if (occluded(shadowSegment(point, normal, rayEnd(light, point), rayOffset)))
        return true;
    if (!mayShadow(lightIndex))
        return false;
    ++moverTests;
    return isDarkByMovers(truthPairRay(point, normal, receiver, pointAtLight(light, point)));
}
