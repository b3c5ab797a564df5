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
    uint32_t keptBatchFaces;    ///< pairs that are needed but were drawn before and kept;
                                ///< without those of closed faces (KeptView::openFaces)
    uint32_t keptTriangleFaces; ///< their triangles
};

/// The faces of a map that need a batch, and those of them that it must be drawn into.
struct BatchFaces {
    uint32_t needed;
    uint32_t drawn;
};

/// What decides whether a batch is drawn into a face of a kept map.
struct KeptTest {
    CellRect cells; ///< that the batch covers
    uint32_t depth; ///< its least, as depthBits
    bool isMoved;   ///< since the last frame
};

/// The state of maps that are kept from frame to frame, as culling reads it.
struct KeptView {
    View<const uint32_t> drawnCells; ///< DrawnView::cells; empty if no map is kept
    View<const uint32_t> slots;
    View<const uint32_t> openBlocks; ///< PrepareBlock::openBlocks
    /// PrepareBlock::openFaces: of the others, which are closed, only what moved is drawn, so
    /// nothing else is tested. Empty: everything is tested, for counts.
    View<const uint32_t> openFaces;
    View<const uint32_t> moved; ///< bit per batch: moved since the last frame

    SDAG_HD bool isMoved(uint32_t batch) const { return moved[batch / 32] >> batch % 32 & 1u; }
    /// Returns whether no face of a map is open. @param faces bits
    SDAG_HD bool areClosed(uint32_t mapIndex, uint32_t faces = (1u << kFaceCount) - 1) const {
        return !openFaces.empty() && (openFaces[mapIndex] & faces) == 0;
    }
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

/// The input of culling. Item i is part i % parts of the hierarchy (partsOf) for map i / parts, so
/// the list of draws is ordered by map, then along the Morton curve.
struct CullView {
    View<const ShadowMapInfo> maps;
    CullMaskView masks;
    BatchView batches;
    MapCulling culling;
    CellDepthView cells; ///< with MapCulling::kCellDepth, and with kept maps
    KeptView kept{};

    SDAG_HD uint32_t parts() const { return partsOf(batches.bvh, maps.count).count; }

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
            return faceNotDrawn(mapIndex, batch, face);
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

    /// Returns whether a batch may be drawn into a face of a kept map, and writes what is to be
    /// tested: whether a receiver needs it, and, if it is not moved, whether it is not drawn yet.
    /// See drawn_cells.h for the rule.
    SDAG_HD bool testOf(uint32_t mapIndex, uint32_t batch, uint32_t face, KeptTest& test) const {
        const bool isMoved = kept.isMoved(batch);
        FaceRect rect;
        if ((kept.areClosed(mapIndex, 1u << face) && !isMoved) ||
            !projectOnMap(maps[mapIndex], batches.boxesWorld[batch], face, 0.0f, rect))
            return false;
        test = {cellsOf(rect),
                depthBits(mutated(Mutant::kDepthLimitHalved, rect.depthMin, 2.0f * rect.depthMin)),
                isMoved};
        return true;
    }
    /// Returns whether a cell is drawn less deep than `depth`.
    SDAG_HD bool isUndrawn(uint32_t mapIndex, uint32_t cell, uint32_t depth) const {
        return kept.drawnCells[kept.slots[mapIndex] * kCellsPerMap + cell % kCellsPerMap] < depth;
    }
    /// Returns the needed depths of the cells that are not drawn as deep.
    SDAG_HD CellDepthView openCells() const { return {cells.cells, kept.openBlocks}; }

    /// Calls reach(batch, level, isDrawn) for every batch of item i that its map reaches, with the
    /// batch's level of detail and whether the map draws that level. Of a map without open faces
    /// only what moved need be reached: it is the first item's, and all of the others is left out
    /// (on CUDA nothing is).
    template <class Reach> SDAG_HD void query(size_t i, const Reach& reach) const {
        const BvhParts divided = partsOf(batches.bvh, maps.count);
        const uint32_t part = uint32_t(i % divided.count), mapIndex = uint32_t(i / divided.count);
        const ShadowMapInfo& map = maps[mapIndex];
        const auto found = [&](uint32_t batch) {
            const uint32_t instance = batches.batches[batch].instance;
            const uint32_t level = levelOf(batches.levels, instance);
            reach(batch, level, level == levelFor(batches.levels, map, instance));
        };
        if (!kept.areClosed(mapIndex)) {
            traverseBelow(
                batches.bvh, divided.level, part, part + 1,
                [&](const Box& box) { return reachesMap(map, box); }, found);
        } else if (part == 0) {
            for (uint32_t word = 0; word < kept.moved.count; ++word)
                for (uint32_t bit = 0; bit < 32 && kept.moved[word] >> bit != 0; ++bit) {
                    const uint32_t batch = word * 32 + bit;
                    if (kept.isMoved(batch) && reachesMap(map, batches.boxesWorld[batch]))
                        found(batch);
                }
        }
    }

private:
    SDAG_HD BatchFaces faceNotDrawn(uint32_t mapIndex, uint32_t batch, uint32_t face) const {
        KeptTest test;
        if (!testOf(mapIndex, batch, face, test) ||
            !cells.reaches(mapIndex, face, test.cells, test.depth))
            return {};
        const bool isDrawn =
            test.isMoved ||
            openCells().any(mapIndex, face, test.cells, test.depth, [&](uint32_t cell, uint32_t) {
                return isUndrawn(mapIndex, cell, test.depth);
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
    /// Returns the item that reached entry `at` of the list; none for unused entries at its end.
    SDAG_HD size_t itemOf(size_t at) const {
        size_t first = 0,
               end = firstReached.count - 1; // the last item that starts at or before the entry
        if (at >= firstReached[end])
            return kNoItem;
        while (end - first > 1) {
            const size_t middle = first + (end - first) / 2;
            (firstReached[middle] <= at ? first : end) = middle;
        }
        return firstReached[first + 1] > reached.count ? kNoItem : first; // was not listed
    }
    static constexpr size_t kNoItem = ~size_t(0);
    /// Adds the result of one face of an entry of an item; other faces and entries add to the same
    /// counts at the same time.
    SDAG_HD void note(size_t item, size_t at, const BatchFaces& faces) const {
        if (faces.needed == 0)
            return;
        CullCounts found{};
        count(faces, cull.batches.batches[reached[at].batch].count, found);
        CullCounts& sum = counts[item];
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

void launchPass(CudaTag, const CountDraws& work); ///< by warps, an entry and a face a lane

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
