// SPDX-License-Identifier: Apache-2.0
// Pages that are kept from frame to frame: which are carried over, which are stale, which release
// their memory, and which are cleared. Source: Olsson et al. 2015, sec. V-D; there a page is freed
// when a frame does not need it (sec. VII-b), here when its memory is needed elsewhere.
#pragma once

#include "cuda/atomics.h"
#include "cuda/mutant.h"
#include "cuda/pass.h"
#include "shadowmap/page_mask.h"

namespace shadowdag {

/// Returns the map that a word of 32 page-table entries belongs to.
/// @param maps ascending in pageTableStart; not empty
SDAG_HD inline uint32_t mapOfWord(View<const ShadowMapInfo> maps, size_t word) {
    uint32_t first = 0, end = uint32_t(maps.count);
    while (end - first > 1) {
        const uint32_t middle = first + (end - first) / 2;
        if (size_t(maps[middle].pageTableStart) <= word * 32)
            first = middle;
        else
            end = middle;
    }
    return first;
}

struct CarryPage;

/// Writes word i of the page table: the entries of the same map before, or none.
struct CarryPages {
    View<const ShadowMapInfo> maps;
    View<const uint32_t> startBefore; ///< mapCount; the map's start in `before`, or kNoPage
    View<const uint32_t> before;
    View<uint32_t> pageTable; ///< 32 a word

    size_t itemCount() const { return pageTable.count / 32; }
    SDAG_HD void operator()(size_t i) const {
        const uint32_t map = mapOfWord(maps, i);
        for (uint32_t k = 0; k < 32; ++k)
            carry(map, i * 32 + k);
    }
    /// CUDA processes them entry by entry.
    CarryPage shortItems() const;
    SDAG_HD void carry(uint32_t map, size_t entry) const {
        const uint32_t start = startBefore[map];
        pageTable[entry] =
            start == kNoPage ? kNoPage : before[start + entry - maps[map].pageTableStart];
    }
};

/// The same by entry.
struct CarryPage {
    CarryPages work;

    size_t itemCount() const { return work.pageTable.count; }
    SDAG_HD void operator()(size_t i) const { work.carry(mapOfWord(work.maps, i / 32), i); }
};
inline CarryPage CarryPages::shortItems() const {
    return {*this};
}

/// Marks the pages of map i / boxes.count into which the batch of box i % boxes.count may be drawn,
/// or may have been drawn before it moved.
struct MarkUnder {
    View<const ShadowMapInfo> maps;
    View<const uint32_t> slots;       ///< mapCount; see DrawnView
    View<const uint32_t> drawnDepths; ///< kFaceCount a slot: greatest drawn depth; empty:
                                      ///< all depths count
    View<const Box> boxesWorld;
    View<uint32_t> marked; ///< bits in the page table's order; start at 0
    uint32_t pageTexelsLog2;

    size_t itemCount() const { return maps.count * boxesWorld.count; }
    SDAG_HD void operator()(size_t i) const {
        const uint32_t mapIndex = uint32_t(i / boxesWorld.count);
        const ShadowMapInfo& map = maps[mapIndex];
        const Box& box = boxesWorld[i % boxesWorld.count];
        if (!reachesMap(map, box))
            return;
        for (uint32_t face = 0; face < kFaceCount; ++face) {
            FaceRect rect;
            if (!projectOnMap(map, box, face, 0.0f, rect) ||
                (!drawnDepths.empty() &&
                 depthBits(rect.depthMin) > drawnDepths[slots[mapIndex] * kFaceCount + face]))
                continue;
            const uint32_t n = map.faceTexels;
            const uint32_t x0 = faceCell(rect.uMin, n) >> pageTexelsLog2;
            const uint32_t x1 = faceCell(rect.uMax, n) >> pageTexelsLog2;
            const uint32_t y1 = faceCell(rect.vMax, n) >> pageTexelsLog2;
            for (uint32_t y = faceCell(rect.vMin, n) >> pageTexelsLog2; y <= y1; ++y) {
                const uint32_t row = pageTableIndex(map, face, 0, y);
                setBits(marked, row + x0, row + x1 + 1);
            }
        }
    }
};

/// The counts of SortOutPages, by position in an array.
enum KeptPageCount : uint32_t {
    kPagesHeld,     ///< needed, and their texels stay
    kPagesStale,    ///< needed, but something moved there: freed and allocated again
    kPagesRetained, ///< not needed, but kept
    kPagesMissing,  ///< needed, and without memory
    kKeptPageCounts
};

/// Decides about the pages of word i: those that are stale, or neither needed nor retained, release
/// their memory.
struct SortOutPages {
    View<const ShadowMapInfo> maps;
    View<const uint32_t> needed; ///< bits; words beyond are not needed
    View<const uint32_t> stale;  ///< bits; empty: none
    View<uint32_t> pageTable;
    View<uint32_t> pageStamps;  ///< per pool page: when it was last needed, 1 or later
    View<uint32_t> pageKeys;    ///< per pool page; starts at 0, free; then the order of eviction
    View<uint32_t> pageEntries; ///< per pool page: its page-table entry
    View<uint32_t> missing;     ///< per word of `needed`: needed pages without memory
    View<uint32_t> pagesPerMap; ///< starts at 0: pages kept
    View<uint32_t> counts;      ///< kKeptPageCounts; start at 0
    uint32_t now;
    bool retains;

