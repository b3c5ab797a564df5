// SPDX-License-Identifier: Apache-2.0
// The slab test of a segment against boxes with integer corners; ray_slabs.h derives its error
// bound. A leaf text (gl/leaf.h).
#pragma once

#include "gl/leaf.h"

#ifdef __cplusplus
#include "voxel/bits.h"
#else
#define lowestBit32(bits) uint(findLSB(bits))
#define bitCount32(bits) uint(bitCount(bits))
#endif

SDAG_LEAF_BEGIN

/// A segment in voxel space, ready for slab tests.
struct DagSegment {
    vec3 from; ///< voxel space
    vec3 to;   ///< voxel space
};

/// Larger coordinates could overflow products; segments that have them count as NaN does.
SDAG_CONST float kLargestScale = 1e30f;
/// 2^-20: by how much boxes are grown, in units of a segment's scale.
SDAG_CONST float kSlabMargin = 1.0f / 1048576.0f;
/// 2^-24: the least direction along an axis, in units of a segment's scale. No infinite inverse, no
/// NaN.
SDAG_CONST float kLeastDirection = 1.0f / 16777216.0f;

/// Returns the larger of the resolution and the ends' coordinates: what rounding errors are
/// relative to. NaN or infinite ends give a value that is not below kLargestScale.
SDAG_LEAF float segmentScale(uint resolution, SDAG_IN(DagSegment) segment) {
    float scale = float(resolution);
    for (int a = 0; a < 3; ++a) {
        // Written so that NaN is taken, and then kept.
        float f = magnitude(segment.from[a]), t = magnitude(segment.to[a]);
        scale = f <= scale ? scale : (scale == scale ? f : scale);
        scale = t <= scale ? scale : (scale == scale ? t : scale);
    }
    return scale;
}

/// Returns by how much boxes are grown for this segment, in voxels (1/256 voxel at 4096^3 as long
/// as the ends are not far outside the grid).
SDAG_LEAF float slabMargin(float scale) {
    SDAG_EXACT float margin = scale * kSlabMargin;
    return margin;
}

/// A segment prepared for slab tests: near(p) = fma(p, inv, cNear) for the plane entered, far(p)
/// for the plane left.
struct RaySlabs {
    vec3 inv, cNear, cFar;
    uint octant; ///< bit a: the segment runs against axis a
};

/// One axis of RaySlabs.
struct AxisSlabs {
    float inv, cNear, cFar;
    uint against; ///< 1: the segment runs against the axis
};

SDAG_LEAF AxisSlabs makeAxisSlabs(float from, float to, float margin, float least) {
    SDAG_EXACT float d = to - from;
    d = magnitude(d) < least ? (d < 0.0f ? -least : least) : d;
    AxisSlabs s;
    s.inv = quotient(1.0f, d);
    SDAG_EXACT float before = (-from - margin) * s.inv, after = (margin - from) * s.inv;
    bool isAgainst = d < 0.0f;
    s.against = uint(isAgainst);
    s.cNear = isAgainst ? after : before;
    s.cFar = isAgainst ? before : after;
    return s;
}

/// Returns the slabs of a segment of that scale, which must be below kLargestScale. Axis by axis: a
/// component that is written by an index makes NVIDIA's compiler of GLSL fail.
SDAG_LEAF RaySlabs makeRaySlabs(SDAG_IN(DagSegment) segment, float scale) {
    float margin = slabMargin(scale);
    SDAG_EXACT float least = scale * kLeastDirection;
    AxisSlabs x = makeAxisSlabs(segment.from.x, segment.to.x, margin, least);
    AxisSlabs y = makeAxisSlabs(segment.from.y, segment.to.y, margin, least);
    AxisSlabs z = makeAxisSlabs(segment.from.z, segment.to.z, margin, least);
    RaySlabs r;
    r.inv = vec3(x.inv, y.inv, z.inv);
    r.cNear = vec3(x.cNear, y.cNear, z.cNear);
    r.cFar = vec3(x.cFar, y.cFar, z.cFar);
    r.octant = x.against | y.against << 1 | z.against << 2;
    return r;
}

