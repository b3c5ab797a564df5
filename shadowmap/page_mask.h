// SPDX-License-Identifier: Apache-2.0
// Which faces and projection-map cells the receivers of a map need, for culling, and which pages
// their boxes cover, as bits; one receiver an item. Source: Olsson et al. 2015, sec. IV-D to IV-F
// and V-A, V-B.
#pragma once

#include "cuda/atomics.h"
#include "cuda/mutant.h"
#include "cuda/pass.h"
#include "cuda/view.h"
#include "shadowmap/cell_depth.h"
#include "shadowmap/cube_face.h"
#include "shadowmap/lookup_pages.h"

namespace shadowdag {

/// Faces smaller than this are needed completely with all their neighbours, because a filter's taps
/// then reach around corners.
constexpr uint32_t kLeastMaskedFaceTexels = 8;

/// Which batches are drawn into which faces. Each kind includes the tests of the one before. The
/// paper's names in brackets.
enum class MapCulling : uint8_t {
    kSphere,        ///< batches in the light's sphere into all six faces: the baseline of culling
    kFaceMask,      ///< faces that receivers reach (CFM)
    kProjectionMap, ///< and projection maps that overlap (PMC)
    kMaximumDepth,  ///< and no batch behind the farthest receiver of a face (PMCD)
    kCellDepth,     ///< and none behind the farthest receivers of all cells that it covers (ours)
};

/// A receiver box (cluster bounds) that will be looked up in a map.
struct MapReceiver {
    uint32_t box; ///< index into the frame's receiver boxes
    uint32_t map; ///< index into the requests, or kNoMap: an unused entry
};
constexpr uint32_t kNoMap = 0xffffffffu;

/// What culling needs to know of the receivers of the maps. All words start at 0.
/// projection: kProjectionWordsPerMap a map, a word a row of cells, bit = u; faces: the cube-face
/// mask, a word a map; depths: kFaceCount a map, the farthest depth at which a blocker can matter,
/// as float bits; cells: the same a cell, as raiseCells leaves it, and blocks of them; both empty
/// if not requested.
struct CullMaskView {
    View<uint32_t> projection;
    View<uint32_t> faces;
    View<uint32_t> depths;
    View<uint32_t> cells;
    View<uint32_t> blocks;
};

/// How far the taps of a filter reach beyond the receiver, in face coordinates.
///
/// Derivation. A tap's texel centre lies at most r texels from the receiver, r = 0.5 for one tap,
/// 1 for 2 x 2 and 1.5 for 3 x 3, so at most e = 2 r / N in u and in v; half a texel more covers
/// rounding. A tap beyond the edge u = 1 is read on the neighbour face, where the receiver itself
/// lies (unclamped) at (1/u, v/u) and the tap at (1/u', v'/u'), with u' > 1, u >= 1 - e, |v| <= 1:
/// they differ by at most e/(1 - e) and e + e/(1 - e), and snapping to the texel that holds the tap
/// adds 1/N. So a box grown by 2 e/(1 - e) + 2/N on every face that it reaches unclamped covers all
/// taps.
SDAG_HD inline float filterMargin(uint32_t faceTexels, uint32_t taps) {
    const float n = float(faceTexels);
    if (taps <= 1)
        return 2.0f / n;
    const float e = float(filterSide(taps)) / n;
    return 2.0f * e / (1.0f - e) + 2.0f / n;
}

/// How much deeper than the receiver a blocker may lie and still be compared: taps compare at the
/// plane through the receiver perpendicular to its ray (see shadow_map_lookup.h), whose 1/depth at
/// a tap m away is at least (1 - m sqrt(1/2)) of the receiver's. Unbounded (1e30) if that is not
/// positive: very small faces.
SDAG_HD inline float filterDepthFactor(float margin) {
    const float least = 1.0f - 0.7072f * margin;
    return least > 1e-3f ? 1.0f / least : 1e30f;
}

/// Sets bits [begin, end) of an array of words.
SDAG_HD inline void setBits(View<uint32_t> words, uint32_t begin, uint32_t end) {
    while (begin < end) {
        const uint32_t word = begin / 32;
        const uint32_t stop = end < word * 32 + 32 ? end : word * 32 + 32;
        const uint32_t count = stop - begin;
        const uint32_t bits = (count == 32 ? ~0u : (1u << count) - 1u) << (begin % 32);
        atomicOrRelaxed(&words[word], bits);
        begin = stop;
    }
}

/// The receivers of maps, on the maps' faces.
struct ReceiverBoxes {
    View<const ShadowMapInfo> maps;
    View<const Box> boxesWorld;
    View<const MapReceiver> receivers;
    uint32_t taps;

    /// Returns whether lookups of a receiver read a face of its map, and where. Depths are those at
    /// which blockers can matter.
    SDAG_HD bool reaches(const MapReceiver& receiver, uint32_t face, FaceRect& rect) const {
        if (receiver.map == kNoMap)
            return false;
        const ShadowMapInfo& map = maps[receiver.map];
        const Box& world = boxesWorld[receiver.box];
        if (world.empty() || !(facesOf(map) >> face & 1u))
            return false;
        rect = {-1.0f, 1.0f, -1.0f, 1.0f, 0.0f, 3.0e38f};
        if (map.faceTexels < kLeastMaskedFaceTexels)
            return true;
        const float margin = filterMargin(map.faceTexels, taps);
        if (!projectOnMap(map, world, face, margin, rect) ||
            !narrowToCone(map.cone, face, margin, rect))
            return false;
        if (!map.window.isDirectional()) // whose taps compare at the receiver's own depth
            rect.depthMax *= filterDepthFactor(margin);
        return true;
    }
};

struct MarkReceiverFace;

/// Marks for culling what receiver i needs.
struct MarkReceiver {
    ReceiverBoxes boxes;
    CullMaskView masks;

