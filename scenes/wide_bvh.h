// SPDX-License-Identifier: Apache-2.0
// The implicit 32-wide bounding volume hierarchy over boxes sorted along the Morton curve that
// lights and batches share. Source: Olsson et al. 2015, sec. IV-G and V-C; Olsson et al., Clustered
// Deferred and Forward Shading, HPG 2012, sec. 4.4.
#pragma once

#include "cuda/view.h"
#include "scenes/box.h"

#include <cstdint>
#include <vector>

namespace shadowdag {

constexpr uint32_t kBvhWidth = 32;
constexpr uint32_t kBvhMaxLevels = 7; ///< 32^7 > 2^32 items

/// Levels of boxes, leaves first. Level 0 holds itemCount boxes in Morton order; box i of level k +
/// 1 encloses boxes [32 i, 32 i + 32) of level k; the last level has at most 32 boxes.
struct WideBvhView {
    View<const Box> boxes;      ///< all levels, one after the other
    View<const uint32_t> items; ///< itemCount; original index of level-0 box i
    uint32_t levelStart[kBvhMaxLevels + 1] = {};
    uint32_t levelCount = 0; ///< 0 when there are no items
};

/// Returns the number of boxes of the top level, 0..kBvhWidth: how many parts traverseFrom divides
/// a query into.
SDAG_HD inline uint32_t topBoxCount(const WideBvhView& bvh) {
    return bvh.levelCount == 0
               ? 0
               : bvh.levelStart[bvh.levelCount] - bvh.levelStart[bvh.levelCount - 1];
}

/// Calls hit(originalIndex) for every item under boxes [topBegin, topEnd) of the top level whose
/// box `test(box)` accepts, in Morton order; `test` must accept a box that encloses an accepted
/// box. No recursion, no allocation.
template <class Test, class Hit>
SDAG_HD void traverseFrom(const WideBvhView& bvh, uint32_t topBegin, uint32_t topEnd,
                          const Test& test, const Hit& hit) {
    if (bvh.levelCount == 0)
        return;
    // One cursor a level: the next box to look at and where its siblings end.
    uint32_t next[kBvhMaxLevels], end[kBvhMaxLevels];
    int level = int(bvh.levelCount) - 1;
    next[level] = bvh.levelStart[level] + topBegin;
    end[level] = bvh.levelStart[level] + topEnd;
    while (level < int(bvh.levelCount)) {
        if (next[level] == end[level]) {
            ++level;
            continue;
        }
        const uint32_t i = next[level]++;
        if (!test(bvh.boxes[i]))
            continue;
        const uint32_t inLevel = i - bvh.levelStart[level];
        if (level == 0) {
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

/// Calls hit(originalIndex) for every item whose box `test(box)` accepts, as traverseFrom does.
template <class Test, class Hit>
SDAG_HD void traverse(const WideBvhView& bvh, const Test& test, const Hit& hit) {
    traverseFrom(bvh, 0, topBoxCount(bvh), test, hit);
}

/// Owns a hierarchy on the host.
class WideBvh {
public:
    /// Builds over the boxes (empty boxes allowed: they enclose nothing). Deterministic.
    void build(View<const Box> boxes);
    /// Recomputes all boxes for moved items without sorting again: correct, if looser.
    void refit(View<const Box> boxes);
    WideBvhView view() const;

private:
    std::vector<Box> boxes_;
    std::vector<uint32_t> items_;
    uint32_t levelStart_[kBvhMaxLevels + 1] = {};
    uint32_t levelCount_ = 0;
};

} // namespace shadowdag
