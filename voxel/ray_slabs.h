// SPDX-License-Identifier: Apache-2.0
// The slab test of a segment against boxes whose corners are integers: one box, the eight children of a cell, the 64 voxels of
// a leaf. dag_trace.h says what it promises; here is why.
//
// Per axis t(p) = fma(p, inv, c) is the time at plane p. inv is fixed, and rounding is monotone, so t is monotone in
// p: a box inside another has the later near and the earlier far planes, hence computed times inside the other's. A traversal may
// therefore drop a cell whose box is missed: the voxels in it are missed as well, in every bit.
//
// Margin, in voxels, with eps = 2^-24, S = max(resolution, |from|, |to|), |d| <= 2 S. Ends rounded to float: 1 eps S. d = to - from: 2 eps S.
// |d| < eps S is replaced by eps S: 2 eps S. 1 / d: eps |t d|, at most 4 eps S while |t| <= 2. from + margin: 1 eps S; times inv: 1 eps S; the fma's own
// rounding: 4 eps S while |t| <= 2 (beyond, its sign and its side of 1 are not in doubt). Sum 15; second orders
// are below the 16th: margin = 16 eps S. So the computed test accepts whatever the exact segment
// touches, and accepts nothing further away than twice the margin.
#pragma once

#include "voxel/voxel_grid.h"

#include <glm/glm.hpp>

#include <bit>
#include <cmath>
#include <cstdint>

#if defined(__AVX2__) && defined(__FMA__) && !defined(__CUDA_ARCH__)
#define SDAG_RAY_SLABS_AVX2 1
#include <immintrin.h>
#endif

