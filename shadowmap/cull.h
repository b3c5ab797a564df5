// SPDX-License-Identifier: Apache-2.0
// Which batches are drawn into which faces of which map; an item is one part of the batch hierarchy
// for one map. First the hierarchy is queried for the batches that a map reaches, then each of
// these is tested once against the map's masks. Source: Olsson et al. 2015, sec. IV-G and V-A, V-B.
#pragma once

#include "cuda/atomics.h"
#include "cuda/mutant.h"
#include "cuda/pass.h"
#include "scenes/batches.h"
#include "shadowmap/drawn_cells.h"
#include "shadowmap/page_mask.h"

namespace shadowdag {

/// A batch to be drawn into some faces of a map.
struct BatchDraw {
    uint32_t map;
    uint32_t batch;
    uint32_t faces; ///< bit f: into face f; not yet set for a batch that is only reached
};

/// The counts of one item.
struct CullCounts {
    uint32_t batchFaces;        ///< (batch, face) pairs to draw
    uint32_t triangleFaces;     ///< their triangles
    uint32_t sphereBatches;     ///< batches in the light's sphere, at full detail
    uint32_t sphereTriangles;   ///< their triangles
    uint32_t keptBatchFaces;    ///< pairs that are needed but were drawn before and kept
    uint32_t keptTriangleFaces; ///< their triangles
};

/// The faces of a map that need a batch, and those of them that it must be drawn into.
struct BatchFaces {
    uint32_t needed;
    uint32_t drawn;
};

/// The state of maps that are kept from frame to frame, as culling reads it.
struct KeptView {
    View<const uint32_t> drawnCells; ///< DrawnView::cells; empty if no map is kept
    View<const uint32_t> slots;
    View<const uint32_t> openBlocks; ///< PrepareBlock::openBlocks
    View<const uint32_t> moved;      ///< bit per batch: moved since the last frame
};

/// Returns the level of polygon detail that a map draws of a batch's part.
SDAG_HD inline uint32_t levelFor(const PolygonLevelsView& levels, const ShadowMapInfo& map,
                                 uint32_t batchInstance) {
    if (levels.empty())
        return 0;
    return map.window.isDirectional()
               ? levels.levelBelow(batchInstance, levels.allowedTexels *
                                                      float(map.window.texelWorld(map.faceTexels)))
               : levels.levelFor(batchInstance, map.lightPositionWorld, map.faceTexels);
}

/// Returns the level of polygon detail of a batch.
SDAG_HD inline uint32_t levelOf(const PolygonLevelsView& levels, uint32_t batchInstance) {
    return levels.empty() ? 0 : levels.levelOf(batchInstance);
}

/// The input of culling. Item i is part i % parts of the hierarchy's top level for map i / parts,
/// so the list of draws is ordered by map, then along the Morton curve.
struct CullView {
    View<const ShadowMapInfo> maps;
    PageMaskView masks;
    BatchView batches;
    MapCulling culling;
    CellDepthView cells; ///< with MapCulling::kCellDepth, and with kept maps
    KeptView kept{};

    SDAG_HD uint32_t parts() const { return topBoxCount(batches.bvh); }

    /// Returns the faces of a map that a batch must be drawn into.
    SDAG_HD BatchFaces facesToDraw(uint32_t mapIndex, uint32_t batch) const {
        BatchFaces faces{};
        for (uint32_t face = 0; face < kFaceCount; ++face) {
            const BatchFaces of = faceToDraw(mapIndex, batch, face);
            faces.needed |= of.needed;
            faces.drawn |= of.drawn;
        }
        return faces;
    }
    /// Returns the same of one face.
    SDAG_HD BatchFaces faceToDraw(uint32_t mapIndex, uint32_t batch, uint32_t face) const {
        const ShadowMapInfo& map = maps[mapIndex];
        const Box& boxWorld = batches.boxesWorld[batch];
        const BatchFaces all{1u << face, 1u << face};
        if (batch % 8 == 0 && isMutant(Mutant::kBatchCulled))
            return {};
        if (!kept.drawnCells.empty())
            return faceNotDrawn(mapIndex, batch, boxWorld, face);
        if (culling == MapCulling::kSphere)
            return facesOf(map) >> face & 1u ? all : BatchFaces{};
        if (!(masks.faces[mapIndex] >> face & 1u))
            return {};
        FaceRect rect;
        if (!projectOnMap(map, boxWorld, face, 0.0f, rect))
            return {};
        rect.depthMin = mutated(Mutant::kDepthLimitHalved, rect.depthMin, 2.0f * rect.depthMin);
        if (culling >= MapCulling::kMaximumDepth &&
            rect.depthMin > bitsFloat(masks.depths[mapIndex * kFaceCount + face]))
            return {};
        if (culling >= MapCulling::kCellDepth
                ? !cells.reaches(mapIndex, face, cellsOf(rect), depthBits(rect.depthMin))
            : culling == MapCulling::kProjectionMap || culling == MapCulling::kMaximumDepth
                ? !overlapsProjection(mapIndex, face, cellsOf(rect))
                : false)
            return {};
        return all;
    }