    size_t itemCount() const { return pageTable.count / 32; }
    SDAG_HD void operator()(size_t i) const {
        uint32_t found[kKeptPageCounts] = {};
        for (uint32_t bit = 0; bit < 32; ++bit) {
            const Page page = sortOut(i, bit);
            for (uint32_t k = 0; k < kKeptPageCounts; ++k)
                found[k] += page.counts(KeptPageCount(k));
        }
        note(i, found);
    }

    /// What becomes of a page.
    struct Page {
        bool isNeeded, isKept, isReleased;

        SDAG_HD bool counts(KeptPageCount as) const {
            return as == kPagesHeld       ? isKept && isNeeded
                   : as == kPagesStale    ? isReleased && isNeeded
                   : as == kPagesRetained ? isKept && !isNeeded
                                          : isNeeded && !isKept;
        }
    };
    /// Decides about entry `bit` of word i.
    SDAG_HD Page sortOut(size_t i, uint32_t bit) const {
        const uint32_t entry = uint32_t(i * 32 + bit), page = pageTable[entry];
        const bool isNeeded = i < needed.count && (needed[i] >> bit & 1u),
                   isStale = !stale.empty() && (stale[i] >> bit & 1u);
        if (page == kNoPage || isStale || !(isNeeded || retains)) {
            if (page != kNoPage) // most are none: writing them anyway would take bandwidth
                pageTable[entry] = kNoPage;
            return {isNeeded, false, page != kNoPage};
        }
        if (isNeeded)
            pageStamps[page] = now;
        pageKeys[page] = isNeeded ? 0xffffffffu : pageStamps[page];
        pageEntries[page] = entry;
        return {isNeeded, true, false};
    }
    /// Adds the counts of word i.
    SDAG_HD void note(size_t i, const uint32_t (&found)[kKeptPageCounts]) const {
        if (i < needed.count)
            missing[i] = found[kPagesMissing];
        const uint32_t kept = found[kPagesHeld] + found[kPagesRetained];
        if (kept)
            atomicAddRelaxed(&pagesPerMap[mapOfWord(maps, i)], kept);
        for (uint32_t k = 0; k < kKeptPageCounts; ++k)
            if (found[k])
                atomicAddRelaxed(&counts[k], found[k]);
    }
};
void launchPass(CudaTag, const SortOutPages& work); ///< by warps

/// Allocates memory to the needed pages of word i that have none, in order, as far as memory goes:
/// free pages first, then the least recently needed ones.
struct AssignPages {
    View<const uint32_t> needed;    ///< bits
    View<const uint32_t> firstPage; ///< exclusive scan of the words' missing pages
    View<uint32_t> pageTable;       ///< 32 a word and perhaps more
    View<const uint32_t> order;     ///< pool pages in the order of eviction; empty: ascending
    View<const uint32_t> pageKeys;  ///< as SortOutPages left them, sorted as `order`; empty: all 0
    View<const uint32_t> pageEntries;
    View<uint32_t> pageStamps;   ///< may be empty
    View<uint32_t> freshEntries; ///< by rank: the page-table entries that were allocated
    uint32_t poolPages;
    uint32_t now;

