// SPDX-License-Identifier: Apache-2.0
// The order of the passes that build voxels, and the memory between them. Pairs of triangles and
// cells go down the octree level by level to bricks of 64^3; every pair lists its leaves; leaves
// are sorted by Morton number and joined; nodes are made unique level by level upwards and numbered
// downwards.
#include "voxel/voxelize_passes.h"

#include "cuda/error.h"
#include "cuda/resident.h"
#include "voxel/dag_builder.h"
#include "voxel/pass_nodes.h"
#include "voxel/voxel_tasks.h"
#include "voxel/voxelize_pass.h"

#include <algorithm>
#include <new>
#include <optional>
#include <string>

namespace shadowdag {
namespace {

/// The scene that is voxelized, on a backend.
class ResidentScene {
public:
    ResidentScene(Backend backend, const TriangleView& triangles, View<const uint32_t> which,
                  const VoxelGrid& grid)
        : pyramids_(triangles.masks.masks, triangles.masks.words), grid_(grid),
          positions_(backend, "voxelize positions"), triangles_(backend, "voxelize triangles"),
          which_(backend, "voxelize list"), triangleCut_(backend, "voxelize triangle cuts"),
          cuts_(backend, "voxelize cut triangles"), masks_(backend, "voxelize masks"),
          levels_(backend, "voxelize mask levels"), words_(backend, "voxelize mask words") {
        positions_.set(triangles.positions);
        triangles_.set(triangles.triangles);
        which_.set(which);
        triangleCut_.set(triangles.masks.triangleCut);
        cuts_.set(triangles.masks.cuts);
        masks_.set(pyramids_.masks);
        levels_.set(pyramids_.levels);
        words_.set(pyramids_.words);
    }

    VoxelScene view() const {
        return {{positions_.view(),
                 triangles_.view(),
                 {triangleCut_.view(), cuts_.view(), {}, {}}}, // the pyramids hold the texels
                {masks_.view(), levels_.view(), words_.view()},
                grid_};
    }
    View<const uint32_t> which() const { return which_.view(); }

private:
    MaskPyramids pyramids_;
    VoxelGrid grid_;
    Resident<glm::vec3> positions_;
    Resident<glm::uvec3> triangles_;
    Resident<uint32_t> which_, triangleCut_;
    Resident<CutTriangle> cuts_;
    Resident<MaskPyramidInfo> masks_;
    Resident<MaskLevel> levels_;
    Resident<uint32_t> words_;
};

/// A cell that is built separately, and the triangles that touch it.
struct Tile {
    uint32_t level;
    PackedCell cell;
    View<const uint32_t> triangles;
};

class PassVoxelizer {
public:
    PassVoxelizer(Backend backend, const ResidentScene& scene, const VoxelGrid& grid,
                  uint64_t budgetBytes, const Progress& progress, PassBuildCounts& counts)
        : backend_(backend), memory_(backend, budgetBytes), scene_(scene.view()),
          which_(scene.which()), grid_(grid), progress_(progress), counts_(counts) {}

    Dag build() {
        Dag dag;
        dag.grid = grid_;
        try {
            if (const std::optional<Words> inside = listInside())
                buildFrom({rootLevelOf(grid_), 0, inside->view()}, dag);
        } catch (const OverBudget& over) {
            refuse(over);
        }
        if (!dag.words.empty())
            dag.rootAddress = 0;
        counts_.peakBytes = memory_.budget.peakBytes();
        tellDone(1.0 - done_);
        return dag;
    }

private:
    [[noreturn]] void refuse(const OverBudget& over) const {
        throw Error(ErrorKind::kResource,
                    "voxelizing at " + std::to_string(grid_.resolution()) + "^3 holds " +
                        std::to_string(over.bytes) +
                        " bytes of lists at a time even cell by cell, more than the budget on " +
                        backendName(backend_) +
                        "; choose a lower resolution, allow more memory, or use --backend cpu");
    }
    void buildFrom(const Tile& whole, Dag& dag) {
        try {
            dag.words = canonicalWords(memory_, nodesOf(whole));
            counts_.tileCount = 1;
        } catch (const OverBudget&) {
            DagBuilder merged(whole.level);
            dag = merged.finish(whole.level, buildParted(whole, merged, 1.0), grid_);
        }
    }
    void tellDone(double share) {
        done_ = std::min(1.0, done_ + share);
        if (progress_)
            progress_(done_);
    }

    /// Returns the listed triangles that meet the grid, if any. Throws Error kInput naming one that
    /// is not finite.
    std::optional<Words> listInside() {
        Words marks = memory_.places("voxelize marks", which_.count),
              bad = memory_.words("voxelize bad", 1);
        bad.buffer().fill(0xff);
        runPass(backend_, MarkInside{scene_, which_, marks.view(), bad.view()});
        if (const uint32_t at = bad.buffer().at(0); at != 0xffffffffu)
            throw Error(ErrorKind::kInput,
                        "triangle " + std::to_string(listed(at).at(0)) +
                            " has a position that is not finite; repair the scene");
        const size_t count = memory_.scan(marks);
        if (count == 0)
            return {};
        Words inside = memory_.words("voxelize inside", count);
        runPass(backend_, ListMarked{which_, std::as_const(marks).view(), inside.view()});
        return inside;
    }
    /// Returns a copy of one entry of the list of triangles.
    Buffer<uint32_t> listed(size_t at) const {
        Buffer<uint32_t> one(backend_, "voxelize one", 1);
        detail::copyBytes(backend_, one.view().data, backend_, which_.data + at, sizeof(uint32_t));
        return one;
    }

