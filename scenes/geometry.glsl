// SPDX-License-Identifier: Apache-2.0
// The world's triangles and their alpha masks (TriangleView, AlphaMaskView) in the buffers that
// geometry_gl.h binds.
#include "scenes/alpha_mask.glsl"
#include "scenes/geometry_bindings_leaf.h"

layout(std430, binding = kPositionsAt) readonly buffer Positions { float positions[]; };
layout(std430, binding = kTrianglesAt) readonly buffer Triangles { uint triangles[]; };
layout(std430, binding = kBatchTrianglesAt) readonly buffer BatchTriangles { uint batchTriangles[]; };

layout(std430, binding = kTriangleCutAt) readonly buffer TriangleCut { uint triangleCut[]; };
layout(std430, binding = kCutsAt) readonly buffer Cuts { CutTriangle cuts[]; };
layout(std430, binding = kMasksAt) readonly buffer Masks { MaskInfo masks[]; };
layout(std430, binding = kMaskWordsAt) readonly buffer MaskWords { uint maskWords[]; };
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
