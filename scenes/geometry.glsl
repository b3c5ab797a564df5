// SPDX-License-Identifier: Apache-2.0
// The world's triangles and what alpha masks cut out of them: TriangleView and alpha_mask.h, as
// geometry_gl.h binds them.
#include "scenes/alpha_mask.glsl"

layout(std430, binding = 2) readonly buffer Positions { float positions[]; };
layout(std430, binding = 3) readonly buffer Triangles { uint triangles[]; };
layout(std430, binding = 4) readonly buffer BatchTriangles { uint batchTriangles[]; };

layout(std430, binding = 7) readonly buffer TriangleCut { uint triangleCut[]; };
layout(std430, binding = 8) readonly buffer Cuts { CutTriangle cuts[]; };
layout(std430, binding = 9) readonly buffer Masks { MaskInfo masks[]; };
layout(std430, binding = 10) readonly buffer MaskWords { uint maskWords[]; };
uniform uint hasMasks;

vec3 vertexWorld(uint triangle, uint corner) {
    uint at = 3u * triangles[3u * triangle + corner];
    return vec3(positions[at], positions[at + 1u], positions[at + 2u]);
}

bool isCut(uint triangle) { return hasMasks != 0u && triangleCut[triangle] != kNotCut; }

uint maskWord(uint index) { return maskWords[index]; }

// Whether a cut triangle is opaque at the point with these weights of its corners.
bool isOpaque(uint triangle, double weight0, double weight1, double weight2) {
    CutTriangle cut = cuts[triangleCut[triangle]];
    return isOpaqueAt(cut, masks[cut.mask], dvec3(weight0, weight1, weight2));
}
