// SPDX-License-Identifier: Apache-2.0
// Which batches are drawn into which faces of which map; one part of the batch hierarchy for one
// map an item. Source: Olsson et al. 2015, sec. IV-G and V-A, V-B.
#pragma once

#include "scenes/batches.h"
#include "shadowmap/drawn_cells.h"
#include "shadowmap/page_mask.h"

namespace shadowdag {

/// A batch to be drawn into some faces of a map.
struct BatchDraw {
    uint32_t map;
    uint32_t batch;
    uint32_t faces; ///< bit f: into face f
};

/// What one item found.
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

/// What culling asks of maps that are kept from frame to frame.
struct KeptView {
    View<const uint32_t> drawnCells; ///< DrawnView::cells; empty: no map is kept
    View<const uint32_t> slots;
    View<const uint32_t> openBlocks; ///< PrepareBlock::openBlocks
    View<const uint32_t> moved;      ///< a bit a batch: it moved since the last frame
};

/// What culling reads. Item i is part i % parts of the hierarchy's top level for map i / parts, so
/// the list of draws is ordered by map, then along the Morton curve.
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
        const ShadowMapInfo& map = maps[mapIndex];
        const Box& boxWorld = batches.boxesWorld[batch];
        if (!kept.drawnCells.empty())
            return facesNotDrawn(mapIndex, batch, boxWorld);
        if (culling == MapCulling::kSphere)
            return {facesOf(map), facesOf(map)};
        uint32_t faces = 0;
        for (uint32_t face = 0; face < kFaceCount; ++face) {
            if (!(masks.faces[mapIndex] >> face & 1u))
                continue;
            FaceRect rect;
            if (!projectOnMap(map, boxWorld, face, 0.0f, rect))
                continue;
            if (culling >= MapCulling::kMaximumDepth &&
                rect.depthMin > bitsFloat(masks.depths[mapIndex * kFaceCount + face]))
                continue;
            if (culling >= MapCulling::kCellDepth
                    ? !cells.reaches(mapIndex, face, cellsOf(rect), depthBits(rect.depthMin))
                : culling == MapCulling::kProjectionMap || culling == MapCulling::kMaximumDepth
                    ? !overlapsProjection(mapIndex, face, cellsOf(rect))
                    : false)
                continue;
            faces |= 1u << face;
        }
        return {faces, faces};
    }

    /// Calls draw(batch, faces) for the batches of item i that are to be drawn; returns the counts.
    template <class Draw> SDAG_HD CullCounts run(size_t i, const Draw& draw) const {
        const uint32_t mapIndex = uint32_t(i / parts());
        const uint32_t part = uint32_t(i % parts());
        const ShadowMapInfo& map = maps[mapIndex];
        CullCounts counts{};
        traverseFrom(
            batches.bvh, part, part + 1, [&](const Box& box) { return reachesMap(map, box); },
            [&](uint32_t batch) {
                const uint32_t triangleCount = batches.batches[batch].count;
                const uint32_t level = levelOf(batch);
                if (level == 0) {
                    ++counts.sphereBatches;
                    counts.sphereTriangles += triangleCount;
                }
                if (level != levelFor(map, batch))
                    return;
                const BatchFaces faces = facesToDraw(mapIndex, batch);
                for (uint32_t rest = faces.drawn; rest; rest &= rest - 1) {
                    ++counts.batchFaces;
                    counts.triangleFaces += triangleCount;
                }
                for (uint32_t rest = faces.needed & ~faces.drawn; rest; rest &= rest - 1) {
                    ++counts.keptBatchFaces;
                    counts.keptTriangleFaces += triangleCount;
                }
                if (faces.drawn)
                    draw(batch, faces.drawn);
            });
        return counts;
    }

private:
    SDAG_HD uint32_t levelOf(uint32_t batch) const {
        return batches.levels.empty() ? 0 : batches.levels.levelOf(batches.batches[batch].instance);
    }
    SDAG_HD uint32_t levelFor(const ShadowMapInfo& map, uint32_t batch) const {
        const PolygonLevelsView& levels = batches.levels;
        if (levels.empty())
            return 0;
        const uint32_t instance = batches.batches[batch].instance;
        return map.window.isSun()
                   ? levels.levelBelow(instance, levels.allowedTexels *
                                                     float(map.window.texelWorld(map.faceTexels)))
                   : levels.levelFor(instance, map.lightPositionWorld, map.faceTexels);
    }

    /// See drawn_cells.h for the rule.
    SDAG_HD BatchFaces facesNotDrawn(uint32_t mapIndex, uint32_t batch, const Box& boxWorld) const {
        const bool isMoved = kept.moved[batch / 32] >> batch % 32 & 1u;
        const CellDepthView open{cells.cells, kept.openBlocks};
        const uint32_t slot = kept.slots[mapIndex];
        BatchFaces faces{};
        for (uint32_t face = 0; face < kFaceCount; ++face) {
            FaceRect rect;
            if (!projectOnMap(maps[mapIndex], boxWorld, face, 0.0f, rect))
                continue;
            const uint32_t bits = depthBits(rect.depthMin);
            const CellRect of = cellsOf(rect);
            if (!cells.reaches(mapIndex, face, of, bits))
                continue;
            faces.needed |= 1u << face;
            if (isMoved || open.any(mapIndex, face, of, bits, [&](uint32_t cell, uint32_t) {
                    return kept.drawnCells[slot * kCellsPerMap + cell % kCellsPerMap] < bits;
                }))
                faces.drawn |= 1u << face;
        }
        return faces;
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

/// Writes to drawCounts[i] the draws of item i, and its counts.
struct CountDraws {
    CullView cull;
    View<uint32_t> drawCounts;
    View<CullCounts> counts;

    SDAG_HD void operator()(size_t i) const {
        uint32_t drawCount = 0;
        counts[i] = cull.run(i, [&](uint32_t, uint32_t) { ++drawCount; });
        drawCounts[i] = drawCount;
    }
};

/// Writes the draws of item i from draws[firstDraw[i]] on.
struct ListDraws {
    CullView cull;
    View<const uint32_t> firstDraw; ///< exclusive scan of CountDraws
    View<BatchDraw> draws;

    SDAG_HD void operator()(size_t i) const {
        const uint32_t mapIndex = uint32_t(i / cull.parts());
        uint32_t next = firstDraw[i];
        if (next == (i + 1 < firstDraw.count ? firstDraw[i + 1] : draws.count))
            return; // nothing was counted
        cull.run(i, [&](uint32_t batch, uint32_t faces) {
            draws[next++] = {mapIndex, batch, faces};
        });
    }
};

} // namespace shadowdag
