// SPDX-License-Identifier: Apache-2.0
// The implicit 32-wide bounding volume hierarchy over boxes sorted along the Morton curve, used for
// lights and for batches. Source: Olsson et al. 2015, sec. IV-G and V-C; Olsson et al., Clustered
// Deferred and Forward Shading, HPG 2012, sec. 4.4.
#pragma once

#include "cuda/view.h"
#include "scenes/box.h"

#include <cstdint>
#include <vector>

namespace shadowdag {

constexpr uint32_t kBvhWidth = 32;
constexpr uint32_t kBvhMaxLevels = 7; ///< 32^7 > 2^32 items

constexpr uint32_t kNoBvhItem = ~0u; ///< fills the last 32 of the static items

/// Levels of boxes, leaves first. Level 0 holds the items' boxes in Morton order, first the static
/// ones, then the moving ones, each run along its own curve; if there are both, empty boxes fill
/// the first run up to a multiple of 32. Box i of level k + 1 encloses boxes [32 i, 32 i + 32) of
/// level k; the last level has at most 32 boxes.
///
///     level 0   S S S ... S - -|M M M ... M       -: empty, kNoBvhItem
///     level 1   [0,32) ... [P-32,P)|[P,P+32) ...  P: start of the movers
///     level 2   at most one box a level encloses both kinds
struct WideBvhView {
    View<const Box> boxes;      ///< all levels, one after the other
    View<const uint32_t> items; ///< as many as level 0; original index of its box i, or kNoBvhItem
    uint32_t levelStart[kBvhMaxLevels + 1] = {};
    uint32_t levelCount = 0; ///< 0 when there are no items
};

/// Returns the number of boxes of the top level, 0..kBvhWidth.
SDAG_HD inline uint32_t topBoxCount(const WideBvhView& bvh) {
    return bvh.levelCount == 0
               ? 0
               : bvh.levelStart[bvh.levelCount] - bvh.levelStart[bvh.levelCount - 1];
}

/// The boxes of a level, by which many threads divide a query.
struct BvhParts {
    uint32_t level = 0, count = 0;
};

/// A query is divided into at least so many parts where the levels allow it, so that no part is
/// long, and all queries into at most kMostBvhParts beyond those of the top level, because callers
/// keep some words for each.
constexpr uint32_t kLeastBvhParts = 64, kMostBvhParts = 1 << 18;

/// Returns by which level `queryCount` queries are each divided: the coarsest above level 0 that
/// has at least kLeastBvhParts boxes, or else the level with the most; a coarser one if that would
/// exceed kMostBvhParts. The top level at least; no part of a hierarchy without items.
SDAG_HD inline BvhParts partsOf(const WideBvhView& bvh, size_t queryCount) {
    BvhParts parts{bvh.levelCount == 0 ? 0 : bvh.levelCount - 1, topBoxCount(bvh)};
    while (parts.level > 1 && parts.count < kLeastBvhParts) {
        const uint32_t finer = bvh.levelStart[parts.level] - bvh.levelStart[parts.level - 1];
        if (finer * queryCount > kMostBvhParts)
            break;
        parts = {parts.level - 1, finer};
    }
    return parts;
}

/// Calls hit(originalIndex) for every item under boxes [begin, end) of level `top` whose box
/// `test(box)` accepts, in the order of level 0; `test` must accept a box that encloses an accepted
/// box. No recursion, no allocation.
template <class Test, class Hit>
SDAG_HD void traverseBelow(const WideBvhView& bvh, uint32_t top, uint32_t topBegin, uint32_t topEnd,
                           const Test& test, const Hit& hit) {
    if (bvh.levelCount == 0)
        return;
    // One cursor per level: the next box to test and the end of its siblings.
    uint32_t next[kBvhMaxLevels], end[kBvhMaxLevels];
    int level = int(top);
    next[level] = bvh.levelStart[level] + topBegin;
    end[level] = bvh.levelStart[level] + topEnd;
    while (level <= int(top)) {
        if (next[level] == end[level]) {
            ++level;
            continue;
        }
        const uint32_t i = next[level]++;
        if (!test(bvh.boxes[i]))
            continue;
        const uint32_t inLevel = i - bvh.levelStart[level];
        if (level == 0) {
            if (bvh.items[inLevel] != kNoBvhItem)
                hit(bvh.items[inLevel]);
        } else {
            --level;
            next[level] = bvh.levelStart[level] + inLevel * kBvhWidth;
            end[level] = next[level] + kBvhWidth;
            if (end[level] > bvh.levelStart[level + 1])
                end[level] = bvh.levelStart[level + 1];
        }
    }
}

/// The same for boxes of the top level.
template <class Test, class Hit>
SDAG_HD void traverseFrom(const WideBvhView& bvh, uint32_t topBegin, uint32_t topEnd,
                          const Test& test, const Hit& hit) {
    traverseBelow(bvh, bvh.levelCount == 0 ? 0 : bvh.levelCount - 1, topBegin, topEnd, test, hit);
}

/// Calls hit(originalIndex) for every item whose box `test(box)` accepts, as traverseFrom does.
template <class Test, class Hit>
SDAG_HD void traverse(const WideBvhView& bvh, const Test& test, const Hit& hit) {
    traverseFrom(bvh, 0, topBoxCount(bvh), test, hit);
}

/// Counts of an update of a hierarchy.
struct BvhUpdateCounts {
    uint32_t sortedKeyCount = 0; ///< Morton codes that changed, and so places along the curve
    uint32_t boxCount = 0;       ///< boxes written, of all levels
    bool isRebuilt = false;      ///< all movers were sorted again: a new mover, or a new grid
    bool isBuilt = false;        ///< everything was built again: a new mover
};

/// Owns a hierarchy on the host. Deterministic: its arrays are a function of the boxes and of the
/// set of moving items, whatever moved before.
class WideBvh {
public:
    /// Builds over the boxes (empty boxes allowed: they enclose nothing), all static.
    void build(View<const Box> boxes);
    /// The same with moving items in a separate run. @param isMover one flag per item; empty: none
    /// is
    void build(View<const Box> boxes, std::vector<uint8_t> isMover);
    /// Follows motion, with the same arrays as build: only codes that changed are sorted, between
    /// their unchanged neighbours, and only boxes above changed ones are recomputed. A static item
    /// that moves becomes a moving one for good; then everything is built again, as is the run of
    /// moving items when its bounds leave the power-of-two grid of its codes.
    /// Cost: moving items times a comparison, changed codes times a logarithm; nothing for static
    /// items.
    /// @param boxes all items' boxes, as many as built; @param moved every item whose box changed
    BvhUpdateCounts update(View<const Box> boxes, const std::vector<uint32_t>& moved);
    /// Recomputes all boxes for moved items without sorting again: correct, but looser. The
    /// baseline for update; do not call update after it.
    void refit(View<const Box> boxes);
    WideBvhView view() const;
    /// Return what an update that did not build everything again may have changed, ascending: runs
    /// of the view's boxes, one per level at most, and of its items.
    std::vector<ArrayRange> movingBoxes() const;
    std::vector<ArrayRange> movingItems() const;

private:
    struct Entry {
        uint64_t code;
        uint32_t item;
        bool operator<(const Entry& b) const {
            return code != b.code ? code < b.code : item < b.item;
        }
    };

    void layOutLevels();
    void sortMovers(View<const Box> boxes);
    void setLeaf(uint32_t slot, const Box& box, BvhUpdateCounts& counts);
    void refitAbove(BvhUpdateCounts& counts);
    Box enclose(uint32_t level, uint32_t i) const;

    std::vector<Box> boxes_;
    std::vector<uint32_t> items_;
    uint32_t levelStart_[kBvhMaxLevels + 1] = {};
    uint32_t levelCount_ = 0;
    std::vector<uint8_t> isMover_; ///< by item; empty: none is
    std::vector<Entry> movers_;    ///< in the order of their slots
    std::vector<uint32_t> slotOf_; ///< by item, of movers
    uint32_t firstMover_ = 0;      ///< slot
    Box moverGrid_;                ///< the grid of the movers' codes
    std::vector<uint32_t> dirty_;  ///< boxes of level 1 above a changed leaf
};

} // namespace shadowdag
