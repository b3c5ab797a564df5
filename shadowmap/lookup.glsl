// SPDX-License-Identifier: Apache-2.0
// Reads a virtual cube map. shadow_map_lookup.h explains filters, bias and low taps.
#include "shadowmap/cube_face.glsl"
#include "shadowmap/filter_leaf.h"

layout(std430, binding = SDAG_PAGE_TABLE_BINDING) readonly buffer PageTable { uint pageTable[]; };
uniform uint pageTexelsLog2;
uniform float biasTexels;
uniform uint filterTaps;

#ifdef SDAG_SPARSE_PAGES
#include "shadowmap/sparse_depth.glsl"
#else
layout(std430, binding = SDAG_DEPTHS_BINDING) readonly buffer Depths { uint depths[]; };
layout(std430, binding = SDAG_MORE_DEPTHS_BINDING) readonly buffer MoreDepths { uint moreDepths[]; };
#endif

// Of the current lookup.
uint missingTapCount = 0u;

uint tapResult(ShadowMapInfo map, CubeTexel texel, float limit) {
    uint page = pageTable[pageTableIndex(map, texel.face, texel.x >> pageTexelsLog2,
                                         texel.y >> pageTexelsLog2)];
    if (page == kNoPage) {
        ++missingTapCount;
        return kTapMissing;
    }
#ifdef SDAG_SPARSE_PAGES
    float w = sparseDepth(map, texel.face, texel.x, texel.y);
#else
    uint index = (page << (2u * pageTexelsLog2)) + texelInPage(texel.x, texel.y, pageTexelsLog2);
    float w = uintBitsToFloat(index < SDAG_CHUNK_TEXELS ? depths[index]
                                                        : moreDepths[index - SDAG_CHUNK_TEXELS]);
#endif
    return w > limit ? kTapDark : kTapLit;
}

#include "shadowmap/directional_lookup.glsl"

uint lookupVisibility(uint mapIndex, vec3 positionWorld, vec3 normalWorld) {
    missingTapCount = 0u;
    ShadowMapInfo map = maps[mapIndex];
    if (map.isDirectional != 0u)
        return lookupDirectional(map, positionWorld, normalWorld);
    precise vec3 d = positionWorld - lightPosition(map);
    float dd = dotInOrder(d, d);
    if (dd == 0.0)
        return 255u;
    if (!(dd > 0.0))
        return 0u;
    CubeReceiver r = makeCubeReceiver(d, dd, positionWorld, normalWorld, map.faceTexels, 0.0,
                                      biasTexels, filterTaps);
    vec3 own = faceFromLight(r.face, r.own), across = faceFromLight(r.face, r.across);
    for (int pass = 0; pass < 2; ++pass) {
        missingTapCount = 0u;
        precise float lit = 0.0, leftOut = 0.0;
        for (int j = 0; j < r.side; ++j) {
            for (int i = 0; i < r.side; ++i) {
                precise float weight = tapWeight(r.side, i, r.fx) * tapWeight(r.side, j, r.fy);
                CubeTexel texel = CubeTexel(r.face, uint(r.x0 + i), uint(r.y0 + j));
                if (!r.isInFace) {
                    texel = wrapTexel(r.face, r.x0 + i, r.y0 + j, map.faceTexels);
                    own = faceFromLight(texel.face, r.own);
                    across = faceFromLight(texel.face, r.across);
                }
                bool isLow;
                float limit = cubeTapLimit(own, across, tapCentre(r, texel.x, map.faceTexels),
                                           tapCentre(r, texel.y, map.faceTexels), r.low, isLow);
                uint answer = tapResult(map, texel, limit);
                if (isLow && answer != kTapMissing)
                    leftOut += weight;
                else if (answer == kTapLit)
                    lit += weight;
            }
        }
        uint visibility;
        if (endsFilter(lit, leftOut, filterTotal(r.side), visibility))
            return visibility;
        r.low = 0.0;
    }
    return 0u;
}
