// SPDX-License-Identifier: Apache-2.0
// Four doubles at once, for the CPU's rasterizers and samples: the operations of glm on vectors of
// doubles, in the same order, so that the results have the same bits.
#pragma once

#include "scenes/world.h"

#if defined(__AVX2__) && !defined(__CUDACC__)
#define SDAG_DOUBLE_LANES 1
#include <immintrin.h>

namespace shadowdag::avx2 {

/// Four numbers, or four masks. glm::min(x, y) is y < x ? y : x, which is minpd(y, x).
using Lanes = __m256d;
inline Lanes all(double value) {
    return _mm256_set1_pd(value);
}
inline Lanes least(Lanes x, Lanes y) {
    return _mm256_min_pd(y, x);
}
inline Lanes most(Lanes x, Lanes y) {
    return _mm256_max_pd(y, x);
}
inline Lanes negative(Lanes x) {
    return _mm256_xor_pd(x, all(-0.0));
}
inline Lanes magnitude(Lanes x) {
    return _mm256_andnot_pd(all(-0.0), x);
}
inline Lanes above(Lanes x, Lanes y) {
    return _mm256_cmp_pd(x, y, _CMP_GT_OQ);
}
inline Lanes atLeast(Lanes x, Lanes y) {
    return _mm256_cmp_pd(x, y, _CMP_GE_OQ);
}

struct Lanes3 {
    Lanes x, y, z;
};
inline Lanes3 difference(const Lanes3& a, const Lanes3& b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
}
inline Lanes3 cross(const Lanes3& a, const Lanes3& b) {
    return {a.y * b.z - b.y * a.z, a.z * b.x - b.z * a.x, a.x * b.y - b.x * a.y};
}
inline Lanes dot(const Lanes3& a, const Lanes3& b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
inline Lanes3 all(const glm::dvec3& value) {
    return {all(value.x), all(value.y), all(value.z)};
}
inline uint32_t bitsOf(Lanes mask) {
    return uint32_t(_mm256_movemask_pd(mask));
}

/// Stores the whole numbers of [from, to] within [0, end]; returns the lanes that have any.
inline Lanes wholeSpans(Lanes from, Lanes to, Lanes end, int32_t* first, int32_t* last) {
    const Lanes zero = _mm256_setzero_pd();
    const Lanes lo = _mm256_ceil_pd(_mm256_max_pd(from, zero)),
                hi = _mm256_floor_pd(_mm256_min_pd(to, end));
    _mm_store_si128(reinterpret_cast<__m128i*>(first), _mm256_cvttpd_epi32(lo));
    _mm_store_si128(reinterpret_cast<__m128i*>(last), _mm256_cvttpd_epi32(hi));
    return _mm256_and_pd(_mm256_and_pd(atLeast(end, from), atLeast(to, zero)), atLeast(hi, lo));
}

/// Returns corner `corner` of four triangles, in world space.
inline Lanes3 vertices(const TriangleView& geometry, const uint32_t* triangles, int corner) {
    const __m128i three = _mm_setr_epi32(-1, -1, -1, 0); // no byte beyond the last vertex
    __m128 p[4];
    for (int lane = 0; lane < 4; ++lane)
        p[lane] = _mm_maskload_ps(
            &geometry.positions[geometry.triangles[triangles[lane]][corner]].x, three);
    _MM_TRANSPOSE4_PS(p[0], p[1], p[2], p[3]);
    return {_mm256_cvtps_pd(p[0]), _mm256_cvtps_pd(p[1]), _mm256_cvtps_pd(p[2])};
}

/// Four vectors of three floats anywhere; a float more is read of each.
inline Lanes3 fourVectors(const float* const (&vectors)[4]) {
    __m128 p[4];
    for (int lane = 0; lane < 4; ++lane)
        p[lane] = _mm_loadu_ps(vectors[lane]);
    _MM_TRANSPOSE4_PS(p[0], p[1], p[2], p[3]);
    return {_mm256_cvtps_pd(p[0]), _mm256_cvtps_pd(p[1]), _mm256_cvtps_pd(p[2])};
}

/// Four vectors of three floats, one after the other.
inline Lanes3 fourVectors(const float* first) {
    const __m128 a = _mm_loadu_ps(first), b = _mm_loadu_ps(first + 4), c = _mm_loadu_ps(first + 8);
    const __m128 xy = _mm_shuffle_ps(b, c, _MM_SHUFFLE(2, 1, 3, 2)),
                 yz = _mm_shuffle_ps(a, b, _MM_SHUFFLE(1, 0, 2, 1));
    return {_mm256_cvtps_pd(_mm_shuffle_ps(a, xy, _MM_SHUFFLE(2, 0, 3, 0))),
            _mm256_cvtps_pd(_mm_shuffle_ps(yz, xy, _MM_SHUFFLE(3, 1, 2, 0))),
            _mm256_cvtps_pd(_mm_shuffle_ps(yz, c, _MM_SHUFFLE(3, 0, 3, 1)))};
}

/// Exchanges rows and columns.
inline void transpose(Lanes& a, Lanes& b, Lanes& c, Lanes& d) {
    const Lanes ab = _mm256_unpacklo_pd(a, b), ba = _mm256_unpackhi_pd(a, b),
                cd = _mm256_unpacklo_pd(c, d), dc = _mm256_unpackhi_pd(c, d);
    a = _mm256_permute2f128_pd(ab, cd, 0x20);
    b = _mm256_permute2f128_pd(ba, dc, 0x20);
    c = _mm256_permute2f128_pd(ab, cd, 0x31);
    d = _mm256_permute2f128_pd(ba, dc, 0x31);
}

} // namespace shadowdag::avx2

#endif
