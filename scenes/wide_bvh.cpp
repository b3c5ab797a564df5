// SPDX-License-Identifier: Apache-2.0
#include "scenes/wide_bvh.h"

#include "cuda/parallel_for.h"
#include "cuda/scan_sort.h"
#include "scenes/morton.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numeric>

namespace shadowdag {
namespace {

Box centresOf(View<const Box> boxes, const std::vector<uint32_t>& items) {
    Box centres;
    for (const uint32_t item : items)
        if (!boxes[item].empty())
            centres.add(boxes[item].center());
    return centres;
}

/// Empty boxes go last: they have no place.
uint64_t codeOf(const Box& box, const Box& grid) {
    return box.empty() ? ~0ull : mortonCode(box.center(), grid);
}

/// Returns a cube around the bounds, its corner on a grid of half its side, which is a power of two
/// less than four times the longest side of the bounds: the same until the bounds leave it or
/// shrink to half. Costs the codes at most two of their 21 bits an axis.
Box steadyCube(const Box& bounds) {
    const glm::vec3 e = bounds.extent();
    const float side = std::max({e.x, e.y, e.z});
    if (!(side > 0.0f))
        return {bounds.min, bounds.min};
    int exponent;
    std::frexp(side, &exponent);
    const float cell = std::ldexp(1.0f, exponent); // side < cell <= 2 side
    const glm::vec3 corner = glm::floor(bounds.min / cell) * cell;
    return {corner, corner + 2.0f * cell};
}

bool isSame(const Box& a, const Box& b) {
    return std::memcmp(&a, &b, sizeof a) == 0; // -0 is not 0 here: arrays are equal bit for bit
}

} // namespace

void WideBvh::build(View<const Box> boxes) {
    build(boxes, {});
}

void WideBvh::build(View<const Box> boxes, std::vector<uint8_t> isMover) {
    SDAG_ASSERT(isMover.empty() || isMover.size() == boxes.count);
    isMover_ = std::move(isMover);
    const auto moves = [&](uint32_t item) { return !isMover_.empty() && isMover_[item]; };
    items_.clear();
    movers_.clear();
    for (uint32_t item = 0; item < boxes.count; ++item) {
        if (moves(item))
            movers_.push_back({0, item});
        else
            items_.push_back(item);
    }
    const Box centres = centresOf(boxes, items_);
    std::vector<uint64_t> keys(items_.size());
    for (size_t i = 0; i < keys.size(); ++i)
        keys[i] = codeOf(boxes[items_[i]], centres);
    sortPairs(Backend::kCpu, viewOf(keys), viewOf(items_));

    slotOf_.assign(movers_.empty() ? 0 : boxes.count, kNoBvhItem);
    while (!movers_.empty() && items_.size() % kBvhWidth != 0)
        items_.push_back(kNoBvhItem);
    firstMover_ = uint32_t(items_.size());
    items_.resize(items_.size() + movers_.size());
    sortMovers(boxes);
    layOutLevels();
    refit(boxes);
}

/// Gives every moving item its code and its slot.
void WideBvh::sortMovers(View<const Box> boxes) {
    Box centres;
    for (const Entry& mover : movers_)
        if (!boxes[mover.item].empty())
            centres.add(boxes[mover.item].center());
    moverGrid_ = steadyCube(centres);
    for (Entry& mover : movers_)
        mover.code = codeOf(boxes[mover.item], moverGrid_);
    std::sort(movers_.begin(), movers_.end());
    for (uint32_t i = 0; i < movers_.size(); ++i) {
        items_[firstMover_ + i] = movers_[i].item;
        slotOf_[movers_[i].item] = firstMover_ + i;
    }
}

void WideBvh::layOutLevels() {
    levelCount_ = 0;
    levelStart_[0] = 0;
    for (size_t levelBoxes = items_.size(); levelBoxes > 0;) {
        levelStart_[levelCount_ + 1] = levelStart_[levelCount_] + uint32_t(levelBoxes);
        ++levelCount_;
        levelBoxes = levelBoxes <= kBvhWidth ? 0 : (levelBoxes + kBvhWidth - 1) / kBvhWidth;
    }
    boxes_.resize(levelStart_[levelCount_]);
}

BvhUpdateCounts WideBvh::update(View<const Box> boxes, const std::vector<uint32_t>& moved) {
    BvhUpdateCounts counts;
    if (moved.empty())
        return counts;
    const auto isNew = [&](uint32_t item) { return isMover_.empty() || !isMover_[item]; };
    if (std::any_of(moved.begin(), moved.end(), isNew)) {
        std::vector<uint8_t> isMover = isMover_;
        isMover.resize(boxes.count, 0);
        for (const uint32_t item : moved)
            isMover[item] = 1;
        build(boxes, std::move(isMover));
        return {uint32_t(boxes.count), uint32_t(boxes_.size()), true, true};
    }

    Box centres;
    for (const Entry& mover : movers_)
        if (!boxes[mover.item].empty())
            centres.add(boxes[mover.item].center());
    if (!isSame(steadyCube(centres), moverGrid_)) {
        sortMovers(boxes);
        counts.sortedKeyCount = uint32_t(movers_.size());
        counts.isRebuilt = true;
        for (uint32_t i = 0; i < movers_.size(); ++i)
            setLeaf(firstMover_ + i, boxes[movers_[i].item], counts);
        refitAbove(counts);
        return counts;
    }

    std::vector<Entry> changed;
    std::vector<uint32_t> left; // positions along movers_ that become free
    for (const uint32_t item : moved) {
        const uint32_t place = slotOf_[item] - firstMover_;
        const uint64_t code = codeOf(boxes[item], moverGrid_);
        if (code != movers_[place].code) {
            changed.push_back({code, item});
            left.push_back(place);
        } else {
            setLeaf(slotOf_[item], boxes[item], counts);
        }
    }
    if (!changed.empty()) {
        counts.sortedKeyCount = uint32_t(changed.size());
        std::sort(changed.begin(), changed.end());
        std::sort(left.begin(), left.end());
        // Merge what stays with what changed, from the first place that differs until both have
        // caught up: beyond that nothing has shifted, up to the next difference.
        std::vector<Entry> merged;
        size_t nextChanged = 0, nextLeft = 0;
        while (nextChanged < changed.size() || nextLeft < left.size()) {
            size_t first = movers_.size();
            if (nextLeft < left.size())
                first = left[nextLeft];
            if (nextChanged < changed.size())
                first = std::min(first, size_t(std::lower_bound(movers_.begin(), movers_.end(),
                                                                changed[nextChanged]) -
                                               movers_.begin()));
            merged.clear();
            size_t next = first; // of movers_
            do {
                if (nextLeft < left.size() && left[nextLeft] == next) {
                    ++nextLeft;
                    ++next;
                } else if (nextChanged < changed.size() &&
                           (next == movers_.size() || changed[nextChanged] < movers_[next])) {
                    merged.push_back(changed[nextChanged++]);
                } else {
                    merged.push_back(movers_[next++]);
                }
            } while (first + merged.size() != next);
            for (size_t i = 0; i < merged.size(); ++i) {
                const uint32_t slot = firstMover_ + uint32_t(first + i);
                movers_[first + i] = merged[i];
                items_[slot] = merged[i].item;
                slotOf_[merged[i].item] = slot;
                setLeaf(slot, boxes[merged[i].item], counts);
            }
        }
    }
    refitAbove(counts);
    return counts;
}

void WideBvh::setLeaf(uint32_t slot, const Box& box, BvhUpdateCounts& counts) {
    if (isSame(boxes_[slot], box))
        return;
    boxes_[slot] = box;
    ++counts.boxCount;
    if (dirty_.empty() || dirty_.back() != slot / kBvhWidth)
        dirty_.push_back(slot / kBvhWidth);
}

/// Recomputes the boxes above the changed leaves, as far up as they change.
void WideBvh::refitAbove(BvhUpdateCounts& counts) {
    std::vector<uint32_t> above;
    for (uint32_t level = 1; level < levelCount_ && !dirty_.empty(); ++level) {
        std::sort(dirty_.begin(), dirty_.end());
        dirty_.erase(std::unique(dirty_.begin(), dirty_.end()), dirty_.end());
        above.clear();
        for (const uint32_t i : dirty_) {
            const Box box = enclose(level, i);
            Box& kept = boxes_[levelStart_[level] + i];
            ++counts.boxCount;
            if (isSame(kept, box))
                continue;
            kept = box;
            above.push_back(i / kBvhWidth);
        }
        dirty_.swap(above);
    }
    dirty_.clear();
}

Box WideBvh::enclose(uint32_t level, uint32_t i) const {
    const uint32_t first = levelStart_[level - 1] + i * kBvhWidth;
    const uint32_t end = std::min(first + kBvhWidth, levelStart_[level]);
    Box box;
    for (uint32_t child = first; child < end; ++child)
        box.add(boxes_[child]);
    return box;
}

void WideBvh::refit(View<const Box> boxes) {
    for (size_t i = 0; i < items_.size(); ++i)
        boxes_[i] = items_[i] == kNoBvhItem ? Box() : boxes[items_[i]];
    for (uint32_t level = 1; level < levelCount_; ++level)
        for (uint32_t i = 0; i < levelStart_[level + 1] - levelStart_[level]; ++i)
            boxes_[levelStart_[level] + i] = enclose(level, i);
}

std::vector<ArrayRange> WideBvh::movingBoxes() const {
    std::vector<ArrayRange> ranges;
    size_t first = firstMover_;
    for (uint32_t level = 0; level < levelCount_; ++level, first /= kBvhWidth) {
        const size_t begin = levelStart_[level] + first, end = levelStart_[level + 1];
        if (!movers_.empty() && begin < end)
            ranges.push_back({begin, end - begin});
    }
    return ranges;
}

std::vector<ArrayRange> WideBvh::movingItems() const {
    if (movers_.empty())
        return {};
    return {{firstMover_, items_.size() - firstMover_}};
}

WideBvhView WideBvh::view() const {
    WideBvhView view;
    view.boxes = viewOf(boxes_);
    view.items = viewOf(items_);
    for (uint32_t i = 0; i <= kBvhMaxLevels; ++i)
        view.levelStart[i] = levelStart_[i];
    view.levelCount = levelCount_;
    return view;
}

} // namespace shadowdag
