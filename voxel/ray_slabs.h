// SPDX-License-Identifier: Apache-2.0
// The slab test of a segment against boxes whose corners are integers: one box, the eight children
// of a cell, the 64 voxels of a leaf. dag_trace.h states its guarantees; this is their derivation.
//
// Per axis t(p) = fma(p, inv, c) is the time at plane p. inv is fixed, and rounding is monotone, so
// t is monotone in p: a box inside another has the later near and the earlier far planes, hence
// computed times inside the other's. A traversal may therefore drop a cell whose box is missed: the
// voxels in it are missed as well, in every bit.
//
// Margin, in voxels, with eps = 2^-24, S = max(resolution, |from|, |to|), |d| <= 2 S. Ends rounded
// to float: 1 eps S. d = to - from: 2 eps S. |d| < eps S is replaced by eps S: 2 eps S. 1 / d: eps
// |t d|, at most 4 eps S while |t| <= 2. from + margin: 1 eps S; times inv: 1 eps S; the fma's own
// rounding: 4 eps S while |t| <= 2 (beyond, its sign and its side of 1 are not in doubt). Sum 15;
// second orders are below the 16th: margin = 16 eps S. So the computed test accepts whatever the
// exact segment touches, and accepts nothing further away than twice the margin.
#pragma once

#include "voxel/ray_slabs_leaf.h"
#include "voxel/voxel_grid.h"

#include <cmath>
#include <cstdint>

#if defined(__AVX2__) && defined(__FMA__) && defined(__BMI2__) && !defined(__CUDA_ARCH__)
#define SDAG_RAY_SLABS_AVX2 1
#include <immintrin.h>
#endif

namespace shadowdag {

/// Returns segmentScale of a grid's resolution.
SDAG_HD inline float segmentScale(const VoxelGrid& grid, const DagSegment& segment) {
    return segmentScale(grid.resolution(), segment);
}

namespace portable {

/// See slabHits.
SDAG_HD inline uint32_t childHits(const RaySlabs& r, float x, float y, float z, float h,
                                  float begin = 0.0f, float end = 1.0f) {
    return slabHits(r, glm::vec3(x, y, z), h, begin, end);
}

/// Returns which of the 64 voxels of the leaf at the corner are met, as bits in the leaf's order.
SDAG_HD inline uint64_t leafHits(const RaySlabs& r, float x, float y, float z, float begin = 0.0f,
                                 float end = 1.0f) {
    const uint32_t octants = childHits(r, x, y, z, 2.0f, begin, end);
    uint64_t hits = 0;
    for (uint32_t o = 0; o < 8; ++o)
        if (octants >> o & 1)
            hits |= uint64_t(childHits(r, x + 2.0f * (o & 1), y + 2.0f * (o >> 1 & 1),
                                       z + 2.0f * (o >> 2), 1.0f, begin, end))
                    << (8 * o);
    return hits;
}

/// A cell's least corner, and steps down and up the octree.
struct Corner {
    uint32_t x = 0, y = 0, z = 0;
    /// Returns the corner of child c, of side `side`.
    SDAG_HD Corner child(uint32_t c, uint32_t side) const {
        return {x + (c & 1) * side, y + (c >> 1 & 1) * side, z + (c >> 2) * side};
    }
    /// Returns the corner of the cell of side 2^level that holds this one.
    SDAG_HD Corner ancestor(uint32_t level) const {
        const uint32_t keep = ~0u << level;
        return {x & keep, y & keep, z & keep};
    }
    SDAG_HD glm::uvec3 cell() const { return glm::uvec3(x, y, z); }
};

/// The tests of one segment; the data that they share is computed once.
struct Tester {
    RaySlabs r;
    uint32_t order; ///< child i ^ order is the i-th visited
    SDAG_HD Tester(const RaySlabs& slabs, bool isFromBack)
        : r(slabs), order(r.octant ^ (isFromBack ? 7u : 0u)) {}
    SDAG_HD uint32_t childHits(const Corner& c, uint32_t side, float begin = 0.0f,
                               float end = 1.0f) const {
        return portable::childHits(r, float(c.x), float(c.y), float(c.z), float(side), begin, end);
    }
    SDAG_HD uint64_t leafHits(const Corner& c, float begin = 0.0f, float end = 1.0f) const {
        return portable::leafHits(r, float(c.x), float(c.y), float(c.z), begin, end);
    }
    /// See firstChild.
    SDAG_HD uint32_t first(uint32_t bits) const { return firstChild(bits, order); }
};

} // namespace portable

#if defined(SDAG_RAY_SLABS_AVX2)

/// The same operations in lanes: the same bits.
namespace avx2 {

/// first[order][bits] of portable::Tester::first.
struct FirstTable {
    uint8_t first[8][256] = {};
    constexpr FirstTable() {
        for (uint32_t octant = 0; octant < 8; ++octant)
            for (uint32_t bits = 1; bits < 256; ++bits)
                for (uint32_t i = 8; i-- > 0;)
                    if (bits >> (i ^ octant) & 1)
                        first[octant][bits] = uint8_t(i ^ octant);
    }
};
inline constexpr FirstTable kFirst;

/// All ones in the lanes in which child c is the upper one.
alignas(16) inline constexpr int32_t kUpper[8][4] = {{0, 0, 0, 0},   {-1, 0, 0, 0},  {0, -1, 0, 0},
                                                     {-1, -1, 0, 0}, {0, 0, -1, 0},  {-1, 0, -1, 0},
                                                     {0, -1, -1, 0}, {-1, -1, -1, 0}};

struct Corner {
    __m128i lanes = _mm_setzero_si128(); ///< x, y, z, 0

