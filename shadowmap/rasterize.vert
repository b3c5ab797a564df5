// SPDX-License-Identifier: Apache-2.0
// Projects a corner of a triangle onto a face of a map, and computes the part of the set-up of
// rasterize.h that the hardware does not. The viewport has the size of the largest face; smaller faces use
// its lower left corner.
#include "scenes/geometry.glsl"
#include "shadowmap/cube_face.glsl"
#include "shadowmap/face_plane_leaf.h"

layout(location = 0) in uint item;
layout(std430, binding = 0) readonly buffer Targets { uvec2 targets[]; }; // map, face
uniform float viewportTexels;

flat out uint mapIndex, face, triangle;
flat out dvec3 plane; // 1/z = x X + y Y + z at the texel's X = 2 x + 1 - N, Y = 2 y + 1 - N
flat out vec3 range;  // least and greatest 1/z of the triangle, 1/z of the near plane
out float gl_ClipDistance[2];

dvec3 lightFromWorld(ShadowMapInfo map, vec3 world) {
    if (map.isDirectional == 0u) {
        precise dvec3 d = dvec3(world) - dvec3(lightPosition(map));
        return d;
    }
    return lightFromWindow(windowFromWorld(map, dvec3(world)));
}

void main() {
    mapIndex = targets[item].x;
    face = targets[item].y;
    triangle = batchTriangles[uint(gl_VertexID) / 3u];
    ShadowMapInfo map = maps[mapIndex];
    double texels = double(map.faceTexels), zNear = nearDepth(map);
    dvec3 a = faceFromLight(face, lightFromWorld(map, vertexWorld(triangle, 0u)));
    dvec3 b = faceFromLight(face, lightFromWorld(map, vertexWorld(triangle, 1u)));
    dvec3 c = faceFromLight(face, lightFromWorld(map, vertexWorld(triangle, 2u)));

    double zMin = min(a.z, min(b.z, c.z)), zMax = max(a.z, max(b.z, c.z));
    double k;
    bool hasArea = facePlane(a, b, c, map.faceTexels, plane, k) && zMax > 0.0LF;
    precise float wMin = float(1.0LF / zMax), wNear = float(1.0LF / zNear);
    precise float wMax = zMin > zNear ? float(1.0LF / zMin) : kLargestInverseDepth;
    range = vec3(wMin, wMax, wNear);

    uint corner = uint(gl_VertexID) % 3u;
    dvec3 p = corner == 0u ? a : corner == 1u ? b : c;
    double share = texels / double(viewportTexels);
    gl_Position = hasArea ? vec4(p.x * share + p.z * (share - 1.0LF), p.y * share + p.z * (share - 1.0LF),
                                 zNear, p.z)
                          : vec4(0.0, 0.0, -1.0, 0.0);
    gl_ClipDistance[0] = float(p.z - p.x);
    gl_ClipDistance[1] = float(p.z - p.y);
#ifdef SDAG_LAYERED
    gl_Layer = int(faceLayer(map, face) & 0xffffu);
#endif
}
