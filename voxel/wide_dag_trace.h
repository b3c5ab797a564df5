// SPDX-License-Identifier: Apache-2.0
// The predicate of dag_trace.h in AVX2, 64 cells at a time over the wide form of a DAG (dag.h):
// half the dependent steps, and none of them looks up an order. The same bits, because the order of
// traversal does not matter.
//
// All masks are in the order of visits: number i of a node's cells is cell i ^ order, order being
// the bits of the segment's octant, seen from its end, for both levels of the node. Planes are
// numbered against the axis if it runs backwards, masks are reordered beside the slab test, and the
// first cell is the lowest bit. LAYOUT.md lists what else was tried.
#pragma once

#include "voxel/dag.h"
#include "voxel/ray_slabs.h"

#include <cstring>

#if defined(SDAG_RAY_SLABS_AVX2)

namespace shadowdag::avx2 {

/// For order o (3 bits): where byte c ^ o of a mask comes from, and what the low and the high half
/// of a byte become when bit b moves to b ^ o.
struct OrderTables {
    alignas(16) uint8_t bytes[8][16] = {}, low[8][16] = {}, high[8][16] = {};
    constexpr OrderTables() {
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
inline constexpr OrderTables kOrders;

/// x, y, z of the 64 cells of a node, in cells.
struct CellPlaces {
    alignas(16) float at[64][4] = {};
    constexpr CellPlaces() {
        for (uint32_t i = 0; i < 64; ++i)
            for (uint32_t a = 0; a < 3; ++a)
                at[i][a] = float((i >> (3 + a) & 1) * 2 + (i >> a & 1));
    }
};
inline constexpr CellPlaces kCells;

/// The tests of one segment. Lanes 0..3 of one side of a pair hold near times, lanes 4..7 negated
/// far times; its other side holds far times and negated near times, so that one <= compares in
/// both directions.
struct WideTester {
    __m256 inv[3], c[3], planes[3];
    __m256 cOther[3], planesOther[3];
    __m128i bytes, low, high;
    uint32_t order; ///< for both levels: 6 bits

    explicit WideTester(const RaySlabs& r) {
        const uint32_t o = r.octant ^ 7u;
        order = o * 9;
        const auto table = [](const uint8_t* t) {
            return _mm_load_si128(reinterpret_cast<const __m128i*>(t));
        };
        bytes = table(kOrders.bytes[o]);
        low = table(kOrders.low[o]);
        high = table(kOrders.high[o]);
        const __m256 sign = _mm256_setr_ps(0.f, 0.f, 0.f, 0.f, -0.f, -0.f, -0.f, -0.f);
        const __m256 lowerFirst = _mm256_setr_ps(0, 0, 0, 0, 1, 1, 1, 1);
        const __m256 upperFirst = _mm256_setr_ps(1, 1, 1, 1, 0, 0, 0, 0);
        for (int a = 0; a < 3; ++a) {
            const __m256 k = (o >> a & 1) ? _mm256_setr_ps(3, 2, 1, 0, 3, 2, 1, 0)
                                          : _mm256_setr_ps(0, 1, 2, 3, 0, 1, 2, 3);
            const bool isAgainst = (r.octant >> a & 1) != 0;
            planes[a] = _mm256_add_ps(k, isAgainst ? upperFirst : lowerFirst);
            planesOther[a] = _mm256_add_ps(k, isAgainst ? lowerFirst : upperFirst);
            const __m128 near = _mm_set1_ps(r.cNear[a]), far = _mm_set1_ps(r.cFar[a]);
            inv[a] = _mm256_xor_ps(_mm256_set1_ps(r.inv[a]), sign);
            c[a] = _mm256_xor_ps(_mm256_set_m128(far, near), sign);
            cOther[a] = _mm256_xor_ps(_mm256_set_m128(near, far), sign);
        }
    }

    /// Returns the mask at `words` in the order of visits.
    uint64_t ordered(const uint32_t* words) const {
        const __m128i half = _mm_set1_epi8(15);
        const __m128i v =
            _mm_shuffle_epi8(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(words)), bytes);
        const __m128i ofLow = _mm_shuffle_epi8(low, _mm_and_si128(v, half));
        const __m128i ofHigh = _mm_shuffle_epi8(high, _mm_and_si128(_mm_srli_epi16(v, 4), half));
        return uint64_t(_mm_cvtsi128_si64(_mm_or_si128(ofLow, ofHigh)));
    }

    /// Returns bits (a0, b0, a1, b1), lowest first: for coordinates a0 + 2 a1 and b0 + 2 b1 of two
    /// axes, whether each's near time is at most the other's far time.
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

    /// Returns which of the 64 cells of side `side` are met, in the order of visits, of the node at
    /// corner + 4 * side * place. All planes are integers under 2^24: exact. A cell is met when
    /// each axis' near time is at most each other's far time (an axis' own always is).
    uint64_t hits(const float* corner, const float* place, float side) const {
        const __m256 cell = _mm256_set1_ps(side), node = _mm256_set1_ps(4 * side);
        // The corner is known before the place, so it is added last.
        const auto times = [&](int a, const __m256& plane, const __m256& offset) {
            const __m256 first = _mm256_fmadd_ps(cell, plane, _mm256_broadcast_ss(corner + a));
            const __m256 p = _mm256_fmadd_ps(node, _mm256_broadcast_ss(place + a), first);
            return _mm256_fmadd_ps(p, inv[a], offset);
        };
        const __m256 greater = _mm256_setr_ps(0, 0, 0, 0, -1, -1, -1, -1);
        const __m256 lesser = _mm256_setr_ps(1, 1, 1, 1, 0, 0, 0, 0);
        const __m256 x = _mm256_max_ps(times(0, planes[0], c[0]), greater);
        const __m256 y = _mm256_max_ps(times(1, planes[1], c[1]), greater);
        const __m256 yOther = _mm256_min_ps(times(1, planesOther[1], cOther[1]), lesser);
        const __m256 zOther = _mm256_min_ps(times(2, planesOther[2], cOther[2]), lesser);
        // Bit number (x0, y0, z0, x1, y1, z1): leave gaps at the missing axis, then fill them: the
        // factor has a bit for each of its four places.
        return _pdep_u64(pair(x, yOther), 0x000000000f0f0f0fu) * 0x0000001100000011u &
               _pdep_u64(pair(x, zOther), 0x0000333300003333u) * 0x0000000000050005u &
               _pdep_u64(pair(y, zOther), 0x0055005500550055u) * 0x0000000000000303u;
    }
};

/// Returns whether the segment meets a voxel; `wide` must not be empty.
inline bool meetsWide(const WideDagView& wide, const RaySlabs& r) {
    const WideTester tester(r);
    const uint32_t* words = wide.words.data;
    const auto maskAt = [words](uint32_t address) {
        uint64_t mask;
        std::memcpy(&mask, words + address, sizeof(mask));
        return mask;
    };
    // One entry a node of the path: its corner, and what of it is still to visit.
    struct Entry {
        alignas(16) float corner[4];
        uint64_t pending;
        uint32_t address;
    };
    Entry stack[(kMaxResolutionLog2 + 1) / 2];
    const uint32_t lastDepth = wide.rootLevel / 2 - 2; // its cells are leaves
    uint32_t depth = 0, address = wide.rootAddress;
    float side = float(1u << (wide.rootLevel - 2)); // of the node's cells
    _mm_store_ps(stack[0].corner, _mm_setzero_ps());
    uint64_t mask = maskAt(address);
    uint64_t pending =
        tester.ordered(words + address) & tester.hits(stack[0].corner, kCells.at[0], side);
    while (true) {
        while (pending == 0) {
            if (depth-- == 0)
                return false;
            pending = stack[depth].pending;
            address = stack[depth].address;
            mask = maskAt(address);
            side *= 4;
        }
        const uint32_t cell = uint32_t(_tzcnt_u64(pending)) ^ tester.order;
        pending &= pending - 1;
        const uint32_t below = words[address + 2 + uint32_t(std::popcount(_bzhi_u64(mask, cell)))];
        const float* place = kCells.at[cell];
        const uint64_t met =
            tester.ordered(words + below) & tester.hits(stack[depth].corner, place, side * 0.25f);
        if (depth == lastDepth) {
            if (met != 0)
                return true;
            continue;
        }
        stack[depth].pending = pending;
        stack[depth].address = address;
        const __m128 moved = _mm_mul_ps(_mm_set1_ps(side), _mm_load_ps(place));
        _mm_store_ps(stack[depth + 1].corner, _mm_add_ps(moved, _mm_load_ps(stack[depth].corner)));
        ++depth;
        address = below;
        mask = maskAt(address);
        side *= 0.25f;
        pending = met;
    }
}

} // namespace shadowdag::avx2

#endif
