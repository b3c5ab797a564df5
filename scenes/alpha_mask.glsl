// SPDX-License-Identifier: Apache-2.0
// What alpha masks cut out of triangles: alpha_mask.h. Whoever includes it has
// uint maskWord(uint index), word `index` of all masks.
#include "gl/numerics.glsl"

struct CutTriangle {
    uint mask;
    float u0, v0, u1, v1, u2, v2;
};
struct MaskInfo {
    uint firstWord, width, height, wrapU, wrapV;
};

const uint kRepeat = 0u, kMirror = 1u;

uint maskWord(uint index);

uint maskTexel(double texel, uint size, uint wrap) {
    precise double at = texel;
    double n = double(size);
    if (wrap == kRepeat) {
        at -= floor(at / n) * n;
    } else if (wrap == kMirror) {
        at -= floor(at / (2.0LF * n)) * (2.0LF * n);
        at = at < n ? at : 2.0LF * n - 1.0LF - at;
    }
    at = at > 0.0LF ? at : 0.0LF;
    return at < n ? uint(at) : size - 1u;
}

uint maskTexelAt(float t0, float t1, float t2, double b1, double b2, uint size, uint wrap) {
    double n = double(size);
    precise double from = double(t0);
    precise double at = from + b1 * (double(t1) - from) + b2 * (double(t2) - from);
    precise double texel = floor(at * n);
    precise double first = floor(double(min(t0, min(t1, t2))) * n);
    precise double last = ceil(double(max(t0, max(t1, t2))) * n) - 1.0LF;
    last = last > first ? last : first;
    texel = texel > first ? texel : first;
    texel = texel < last ? texel : last;
    return maskTexel(texel, size, wrap);
}

// Whether a cut triangle is opaque at the point with these weights of its corners.
bool isOpaqueAt(CutTriangle cut, MaskInfo info, dvec3 weights) {
    precise double sum = weights.x + weights.y + weights.z;
    precise double b1 = weights.y / sum, b2 = weights.z / sum;
    b1 = b1 > 0.0LF ? (b1 < 1.0LF ? b1 : 1.0LF) : 0.0LF;
    b2 = b2 > 0.0LF ? (b2 < 1.0LF - b1 ? b2 : 1.0LF - b1) : 0.0LF;
    uint x = maskTexelAt(cut.u0, cut.u1, cut.u2, b1, b2, info.width, info.wrapU);
    uint y = maskTexelAt(cut.v0, cut.v1, cut.v2, b1, b2, info.height, info.wrapV);
    uint word = maskWord(info.firstWord + y * ((info.width + 31u) / 32u) + x / 32u);
    return (word >> (x & 31u) & 1u) != 0u;
}