    size_t itemCount() const { return boxes.receivers.count; }
    /// Most receivers are seen by one face of six: on CUDA each face is an item.
    MarkReceiverFace shortItems() const;
    SDAG_HD void operator()(size_t i) const {
        for (uint32_t face = 0; face < kFaceCount; ++face)
            markFace(boxes.receivers[i], face);
    }
    SDAG_HD void markFace(const MapReceiver& receiver, uint32_t face) const {
        FaceRect rect;
        if (!boxes.reaches(receiver, face, rect))
            return;
        orOnceRelaxed(&masks.faces[receiver.map], 1u << face);
        raiseOnceRelaxed(&masks.depths[receiver.map * kFaceCount + face], floatBits(rect.depthMax));
        const CellRect cells = cellsOf(rect);
        const uint32_t first = receiver.map * kProjectionWordsPerMap + face * kProjectionMapSize;
        const uint32_t row = (~0u >> (31 - cells.u1)) & (~0u << cells.u0);
        for (uint32_t v = cells.v0; v <= cells.v1; ++v)
            atomicOrRelaxed(&masks.projection[first + v], row);
        if (!masks.cells.empty())
            raiseCells(masks.cells, masks.blocks, receiver.map, face, cells,
                       depthBits(rect.depthMax));
    }
};

/// The same by receiver and face: lanes take neighbouring receivers and one face.
struct MarkReceiverFace {
    MarkReceiver work;

    size_t itemCount() const { return work.boxes.receivers.count * kFaceCount; }
    SDAG_HD void operator()(size_t i) const {
        const size_t count = work.boxes.receivers.count;
        work.markFace(work.boxes.receivers[i % count], uint32_t(i / count));
    }
};
inline MarkReceiverFace MarkReceiver::shortItems() const {
    return {*this};
}

/// Marks the pages that receivers cover; an item is a receiver, a face and a step.
struct MarkBoxPages {
    View<const Box> boxesWorld;
    View<const MapReceiver> receivers;
    PageDemand demand;

    size_t itemCount() const { return receivers.count * kFaceCount * demand.stepCount; }
    SDAG_HD void operator()(size_t i) const {
        const size_t count = receivers.count;
        MapReceiver receiver = receivers[i % count];
        if (receiver.map == kNoMap)
            return;
        receiver.map += uint32_t(i / count / kFaceCount) * demand.mapCount;
        const uint32_t face = uint32_t(i / count % kFaceCount);
        const ReceiverBoxes boxes{demand.maps, boxesWorld, receivers, demand.taps};
        FaceRect rect;
        if (!boxes.reaches(receiver, face, rect))
            return;
        const ShadowMapInfo& map = demand.maps[receiver.map];
        const auto pageOf = [&](float at) {
            return faceCell(at, map.faceTexels) >> demand.pageTexelsLog2;
        };
        for (uint32_t y = pageOf(rect.vMin), last = pageOf(rect.vMax); y <= last; ++y) {
            const uint32_t row = pageTableIndex(map, face, 0, y);
            setBits(demand.pages, row + pageOf(rect.uMin), row + pageOf(rect.uMax) + 1);
        }
    }
};

/// Marks the pages that boxes cover, and so those of lookups from anywhere within them.
class BoxPageMarker final : public PageMarker {
public:
    /// @param boxesWorld,receivers on the backend, as long as this lives
    BoxPageMarker(Backend backend, View<const Box> boxesWorld, View<const MapReceiver> receivers)
        : backend_(backend), boxesWorld_(boxesWorld), receivers_(receivers) {}

    void mark(const PageDemand& demand) const override {
        runPass(backend_, MarkBoxPages{boxesWorld_, receivers_, demand});
    }

private:
    Backend backend_;
    View<const Box> boxesWorld_;
    View<const MapReceiver> receivers_;
};

/// Writes to counts[i] the pages marked in word i, and 0 to the remaining counts.
struct CountPages {
    View<const uint32_t> pages;
    View<uint32_t> counts; ///< as long as `pages`, or longer

    size_t itemCount() const { return counts.count; }
    size_t grain() const { return 4096; }
    SDAG_HD void operator()(size_t i) const {
        uint32_t bits = i < pages.count ? pages[i] : 0, count = 0;
        for (; bits; bits &= bits - 1)
            ++count;
        counts[i] = count;
    }
};

/// Counts the marked pages of every map: all bits of its words, which are no other map's.
struct CountPagesOfMaps {
    View<const ShadowMapInfo> maps;
    View<const uint32_t> pages; ///< PageDemand::pages
    View<uint32_t> counts;      ///< a map each

    size_t itemCount() const { return maps.count; }
    size_t grain() const { return 4; }
    SDAG_HD void operator()(size_t m) const {
        const ShadowMapInfo& map = maps[m];
        const uint32_t first = map.pageTableStart / 32;
        const uint32_t words = (kFaceCount * map.facePages * map.facePages + 31) / 32;
        uint32_t count = 0;
        for (uint32_t w = first; w < first + words; ++w)
            for (uint32_t bits = pages[w]; bits; bits &= bits - 1)
                ++count;
        counts[m] = count;
    }
};
void launchPass(CudaTag, const CountPagesOfMaps& work); ///< by warps

} // namespace shadowdag
