// SPDX-License-Identifier: Apache-2.0
// The pool of pages and the page tables of the maps of a frame, and their state between frames:
// which map of this frame is which of the last, and where its pages and drawn depths are. The host
// does the bookkeeping per map (hundreds of maps); pages and cells are handled by passes
// (kept_pages.h, drawn_cells.h).
#pragma once

#include "cuda/resident.h"
#include "shadowmap/cull.h"
#include "shadowmap/shadow_maps.h"

#include <vector>

namespace shadowdag {

class MapDrawer;

/// Internal to this folder.
class PageCache {
public:
    /// @param drawer holds the pool; null: this object does
    explicit PageCache(Backend backend, MapDrawer* drawer = nullptr);

    /// Releases all kept maps; their pages count as freed in the next frame. Memory stays, and
    /// pool() is empty until the next allocate().
    void forget();
    /// Releases all state of earlier frames, counts too: the next frame depends on itself alone.
    void reset();

    /// Starts a frame. With `keeps`, finds the kept maps of the requests, and appends to `maps` and
    /// `wordCount` those that are not requested and may stay; otherwise releases all.
    /// @param maps those of the requests, with the resolutions that fit
    /// @param wordCount of the page masks, 32 pages a word
    void begin(std::vector<ShadowMapInfo>& maps, uint64_t& wordCount,
               const ShadowMapOptions& options, bool keeps);

    /// Stores which batches moved since the last frame. Call before begin, of frames that may keep
    /// maps.
    /// @param areAllNamed whether movedBatches has all that moved; if not, all boxes are compared
    void noteMotion(const BatchView& hostBatches, View<const uint32_t> movedBatches,
                    bool areAllNamed);

    /// Allocates the needed pages, and clears the new ones unless the caller does that.
    /// @param needed bits of the requests' words; @param firstPage their exclusive scan
    /// @param wanted bits set
    /// @param counts receives all counts of pages, except those that count() fetches
    /// @param clears whether new pages are cleared; else freshEntries() has them
    /// @param stages receives the times of "page commit" and "page clear"
    void allocate(View<const ShadowMapInfo> maps, View<const uint32_t> needed,
                  View<const uint32_t> firstPage, uint64_t wanted, bool clears,
                  ShadowMapCounts& counts, StageTimes& stages);

    /// Fetches the counts for which allocate did not wait: how many pages were committed, freed and
    /// cleared. Call before the next allocate.
    void count(ShadowMapCounts& counts);

    /// Prepares culling: writes the needs of masks.cells and masks.blocks. Only when it keeps.
    KeptView prepareCulling(View<const ShadowMapInfo> maps, const CullMaskView& masks,
                            MapCulling culling);

    /// Stores that everything that culling requested is drawn. Only when it keeps.
    void noteDrawn(View<const uint32_t> cells);

    bool keeps() const { return keeps_; }
    View<const uint32_t> pageTable() const { return pageTable_.view(); }
    /// Returns the entries of pages that the last allocate() gave memory to, ascending.
    View<const uint32_t> freshEntries() const { return freshEntries_.view(); }
    /// Returns the page table for drawing: without pages that are complete.
    View<const uint32_t> openTable() const {
        return keeps_ ? openTable_.view() : pageTable_.view();
    }
    /// Return the pool; empty where a drawer holds it.
    View<uint32_t> pool() { return pool_.view(); }
    View<const uint32_t> pool() const { return pool_.view(); }

private:
    struct KeptMap {
        ShadowMapInfo info;
        uint32_t slot;
        uint32_t pageCount = 0;
    };

    uint32_t takeSlot();
    void sortOut(View<const ShadowMapInfo> maps, View<const uint32_t> needed);
    void countFresh(uint64_t fresh, uint64_t stale, ShadowMapCounts& counts) const;
    uint64_t pageTexels() const { return uint64_t(1) << (2 * pageTexelsLog2_); }
    DrawnView drawn() { return {drawnCells_.view(), drawnDepths_.view(), slots_.view()}; }

    Backend backend_;
    MapDrawer* drawer_;
    bool keeps_ = false, retains_ = false;
    uint32_t pageTexelsLog2_ = 6;
    uint64_t capacityPages_ = 0;
    uint32_t now_ = 0;                        // frames kept
    uint64_t heldPages_ = 0, heldBefore_ = 0; // pages with memory after the last frame, and before
    uint64_t heldAfter_ = 0; // as heldPages_, which reset() clears, for counts that are pending
    bool isCountPending_ = false; // until count()
    size_t requestCount_ = 0;     // the first maps; the others are not requested
    size_t keptRequestCount_ = 0;
    std::vector<KeptMap> kept_; // in the order of the last frame's maps
    std::vector<uint8_t> isSlotUsed_;
    std::vector<uint32_t> freshSlotsHost_;
    std::vector<Box> batchBoxes_; // of the last frame

    // mapCount * start in tableBefore_ or kNoPage; slot.
    Resident<uint32_t> startBefore_, slots_;
    Buffer<uint32_t> freshSlots_;
    // Entries: 32 a word; pool page or kNoPage.
    // isTableSame_: every entry stays where it was, so pageTable_ is that of the build before.
    bool isTableSame_ = false;
    Buffer<uint32_t> pageTable_, tableBefore_, openTable_;
    // Bits in the page table's order: pages under moved batches, first at the old place, then at
    // the new one.
    Buffer<uint32_t> marked_;
    // Moved batches: boxes before and now; one bit per batch.
    Buffer<Box> movedBefore_, movedNow_;
    Resident<uint32_t> movedBits_;
    // A page of the pool each, see SortOutPages; empty after a frame that keeps nothing.
    Buffer<uint32_t> pageStamps_, pageKeys_, pageEntries_, order_, freeRank_;
    Buffer<uint32_t> missing_, keptPerMap_, keptCounts_, freshEntries_;
    Buffer<uint32_t> pool_; // pageTexels() a page
    // By slot, see DrawnView; openBlocks_, openFaces_: see PrepareBlock; openRows_: see
    // ListOpenCells.
    Buffer<uint32_t> drawnCells_, drawnDepths_, openBlocks_, openFaces_, openRows_;
};

} // namespace shadowdag