namespace shadowdag {

/// A segment in voxel space, ready for slab tests.
struct DagSegment {
    glm::vec3 from; ///< voxel space
    glm::vec3 to;   ///< voxel space
};

/// Returns the larger of the resolution and the ends' coordinates: what rounding errors are relative to. NaN or
/// infinite ends give a value that is not below kLargestScale.
SDAG_HD inline float segmentScale(const VoxelGrid& grid, const DagSegment& segment) {
    float scale = float(grid.resolution());
    for (int a = 0; a < 3; ++a) {
        // Written so that NaN is taken, and then kept.
        const float f = fabsf(segment.from[a]), t = fabsf(segment.to[a]);
        scale = f <= scale ? scale : (scale == scale ? f : scale);
        scale = t <= scale ? scale : (scale == scale ? t : scale);
    }
    return scale;
}

/// Larger coordinates could overflow products; segments that have them count as NaN does.
constexpr float kLargestScale = 1e30f;

/// Returns by how much boxes are grown for this segment, in voxels (2^-20 of its scale: 1/256 voxel at 4096^3 as long as
/// the ends are not far outside the grid).
SDAG_HD inline float slabMargin(float scale) { return scale * 9.5367431640625e-7f; }

/// A segment as slab tests want it: near(p) = fma(p, inv, cNear) for the plane entered, far(p) for the plane left.
struct RaySlabs {
    float inv[3], cNear[3], cFar[3];
    uint32_t octant; ///< bit a: the segment runs against axis a
};

/// Returns the slabs of a segment of that scale, which must be below kLargestScale.
SDAG_HD inline RaySlabs makeRaySlabs(const DagSegment& segment, float scale) {
    RaySlabs r;
    r.octant = 0;
    const float margin = slabMargin(scale);
    const float least = scale * 5.9604644775390625e-8f; // 2^-24: no infinite inverse, no NaN
    for (int a = 0; a < 3; ++a) {
        const float from = segment.from[a];
        float d = segment.to[a] - from;
        d = fabsf(d) < least ? (d < 0 ? -least : least) : d;
        r.inv[a] = 1.0f / d;
        const float before = (-from - margin) * r.inv[a], after = (margin - from) * r.inv[a];
        const bool isAgainst = d < 0;
        r.octant |= uint32_t(isAgainst) << a;
        r.cNear[a] = isAgainst ? after : before;
        r.cFar[a] = isAgainst ? before : after;
    }
    return r;
}

namespace portable {

SDAG_HD inline float slabLesser(float a, float b) { return a < b ? a : b; }
SDAG_HD inline float slabGreater(float a, float b) { return a > b ? a : b; }

/// Returns, as bits c = x | y << 1 | z << 2, which of the eight cells of side h at the corner are met.
SDAG_HD inline uint32_t childHits(const RaySlabs& r, float x, float y, float z, float h) {
    const float corner[3] = {x, y, z};
    float near[3][2], far[3][2];
    for (int a = 0; a < 3; ++a) {
        const float toNear = (r.octant >> a & 1) ? h : 0.0f, toFar = h - toNear;
        for (int b = 0; b < 2; ++b) {
            const float p = corner[a] + (b ? h : 0.0f);
            near[a][b] = slabGreater(fmaf(p + toNear, r.inv[a], r.cNear[a]), 0.0f);
            far[a][b] = slabLesser(fmaf(p + toFar, r.inv[a], r.cFar[a]), 1.0f);
        }
    }
    uint32_t hits = 0;
    for (uint32_t c = 0; c < 8; ++c) {
        const float enter = slabGreater(slabGreater(near[0][c & 1], near[1][c >> 1 & 1]), near[2][c >> 2]);
        const float leave = slabLesser(slabLesser(far[0][c & 1], far[1][c >> 1 & 1]), far[2][c >> 2]);
        hits |= uint32_t(enter <= leave) << c;
    }
    return hits;
}

/// Returns which of the 64 voxels of the leaf at the corner are met, as bits in the leaf's order.
SDAG_HD inline uint64_t leafHits(const RaySlabs& r, float x, float y, float z) {
    const uint32_t octants = childHits(r, x, y, z, 2.0f);
    uint64_t hits = 0;
    for (uint32_t o = 0; o < 8; ++o)
        if (octants >> o & 1)
            hits |= uint64_t(childHits(r, x + 2.0f * (o & 1), y + 2.0f * (o >> 1 & 1), z + 2.0f * (o >> 2), 1.0f))
                    << (8 * o);
    return hits;
}

} // namespace portable

#if defined(SDAG_RAY_SLABS_AVX2)

/// The same operations on eight lanes: the same bits.
namespace avx2 {

inline uint32_t childHits(const RaySlabs& r, float x, float y, float z, float h) {
    const __m256 zero = _mm256_setzero_ps();
    const __m256 side = _mm256_set1_ps(h);
    const __m256 bits[3] = {_mm256_setr_ps(0, 1, 0, 1, 0, 1, 0, 1), _mm256_setr_ps(0, 0, 1, 1, 0, 0, 1, 1),
                            _mm256_setr_ps(0, 0, 0, 0, 1, 1, 1, 1)};
    const float corner[3] = {x, y, z};
    __m256 enter = zero, leave = _mm256_set1_ps(1.0f);
    for (int a = 0; a < 3; ++a) {
        const float toNear = (r.octant >> a & 1) ? h : 0.0f;
        const __m256 p = _mm256_fmadd_ps(side, bits[a], _mm256_set1_ps(corner[a]));
        const __m256 inv = _mm256_set1_ps(r.inv[a]);
        enter = _mm256_max_ps(enter, _mm256_fmadd_ps(_mm256_add_ps(p, _mm256_set1_ps(toNear)), inv, _mm256_set1_ps(r.cNear[a])));
        leave = _mm256_min_ps(leave, _mm256_fmadd_ps(_mm256_add_ps(p, _mm256_set1_ps(h - toNear)), inv, _mm256_set1_ps(r.cFar[a])));
    }
    return uint32_t(_mm256_movemask_ps(_mm256_cmp_ps(enter, leave, _CMP_LE_OQ)));
}

/// A voxel is met when each axis' near time is at most each other's far time (an axis' own always is): pairs of axes
/// give 16 bits each, which are spread along the third axis and combined.
inline uint64_t leafHits(const RaySlabs& r, float x, float y, float z) {
    const float corner[3] = {x, y, z};
    __m256 near[3], far[3]; // four values each, twice
    for (int a = 0; a < 3; ++a) {
        const float toNear = (r.octant >> a & 1) ? 1.0f : 0.0f;
        const __m256 p = _mm256_add_ps(_mm256_set1_ps(corner[a]), _mm256_setr_ps(0, 1, 2, 3, 0, 1, 2, 3));
        const __m256 inv = _mm256_set1_ps(r.inv[a]);
        near[a] = _mm256_max_ps(_mm256_fmadd_ps(_mm256_add_ps(p, _mm256_set1_ps(toNear)), inv, _mm256_set1_ps(r.cNear[a])), _mm256_setzero_ps());
        far[a] = _mm256_min_ps(_mm256_fmadd_ps(_mm256_add_ps(p, _mm256_set1_ps(1.0f - toNear)), inv, _mm256_set1_ps(r.cFar[a])), _mm256_set1_ps(1.0f));
    }
    // Bit (a0, b0, a1, b1) of pair (a, b): coordinates a0 + 2 a1 and b0 + 2 b1.
    const auto pair = [&](int a, int b) {
        const __m256i along = _mm256_setr_epi32(0, 1, 0, 1, 2, 3, 2, 3);
        const __m256i across = _mm256_setr_epi32(0, 0, 1, 1, 0, 0, 1, 1);
        const __m256i further = _mm256_setr_epi32(2, 2, 3, 3, 2, 2, 3, 3);
        const __m256 nearA = _mm256_permutevar8x32_ps(near[a], along), farA = _mm256_permutevar8x32_ps(far[a], along);
        const auto half = [&](__m256i of) {
            const __m256 nearB = _mm256_permutevar8x32_ps(near[b], of), farB = _mm256_permutevar8x32_ps(far[b], of);
            return uint32_t(_mm256_movemask_ps(_mm256_and_ps(_mm256_cmp_ps(nearA, farB, _CMP_LE_OQ), _mm256_cmp_ps(nearB, farA, _CMP_LE_OQ))));
        };
        return half(across) | half(further) << 8;
    };
    // The leaf's bit number is (x0, y0, z0, x1, y1, z1), lowest first: open gaps at the missing axis and fill them.
    const auto spread = [](uint64_t bits, uint64_t gaps, int shift0, int shift1) {
        const uint64_t s = _pdep_u64(bits, gaps);
        const uint64_t t = s | s << shift0;
        return t | t << shift1;
    };
    const uint64_t xy = spread(pair(0, 1), 0x000000000f0f0f0fu, 4, 32);
    const uint64_t xz = spread(pair(0, 2), 0x0000333300003333u, 2, 16);
    const uint64_t yz = spread(pair(1, 2), 0x0055005500550055u, 1, 8);
    return xy & xz & yz;
}

} // namespace avx2

namespace slabs = avx2;
#else
namespace slabs = portable;
#endif

/// Returns whether the segment meets the cube of side `side` at the corner.
SDAG_HD inline bool hitsCube(const RaySlabs& r, float x, float y, float z, float side) {
    const float corner[3] = {x, y, z};
    float enter = 0.0f, leave = 1.0f;
    for (int a = 0; a < 3; ++a) {
        const float toNear = (r.octant >> a & 1) ? side : 0.0f;
        enter = portable::slabGreater(fmaf(corner[a] + toNear, r.inv[a], r.cNear[a]), enter);
        leave = portable::slabLesser(fmaf(corner[a] + (side - toNear), r.inv[a], r.cFar[a]), leave);
    }
    return enter <= leave;
}

} // namespace shadowdag
