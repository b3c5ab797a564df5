// SPDX-License-Identifier: Apache-2.0
// The traversal of wide_bvh.h by a warp of a GPU; empty where the compiler is not CUDA's.
#pragma once

#include "cuda/warp.h"
#include "scenes/wide_bvh.h"

#if defined(__CUDACC__)
namespace shadowdag {

static_assert(kBvhWidth == kGroupLanes); // a lane a child

/// traverseBelow, by all lanes of a warp: they test the children of a box together.
/// hit(first, bits): boxes `first` + lane of level 0 are accepted where bit `lane` is set; called
/// in ascending order, by all lanes.
template <class Test, class Hit>
__device__ void traverseByWarp(const WideBvhView& bvh, uint32_t top, uint32_t topBegin,
                               uint32_t topEnd, const Test& test, const Hit& hit) {
    if (bvh.levelCount == 0)
        return;
    uint32_t first[kBvhMaxLevels],
        rest[kBvhMaxLevels]; // of a level: the boxes, those to descend to
    int level = int(top);
    uint32_t begin = bvh.levelStart[level] + topBegin, end = bvh.levelStart[level] + topEnd;
    while (true) {
        const uint32_t box = begin + laneOfWarp();
        const uint32_t bits = __ballot_sync(kAllLanes, box < end && test(bvh.boxes[box]));
        if (level == 0) {
            hit(begin - bvh.levelStart[0], bits);
            rest[0] = 0;
        } else {
            first[level] = begin - bvh.levelStart[level];
            rest[level] = bits;
        }
        while (rest[level] == 0)
            if (++level > int(top))
                return;
        const uint32_t child = first[level] + (uint32_t(__ffs(int(rest[level]))) - 1);
        rest[level] &= rest[level] - 1;
        --level;
        begin = bvh.levelStart[level] + child * kBvhWidth;
        end = begin + kBvhWidth < bvh.levelStart[level + 1] ? begin + kBvhWidth
                                                            : bvh.levelStart[level + 1];
    }
}

} // namespace shadowdag
#endif
