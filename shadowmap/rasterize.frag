// SPDX-License-Identifier: Apache-2.0
// Writes a texel of a face: 1/z of the triangle's plane at the texel's centre, with the formula of
// rasterize.h, so that depths are equal bit for bit. Texels of pages without memory are discarded.
#include "scenes/geometry.glsl"
#include "shadowmap/cube_face.glsl"

flat in uint mapIndex, face, triangle;
flat in dvec3 plane;
flat in vec3 range;

#if defined(SDAG_LAYERED)
layout(location = 0) out float depth; // blended by maximum
#elif defined(SDAG_SPARSE_PAGES)
layout(r32ui, binding = 0) coherent uniform uimage2DArray sparseLayers;
#else
layout(std430, binding = SDAG_PAGE_TABLE_BINDING) readonly buffer PageTable { uint pageTable[]; };
layout(std430, binding = SDAG_DEPTHS_BINDING) buffer Depths { uint depths[]; };
layout(std430, binding = SDAG_MORE_DEPTHS_BINDING) buffer MoreDepths { uint moreDepths[]; };
uniform uint pageTexelsLog2;
#endif

// Whether a masked triangle is opaque at the texel. A corner's weight is the volume of the texel's ray
// and the opposite edge. The corners of a directional light were scaled by their depths; the weights undo
// this.
bool isOpaqueOnFace(ShadowMapInfo map, dvec3 ray) {
    dvec3 p[3];
    double weight[3] = double[3](1.0LF, 1.0LF, 1.0LF);
    for (uint i = 0u; i < 3u; ++i) {
        vec3 world = vertexWorld(triangle, i);
        dvec3 q = dvec3(world) - dvec3(lightPosition(map));
        if (map.isDirectional != 0u) {
            q = lightFromWindow(windowFromWorld(map, dvec3(world)));
            weight[i] = q.z;
        }
        p[i] = faceFromLight(face, q);
    }
    return isOpaque(triangle, dotInOrder(crossInOrder(p[1], p[2]), ray) * weight[0],
                    dotInOrder(crossInOrder(p[2], p[0]), ray) * weight[1],
                    dotInOrder(crossInOrder(p[0], p[1]), ray) * weight[2]);
}

void main() {
    ShadowMapInfo map = maps[mapIndex];
    int n = int(map.faceTexels);
    ivec2 texel = ivec2(gl_FragCoord.xy);
    if (texel.x >= n || texel.y >= n)
        discard;
#ifndef SDAG_SPARSE_PAGES
    uvec2 at = uvec2(texel);
    uint page = pageTable[pageTableIndex(map, face, at.x >> pageTexelsLog2, at.y >> pageTexelsLog2)];
    if (page == kNoPage)
        discard;
#endif
    double X = double(2 * texel.x + 1 - n), Y = double(2 * texel.y + 1 - n);
    precise double row = plane.y * Y + plane.z;
    precise double exact = plane.x * X + row;
    float w = min(max(float(exact), range.x), range.y);
    if (w > range.z)
        discard;
    if (isCut(triangle) && !isOpaqueOnFace(map, dvec3(X / double(n), Y / double(n), 1.0LF)))
        discard;
#if defined(SDAG_LAYERED)
    depth = w;
#elif defined(SDAG_SPARSE_PAGES)
    imageAtomicMax(sparseLayers, ivec3(texel, faceLayer(map, face) & 0xffffu), floatBitsToUint(w));
#else
    uint index = (page << (2u * pageTexelsLog2)) + texelInPage(at.x, at.y, pageTexelsLog2);
    uint bits = floatBitsToUint(w);
    // Most fragments lie behind. The value read may be outdated, but never too great.
    if (index < SDAG_CHUNK_TEXELS) {
        if (depths[index] < bits)
            atomicMax(depths[index], bits);
    } else if (moreDepths[index - SDAG_CHUNK_TEXELS] < bits) {
        atomicMax(moreDepths[index - SDAG_CHUNK_TEXELS], bits);
    }
#endif
}