    Corner child(uint32_t c, uint32_t side) const {
        const __m128i upper = _mm_load_si128(reinterpret_cast<const __m128i*>(kUpper[c]));
        return {_mm_add_epi32(lanes, _mm_and_si128(upper, _mm_set1_epi32(int(side))))};
    }
    Corner ancestor(uint32_t level) const {
        return {_mm_and_si128(lanes, _mm_set1_epi32(int(~0u << level)))};
    }
    glm::uvec3 cell() const {
        return glm::uvec3(_mm_extract_epi32(lanes, 0), _mm_extract_epi32(lanes, 1),
                          _mm_extract_epi32(lanes, 2));
    }
};

/// Lanes 0..5 hold, for each axis, the lower and the upper child; they are then spread to the eight
/// children.
struct Tester {
    __m256 inv, cNear, cFar;
    __m256 nearSides, farSides; ///< planes of the children, in sides from the corner
    uint32_t octant;
    const uint8_t* firstOf;

    Tester(const RaySlabs& r, bool isFromBack)
        : octant(r.octant), firstOf(kFirst.first[r.octant ^ (isFromBack ? 7u : 0u)]) {
        const auto twice = [](const glm::vec3& v) {
            return _mm256_setr_ps(v[0], v[0], v[1], v[1], v[2], v[2], 0, 0);
        };
        inv = twice(r.inv);
        cNear = twice(r.cNear);
        cFar = twice(r.cFar);
        const glm::vec3 against(float(octant & 1), float(octant >> 1 & 1), float(octant >> 2));
        const __m256 lower = _mm256_setr_ps(0, 1, 0, 1, 0, 1, 0, 0);
        nearSides = _mm256_add_ps(lower, twice(against));
        farSides = _mm256_sub_ps(_mm256_add_ps(lower, _mm256_set1_ps(1)), twice(against));
    }

    uint32_t childHits(const Corner& corner, uint32_t side, float begin = 0.0f,
                       float end = 1.0f) const {
        const __m256 sides = _mm256_set1_ps(float(side));
        const __m256 p =
            _mm256_permutevar8x32_ps(_mm256_castps128_ps256(_mm_cvtepi32_ps(corner.lanes)),
                                     _mm256_setr_epi32(0, 0, 1, 1, 2, 2, 3, 3));
        const __m256 near = _mm256_fmadd_ps(_mm256_fmadd_ps(sides, nearSides, p), inv, cNear);
        const __m256 far = _mm256_fmadd_ps(_mm256_fmadd_ps(sides, farSides, p), inv, cFar);
        const __m256i ofX = _mm256_setr_epi32(0, 1, 0, 1, 0, 1, 0, 1),
                      ofY = _mm256_setr_epi32(2, 2, 3, 3, 2, 2, 3, 3),
                      ofZ = _mm256_setr_epi32(4, 4, 4, 4, 5, 5, 5, 5);
        const __m256 enter = _mm256_max_ps(
            _mm256_max_ps(_mm256_permutevar8x32_ps(near, ofX), _mm256_permutevar8x32_ps(near, ofY)),
            _mm256_max_ps(_mm256_permutevar8x32_ps(near, ofZ), _mm256_set1_ps(begin)));
        const __m256 leave = _mm256_min_ps(
            _mm256_min_ps(_mm256_permutevar8x32_ps(far, ofX), _mm256_permutevar8x32_ps(far, ofY)),
            _mm256_min_ps(_mm256_permutevar8x32_ps(far, ofZ), _mm256_set1_ps(end)));
        return uint32_t(_mm256_movemask_ps(_mm256_cmp_ps(enter, leave, _CMP_LE_OQ)));
    }

