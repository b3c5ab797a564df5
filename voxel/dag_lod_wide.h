// SPDX-License-Identifier: Apache-2.0
// The traversal of dag_lod.h in AVX2 over the wide form of a DAG. The same bits, because the
// definition there does not depend on the order of visits. Used by dag_lod.h only.
//
// A node's 64 cells are of level C, its eight children of level C + 1. Both can stop a segment:
// the children through their cells, all eight of a child set where one is, because a box is met
// when and only when one of its eight halves is: a time at which the segment is in the box is, axis
// by axis, in the lower half or in the upper, whose computed times overlap (their common plane
// entered is never later than left).
#pragma once

#include "voxel/lod_coverage.h"
#include "voxel/wide_dag_trace.h"

#if defined(SDAG_RAY_SLABS_AVX2)

namespace shadowdag::avx2 {

/// WideTester limited to the times of the segment between two limits.
struct WideLodTester : WideTester {
    explicit WideLodTester(const RaySlabs& r) : WideTester(r) {}

    /// As WideTester::hits, met from `begin` to `end`. Near times are kept from below at begin, far
    /// times from above at end, in two of the axes: each pair has one of them.
    uint64_t hits(const float* corner, const float* place, float side, float begin,
                  float end) const {
        const __m256 cell = _mm256_set1_ps(side), node = _mm256_set1_ps(4 * side);
        const auto times = [&](int a, const __m256& plane, const __m256& offset) {
            const __m256 first = _mm256_fmadd_ps(cell, plane, _mm256_broadcast_ss(corner + a));
            const __m256 p = _mm256_fmadd_ps(node, _mm256_broadcast_ss(place + a), first);
            return _mm256_fmadd_ps(p, inv[a], offset);
        };
        const __m128 b = _mm_set1_ps(begin), e = _mm_set1_ps(end);
        const __m256 sign = _mm256_set1_ps(-0.0f);
        const __m256 greater = _mm256_set_m128(_mm_xor_ps(e, _mm256_castps256_ps128(sign)), b);
        const __m256 lesser = _mm256_set_m128(_mm_xor_ps(b, _mm256_castps256_ps128(sign)), e);
        const __m256 x = _mm256_max_ps(times(0, planes[0], c[0]), greater);
        const __m256 y = _mm256_max_ps(times(1, planes[1], c[1]), greater);
        const __m256 yOther = _mm256_min_ps(times(1, planesOther[1], cOther[1]), lesser);
        const __m256 zOther = _mm256_min_ps(times(2, planesOther[2], cOther[2]), lesser);
        return _pdep_u64(pair(x, yOther), 0x000000000f0f0f0fu) * 0x0000001100000011u &
               _pdep_u64(pair(x, zOther), 0x0000333300003333u) * 0x0000000000050005u &
               _pdep_u64(pair(y, zOther), 0x0055005500550055u) * 0x0000000000000303u;
    }
};

/// One segment through the wide form. Times is LodTimes.
template <class Times> struct WideLodTrace {
    const WideDagView& wide;
    const Times& times;
    uint32_t threshold;
    WideLodTester tester;

    static uint64_t maskAt(const uint32_t* words) {
        uint64_t mask;
        std::memcpy(&mask, words, sizeof(mask));
        return mask;
    }
    /// Returns the address of the node below a cell.
    uint32_t below(uint32_t address, uint32_t cell) const {
        const uint64_t mask = maskAt(wide.words.data + address);
        return wide.words[address + 2 + uint32_t(std::popcount(_bzhi_u64(mask, cell)))];
    }
    /// Returns whether one of the children (bytes that are not 0, in the order of visits) counts.
    bool anyChildCounts(uint32_t address, uint32_t level, uint64_t met) const {
        if (threshold == 0)
            return met != 0;
        const uint64_t mask = maskAt(wide.words.data + address);
        while (met != 0) {
            const uint32_t byte = uint32_t(_tzcnt_u64(met)) / 8;
            const uint32_t child = byte ^ (tester.order & 7u);
            const uint32_t coverage =
                level == 1 ? detail::octantCoverage(uint32_t(mask >> (8 * child)) & 0xffu)
                           : wide.coverage[address + child / 4] >> (8 * (child % 4)) & 0xffu;
            if (coverage >= threshold)
                return true;
            met &= ~(uint64_t(0xff) << (8 * byte));
        }
        return false;
    }
    /// Returns whether one of the cells (bits, in the order of visits) counts.
    bool anyCellCounts(uint32_t address, uint32_t level, uint64_t met) const {
        if (threshold == 0 || level == 0)
            return met != 0;
        for (; met != 0; met &= met - 1) {
            const uint32_t node = below(address, uint32_t(_tzcnt_u64(met)) ^ tester.order);
            const uint32_t coverage = level == kLeafLog2
                                          ? detail::leafCoverage(maskAt(wide.words.data + node))
                                          : wide.coverage[node + 2];
            if (coverage >= threshold)
                return true;
        }
        return false;
    }
    /// Returns whether the node's children or cells, those of `level`, stop the segment; if not,
    /// `pending` receives the cells to descend into.
    bool stops(uint32_t address, uint32_t level, const float* corner, const float* place,
               uint64_t& pending) const {
        const float side = float(1u << level);
        const uint64_t mask = tester.ordered(wide.words.data + address);
        const auto isRead = [&](uint32_t l) { return l <= times.top && l >= times.bottom; };
        if (isRead(level + 1)) {
            const __m128i empty =
                _mm_cmpeq_epi8(_mm_cvtsi64_si128(int64_t(mask)), _mm_setzero_si128());
            const uint64_t filled = ~uint64_t(_mm_cvtsi128_si64(empty));
            const uint64_t met = filled & tester.hits(corner, place, side, times.begin[level + 1],
                                                      times.end[level + 1]);
            if (anyChildCounts(address, level + 1, met))
                return true;
        }
        if (isRead(level)) {
            const uint64_t met =
                mask & tester.hits(corner, place, side, times.begin[level], times.end[level]);
            if (anyCellCounts(address, level, met))
                return true;
        }
        pending = 0;
        if (level > times.bottom) {
            const float begin = level <= times.top ? times.begin[level - 1] : 0.0f;
            pending = mask & tester.hits(corner, place, side, begin, 1.0f);
        }
        return false;
    }
    /// Returns whether the root's cell or anything in it stops the segment.
    bool isDark(const RaySlabs& r, uint32_t rootLevel) const {
        if (times.top >= rootLevel && wide.rootLevel == rootLevel) {
            const bool isMet = (portable::childHits(r, 0, 0, 0, float(1u << rootLevel),
                                                    times.begin[rootLevel], times.end[rootLevel]) &
                                1) != 0;
            if (isMet && (threshold == 0 || wide.coverage[wide.rootAddress + 2] >= threshold))
                return true;
            if (times.bottom >= rootLevel)
                return false;
        }
        struct Entry {
            alignas(16) float corner[4];
            uint64_t pending;
            uint32_t address;
        };
        Entry stack[(kMaxResolutionLog2 + 1) / 2];
        uint32_t depth = 0, level = wide.rootLevel - 2;
        _mm_store_ps(stack[0].corner, _mm_setzero_ps());
        stack[0].address = wide.rootAddress;
        if (stops(wide.rootAddress, level, stack[0].corner, kCells.at[0], stack[0].pending))
            return true;
        while (true) {
            Entry& here = stack[depth];
            if (here.pending == 0) {
                if (depth-- == 0)
                    return false;
                level += 2;
                continue;
            }
            const uint32_t cell = uint32_t(_tzcnt_u64(here.pending)) ^ tester.order;
            here.pending &= here.pending - 1;
            const uint32_t node = below(here.address, cell);
            uint64_t pending = 0;
            if (stops(node, level - 2, here.corner, kCells.at[cell], pending))
                return true;
            if (pending == 0)
                continue;
            Entry& next = stack[++depth];
            const __m128 moved =
                _mm_mul_ps(_mm_set1_ps(float(1u << level)), _mm_load_ps(kCells.at[cell]));
            _mm_store_ps(next.corner, _mm_add_ps(moved, _mm_load_ps(here.corner)));
            next.pending = pending;
            next.address = node;
            level -= 2;
        }
    }
};

} // namespace shadowdag::avx2

#endif
