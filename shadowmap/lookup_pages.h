// SPDX-License-Identifier: Apache-2.0
// Which pages of a map the lookups of its receivers read, as bits: the filter itself marks them.
#pragma once

#include "cuda/atomics.h"
#include "cuda/mutant.h"
#include "cuda/view.h"
#include "shadowmap/shadow_map_lookup.h"

namespace shadowdag {

/// The pages asked for, of the maps of a frame at several resolutions.
struct PageDemand {
    View<const ShadowMapInfo> maps; ///< map m at resolution `step`: step * mapCount + m
    uint32_t mapCount, stepCount;
    /// One bit a page-table entry, in its order, so a map starts at word pageTableStart / 32. All 0
    /// before; bits alone are set.
    View<uint32_t> pages;
    uint32_t pageTexelsLog2;
    uint32_t taps; ///< of the filter: ShadowMapBias::taps
};

/// Which pages of the maps of a frame get memory. The results of lookups are the same as long as
/// the pool holds all of them: else it lowers the resolutions, or refuses pages.
enum class PageMarks : uint8_t {
    kBoxes,   ///< all that the boxes of clusters cover: the paper's
    kLookups, ///< those that the lookups of samples read (ours)
};

/// Marks the pages that the lookups of a frame will read.
class PageMarker {
public:
    virtual ~PageMarker() = default;
    /// Marks at least the pages that the lookups of each map will read, on the backend where the
    /// views live (CUDA: queued). The same bits for any number of threads.
    virtual void mark(const PageDemand& demand) const = 0;
};

/// Taps that mark their pages instead of reading them.
struct MarkingTaps {
    const ShadowMapInfo& map;
    const PageDemand& demand;
    bool isInFace = false;

    SDAG_HD void begin(uint32_t face, int32_t x, int32_t y, int32_t side) {
        const int32_t n = int32_t(map.faceTexels);
        isInFace = x >= 0 && y >= 0 && x + side <= n && y + side <= n;
        if (!isInFace)
            return;
        int32_t last = side - 1;
        if (isMutant(Mutant::kMapMarginZero)) { // one tap of those around the receiver
            x += side / 2;
            y += side / 2;
            last = 0;
        }
        const uint32_t log2 = demand.pageTexelsLog2;
        for (int32_t py = y >> log2; py <= (y + last) >> log2; ++py)
            for (int32_t px = x >> log2; px <= (x + last) >> log2; ++px)
                markPage(face, uint32_t(px), uint32_t(py));
    }

    SDAG_HD TapResult ask(const CubeTexel& texel, float, float, float, bool) const {
        if (!isInFace && !isMutant(Mutant::kMapMarginZero))
            markPage(texel.face, texel.x >> demand.pageTexelsLog2,
                     texel.y >> demand.pageTexelsLog2);
        return TapResult::kLit;
    }

    SDAG_HD void markPage(uint32_t face, uint32_t x, uint32_t y) const {
        if (map.pageTableStart == 0 && y == map.facePages / 2 && isMutant(Mutant::kMapPageDropped))
            return;
        const uint32_t entry = pageTableIndex(map, face, x, y);
        orOnceRelaxed(&demand.pages[entry / 32], 1u << entry % 32);
    }
};

/// Marks the pages that lookupVisibility reads in a map, and no other.
/// @param mapIndex into demand.maps @param positionWorld,normalWorld as lookupVisibility has them
SDAG_HD inline void markLookup(const PageDemand& demand, uint32_t mapIndex,
                               const glm::vec3& positionWorld, const glm::vec3& normalWorld) {
    const ShadowMapInfo& map = demand.maps[mapIndex];
    MarkingTaps taps{map, demand};
    filterVisibility(map, positionWorld, normalWorld, {0.0f, demand.taps}, taps);
}

} // namespace shadowdag
