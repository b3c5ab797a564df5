// SPDX-License-Identifier: Apache-2.0
// Ray streams for processors with AVX-512 (F, BW, CD, DQ, VL: x86-64-v4).
#include "voxel/dag_stream_kernel.h"

#if defined(__AVX512F__) && defined(__AVX512DQ__) && defined(__AVX512VL__) && defined(__BMI2__)
#include "voxel/dag_stream_order.h"
#include "voxel/lanes_avx512.h"
#include "voxel/lanes_twice.h"

#include <immintrin.h>

namespace shadowdag::stream {
namespace {

/// For lane l of 16: the coordinates of a pair's cell, bits (a0, b0, a1, b1) of l.
struct PairLanes {
    alignas(64) int first[16], second[16];
    constexpr PairLanes() : first(), second() {
        for (int l = 0; l < 16; ++l) {
            first[l] = (l & 1) + 2 * (l >> 2 & 1);
            second[l] = (l >> 1 & 1) + 2 * (l >> 3 & 1);
        }
    }
};
constexpr PairLanes kPairLanes;

struct Avx512 : Twice<Avx512Lanes> {
    /// All 16 pairs of two axes in one register: x and y as first of a pair, y and z as second.
    class Grid {
    public:
        Grid(const Slabs& s, uint32_t octant) : order_(octant) {
            for (int i = 0; i < 4; ++i) {
                const int a = kAxis[i];
                const __m512 planes =
                    _mm512_castps256_ps512(_mm256_loadu_ps(planeNumbers(octant, a)));
                const __m512i lanes =
                    _mm512_load_si512(i < 2 ? kPairLanes.first : kPairLanes.second);
                nearPlanes_[i] = _mm512_permutexvar_ps(lanes, planes);
                farPlanes_[i] =
                    _mm512_permutexvar_ps(_mm512_add_epi32(lanes, _mm512_set1_epi32(4)), planes);
            }
            planesXY_ =
                _mm512_insertf32x8(_mm512_castps256_ps512(_mm256_loadu_ps(planeNumbers(octant, 0))),
                                   _mm256_loadu_ps(planeNumbers(octant, 1)), 1);
            planesZ_ = _mm256_loadu_ps(planeNumbers(octant, 2));
            for (int a = 0; a < 3; ++a) {
                invNear_[a] = _mm512_set1_ps(s.invNear[a]);
                invFar_[a] = _mm512_set1_ps(s.invFar[a]);
                cNear_[a] = _mm512_set1_ps(s.cNear[a]);
                cFar_[a] = _mm512_set1_ps(s.cFar[a]);
            }
        }

        uint64_t ordered(const uint32_t* words) const { return order_.ordered(words); }

        /// Returns which of the 64 cells at the corner are met, in the order of visits. A cell is
        /// met when each axis' near time is at most each other's far time (an axis' own always is).
        uint64_t hits(const float* corner, float side) const {
            const __m512 cell = _mm512_set1_ps(side), zero = _mm512_setzero_ps(),
                         one = _mm512_set1_ps(1);
            __m512 near[4], far[4];
            for (int i = 0; i < 4; ++i) {
                const int a = kAxis[i];
                const __m512 at = _mm512_set1_ps(corner[a]);
                near[i] = _mm512_max_ps(_mm512_fmadd_ps(_mm512_fmadd_ps(cell, nearPlanes_[i], at),
                                                        invNear_[a], cNear_[a]),
                                        zero);
                far[i] = _mm512_min_ps(
                    _mm512_fmadd_ps(_mm512_fmadd_ps(cell, farPlanes_[i], at), invFar_[a], cFar_[a]),
                    one);
            }
            const auto pair = [&](int a, int b) {
                return uint32_t(_mm512_mask_cmp_ps_mask(
                    _mm512_cmp_ps_mask(near[a], far[b], _CMP_LE_OQ), near[b], far[a], _CMP_LE_OQ));
            };
            return cellsOfPairs(pair(0, 2), pair(0, 3), pair(1, 3));
        }

        /// Sets out[8 * a + k] to the planes of axis a, numbered as planeNumbers does.
        void planes(const float* corner, float side, float* out) const {
            const __m512 xy =
                _mm512_insertf32x8(_mm512_set1_ps(corner[0]), _mm256_set1_ps(corner[1]), 1);
            _mm512_store_ps(out, _mm512_fmadd_ps(_mm512_set1_ps(side), planesXY_, xy));
            _mm256_store_ps(out + 16, _mm256_fmadd_ps(_mm256_set1_ps(side), planesZ_,
                                                      _mm256_set1_ps(corner[2])));
        }

    private:
        __m512 planesXY_;
        __m256 planesZ_;
        static constexpr int kAxis[4] = {0, 1, 1, 2};
        MaskOrder order_;
        __m512 nearPlanes_[4], farPlanes_[4], invNear_[3], invFar_[3], cNear_[3], cFar_[3];
    };
};

} // namespace

void traceAvx512(const Work& work) {
    traceAll<Avx512>(work);
}

} // namespace shadowdag::stream

#endif
