// SPDX-License-Identifier: Apache-2.0
// Vectors of floats for the kernels that are compiled once per instruction set: AVX2. Every
// vector type has the same functions; results of comparisons hold one per lane. Only files that are
// compiled for that processor include it.
#pragma once

#if defined(__AVX2__) && defined(__FMA__)

#include "voxel/ray_slabs_leaf.h" // kLargestScale

#include <immintrin.h>

namespace shadowdag::stream {
namespace {

/// 8 floats, by AVX2 and FMA.
struct Avx2Lanes {
    static constexpr uint32_t kWidth = 8;
    using Floats = __m256;
    using Ints = __m256i; ///< signed
    struct Doubles {
        __m256d low, high;
    };
    /// Lanes, as comparisons give them and select() takes them. Converts to bits, lane 0 the
    /// lowest; back by mask(), which is slower.
    struct Mask {
        __m256 v;
        operator uint32_t() const { return uint32_t(_mm256_movemask_ps(v)); }
        friend Mask operator&(Mask a, Mask b) { return {_mm256_and_ps(a.v, b.v)}; }
        friend Mask operator|(Mask a, Mask b) { return {_mm256_or_ps(a.v, b.v)}; }
        friend Mask operator~(Mask a) {
            return {_mm256_xor_ps(a.v, _mm256_castsi256_ps(_mm256_set1_epi32(-1)))};
        }
    };
    /// @param bits those above the lanes are ignored
    static Mask mask(uint32_t bits) {
        const __m256i lanes = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
        const __m256i all = _mm256_set1_epi32(int(bits));
        return {_mm256_castsi256_ps(_mm256_cmpeq_epi32(_mm256_and_si256(all, lanes), lanes))};
    }