    size_t itemCount() const { return needed.count; }
    SDAG_HD void operator()(size_t i) const {
        uint32_t rank = firstPage[i];
        for (uint32_t bit = 0; bit < 32; ++bit)
            if (isMissing(i, bit))
                assign(uint32_t(i * 32 + bit), rank++);
    }
    /// Returns whether entry `bit` of word i is needed and has no memory.
    SDAG_HD bool isMissing(size_t i, uint32_t bit) const {
        return (needed[i] >> bit & 1u) && pageTable[i * 32 + bit] == kNoPage;
    }
    /// Gives an entry the page of a rank among all that are missing.
    SDAG_HD void assign(uint32_t entry, uint32_t rank) const {
        if (rank >= poolPages)
            return;
        const uint32_t page = order.empty() ? rank : order[rank];
        if (!pageKeys.empty() && pageKeys[rank] != 0)
            pageTable[pageEntries[page]] = kNoPage; // of a page that is not needed
        if (!pageStamps.empty())
            pageStamps[page] = now;
        pageTable[entry] = page;
        freshEntries[rank] = entry;
    }
};
void launchPass(CudaTag, const AssignPages& work); ///< by warps

/// Texels that one item clears; a page holds at least 256.
constexpr uint32_t kClearedTexelsLog2 = 6;

/// Pages that just got memory, by rank: their page-table entries.
struct FreshPages {
    View<const uint32_t> entries;
    View<const uint32_t> usedCount; ///< one word, how many of the entries are in use: on CUDA,
                                    ///< where the host does not wait for it; empty: all are

    SDAG_HD size_t count() const { return usedCount.empty() ? entries.count : usedCount[0]; }
};

/// Sets to empty a run of texels of a page that just got memory: run i of all, pages in order.
struct ClearPages {
    FreshPages fresh;
    View<const uint32_t> pageTable;
    View<uint32_t> pool;
    uint32_t pageTexelsLog2;

    SDAG_HD uint32_t runsLog2() const { return 2 * pageTexelsLog2 - kClearedTexelsLog2; }
    size_t itemCount() const { return fresh.count() << runsLog2(); }
    SDAG_HD void operator()(size_t i) const {
        if (isMutant(Mutant::kPagesNotCleared))
            return;
        const size_t page = pageTable[fresh.entries[i >> runsLog2()]];
        const size_t run = i & ((size_t(1) << runsLog2()) - 1);
        uint32_t* const texels =
            &pool[(page << (2 * pageTexelsLog2)) + (run << kClearedTexelsLog2)];
        for (uint32_t k = 0; k < 1u << kClearedTexelsLog2; ++k)
            texels[k] = 0;
    }
};

void launchPass(CudaTag, const ClearPages& work); ///< by ClearTexels

/// The same by four texels: neighbouring threads write neighbouring texels.
struct ClearTexels {
    struct alignas(16) TexelQuad {
        uint32_t texels[4];
    };
    ClearPages work;

    SDAG_HD uint32_t quadsLog2() const { return 2 * work.pageTexelsLog2 - 2; }
    SDAG_HD size_t itemCount() const { return work.fresh.count() << quadsLog2(); }
    SDAG_HD void operator()(size_t i) const {
        const size_t page = work.pageTable[work.fresh.entries[i >> quadsLog2()]];
        const size_t quad = (page << quadsLog2()) + (i & ((size_t(1) << quadsLog2()) - 1));
        reinterpret_cast<TexelQuad*>(work.pool.data)[quad] = TexelQuad{};
    }
};

/// order[i] = i: the values that sorting pages by their keys moves along.
struct NumberPages {
    View<uint32_t> order;

    size_t itemCount() const { return order.count; }
    SDAG_HD void operator()(size_t i) const { order[i] = uint32_t(i); }
};

/// Marks the free pages with 1: an exclusive scan of the marks numbers them.
struct MarkFreePages {
    View<const uint32_t> pageKeys; ///< of SortOutPages
    View<uint32_t> marks;

    size_t itemCount() const { return pageKeys.count; }
    size_t grain() const { return 16384; }
    SDAG_HD void operator()(size_t page) const { marks[page] = pageKeys[page] == 0; }
};

/// Lists the free pages, ascending: the order in which they are taken where none is evicted.
struct ListFreePages {
    View<const uint32_t> pageKeys;
    View<const uint32_t> rank; ///< of free pages
    View<uint32_t> order;

    size_t itemCount() const { return pageKeys.count; }
    size_t grain() const { return 16384; }
    SDAG_HD void operator()(size_t page) const {
        if (pageKeys[page] == 0)
            order[rank[page]] = uint32_t(page);
    }
};

} // namespace shadowdag
