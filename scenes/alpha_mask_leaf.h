// SPDX-License-Identifier: Apache-2.0
// Finds the texel of an alpha mask for a point of a triangle (alpha_mask.h). A leaf text
// (gl/leaf.h).
#pragma once

#include "gl/leaf.h"

SDAG_LEAF_BEGIN

/// Wrap modes of MaskWrap; any other value clamps.
SDAG_CONST uint kMaskRepeat = 0u, kMaskMirror = 1u;
/// Marks a triangle without a mask.
SDAG_CONST uint kNotCut = 0xffffffffu;

SDAG_LEAF uint maskRowWords(uint width) {
    return (width + 31u) / 32u;
}

/// Returns the texel of an axis of `size` for a whole number of texels. NaN: 0.
SDAG_LEAF uint maskTexel(double texel, uint size, uint wrap) {
    SDAG_EXACT double at = texel;
    double n = double(size);
    if (wrap == kMaskRepeat) {
        at -= floor(at / n) * n;
    } else if (wrap == kMaskMirror) {
        at -= floor(at / (2.0f * n)) * (2.0f * n);
        at = at < n ? at : 2.0f * n - 1.0f - at;
    }
    at = at > 0.0f ? at : double(0.0f);
    return at < n ? uint(at) : size - 1u;
}

/// The texels of one axis, before wrapping, that may contain points of a triangle: a point on the
/// triangle's own border belongs to the inside. Otherwise the last line of a board would use the
/// opposite border of the texture.
struct TexelSpan {
    double first, last;
};

/// Returns the texels of a triangle. @param a,b,c its texture coordinates on the axis
SDAG_LEAF TexelSpan texelSpanOf(float a, float b, float c, uint size) {
    SDAG_EXACT double least = double(a < b ? (a < c ? a : c) : (b < c ? b : c)) * double(size);
    SDAG_EXACT double most = double(a > b ? (a > c ? a : c) : (b > c ? b : c)) * double(size);
    SDAG_EXACT double last = ceil(most) - 1.0f;
    TexelSpan span;
    span.first = floor(least);
    span.last = last > span.first ? last : span.first;
    return span;
}

/// Returns the texel of an axis at the point with weights b1 and b2 of the second and third corner.
SDAG_LEAF uint maskTexelAt(float t0, float t1, float t2, double b1, double b2, uint size,
                           uint wrap) {
    double from = double(t0);
    SDAG_EXACT double at = from + b1 * (double(t1) - from) + b2 * (double(t2) - from);
    SDAG_EXACT double inTexels = at * double(size);
    double texel = floor(inTexels);
    TexelSpan span = texelSpanOf(t0, t1, t2, size);
    texel = texel > span.first ? texel : span.first; // NaN: first
    texel = texel < span.last ? texel : span.last;
    return maskTexel(texel, size, wrap);
}

/// Normalizes weights of corners, in any common unit and sign, not all 0, to those of the second
/// and third for a sum of 1. Weights that rounding put past an edge count as on it.
SDAG_LEAF void unitWeights(double weight0, double weight1, double weight2, SDAG_OUT(double) b1,
                           SDAG_OUT(double) b2) {
    SDAG_EXACT double sum = weight0 + weight1 + weight2;
    SDAG_EXACT double second = weight1 / sum, third = weight2 / sum;
    second = second > 0.0f ? (second < 1.0f ? second : double(1.0f)) : double(0.0f);
    SDAG_EXACT double rest = 1.0f - second;
    b1 = second;
    b2 = third > 0.0f ? (third < rest ? third : rest) : double(0.0f);
}

SDAG_LEAF_END
