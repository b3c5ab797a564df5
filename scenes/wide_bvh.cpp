// SPDX-License-Identifier: Apache-2.0
#include "scenes/wide_bvh.h"

#include "cuda/parallel_for.h"
#include "cuda/scan_sort.h"
#include "scenes/morton.h"

#include <numeric>

namespace shadowdag {

void WideBvh::build(View<const Box> boxes) {
    const size_t count = boxes.count;
    Box centres;
    for (const Box& box : boxes)
        if (!box.empty())
            centres.add(box.center());
    std::vector<uint64_t> keys(count);
    items_.resize(count);
    std::iota(items_.begin(), items_.end(), 0u);
    // Empty boxes go last: they have no place.
    for (size_t i = 0; i < count; ++i)
        keys[i] = boxes[i].empty() ? ~0ull : mortonCode(boxes[i].center(), centres);
    sortPairs(Backend::kCpu, viewOf(keys), viewOf(items_));

    levelCount_ = 0;
    levelStart_[0] = 0;
    for (size_t levelBoxes = count; levelBoxes > 0;) {
        levelStart_[levelCount_ + 1] = levelStart_[levelCount_] + uint32_t(levelBoxes);
        ++levelCount_;
        levelBoxes = levelBoxes <= kBvhWidth ? 0 : (levelBoxes + kBvhWidth - 1) / kBvhWidth;
    }
    boxes_.resize(levelStart_[levelCount_]);
    refit(boxes);
}

void WideBvh::refit(View<const Box> boxes) {
    SDAG_ASSERT(boxes.count == items_.size());
    for (size_t i = 0; i < items_.size(); ++i)
        boxes_[i] = boxes[items_[i]];
    for (uint32_t level = 1; level < levelCount_; ++level) {
        const uint32_t childEnd = levelStart_[level];
        for (uint32_t i = levelStart_[level]; i < levelStart_[level + 1]; ++i) {
            const uint32_t first = levelStart_[level - 1] + (i - levelStart_[level]) * kBvhWidth;
            Box box;
            for (uint32_t child = first; child < first + kBvhWidth && child < childEnd; ++child)
                box.add(boxes_[child]);
            boxes_[i] = box;
        }
    }
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