/// Returns the times at which the segment passes one plane of each axis.
SDAG_LEAF vec3 slabTimes(SDAG_IN(vec3) planes, SDAG_IN(vec3) inv, SDAG_IN(vec3) c) {
    return vec3(fusedMultiplyAdd(planes.x, inv.x, c.x), fusedMultiplyAdd(planes.y, inv.y, c.y),
                fusedMultiplyAdd(planes.z, inv.z, c.z));
}

/// Returns, as bits c = x | y << 1 | z << 2, which of the eight cells of side h at the corner are
/// met between two times of the segment, 0 <= begin <= end <= 1.
SDAG_LEAF uint slabHits(SDAG_IN(RaySlabs) r, SDAG_IN(vec3) corner, float h, float begin,
                        float end) {
    vec3 side = vec3(h), from = vec3(begin), to = vec3(end);
    vec3 toNear = vec3((r.octant & 1u) != 0u ? h : 0.0f, (r.octant & 2u) != 0u ? h : 0.0f,
                       (r.octant & 4u) != 0u ? h : 0.0f);
    vec3 toFar = side - toNear, upper = corner + side;
    // Component a: of the lower and of the upper child along axis a.
    vec3 nearLower = greater(slabTimes(corner + toNear, r.inv, r.cNear), from);
    vec3 nearUpper = greater(slabTimes(upper + toNear, r.inv, r.cNear), from);
    vec3 farLower = lesser(slabTimes(corner + toFar, r.inv, r.cFar), to);
    vec3 farUpper = lesser(slabTimes(upper + toFar, r.inv, r.cFar), to);
    // The four columns (x, y).
    float enter0 = greater(nearLower.x, nearLower.y), leave0 = lesser(farLower.x, farLower.y);
    float enter1 = greater(nearUpper.x, nearLower.y), leave1 = lesser(farUpper.x, farLower.y);
    float enter2 = greater(nearLower.x, nearUpper.y), leave2 = lesser(farLower.x, farUpper.y);
    float enter3 = greater(nearUpper.x, nearUpper.y), leave3 = lesser(farUpper.x, farUpper.y);
    return uint(greater(enter0, nearLower.z) <= lesser(leave0, farLower.z)) |
           uint(greater(enter1, nearLower.z) <= lesser(leave1, farLower.z)) << 1 |
           uint(greater(enter2, nearLower.z) <= lesser(leave2, farLower.z)) << 2 |
           uint(greater(enter3, nearLower.z) <= lesser(leave3, farLower.z)) << 3 |
           uint(greater(enter0, nearUpper.z) <= lesser(leave0, farUpper.z)) << 4 |
           uint(greater(enter1, nearUpper.z) <= lesser(leave1, farUpper.z)) << 5 |
           uint(greater(enter2, nearUpper.z) <= lesser(leave2, farUpper.z)) << 6 |
           uint(greater(enter3, nearUpper.z) <= lesser(leave3, farUpper.z)) << 7;
}

/// Returns the first of these children (bits, not 0) when child i ^ order is the i-th visited: the
/// lowest bit when bit numbers i stand for i ^ order.
SDAG_LEAF uint firstChild(uint children, uint order) {
    uint bits = children;
    bits = (order & 1u) != 0u ? (bits & 0x55u) << 1 | (bits >> 1 & 0x55u) : bits;
    bits = (order & 2u) != 0u ? (bits & 0x33u) << 2 | (bits >> 2 & 0x33u) : bits;
    bits = (order & 4u) != 0u ? (bits & 0x0fu) << 4 | (bits >> 4 & 0x0fu) : bits;
    return lowestBit32(bits) ^ order;
}

SDAG_LEAF_END
