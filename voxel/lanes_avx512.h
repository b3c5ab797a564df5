// SPDX-License-Identifier: Apache-2.0
// Vectors of floats for the kernels that are compiled once per instruction set: AVX-512
// (lanes_avx2.h).
#pragma once

#if defined(__AVX512F__) && defined(__AVX512DQ__) && defined(__AVX512VL__)

#include "voxel/ray_slabs_leaf.h" // kLargestScale

#include <immintrin.h>

namespace shadowdag::stream {
namespace {

/// 16 floats, by AVX-512.
struct Avx512Lanes {
    static constexpr uint32_t kWidth = 16;
    using Floats = __m512;
    using Ints = __m512i; ///< signed
    struct Doubles {
        __m512d low, high;
    };
    using Mask = uint32_t;
    static Mask mask(uint32_t bits) { return bits; }

    static Floats splat(float v) { return _mm512_set1_ps(v); }
    static Floats load(const float* from) { return _mm512_loadu_ps(from); }
    static Floats loadBytes(const uint8_t* from) { return _mm512_cvtepi32_ps(bytes(from)); }
    static uint32_t nonZero(const uint8_t* from) {
        const __m512i v = bytes(from);
        return _mm512_test_epi32_mask(v, v);
    }
    static void storeFlags(uint8_t* to, uint32_t bits) {
        const __m512i flags = _mm512_maskz_set1_epi32(__mmask16(bits), 1);
        _mm_storeu_si128(reinterpret_cast<__m128i*>(to), _mm512_cvtepi32_epi8(flags));
    }
    /// @param to aligned to the vector
    static void store(float* to, Floats v) { _mm512_store_ps(to, v); }
    static Floats gather(const float* base, const uint32_t* index) {
        return _mm512_i32gather_ps(_mm512_loadu_si512(index), base, 4);
    }
    static float lane(const Floats& v, uint32_t i) {
        return reinterpret_cast<const float*>(&v)[i]; // vectors may alias
    }
    static Floats add(Floats a, Floats b) { return _mm512_add_ps(a, b); }
    static Floats sub(Floats a, Floats b) { return _mm512_sub_ps(a, b); }
    static Floats mul(Floats a, Floats b) { return _mm512_mul_ps(a, b); }
    static Floats div(Floats a, Floats b) { return _mm512_div_ps(a, b); }
    static Floats fma(Floats a, Floats b, Floats c) { return _mm512_fmadd_ps(a, b, c); }
    static Floats root(Floats a) { return _mm512_sqrt_ps(a); }
    static Floats lesser(Floats a, Floats b) { return _mm512_min_ps(a, b); }
    static Floats greater(Floats a, Floats b) { return _mm512_max_ps(a, b); }
    static Floats absolute(Floats a) { return _mm512_abs_ps(a); }
    static uint32_t less(Floats a, Floats b) { return _mm512_cmp_ps_mask(a, b, _CMP_LT_OQ); }
    static uint32_t lessOrEqual(Floats a, Floats b) { return _mm512_cmp_ps_mask(a, b, _CMP_LE_OQ); }
    static Floats select(uint32_t which, Floats a, Floats b) {
        return _mm512_mask_blend_ps(__mmask16(which), b, a);
    }
    static Ints splatInt(int32_t v) { return _mm512_set1_epi32(v); }
    static Ints toInts(Floats v) { return _mm512_cvttps_epi32(v); }
    static Floats toFloats(Ints v) { return _mm512_cvtepi32_ps(v); }
    static void storeInts(int32_t* to, Ints v) { _mm512_store_si512(to, v); }
    static Ints addInts(Ints a, Ints b) { return _mm512_add_epi32(a, b); }
    static Ints mulInts(Ints a, Ints b) { return _mm512_mullo_epi32(a, b); }
    static Ints andInts(Ints a, Ints b) { return _mm512_and_si512(a, b); }
    static Ints shiftLeft(Ints a, int by) { return _mm512_sll_epi32(a, _mm_cvtsi32_si128(by)); }
    static Ints shiftRight(Ints a, int by) { return _mm512_sra_epi32(a, _mm_cvtsi32_si128(by)); }
    static uint32_t equalInts(Ints a, Ints b) { return _mm512_cmpeq_epi32_mask(a, b); }
    static Ints selectInts(uint32_t which, Ints a, Ints b) {
        return _mm512_mask_blend_epi32(__mmask16(which), b, a);
    }
    static Ints gatherInts(const uint32_t* base, Ints index) {
        return _mm512_i32gather_epi32(index, base, 4);
    }
    /// Returns 1 << by of every lane. @param by 0..31
    static Ints bitOf(Ints by) { return _mm512_sllv_epi32(splatInt(1), by); }
    /// Returns base[index], or what other threads' atomics have replaced since. For words in which
    /// bits are only set, where an old value errs on the safe side.
    static Ints gatherShared(const uint32_t* base, Ints index) { return gatherInts(base, index); }
    /// Asks the caches for base[index] of every lane.
    static void prefetch(const uint32_t* base, Ints index) {
        alignas(64) int32_t at[kWidth];
        storeInts(at, index);
        for (const int32_t i : at)
            __builtin_prefetch(base + i);
    }
    static Floats bitsToFloats(Ints v) { return _mm512_castsi512_ps(v); }
    static Doubles splatDouble(double v) { return {_mm512_set1_pd(v), _mm512_set1_pd(v)}; }
    static Doubles toDoubles(Floats v) {
        return {_mm512_cvtps_pd(_mm512_castps512_ps256(v)),
                _mm512_cvtps_pd(_mm512_extractf32x8_ps(v, 1))};
    }
    static Floats toFloats(const Doubles& v) {
        return _mm512_insertf32x8(_mm512_castps256_ps512(_mm512_cvtpd_ps(v.low)),
                                  _mm512_cvtpd_ps(v.high), 1);
    }
    static Doubles add(const Doubles& a, const Doubles& b) {
        return {_mm512_add_pd(a.low, b.low), _mm512_add_pd(a.high, b.high)};
    }
    static Doubles sub(const Doubles& a, const Doubles& b) {
        return {_mm512_sub_pd(a.low, b.low), _mm512_sub_pd(a.high, b.high)};
    }
    static Doubles mul(const Doubles& a, const Doubles& b) {
        return {_mm512_mul_pd(a.low, b.low), _mm512_mul_pd(a.high, b.high)};
    }
    static Doubles div(const Doubles& a, const Doubles& b) {
        return {_mm512_div_pd(a.low, b.low), _mm512_div_pd(a.high, b.high)};
    }
    static Doubles lesser(const Doubles& a, const Doubles& b) {
        return {_mm512_min_pd(a.low, b.low), _mm512_min_pd(a.high, b.high)};
    }
    static Doubles greater(const Doubles& a, const Doubles& b) {
        return {_mm512_max_pd(a.low, b.low), _mm512_max_pd(a.high, b.high)};
    }
    static uint32_t lessOrEqual(const Doubles& a, const Doubles& b) {
        return uint32_t(_mm512_cmp_pd_mask(a.low, b.low, _CMP_LE_OQ)) |
               uint32_t(_mm512_cmp_pd_mask(a.high, b.high, _CMP_LE_OQ)) << 8;
    }
    static Doubles truncate(const Doubles& v) {
        constexpr int kToZero = _MM_FROUND_TO_ZERO | _MM_FROUND_NO_EXC;
        return {_mm512_roundscale_pd(v.low, kToZero), _mm512_roundscale_pd(v.high, kToZero)};
    }
    static float least(uint32_t which, Floats v) {
        return _mm512_reduce_min_ps(select(which, v, splat(kLargestScale)));
    }
    static float greatest(uint32_t which, Floats v) {
        return _mm512_reduce_max_ps(select(which, v, splat(-kLargestScale)));
    }

private:
    static __m512i bytes(const uint8_t* from) {
        return _mm512_cvtepu8_epi32(_mm_loadu_si128(reinterpret_cast<const __m128i*>(from)));
    }
};

} // namespace
} // namespace shadowdag::stream

#endif
