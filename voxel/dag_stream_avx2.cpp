// SPDX-License-Identifier: Apache-2.0
// Ray streams for processors with AVX2, FMA and BMI2.
#include "voxel/dag_stream_kernel.h"

#if defined(__AVX2__) && defined(__FMA__) && defined(__BMI2__)
#include "voxel/dag_stream_order.h"
#include "voxel/lanes_avx2.h"
#include "voxel/lanes_twice.h"

#include <immintrin.h>

namespace shadowdag::stream {
namespace {

struct Avx2 : Twice<Twice<Avx2Lanes>> {
    /// Lanes 0..3 of one side of a pair hold near times, lanes 4..7 negated far times; its other
    /// side holds far times and negated near times, so that one <= compares in both directions.
    class Grid {
    public:
        Grid(const Slabs& s, uint32_t octant) : order_(octant) {
            const __m256 sign = _mm256_setr_ps(0.f, 0.f, 0.f, 0.f, -0.f, -0.f, -0.f, -0.f);
            const auto both = [&](float low, float high) {
                return _mm256_xor_ps(_mm256_set_m128(_mm_set1_ps(high), _mm_set1_ps(low)), sign);
            };
            for (int a = 0; a < 3; ++a) {
                planes_[a] = _mm256_loadu_ps(planeNumbers(octant, a));
                inv_[a] = both(s.invNear[a], s.invFar[a]);
                c_[a] = both(s.cNear[a], s.cFar[a]);
                planesOther_[a] = _mm256_permute2f128_ps(planes_[a], planes_[a], 1);
                invOther_[a] = both(s.invFar[a], s.invNear[a]);
                cOther_[a] = both(s.cFar[a], s.cNear[a]);
            }
        }

        uint64_t ordered(const uint32_t* words) const { return order_.ordered(words); }

        /// Returns which of the 64 cells at the corner are met, in the order of visits. A cell is
        /// met when each axis' near time is at most each other's far time (an axis' own always is).
        uint64_t hits(const float* corner, float side) const {
            const __m256 cell = _mm256_set1_ps(side);
            const auto times = [&](int a, __m256 plane, __m256 inv, __m256 c) {
                const __m256 p = _mm256_fmadd_ps(cell, plane, _mm256_broadcast_ss(corner + a));
                return _mm256_fmadd_ps(p, inv, c);
            };
            const __m256 greater = _mm256_setr_ps(0, 0, 0, 0, -1, -1, -1, -1);
            const __m256 lesser = _mm256_setr_ps(1, 1, 1, 1, 0, 0, 0, 0);
            const __m256 x = _mm256_max_ps(times(0, planes_[0], inv_[0], c_[0]), greater);
            const __m256 y = _mm256_max_ps(times(1, planes_[1], inv_[1], c_[1]), greater);
            const __m256 yOther =
                _mm256_min_ps(times(1, planesOther_[1], invOther_[1], cOther_[1]), lesser);
            const __m256 zOther =
                _mm256_min_ps(times(2, planesOther_[2], invOther_[2], cOther_[2]), lesser);
            return cellsOfPairs(pair(x, yOther), pair(x, zOther), pair(y, zOther));
        }

        /// Sets out[8 * a + k] to the planes of axis a, numbered as planeNumbers does.
        void planes(const float* corner, float side, float* out) const {
            for (int a = 0; a < 3; ++a)
                _mm256_store_ps(out + 8 * a, _mm256_fmadd_ps(_mm256_set1_ps(side), planes_[a],
                                                             _mm256_broadcast_ss(corner + a)));
        }

    private:
        /// Returns bits (a0, b0, a1, b1), lowest first: for coordinates a0 + 2 a1 and b0 + 2 b1 of
        /// two axes, whether each's near time is at most the other's far time.
        static uint32_t pair(__m256 a, __m256 b) {
            const __m256 a0 = _mm256_permute_ps(a, 0x44), a1 = _mm256_permute_ps(a, 0xee);
            const __m256 b0 = _mm256_permute_ps(b, 0x50), b1 = _mm256_permute_ps(b, 0xfa);
            const auto le = [](__m256 x, __m256 y) {
                return _mm256_castps_si256(_mm256_cmp_ps(x, y, _CMP_LE_OQ));
            };
            const __m256i both = _mm256_packs_epi16(_mm256_packs_epi32(le(a0, b0), le(a1, b0)),
                                                    _mm256_packs_epi32(le(a0, b1), le(a1, b1)));
            const uint32_t bits = uint32_t(_mm256_movemask_epi8(both));
            return bits & bits >> 16;
        }

        MaskOrder order_;
        __m256 inv_[3], c_[3], planes_[3], invOther_[3], cOther_[3], planesOther_[3];
    };
};

} // namespace

void traceAvx2(const Work& work) {
    traceAll<Avx2>(work);
}

} // namespace shadowdag::stream

#endif
