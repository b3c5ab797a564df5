// SPDX-License-Identifier: Apache-2.0
// markLookup (shadowmap/lookup_pages.h) for V::kWidth receivers at once: the pages of the taps that
// lookup_lanes_kernel.h reads. Included as that is.
#pragma once

#include "hybrid/frame/lookup_lanes_kernel.h"

namespace shadowdag::stream {
namespace {

/// Marks the pages of `lanes`. @param entry of each lane's page, from the map's first on
template <class V>
void markEntries(const LookupWork& work, uint32_t lanes, const typename V::Ints& entry) {
    if (lanes == 0)
        return;
    alignas(64) int32_t entries[V::kWidth];
    V::storeInts(entries, entry);
    while (lanes != 0) { // neighbours mostly share a page
        const auto first = uint32_t(entries[__builtin_ctz(lanes)]);
        uint32_t* word = work.pages + first / 32;
        const uint32_t bit = 1u << first % 32;
        if ((__atomic_load_n(word, __ATOMIC_RELAXED) & bit) == 0)
            __atomic_fetch_or(word, bit, __ATOMIC_RELAXED);
        lanes &= ~uint32_t(V::equalInts(entry, V::splatInt(int32_t(first))));
    }
}

template <class V, class Receivers, int side> void markAll(LookupWork& work) {
    using I = typename V::Ints;
    const int log2 = int(work.pageTexelsLog2);
    for (uint32_t start = 0; start < work.count; start += V::kWidth) {
        const uint32_t asked = askedOf<V>(work, start);
        if (asked == 0)
            continue;
        const Receivers r(work, start, V::mask(asked)); // what it derives of planes is not read
        I first[2], last[2];
        for (int a = 0; a < 2; ++a) {
            first[a] = V::shiftRight(V::toInts(r.texel(work, a, 0)), log2);
            last[a] = V::shiftRight(V::toInts(r.texel(work, a, side - 1)), log2);
        }
        const uint32_t on = r.on;
        const uint32_t twoX = on & ~uint32_t(V::equalInts(first[0], last[0]));
        const uint32_t twoY = on & ~uint32_t(V::equalInts(first[1], last[1]));
        markEntries<V>(work, on, entriesOf<V>(work, r, first[0], first[1]));
        if (twoX != 0)
            markEntries<V>(work, twoX, entriesOf<V>(work, r, last[0], first[1]));
        if (twoY != 0) {
            markEntries<V>(work, twoY, entriesOf<V>(work, r, first[0], last[1]));
            markEntries<V>(work, twoX & twoY, entriesOf<V>(work, r, last[0], last[1]));
        }
        for (uint32_t lanes = asked & ~on; lanes != 0; lanes &= lanes - 1)
            work.left[work.leftCount++] = start + uint32_t(__builtin_ctz(lanes));
    }
}

template <class V> void markPages(LookupWork& work) {
    forFilter<V>(work, [&]<class Receivers, int side>() { markAll<V, Receivers, side>(work); });
}

} // namespace
} // namespace shadowdag::stream