    /// A voxel is met when each axis' near time is at most each other's far time (an axis' own
    /// always is): pairs of axes give 16 bits each, which are spread along the third axis and
    /// combined.
    uint64_t leafHits(const Corner& corner, float begin = 0.0f, float end = 1.0f) const {
        const __m256 cornerLanes = _mm256_castps128_ps256(_mm_cvtepi32_ps(corner.lanes));
        __m256 near[3], far[3]; // planes of voxels 0..3, twice
        for (int a = 0; a < 3; ++a) {
            const __m256i lane = _mm256_set1_epi32(2 * a);
            const __m256 p =
                _mm256_add_ps(_mm256_permutevar8x32_ps(cornerLanes, _mm256_set1_epi32(a)),
                              _mm256_setr_ps(0, 1, 2, 3, 0, 1, 2, 3));
            const __m256 invA = _mm256_permutevar8x32_ps(inv, lane);
            const __m256 pNear = _mm256_add_ps(p, _mm256_permutevar8x32_ps(nearSides, lane));
            const __m256 pFar = _mm256_add_ps(p, _mm256_permutevar8x32_ps(farSides, lane));
            near[a] =
                _mm256_max_ps(_mm256_fmadd_ps(pNear, invA, _mm256_permutevar8x32_ps(cNear, lane)),
                              _mm256_set1_ps(begin));
            far[a] =
                _mm256_min_ps(_mm256_fmadd_ps(pFar, invA, _mm256_permutevar8x32_ps(cFar, lane)),
                              _mm256_set1_ps(end));
        }
        // Bit (a0, b0, a1, b1) of a pair: coordinates a0 + 2 a1 and b0 + 2 b1. The upper half has
        // b1 = 1: b permuted once serves both, moved by 2.
        const __m256i along = _mm256_setr_epi32(0, 1, 0, 1, 2, 3, 2, 3);
        const __m256i across = _mm256_setr_epi32(0, 0, 1, 1, 0, 0, 1, 1);
        const __m256i further = _mm256_setr_epi32(2, 2, 3, 3, 2, 2, 3, 3);
        const auto half = [](__m256 nearA, __m256 farA, __m256 nearB, __m256 farB) {
            return uint32_t(_mm256_movemask_ps(_mm256_and_ps(
                _mm256_cmp_ps(nearA, farB, _CMP_LE_OQ), _mm256_cmp_ps(nearB, farA, _CMP_LE_OQ))));
        };
        const auto at = [](__m256 v, __m256i lanes) { return _mm256_permutevar8x32_ps(v, lanes); };
        const __m256 nearX = at(near[0], along), farX = at(far[0], along),
                     nearY = at(near[1], along), farY = at(far[1], along);
        const __m256 nearZ0 = at(near[2], across), farZ0 = at(far[2], across),
                     nearZ1 = at(near[2], further), farZ1 = at(far[2], further);
        const uint32_t pairXY = half(nearX, farX, at(near[1], across), at(far[1], across)) |
                                half(nearX, farX, at(near[1], further), at(far[1], further)) << 8;
        const uint32_t pairXZ = half(nearX, farX, nearZ0, farZ0) | half(nearX, farX, nearZ1, farZ1)
                                                                       << 8;
        const uint32_t pairYZ = half(nearY, farY, nearZ0, farZ0) | half(nearY, farY, nearZ1, farZ1)
                                                                       << 8;
        // The leaf's bit number is (x0, y0, z0, x1, y1, z1), lowest first: open gaps at the missing
        // axis and fill them.
        const auto spread = [](uint64_t bits, uint64_t gaps, int shift0, int shift1) {
            const uint64_t s = _pdep_u64(bits, gaps);
            const uint64_t t = s | s << shift0;
            return t | t << shift1;
        };
        return spread(pairXY, 0x000000000f0f0f0fu, 4, 32) &
               spread(pairXZ, 0x0000333300003333u, 2, 16) &
               spread(pairYZ, 0x0055005500550055u, 1, 8);
    }

    uint32_t first(uint32_t bits) const { return firstOf[bits]; }
};

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
        enter = greater(fmaf(corner[a] + toNear, r.inv[a], r.cNear[a]), enter);
        leave = lesser(fmaf(corner[a] + (side - toNear), r.inv[a], r.cFar[a]), leave);
    }
    return enter <= leave;
}

} // namespace shadowdag
