// SPDX-License-Identifier: Apache-2.0
// Tests whether an alpha mask cuts a point out of a triangle (alpha_mask.h). The file that includes this
// one defines uint maskWord(uint index), which returns word `index` of all masks.
#include "scenes/alpha_mask_leaf.h"

struct CutTriangle {
    uint mask;
    float u0, v0, u1, v1, u2, v2;
};
struct MaskInfo {
    uint firstWord, width, height, wrapU, wrapV;
};

uint maskWord(uint index);

// Whether a cut triangle is opaque at the point with these weights of its corners.
bool isOpaqueAt(CutTriangle cut, MaskInfo info, dvec3 weights) {
    double b1, b2;
    unitWeights(weights.x, weights.y, weights.z, b1, b2);
    uint x = maskTexelAt(cut.u0, cut.u1, cut.u2, b1, b2, info.width, info.wrapU);
    uint y = maskTexelAt(cut.v0, cut.v1, cut.v2, b1, b2, info.height, info.wrapV);
    uint word = maskWord(info.firstWord + y * maskRowWords(info.width) + x / 32u);
    return (word >> (x & 31u) & 1u) != 0u;
}
