// SPDX-License-Identifier: Apache-2.0
// Items of very unequal size: an item that is too large for one thread is put on a list, in parts,
// and a second pass assigns each part to a group of lanes. So all threads of a GPU share the work
// of a triangle that covers the picture. Source: the split of small and large triangles in Laine,
// Karras, High-Performance Software Rasterization on GPUs, HPG 2011, sec. 4.
#pragma once

#include "cuda/atomics.h"
#include "cuda/view.h"

namespace shadowdag {

/// Lanes that take a part together: a warp of a GPU.
constexpr uint32_t kGroupLanes = 32;

/// Limits of a list, so that its counts fit one word: items, and parts of an item. (Maps of
/// `houses` that are all drawn at once, at 1920 x 1080, have 1.24 million large triangles.)
constexpr size_t kMaxSplitItems = size_t(3) << 20;
constexpr uint32_t kMaxSplitParts = 1u << 19;

/// An item that was split; `a` and `b` identify it to the pass that added it.
struct SplitItem {
    uint64_t firstPart; ///< number of its first part in the whole list
    uint32_t partCount;
    uint32_t a, b;
    uint32_t index; ///< its place in the list: that of further data of it
};

/// The list as passes see it.
struct SplitWorkView {
    View<SplitItem> items;
    View<uint64_t> taken; ///< [0]: items from bit kPartBits on, their parts below; [1]: refused

    static constexpr uint32_t kPartBits = 42;
    /// Threads that may add to a full list at once, more than the largest device runs.
    static constexpr uint64_t kMostAtOnce = uint64_t(1) << 19;
    static_assert(kMaxSplitItems + kMostAtOnce < uint64_t(1) << (64 - kPartBits));
    static_assert((kMaxSplitItems + kMostAtOnce) * kMaxSplitParts < uint64_t(1) << kPartBits);

    /// Adds an item of 1..kMaxSplitParts parts; returns false, and counts, if the list is full: the
    /// caller then does all of it by itself. Which items find space depends on the order of
    /// threads; the parts do not.
    /// @param index receives the item's place in the list
    SDAG_HD bool add(uint32_t a, uint32_t b, uint32_t partCount, uint32_t& index) const {
        SDAG_ASSERT(partCount > 0 && partCount <= kMaxSplitParts);
        // Tested first, so that the counts exceed the list by no more than the threads that run at
        // once (some 300 000 on the largest device); added in one step, so that items and their
        // parts ascend together.
        if (loadRelaxed(&taken[0]) >> kPartBits < items.count) {
            const uint64_t seen =
                atomicAddRelaxed(&taken[0], (uint64_t(1) << kPartBits) + partCount);
            if (seen >> kPartBits < items.count) {
                index = uint32_t(seen >> kPartBits);
                items[index] = {seen & ((uint64_t(1) << kPartBits) - 1), partCount, a, b, index};
                return true;
            }
        }
        atomicAddRelaxed(&taken[1], 1);
        return false;
    }
    /// Return the number of items and of parts in the list. For passes after the one that adds.
    SDAG_HD size_t itemCount() const {
        const size_t asked = size_t(taken[0] >> kPartBits);
        return asked < items.count ? asked : items.count;
    }
    SDAG_HD uint64_t partCount() const {
        const size_t count = itemCount();
        return count == 0 ? 0 : items[count - 1].firstPart + items[count - 1].partCount;
    }
    /// Returns the item that contains a part.
    SDAG_HD SplitItem itemOf(uint64_t part) const {
        size_t first = 0, end = itemCount();
        while (end - first > 1) {
            const size_t middle = first + (end - first) / 2;
            (items[middle].firstPart <= part ? first : end) = middle;
        }
        return items[first];
    }
};

} // namespace shadowdag