    /// Calls reach(batch, level, isDrawn) for every batch of item i that its map reaches, with the
    /// batch's level of detail and whether the map draws that level.
    template <class Reach> SDAG_HD void query(size_t i, const Reach& reach) const {
        const uint32_t part = uint32_t(i % parts());
        const ShadowMapInfo& map = maps[i / parts()];
        traverseFrom(
            batches.bvh, part, part + 1, [&](const Box& box) { return reachesMap(map, box); },
            [&](uint32_t batch) {
                const uint32_t instance = batches.batches[batch].instance;
                const uint32_t level = levelOf(batches.levels, instance);
                reach(batch, level, level == levelFor(batches.levels, map, instance));
            });
    }

private:
    /// See drawn_cells.h for the rule.
    SDAG_HD BatchFaces faceNotDrawn(uint32_t mapIndex, uint32_t batch, const Box& boxWorld,
                                    uint32_t face) const {
        FaceRect rect;
        if (!projectOnMap(maps[mapIndex], boxWorld, face, 0.0f, rect))
            return {};
        const uint32_t bits =
            depthBits(mutated(Mutant::kDepthLimitHalved, rect.depthMin, 2.0f * rect.depthMin));
        const CellRect of = cellsOf(rect);
        if (!cells.reaches(mapIndex, face, of, bits))
            return {};
        const bool isMoved = kept.moved[batch / 32] >> batch % 32 & 1u;
        const CellDepthView open{cells.cells, kept.openBlocks};
        const uint32_t slot = kept.slots[mapIndex];
        const bool isDrawn =
            isMoved || open.any(mapIndex, face, of, bits, [&](uint32_t cell, uint32_t) {
                return kept.drawnCells[slot * kCellsPerMap + cell % kCellsPerMap] < bits;
            });
        return {1u << face, uint32_t(isDrawn) << face};
    }

    SDAG_HD bool overlapsProjection(uint32_t mapIndex, uint32_t face, const CellRect& rect) const {
        const uint32_t row = (~0u >> (31 - rect.u1)) & (~0u << rect.u0);
        const uint32_t first = mapIndex * kProjectionWordsPerMap + face * kProjectionMapSize;
        for (uint32_t v = rect.v0; v <= rect.v1; ++v)
            if (masks.projection[first + v] & row)
                return true;
        return false;
    }
};

/// Counts the batches that the map of item i reaches and would draw.
struct CountReached {
    CullView cull;
    View<uint32_t> reachedCounts; ///< by item
    View<CullCounts> counts;

    size_t itemCount() const { return reachedCounts.count; }
    size_t grain() const { return 4; }
    SDAG_HD void operator()(size_t i) const {
        CullCounts found{};
        uint32_t reached = 0;
        cull.query(i, [&](uint32_t batch, uint32_t level, bool isDrawn) {
            if (level == 0) {
                ++found.sphereBatches;
                found.sphereTriangles += cull.batches.batches[batch].count;
            }
            reached += isDrawn;
        });
        reachedCounts[i] = reached;
        counts[i] = found;
    }
};

void launchPass(CudaTag, const CountReached& work); ///< by warps

/// The entries of item i in a list: from first[i] to the next item's. Empty if the list is too
/// short for them; then everything is repeated.
struct ItemRange {
    size_t begin, end;
};
SDAG_HD inline ItemRange rangeOf(View<const uint32_t> first, size_t i, size_t listCount) {
    const size_t begin = first[i], end = first[i + 1];
    return end <= listCount ? ItemRange{begin, end} : ItemRange{0, 0};
}

/// Writes the batches that CountReached counted from reached[firstReached[i]] on.
struct ListReached {
    CullView cull;
    View<const uint32_t> firstReached; ///< exclusive scan of CountReached, the total last
    View<BatchDraw> reached;           ///< may have unused entries at its end

    size_t itemCount() const { return firstReached.count - 1; }
    size_t grain() const { return 4; }
    SDAG_HD void operator()(size_t i) const {
        const ItemRange range = rangeOf(firstReached, i, reached.count);
        if (range.begin == range.end)
            return;
        size_t next = range.begin;
        cull.query(i, [&](uint32_t batch, uint32_t, bool isDrawn) {
            if (isDrawn)
                reached[next++] = {uint32_t(i / cull.parts()), batch, 0};
        });
    }
};

void launchPass(CudaTag, const ListReached& work); ///< by warps

struct CountDrawsOfFace;

/// Tests the batches that were reached against their map's masks: writes the faces of each, whether
/// it is drawn, and the counts.
struct CountDraws {
    CullView cull;
    View<const uint32_t> firstReached;
    View<BatchDraw> reached; ///< as ListReached leaves it: of no face
    View<uint32_t> isDrawn;  ///< by entry of reached, and one more; 0 before
    View<CullCounts> counts; ///< written by CountReached; the rest is filled in