    /// Returns the address of the tile's root among the merged nodes, or kNoNode.
    /// @param share of the whole work, an estimate
    uint32_t buildTile(const Tile& tile, DagBuilder& merged, double share) {
        try {
            const PassNodes nodes = nodesOf(tile);
            ++counts_.tileCount;
            tellDone(share);
            return mergeNodes(nodes, tile.level, merged);
        } catch (const OverBudget& over) {
            if (tile.level <= uint32_t(kBrickLog2))
                refuse(over);
        }
        return buildParted(tile, merged, share);
    }
    uint32_t buildParted(const Tile& tile, DagBuilder& merged, double share) {
        if (tile.level <= uint32_t(kBrickLog2))
            throw OverBudget{memory_.budget.heldBytes()};
        const CellPairs pairs{tile.triangles, {}, tile.cell};
        const size_t count = tile.triangles.count;
        Words childMask = memory_.words("voxelize children", count),
              marks = memory_.places("voxelize child marks", count);
        runPass(backend_, CountChildren{scene_, pairs, tile.level, childMask.view(), marks.view()});
        uint32_t addresses[8];
        for (uint32_t c = 0; c < 8; ++c) {
            runPass(backend_, MarkChild{std::as_const(childMask).view(), c, marks.view()});
            detail::fillBytes(backend_, marks.view().data + count, 0, sizeof(uint32_t));
            const size_t childCount = memory_.scan(marks);
            addresses[c] = kNoNode;
            if (childCount == 0) {
                tellDone(share / 8);
                continue;
            }
            Words of = memory_.words("voxelize child triangles", childCount);
            runPass(backend_, ListMarked{tile.triangles, std::as_const(marks).view(), of.view()});
            addresses[c] = buildTile({tile.level - 1, packCell(childCell(unpackCell(tile.cell), c)),
                                      std::as_const(of).view()},
                                     merged, share / 8);
        }
        return merged.addInner(tile.level, addresses);
    }

    /// Pairs of triangles and cells of one level.
    struct Pairs {
        std::optional<Words> triangles;
        std::optional<LongWords> cells;
        CellPairs view;
    };
    /// Returns the (triangle, brick) pairs of a tile.
    Pairs listBricks(const Tile& tile, uint32_t brickLevel) {
        Pairs pairs{{}, {}, {tile.triangles, {}, tile.cell}};
        for (uint32_t level = tile.level; level > brickLevel; --level) {
            const size_t count = pairs.view.triangles.count;
            Words childMask = memory_.words("voxelize children", count),
                  first = memory_.places("voxelize first child", count);
            runPass(backend_,
                    CountChildren{scene_, pairs.view, level, childMask.view(), first.view()});
            const size_t total = memory_.scan(first);
            Words triangles = memory_.words("voxelize pair triangles", total);
            LongWords cells = memory_.longWords("voxelize pair cells", total);
            if (total > 0)
                runPass(backend_,
                        ListChildren{pairs.view, std::as_const(childMask).view(),
                                     std::as_const(first).view(), triangles.view(), cells.view()});
            pairs.triangles = std::move(triangles);
            pairs.cells = std::move(cells);
            pairs.view = {std::as_const(*pairs.triangles).view(),
                          std::as_const(*pairs.cells).view(), 0};
            if (total == 0)
                break;
        }
        return pairs;
    }

    /// Returns the leaves of a tile, if any.
    std::optional<PassLeaves> listLeaves(const Tile& tile) {
        const uint32_t brickLevel = std::min(uint32_t(kBrickLog2), rootLevelOf(grid_));
        std::optional<Pairs> pairs(listBricks(tile, brickLevel));
        const size_t pairCount = pairs->view.triangles.count;
        if (pairCount == 0)
            return {};
        std::optional<Words> first(memory_.places("voxelize first leaf", pairCount));
        runPass(backend_, ListLeaves{scene_, pairs->view, brickLevel, first->view(), {}, {}});
        const size_t total = memory_.scan(*first);
        if (total == 0)
            return {};
        LongWords keys = memory_.longWords("voxelize leaf keys", total),
                  voxels = memory_.longWords("voxelize leaf voxels", total);
        runPass(backend_, ListLeaves{scene_, pairs->view, brickLevel, first->view(), keys.view(),
                                     voxels.view()});
        first.reset();
        pairs.reset();
        Words order = memory_.counting("voxelize leaf order", total);
        memory_.sort(keys, order);
        const PassMemory::HeldRuns held = memory_.runsOf(keys, 0);
        const size_t count = held.runs.count();
        PassLeaves leaves{memory_.longWords("voxelize joined keys", count),
                          memory_.longWords("voxelize joined voxels", count)};
        runPass(backend_, JoinLeaves{std::as_const(keys).view(), std::as_const(order).view(),
                                     std::as_const(voxels).view(), held.runs.start.view(),
                                     leaves.keys.view(), leaves.voxels.view()});
        return leaves;
    }

    PassNodes nodesOf(const Tile& tile) {
        return buildNodes(memory_, listLeaves(tile), tile.level);
    }

    Backend backend_;
    PassMemory memory_;
    VoxelScene scene_;
    View<const uint32_t> which_;
    VoxelGrid grid_;
    const Progress& progress_;
    PassBuildCounts& counts_;
    double done_ = 0;
};

} // namespace

Dag voxelizeByPasses(Backend backend, const TriangleView& triangles, View<const uint32_t> which,
                     const VoxelGrid& grid, uint64_t budgetBytes, const Progress& progress,
                     PassBuildCounts* counts) {
    PassBuildCounts ignored;
    try {
        const ResidentScene scene(backend, triangles, which, grid);
        PassBuildCounts& filled = counts ? *counts : ignored;
        filled = {};
        return PassVoxelizer(backend, scene, grid, budgetBytes, progress, filled).build();
    } catch (const std::bad_alloc&) {
        throwOutOfMemory("voxelizing", grid);
    }
}

} // namespace shadowdag
