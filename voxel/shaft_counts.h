// SPDX-License-Identifier: Apache-2.0
// What the shafts of a frame proved.
#pragma once

#include <cstdint>

namespace shadowdag {

/// What shafts did.
/// askedCount: (cluster, light) pairs asked; litCount, darkCount: those proven whole; pairCount:
/// (sample, light) pairs asked, litPairCount, darkPairCount: proven, in whole or in part;
/// shaftCount: shafts made; cutCount, cutCellCount: times that rays were traced from a cut, and its
/// cells.
struct ShaftCounts {
    uint64_t askedCount = 0, litCount = 0, darkCount = 0;
    uint64_t pairCount = 0, litPairCount = 0, darkPairCount = 0;
    uint64_t shaftCount = 0, cutCount = 0, cutCellCount = 0;

    void add(const ShaftCounts& o) {
        askedCount += o.askedCount;
        litCount += o.litCount;
        darkCount += o.darkCount;
        pairCount += o.pairCount;
        litPairCount += o.litPairCount;
        darkPairCount += o.darkPairCount;
        shaftCount += o.shaftCount;
        cutCount += o.cutCount;
        cutCellCount += o.cutCellCount;
    }
};

} // namespace shadowdag
