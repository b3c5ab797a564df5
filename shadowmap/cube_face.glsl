// SPDX-License-Identifier: Apache-2.0
// The faces of cube maps and their texels (cube_face.h), and the maps of a frame as shaders read them
// (GlMap of rasterize_gl.h).
#include "gl/numerics.glsl"

struct ShadowMapInfo {
    float lightX, lightY, lightZ, rangeWorld;
    uint faceTexels, facePages, pageTableStart, isSun;
    uint layer0, layer1, layer2, layer3, layer4, layer5; // of sparse textures: array << 16 | layer
    uint spare0, spare1;
    dvec4 u, v, w; // a sun's window: dot(xyz, point) - w
};
layout(std430, binding = SDAG_MAPS_BINDING) readonly buffer Maps { ShadowMapInfo maps[]; };

const uint kNoPage = 0xffffffffu;
const uint kSunFace = 4u;

uint faceLayer(ShadowMapInfo map, uint face) {
    return face < 3u ? (face == 0u ? map.layer0 : face == 1u ? map.layer1 : map.layer2)
                     : (face == 3u ? map.layer3 : face == 4u ? map.layer4 : map.layer5);
}

vec3 lightPosition(ShadowMapInfo map) { return vec3(map.lightX, map.lightY, map.lightZ); }

dvec3 windowFromWorld(ShadowMapInfo map, dvec3 p) {
    precise dvec3 q = dvec3(dotInOrder(map.u.xyz, p) - map.u.w, dotInOrder(map.v.xyz, p) - map.v.w,
                            dotInOrder(map.w.xyz, p) - map.w.w);
    return q;
}

// (u axis, v axis, depth) of a vector relative to the light.
vec3 faceFromLight(uint face, vec3 p) {
    vec3 q = face < 2u ? p.yzx : face < 4u ? p.zxy : p;
    return (face & 1u) != 0u ? vec3(q.xy, -q.z) : q;
}

dvec3 faceFromLight(uint face, dvec3 p) {
    dvec3 q = face < 2u ? p.yzx : face < 4u ? p.zxy : p;
    return (face & 1u) != 0u ? dvec3(q.xy, -q.z) : q;
}

vec3 lightFromFace(uint face, vec3 q) {
    vec3 p = (face & 1u) != 0u ? vec3(q.xy, -q.z) : q;
    return face < 2u ? p.zxy : face < 4u ? p.yzx : p;
}

uint faceOf(vec3 d) {
    vec3 a = abs(d);
    if (a.x >= a.y && a.x >= a.z)
        return d.x < 0.0 ? 1u : 0u;
    if (a.y >= a.z)
        return d.y < 0.0 ? 3u : 2u;
    return d.z < 0.0 ? 5u : 4u;
}

uint faceCell(float u, uint count) {
    precise float s = (u + 1.0) * (0.5 * float(count));
    if (!(s > 0.0))
        return 0u;
    uint cell = s < float(count) ? uint(s) : count - 1u;
    return min(cell, count - 1u);
}

float faceCellCentre(int cell, uint count) {
    return quotient(float(2 * cell + 1 - int(count)), float(count));
}

uint pageTableIndex(ShadowMapInfo map, uint face, uint x, uint y) {
    return map.pageTableStart + (face * map.facePages + y) * map.facePages + x;
}

// What lies nearer to the light than this does not block.
double nearDepth(ShadowMapInfo map) {
    const double kNearPerRange = 1.0LF / 1048576.0LF;
    return map.isSun != 0u ? kNearPerRange : double(map.rangeWorld) * kNearPerRange;
}
