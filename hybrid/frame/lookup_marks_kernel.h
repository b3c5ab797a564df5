// SPDX-License-Identifier: Apache-2.0
// markLookup (shadowmap/lookup_pages.h) for V::kWidth receivers at once: the pages of the taps that
// lookup_lanes_kernel.h reads. Included as that is.
#pragma once

#include "hybrid/frame/lookup_lanes_kernel.h"

namespace shadowdag::stream {
namespace {

/// Marks the page of an entry, from the map's first on.
inline void markEntry(const LookupWork& work, uint32_t entry) {
    uint32_t* word = work.pages + entry / 32;
    const uint32_t bit = 1u << entry % 32;
    if ((__atomic_load_n(word, __ATOMIC_RELAXED) & bit) == 0)
        __atomic_fetch_or(word, bit, __ATOMIC_RELAXED);
}

/// The pages of one vector's filters: as pages have at least 16 texels across and filters at most
/// three, one or two along each axis.
template <class V> struct FilterPages {
    using I = typename V::Ints;
    using M = typename V::Mask;

    I entry;            ///< of the filter's first page
    M twoX, twoY;       ///< lanes that reach the page after it along x, y
    uint32_t facePages; ///< from a page's entry to that of the page after it along y

    /// Returns lanes whose pages are all known to be marked: most, where samples lie close. Lanes
    /// whose two pages along x lie in two words are left out, and lanes whose pages other threads
    /// mark at this moment may be; to mark them again does no harm.
    M areMarked(const LookupWork& work) const {
        const M first = isRowMarked(work, entry);
        if (uint32_t(twoY) == 0)
            return first;
        const I next = V::addInts(entry, V::splatInt(int32_t(facePages)));
        return first & (~twoY | isRowMarked(work, V::selectInts(twoY, next, entry)));
    }

    /// Marks the pages of lanes.
    void mark(const LookupWork& work, uint32_t lanes) const {
        alignas(64) int32_t entries[V::kWidth];
        V::storeInts(entries, entry);
        for (; lanes != 0; lanes &= lanes - 1) {
            const auto lane = uint32_t(__builtin_ctz(lanes));
            const auto first = uint32_t(entries[lane]);
            const bool isTwoX = (uint32_t(twoX) >> lane & 1) != 0;
            const bool isTwoY = (uint32_t(twoY) >> lane & 1) != 0;
            markEntry(work, first);
            if (isTwoX)
                markEntry(work, first + 1);
            if (isTwoY)
                markEntry(work, first + facePages);
            if (isTwoX && isTwoY)
                markEntry(work, first + facePages + 1);
        }
    }

private:
    /// Returns lanes whose page `at`, and in lanes of twoX the one after it, are known to be
    /// marked. @param at entries of the map, in all lanes
    M isRowMarked(const LookupWork& work, const I& at) const {
        const I zero = V::splatInt(0);
        const I firstBit = V::bitOf(V::andInts(at, V::splatInt(31)));
        const I nextBit = V::selectInts(twoX, V::addInts(firstBit, firstBit), zero);
        const I bits = V::addInts(firstBit, nextBit);
        const I word = V::gatherShared(work.pages, V::shiftRight(at, 5));
        const M isInNextWord = twoX & V::equalInts(nextBit, zero);
        return V::equalInts(V::andInts(word, bits), bits) & ~isInNextWord;
    }
};

template <class V, class Receivers, int side> void markAll(LookupWork& work) {
    using I = typename V::Ints;
    using M = typename V::Mask;
    const int log2 = int(work.pageTexelsLog2);
    for (uint32_t start = 0; start < work.count; start += V::kWidth) {
        const uint32_t asked = askedOf<V>(work, start);
        if (asked == 0)
            continue;
        const Receivers r(work, start, V::mask(asked)); // what it derives of planes is not read
        I first[2];
        M isTwo[2];
        for (int a = 0; a < 2; ++a) {
            first[a] = V::shiftRight(V::toInts(r.texel(work, a, 0)), log2);
            const I last = V::shiftRight(V::toInts(r.texel(work, a, side - 1)), log2);
            isTwo[a] = r.on & ~V::equalInts(first[a], last);
        }
        const FilterPages<V> pages{entriesOf<V>(work, r, first[0], first[1]), isTwo[0], isTwo[1],
                                   work.facePages};
        const uint32_t on = r.on;
        if (const uint32_t open = on & ~uint32_t(pages.areMarked(work)); open != 0)
            pages.mark(work, open);
        for (uint32_t lanes = asked & ~on; lanes != 0; lanes &= lanes - 1)
            work.left[work.leftCount++] = start + uint32_t(__builtin_ctz(lanes));
    }
}

template <class V> void markPages(LookupWork& work) {
    forFilter<V>(work, [&]<class Receivers, int side>() { markAll<V, Receivers, side>(work); });
}

} // namespace
} // namespace shadowdag::stream
