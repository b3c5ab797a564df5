// SPDX-License-Identifier: Apache-2.0
// Masks of 64 cells: reordered into the order of visits, and combined. Only for the x86 files of
// ray streams (dag_stream_kernel.h).
#pragma once

#include "voxel/dag_stream_kernel.h"

#if defined(__AVX2__) && defined(__BMI2__)
#include <immintrin.h>

namespace shadowdag::stream {
namespace {

/// For order o (3 bits): where byte c ^ o of a mask comes from, and what the low and the high half
/// of a byte become when bit b moves to b ^ o.
struct OrderTables {
    alignas(16) uint8_t bytes[8][16], low[8][16], high[8][16];
    constexpr OrderTables() : bytes(), low(), high() {
        for (uint32_t o = 0; o < 8; ++o)
            for (uint32_t i = 0; i < 16; ++i) {
                bytes[o][i] = uint8_t(i < 8 ? i ^ o : 0x80);
                for (uint32_t b = 0; b < 4; ++b)
                    if (i >> b & 1) {
                        low[o][i] |= uint8_t(1u << (b ^ o));
                        high[o][i] |= uint8_t(1u << ((b + 4) ^ o));
                    }
            }
    }
};
constexpr OrderTables kOrders;

/// Brings masks into the order of visits of an octant.
class MaskOrder {
public:
    explicit MaskOrder(uint32_t octant) {
        const uint32_t o = endOctant(octant);
        const auto table = [](const uint8_t* t) {
            return _mm_load_si128(reinterpret_cast<const __m128i*>(t));
        };
        bytes_ = table(kOrders.bytes[o]);
        low_ = table(kOrders.low[o]);
        high_ = table(kOrders.high[o]);
    }

    uint64_t ordered(const uint32_t* words) const {
        const __m128i half = _mm_set1_epi8(15);
        const __m128i v =
            _mm_shuffle_epi8(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(words)), bytes_);
        const __m128i ofLow = _mm_shuffle_epi8(low_, _mm_and_si128(v, half));
        const __m128i ofHigh = _mm_shuffle_epi8(high_, _mm_and_si128(_mm_srli_epi16(v, 4), half));
        return uint64_t(_mm_cvtsi128_si64(_mm_or_si128(ofLow, ofHigh)));
    }

private:
    __m128i bytes_, low_, high_;
};

/// Returns the cells whose three pairs of coordinates are set. Bit number (x0, y0, z0, x1, y1, z1):
/// leave gaps at the missing axis, then fill them; the factor has a bit for each of its four
/// places.
inline uint64_t cellsOfPairs(uint32_t xy, uint32_t xz, uint32_t yz) {
    return _pdep_u64(xy, 0x000000000f0f0f0fu) * 0x0000001100000011u &
           _pdep_u64(xz, 0x0000333300003333u) * 0x0000000000050005u &
           _pdep_u64(yz, 0x0055005500550055u) * 0x0000000000000303u;
}

} // namespace
} // namespace shadowdag::stream

#endif
