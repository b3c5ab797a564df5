// SPDX-License-Identifier: Apache-2.0
// The shadow maps of a frame in the layout of shaders (GlMap of rasterize_gl.h).
#include "shadowmap/cube_face_leaf.h"

struct ShadowMapInfo {
    float lightX, lightY, lightZ, rangeWorld;
    uint faceTexels, facePages, pageTableStart, isDirectional;
    uint layer0, layer1, layer2, layer3, layer4, layer5; // of sparse textures: array << 16 | layer
    uint spare0, spare1;
    dvec4 u, v, w; // a directional light's window: dot(xyz, point) - w
};
layout(std430, binding = SDAG_MAPS_BINDING) readonly buffer Maps { ShadowMapInfo maps[]; };

uint faceLayer(ShadowMapInfo map, uint face) {
    return face < 3u ? (face == 0u ? map.layer0 : face == 1u ? map.layer1 : map.layer2)
                     : (face == 3u ? map.layer3 : face == 4u ? map.layer4 : map.layer5);
}

vec3 lightPosition(ShadowMapInfo map) { return vec3(map.lightX, map.lightY, map.lightZ); }

dvec3 windowFromWorld(ShadowMapInfo map, dvec3 p) {
    return windowPoint(map.u.xyz, map.v.xyz, map.w.xyz, dvec3(map.u.w, map.v.w, map.w.w), p);
}

uint pageTableIndex(ShadowMapInfo map, uint face, uint x, uint y) {
    return pageTableIndexOf(map.pageTableStart, map.facePages, face, x, y);
}

// Surfaces nearer to the light than this do not block.
double nearDepth(ShadowMapInfo map) {
    return nearDepthOf(map.isDirectional != 0u, map.rangeWorld);
}
