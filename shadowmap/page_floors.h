// SPDX-License-Identifier: Apache-2.0
// The least stored depth of each page that is drawn into, so that what lies behind is not drawn.
#pragma once

#include "cuda/macros.h"
#include "cuda/view.h"

#include <algorithm>
#include <cstdint>

#if defined(__AVX2__) && !defined(__CUDACC__)
#define SDAG_PAGE_FLOOR_LANES 1
#include <immintrin.h>
#endif

namespace shadowdag {

/// What is known of one page of the pool.
struct PageFloor {
    uint32_t least; ///< no texel of the face in the page has smaller bits
    int32_t rows;   ///< rows drawn since `least` was computed
};

/// The pages of a pool, of which each is used by one thread. Bits of positive floats are ordered as
/// the floats are.
class PageFloors {
public:
    /// @param floors one a page of the pool; {0, kUnknownRows} where nothing is known
    explicit PageFloors(View<PageFloor> floors) : floors_(floors) {}

    /// Causes the first question about a page to read it.
    static constexpr int32_t kUnknownRows = 1 << 30;

    /// Returns whether all texels are known to be at least `bits`; reads no texel.
    bool hides(uint32_t page, uint32_t bits) const { return bits <= floors_[page].least; }

    /// Returns whether all texels are at least `bits`, and reads them to find out if as many rows
    /// were drawn since the last time as the page has, or, if that did not help, four times as
    /// many: reading costs less than they did.
    /// @param texels of the page, rows of `side` @param columns,rows in the face, from 1 to side
    bool refreshed(uint32_t page, uint32_t bits, const uint32_t* texels, int32_t side,
                   int32_t columns, int32_t rows) {
        PageFloor& floor = floors_[page];
        if (bits > floor.least && floor.rows >= side) {
            const uint32_t least = leastOf(texels, side, columns, rows);
            floor.rows = least > floor.least ? 0 : -3 * side;
            floor.least = std::max(floor.least, least);
        }
        return bits <= floor.least;
    }

    /// Returns what is known of all pages of the pool.
    const PageFloor* data() const { return floors_.data; }

    /// All texels are at least `bits` from now on.
    void raise(uint32_t page, uint32_t bits) {
        floors_[page].least = std::max(floors_[page].least, bits);
    }

    /// So many rows, or parts of rows, are drawn.
    void noteRows(uint32_t page, int32_t count) {
        PageFloor& floor = floors_[page];
        floor.rows = std::min(floor.rows + count, kUnknownRows);
    }

private:
    static uint32_t leastOf(const uint32_t* texels, int32_t side, int32_t columns, int32_t rows) {
        uint32_t least = 0xffffffffu;
#if defined(SDAG_PAGE_FLOOR_LANES) // GCC 12 does not vectorize the loop
        constexpr int32_t kEight = 8;
        __m256i lanes[2] = {_mm256_set1_epi32(-1), _mm256_set1_epi32(-1)};
#endif
        for (int32_t y = 0; y < rows; ++y, texels += side) {
            int32_t x = 0;
#if defined(SDAG_PAGE_FLOOR_LANES)
            for (; x + 2 * kEight <= columns; x += 2 * kEight)
                for (int32_t i = 0; i < 2; ++i)
                    lanes[i] = _mm256_min_epu32(
                        lanes[i], _mm256_loadu_si256(
                                      reinterpret_cast<const __m256i*>(texels + x + i * kEight)));
#endif
            for (; x < columns; ++x)
                least = std::min(least, texels[x]);
        }
#if defined(SDAG_PAGE_FLOOR_LANES)
        alignas(32) uint32_t of[kEight];
        _mm256_store_si256(reinterpret_cast<__m256i*>(of), _mm256_min_epu32(lanes[0], lanes[1]));
        least = std::min(least, *std::min_element(of, of + kEight));
#endif
        return least;
    }

    View<PageFloor> floors_;
};

} // namespace shadowdag