    static Floats splat(float v) { return _mm256_set1_ps(v); }
    static Floats load(const float* from) { return _mm256_loadu_ps(from); }
    static Floats loadBytes(const uint8_t* from) {
        const __m128i bytes = _mm_loadl_epi64(reinterpret_cast<const __m128i*>(from));
        return _mm256_cvtepi32_ps(_mm256_cvtepu8_epi32(bytes));
    }
    /// Returns the lanes whose byte is not 0.
    static uint32_t nonZero(const uint8_t* from) {
        const __m128i bytes = _mm_loadl_epi64(reinterpret_cast<const __m128i*>(from));
        return ~uint32_t(_mm_movemask_epi8(_mm_cmpeq_epi8(bytes, _mm_setzero_si128()))) & 0xffu;
    }
    /// Writes 1 for the lanes of `bits`, 0 for others.
    static void storeFlags(uint8_t* to, uint32_t bits) {
        const __m128i lanes = _mm_setr_epi8(1, 2, 4, 8, 16, 32, 64, -128, 0, 0, 0, 0, 0, 0, 0, 0);
        const __m128i is = _mm_and_si128(_mm_set1_epi8(char(bits)), lanes);
        _mm_storel_epi64(reinterpret_cast<__m128i*>(to), _mm_min_epu8(is, _mm_set1_epi8(1)));
    }
    /// @param to aligned to the vector
    static void store(float* to, Floats v) { _mm256_store_ps(to, v); }
    static Floats gather(const float* base, const uint32_t* index) {
        return _mm256_i32gather_ps(base,
                                   _mm256_loadu_si256(reinterpret_cast<const __m256i*>(index)), 4);
    }
    static float lane(const Floats& v, uint32_t i) {
        return reinterpret_cast<const float*>(&v)[i]; // vectors may alias
    }
    static Floats add(Floats a, Floats b) { return _mm256_add_ps(a, b); }
    static Floats sub(Floats a, Floats b) { return _mm256_sub_ps(a, b); }
    static Floats mul(Floats a, Floats b) { return _mm256_mul_ps(a, b); }
    static Floats div(Floats a, Floats b) { return _mm256_div_ps(a, b); }
    static Floats fma(Floats a, Floats b, Floats c) { return _mm256_fmadd_ps(a, b, c); }
    static Floats root(Floats a) { return _mm256_sqrt_ps(a); }
    static Floats lesser(Floats a, Floats b) { return _mm256_min_ps(a, b); }
    static Floats greater(Floats a, Floats b) { return _mm256_max_ps(a, b); }
    static Floats absolute(Floats a) { return _mm256_andnot_ps(_mm256_set1_ps(-0.0f), a); }
    static Mask less(Floats a, Floats b) { return {_mm256_cmp_ps(a, b, _CMP_LT_OQ)}; }
    static Mask lessOrEqual(Floats a, Floats b) { return {_mm256_cmp_ps(a, b, _CMP_LE_OQ)}; }
    static Floats select(Mask which, Floats a, Floats b) { return _mm256_blendv_ps(b, a, which.v); }
    static Floats select(uint32_t which, Floats a, Floats b) { return select(mask(which), a, b); }
    static Ints splatInt(int32_t v) { return _mm256_set1_epi32(v); }
    /// Rounds towards zero; what is not in the range of integers becomes any number.
    static Ints toInts(Floats v) { return _mm256_cvttps_epi32(v); }
    static Floats toFloats(Ints v) { return _mm256_cvtepi32_ps(v); }
    /// @param to aligned to the vector
    static void storeInts(int32_t* to, Ints v) {
        _mm256_store_si256(reinterpret_cast<__m256i*>(to), v);
    }
    static Ints addInts(Ints a, Ints b) { return _mm256_add_epi32(a, b); }
    static Ints mulInts(Ints a, Ints b) { return _mm256_mullo_epi32(a, b); }
    static Ints andInts(Ints a, Ints b) { return _mm256_and_si256(a, b); }
    static Ints shiftLeft(Ints a, int by) { return _mm256_sll_epi32(a, _mm_cvtsi32_si128(by)); }
    static Ints shiftRight(Ints a, int by) { return _mm256_sra_epi32(a, _mm_cvtsi32_si128(by)); }
    static Mask equalInts(Ints a, Ints b) {
        return {_mm256_castsi256_ps(_mm256_cmpeq_epi32(a, b))};
    }
    static Ints selectInts(Mask which, Ints a, Ints b) {
        return _mm256_castps_si256(select(which, _mm256_castsi256_ps(a), _mm256_castsi256_ps(b)));
    }
    static Ints gatherInts(const uint32_t* base, Ints index) {
        return _mm256_i32gather_epi32(reinterpret_cast<const int*>(base), index, 4);
    }
    /// Returns 1 << by of every lane. @param by 0..31
    static Ints bitOf(Ints by) { return _mm256_sllv_epi32(splatInt(1), by); }
    /// Returns base[index], or what other threads' atomics have replaced since. For words in which
    /// bits are only set, where an old value errs on the safe side.
    static Ints gatherShared(const uint32_t* base, Ints index) { return gatherInts(base, index); }
    /// Asks the caches for base[index] of every lane.
    static void prefetch(const uint32_t* base, Ints index) {
        alignas(32) int32_t at[kWidth];
        storeInts(at, index);
        for (const int32_t i : at)
            __builtin_prefetch(base + i);
    }
    static Floats bitsToFloats(Ints v) { return _mm256_castsi256_ps(v); }
    static Doubles splatDouble(double v) { return {_mm256_set1_pd(v), _mm256_set1_pd(v)}; }
    static Doubles toDoubles(Floats v) {
        return {_mm256_cvtps_pd(_mm256_castps256_ps128(v)),
                _mm256_cvtps_pd(_mm256_extractf128_ps(v, 1))};
    }
    static Floats toFloats(const Doubles& v) {
        return _mm256_set_m128(_mm256_cvtpd_ps(v.high), _mm256_cvtpd_ps(v.low));
    }
    static Doubles add(const Doubles& a, const Doubles& b) {
        return {_mm256_add_pd(a.low, b.low), _mm256_add_pd(a.high, b.high)};
    }
    static Doubles sub(const Doubles& a, const Doubles& b) {
        return {_mm256_sub_pd(a.low, b.low), _mm256_sub_pd(a.high, b.high)};
    }
    static Doubles mul(const Doubles& a, const Doubles& b) {
        return {_mm256_mul_pd(a.low, b.low), _mm256_mul_pd(a.high, b.high)};
    }
    static Doubles div(const Doubles& a, const Doubles& b) {
        return {_mm256_div_pd(a.low, b.low), _mm256_div_pd(a.high, b.high)};
    }
    static Doubles lesser(const Doubles& a, const Doubles& b) {
        return {_mm256_min_pd(a.low, b.low), _mm256_min_pd(a.high, b.high)};
    }
    static Doubles greater(const Doubles& a, const Doubles& b) {
        return {_mm256_max_pd(a.low, b.low), _mm256_max_pd(a.high, b.high)};
    }
    static Mask lessOrEqual(const Doubles& a, const Doubles& b) {
        const __m256 low = _mm256_castpd_ps(_mm256_cmp_pd(a.low, b.low, _CMP_LE_OQ));
        const __m256 high = _mm256_castpd_ps(_mm256_cmp_pd(a.high, b.high, _CMP_LE_OQ));
        const __m256d halves = _mm256_castps_pd(_mm256_shuffle_ps(low, high, 0x88));
        return {_mm256_castpd_ps(_mm256_permute4x64_pd(halves, 0xd8))};
    }
    /// Rounds towards zero. @param v in the range of integers
    static Doubles truncate(const Doubles& v) {
        constexpr int kToZero = _MM_FROUND_TO_ZERO | _MM_FROUND_NO_EXC;
        return {_mm256_round_pd(v.low, kToZero), _mm256_round_pd(v.high, kToZero)};
    }
    static float least(uint32_t which, Floats v) {
        v = select(which, v, splat(kLargestScale));
        __m128 h = _mm_min_ps(_mm256_castps256_ps128(v), _mm256_extractf128_ps(v, 1));
        h = _mm_min_ps(h, _mm_movehl_ps(h, h));
        return _mm_cvtss_f32(_mm_min_ss(h, _mm_movehdup_ps(h)));
    }
    static float greatest(uint32_t which, Floats v) {
        v = select(which, v, splat(-kLargestScale));
        __m128 h = _mm_max_ps(_mm256_castps256_ps128(v), _mm256_extractf128_ps(v, 1));
        h = _mm_max_ps(h, _mm_movehl_ps(h, h));
        return _mm_cvtss_f32(_mm_max_ss(h, _mm_movehdup_ps(h)));
    }
};

} // namespace
} // namespace shadowdag::stream

#endif