    size_t itemCount() const { return counts.count; }
    size_t grain() const { return 4; }
    /// An item may have reached thousands of batches, and a face may take long: CUDA processes them
    /// face by face.
    CountDrawsOfFace shortItems() const;
    /// Processes all batches that item i reached.
    SDAG_HD void operator()(size_t i) const {
        const ItemRange range = rangeOf(firstReached, i, reached.count);
        CullCounts& found = counts[i];
        for (size_t at = range.begin; at < range.end; ++at) {
            const BatchDraw draw = reached[at];
            const BatchFaces faces = cull.facesToDraw(draw.map, draw.batch);
            count(faces, cull.batches.batches[draw.batch].count, found);
            reached[at].faces = faces.drawn;
            isDrawn[at] = faces.drawn != 0;
        }
    }
    /// Processes one face of one entry, of which nothing is known yet; other faces and entries add
    /// to the same counts. Does nothing for unused entries at the end of the list.
    SDAG_HD void testFace(size_t at, uint32_t face) const {
        size_t first = 0,
               end = firstReached.count - 1; // the last item that starts at or before the entry
        if (at >= firstReached[end])
            return;
        while (end - first > 1) {
            const size_t middle = first + (end - first) / 2;
            (firstReached[middle] <= at ? first : end) = middle;
        }
        if (firstReached[first + 1] > reached.count) // was not listed
            return;
        const uint32_t map = reached[at].map, batch = reached[at].batch;
        const BatchFaces faces = cull.faceToDraw(map, batch, face);
        if (faces.needed == 0)
            return;
        CullCounts found{};
        count(faces, cull.batches.batches[batch].count, found);
        CullCounts& sum = counts[first];
        const auto add = [](uint32_t& to, uint32_t by) {
            if (by > 0)
                atomicAddRelaxed(&to, by);
        };
        add(sum.batchFaces, found.batchFaces);
        add(sum.triangleFaces, found.triangleFaces);
        add(sum.keptBatchFaces, found.keptBatchFaces);
        add(sum.keptTriangleFaces, found.keptTriangleFaces);
        if (faces.drawn != 0) {
            atomicOrRelaxed(&reached[at].faces, faces.drawn);
            atomicOrRelaxed(&isDrawn[at], 1u);
        }
    }

private:
    SDAG_HD static void count(const BatchFaces& faces, uint32_t triangleCount, CullCounts& found) {
        for (uint32_t rest = faces.drawn; rest; rest &= rest - 1) {
            ++found.batchFaces;
            found.triangleFaces += triangleCount;
        }
        for (uint32_t rest = faces.needed & ~faces.drawn; rest; rest &= rest - 1) {
            ++found.keptBatchFaces;
            found.keptTriangleFaces += triangleCount;
        }
    }
};

/// The same by entry and face: lanes take neighbouring entries and one face.
struct CountDrawsOfFace {
    CountDraws work;

    size_t itemCount() const { return work.reached.count * kFaceCount; }
    SDAG_HD void operator()(size_t i) const {
        const size_t count = work.reached.count;
        work.testFace(i % count, uint32_t(i / count));
    }
};
inline CountDrawsOfFace CountDraws::shortItems() const {
    return {*this};
}

/// Writes entry i of the reached batches to the draws, if it is drawn and there is space. Unused
/// entries at the end of the list keep an empty face mask.
struct ListDraws {
    View<const BatchDraw> reached; ///< with the faces that CountDraws found
    View<const uint32_t> drawOf;   ///< by entry: exclusive scan of CountDraws, the total last
    View<BatchDraw> draws;

    size_t itemCount() const { return reached.count; }
    size_t grain() const { return 4096; }
    SDAG_HD void operator()(size_t i) const {
        if (drawOf[i] != drawOf[i + 1] && drawOf[i] < draws.count)
            draws[drawOf[i]] = reached[i];
    }
};

/// The lengths of culling's lists, in the order in which they are stored.
enum CullLength : uint32_t { kReachedLength, kDrawLength, kCullLengths };

/// Copies the lengths to where they are fetched together.
struct NoteCullLengths {
    View<const uint32_t> firstReached, drawOf; ///< the total last
    View<uint32_t> lengths;                    ///< kCullLengths

    size_t itemCount() const { return 1; }
    SDAG_HD void operator()(size_t) const {
        lengths[kReachedLength] = firstReached[firstReached.count - 1];
        lengths[kDrawLength] = drawOf[drawOf.count - 1];
    }
};

} // namespace shadowdag
