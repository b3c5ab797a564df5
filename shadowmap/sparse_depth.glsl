// SPDX-License-Identifier: Apache-2.0
// Texels of shadow maps in sparse textures (sparse_gl.h). GLSL does not allow an index that differs between
// invocations to select a sampler, so the samplers are listed.
#include "shadowmap/cube_face.glsl"

#ifdef SDAG_LAYERED
uniform sampler2DArray sparseMaps[SDAG_SPARSE_ARRAYS];
#define SDAG_TEXEL(i) texelFetch(sparseMaps[i], at, 0).r
#else
uniform usampler2DArray sparseMaps[SDAG_SPARSE_ARRAYS]; // the bits of floats
#define SDAG_TEXEL(i) uintBitsToFloat(texelFetch(sparseMaps[i], at, 0).r)
#endif

#if SDAG_SPARSE_ARRAYS != 16
#error "the list below names 16 textures"
#endif

float sparseTexel(uint array, ivec3 at) {
    switch (array) {
    case 0u: return SDAG_TEXEL(0);
    case 1u: return SDAG_TEXEL(1);
    case 2u: return SDAG_TEXEL(2);
    case 3u: return SDAG_TEXEL(3);
    case 4u: return SDAG_TEXEL(4);
    case 5u: return SDAG_TEXEL(5);
    case 6u: return SDAG_TEXEL(6);
    case 7u: return SDAG_TEXEL(7);
    case 8u: return SDAG_TEXEL(8);
    case 9u: return SDAG_TEXEL(9);
    case 10u: return SDAG_TEXEL(10);
    case 11u: return SDAG_TEXEL(11);
    case 12u: return SDAG_TEXEL(12);
    case 13u: return SDAG_TEXEL(13);
    case 14u: return SDAG_TEXEL(14);
    default: return SDAG_TEXEL(15);
    }
}

float sparseDepth(ShadowMapInfo map, uint face, uint x, uint y) {
    uint place = faceLayer(map, face);
    return sparseTexel(place >> 16, ivec3(x, y, place & 0xffffu));
}
