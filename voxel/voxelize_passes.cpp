// SPDX-License-Identifier: Apache-2.0
// The order of the passes that build voxels, and the memory between them. Pairs of triangles and
// cells go down the octree level by level to bricks of 64^3; every pair lists its leaves; leaves
// are sorted by Morton number and joined; nodes are made unique level by level upwards and numbered
// downwards.
#include "voxel/voxelize_passes.h"

#include "cuda/error.h"
#include "cuda/scan_sort.h"
#include "voxel/dag_builder.h"
#include "voxel/pass_memory.h"
#include "voxel/unique_nodes_pass.h"
#include "voxel/voxel_tasks.h"
#include "voxel/voxelize_pass.h"

#include <algorithm>
#include <new>
#include <optional>
#include <string>

namespace shadowdag {
namespace {

using Words = PassList<uint32_t>;
using LongWords = PassList<uint64_t>;

/// What one entry of a list may be numbered by.
constexpr uint64_t kMaxListLength = 0xfffffffeull;

/// A copy of a host array on a backend; on the CPU the array itself.
template <class T> class Placed {
public:
    Placed(Backend backend, const std::string& name, View<const T> host)
        : copy_(backend, name), view_(host) {
        if (backend == Backend::kCpu)
            return;
        copy_.resize(host.count);
        detail::copyBytes(backend, copy_.view().data, Backend::kCpu, host.data,
                          host.count * sizeof(T));
        view_ = std::as_const(copy_).view();
    }
    View<const T> view() const { return view_; }

private:
    Buffer<T> copy_;
    View<const T> view_;
};

/// The scene that is voxelized, on a backend.
class PlacedScene {
public:
    PlacedScene(Backend backend, const TriangleView& triangles, View<const uint32_t> which,
                const VoxelGrid& grid)
        : pyramids_(triangles.masks.masks, triangles.masks.words), grid_(grid),
          positions_(backend, "voxelize positions", triangles.positions),
          triangles_(backend, "voxelize triangles", triangles.triangles),
          which_(backend, "voxelize list", which),
          triangleCut_(backend, "voxelize triangle cuts", triangles.masks.triangleCut),
          cuts_(backend, "voxelize cut triangles", triangles.masks.cuts),
          masks_(backend, "voxelize masks", viewOf(std::as_const(pyramids_.masks))),
          levels_(backend, "voxelize mask levels", viewOf(std::as_const(pyramids_.levels))),
          words_(backend, "voxelize mask words", viewOf(std::as_const(pyramids_.words))) {}

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
    Placed<glm::vec3> positions_;
    Placed<glm::uvec3> triangles_;
    Placed<uint32_t> which_, triangleCut_;
    Placed<CutTriangle> cuts_;
    Placed<MaskPyramidInfo> masks_;
    Placed<MaskLevel> levels_;
    Placed<uint32_t> words_;
};

/// A cell that is built by itself, and the triangles that touch it.
struct Tile {
    uint32_t level;
    PackedCell cell;
    View<const uint32_t> triangles;
};

/// The unique nodes of a tile. inner[i]: of level kLeafLog2 + 1 + i, kChildCount words a node.
struct TileNodes {
    std::optional<LongWords> leaves; ///< null: the tile is empty
    std::vector<Words> inner;
};

class PassVoxelizer {
public:
    PassVoxelizer(Backend backend, const PlacedScene& scene, const VoxelGrid& grid,
                  uint64_t budgetBytes, const Progress& progress, PassBuildCounts& counts)
        : backend_(backend), scene_(scene.view()), which_(scene.which()), grid_(grid),
          budget_(budgetBytes), progress_(progress), counts_(counts) {}

    Dag build() {
        Dag dag;
        dag.grid = grid_;
        try {
            const std::optional<Words> inside = listInside();
            if (!inside)
                return dag;
            const Tile whole{rootLevelOf(grid_), 0, inside->view()};
            try {
                dag.words = wordsOf(nodesOf(whole));
                counts_.tileCount = 1;
            } catch (const OverBudget&) {
                DagBuilder merged(whole.level);
                dag = merged.finish(whole.level, buildParted(whole, merged, 1.0), grid_);
            }
        } catch (const OverBudget& over) {
            refuse(over);
        }
        if (!dag.words.empty())
            dag.rootAddress = 0;
        counts_.peakBytes = budget_.peakBytes();
        tellDone(1.0 - done_);
        return dag;
    }

private:
    [[noreturn]] void refuse(const OverBudget& over) const {
        throw Error(ErrorKind::kResource,
                    "voxelizing at " + std::to_string(grid_.resolution()) + "^3 holds " +
                        std::to_string(over.bytes) +
                        " bytes of lists at a time even cell by cell, more than it may on " +
                        backendName(backend_) +
                        "; ask for a lower resolution, give it more memory, or use --backend cpu");
    }
    void tellDone(double share) {
        done_ = std::min(1.0, done_ + share);
        if (progress_)
            progress_(done_);
    }

    Words words(const char* name, size_t count) { return {budget_, backend_, name, count}; }
    LongWords longWords(const char* name, size_t count) { return {budget_, backend_, name, count}; }
    /// Returns count + 1 words, of which the last is 0: counts, and after a scan their places.
    Words places(const char* name, size_t count) {
        Words list = words(name, count + 1);
        detail::fillBytes(backend_, list.view().data + count, 0, sizeof(uint32_t));
        return list;
    }
    /// Turns counts into places and returns their sum.
    size_t scan(Words& list) {
        const uint64_t total = exclusiveScan(backend_, std::as_const(list).view(), list.view());
        if (total > kMaxListLength)
            throw OverBudget{total * sizeof(uint64_t)};
        return size_t(total);
    }
    /// Sorts keys, `order` along; the other copies that sorting takes are counted.
    void sort(LongWords& keys, Words& order) {
        const Reservation scratch(budget_, keys.size() * (sizeof(uint64_t) + sizeof(uint32_t)));
        sortPairs(backend_, keys.view(), order.view());
    }
    Words counting(const char* name, size_t count) {
        Words order = words(name, count);
        SDAG_DISPATCH(backend_, countUp, {order.view()});
        return order;
    }
    /// Runs, and what of the budget they take at most.
    struct HeldRuns {
        Reservation taken;
        Runs runs;
        HeldRuns(PassBudget& budget, Backend backend, size_t itemCount)
            : taken(budget, 2 * (itemCount + 1) * sizeof(uint32_t)), runs(backend, "voxelize") {}
    };
    HeldRuns runsOf(const LongWords& keys, uint32_t shift) {
        HeldRuns held(budget_, backend_, keys.size());
        listRuns(backend_, keys.view(), shift, held.runs);
        return held;
    }

    /// Returns the listed triangles that meet the grid, if any. Throws Error kInput naming one that
    /// is not finite.
    std::optional<Words> listInside() {
        Words marks = places("voxelize marks", which_.count), bad = words("voxelize bad", 1);
        bad.buffer().fill(0xff);
        SDAG_DISPATCH(backend_, markInside, {scene_, which_, marks.view(), bad.view()});
        if (const uint32_t at = bad.buffer().at(0); at != 0xffffffffu)
            throw Error(ErrorKind::kInput,
                        "triangle " + std::to_string(listed(at).at(0)) +
                            " has a position that is not finite; repair the scene");
        const size_t count = scan(marks);
        if (count == 0)
            return {};
        Words inside = words("voxelize inside", count);
        SDAG_DISPATCH(backend_, listMarked, {which_, std::as_const(marks).view(), inside.view()});
        return inside;
    }
    /// Returns a copy of one entry of the list of triangles.
    Buffer<uint32_t> listed(size_t at) const {
        Buffer<uint32_t> one(backend_, "voxelize one", 1);
        detail::copyBytes(backend_, one.view().data, backend_, which_.data + at, sizeof(uint32_t));
        return one;
    }

    /// Returns the address of the tile's root among the merged nodes, or kNoNode.
    /// @param share of the whole work, as far as known
    uint32_t buildTile(const Tile& tile, DagBuilder& merged, double share) {
        try {
            const TileNodes nodes = nodesOf(tile);
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
            throw OverBudget{budget_.heldBytes()};
        const CellPairs pairs{tile.triangles, {}, tile.cell};
        const size_t count = tile.triangles.count;
        Words childMask = words("voxelize children", count),
              marks = places("voxelize child marks", count);
        SDAG_DISPATCH(backend_, countChildren,
                      {scene_, pairs, tile.level, childMask.view(), marks.view()});
        uint32_t addresses[8];
        for (uint32_t c = 0; c < 8; ++c) {
            SDAG_DISPATCH(backend_, markChild, {std::as_const(childMask).view(), c, marks.view()});
            detail::fillBytes(backend_, marks.view().data + count, 0, sizeof(uint32_t));
            const size_t childCount = scan(marks);
            addresses[c] = kNoNode;
            if (childCount == 0) {
                tellDone(share / 8);
                continue;
            }
            Words of = words("voxelize child triangles", childCount);
            SDAG_DISPATCH(backend_, listMarked,
                          {tile.triangles, std::as_const(marks).view(), of.view()});
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
            Words childMask = words("voxelize children", count),
                  first = places("voxelize first child", count);
            SDAG_DISPATCH(backend_, countChildren,
                          {scene_, pairs.view, level, childMask.view(), first.view()});
            const size_t total = scan(first);
            Words triangles = words("voxelize pair triangles", total);
            LongWords cells = longWords("voxelize pair cells", total);
            if (total > 0)
                SDAG_DISPATCH(backend_, listChildren,
                              {pairs.view, std::as_const(childMask).view(),
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

    /// The leaves of a tile, ascending by Morton number.
    struct Leaves {
        LongWords keys, voxels;
    };
    std::optional<Leaves> listLeaves(const Tile& tile) {
        const uint32_t brickLevel = std::min(uint32_t(kBrickLog2), rootLevelOf(grid_));
        std::optional<Pairs> pairs(listBricks(tile, brickLevel));
        const size_t pairCount = pairs->view.triangles.count;
        if (pairCount == 0)
            return {};
        std::optional<Words> first(places("voxelize first leaf", pairCount));
        SDAG_DISPATCH(backend_, listLeaves,
                      {scene_, pairs->view, brickLevel, first->view(), {}, {}});
        const size_t total = scan(*first);
        if (total == 0)
            return {};
        LongWords keys = longWords("voxelize leaf keys", total),
                  voxels = longWords("voxelize leaf voxels", total);
        SDAG_DISPATCH(backend_, listLeaves,
                      {scene_, pairs->view, brickLevel, first->view(), keys.view(), voxels.view()});
        first.reset();
        pairs.reset();
        Words order = counting("voxelize leaf order", total);
        sort(keys, order);
        const HeldRuns held = runsOf(keys, 0);
        const size_t count = held.runs.count();
        Leaves leaves{longWords("voxelize joined keys", count),
                      longWords("voxelize joined voxels", count)};
        SDAG_DISPATCH(backend_, joinLeaves,
                      {std::as_const(keys).view(), std::as_const(order).view(),
                       std::as_const(voxels).view(), held.runs.start.view(), leaves.keys.view(),
                       leaves.voxels.view()});
        return leaves;
    }

    TileNodes nodesOf(const Tile& tile) {
        TileNodes nodes;
        std::optional<Leaves> leaves = listLeaves(tile);
        if (!leaves)
            return nodes;
        LongWords keys = std::move(leaves->keys);
        Words nodeOfCell = words("voxelize node of cell", keys.size());
        {
            LongWords sorted = std::move(leaves->voxels);
            leaves.reset();
            Words order = counting("voxelize cell order", keys.size());
            sort(sorted, order);
            const HeldRuns held = runsOf(sorted, 0);
            nodes.leaves.emplace(longWords("voxelize leaves", held.runs.count()));
            SDAG_DISPATCH(
                backend_, listRunValues,
                {std::as_const(sorted).view(), held.runs.start.view(), nodes.leaves->view()});
            SDAG_DISPATCH(backend_, numberByRun,
                          {std::as_const(order).view(), held.runs.next.view(), nodeOfCell.view()});
        }
        for (uint32_t level = kLeafLog2 + 1; level <= tile.level; ++level)
            nodes.inner.push_back(joinLevel(keys, nodeOfCell));
        return nodes;
    }

    /// Replaces the cells of a level by those of the level above; returns that level's nodes.
    Words joinLevel(LongWords& keys, Words& nodeOfCell) {
        std::optional<HeldRuns> held(runsOf(keys, 3));
        const size_t count = held->runs.count();
        LongWords keysAbove = longWords("voxelize cell keys", count);
        Words children = words("voxelize cell children", count * kChildCount);
        SDAG_DISPATCH(backend_, gatherChildren,
                      {std::as_const(keys).view(), std::as_const(nodeOfCell).view(),
                       held->runs.start.view(), keysAbove.view(), children.view()});
        held.reset();
        keys = std::move(keysAbove);
        Words order = counting("voxelize cell order", count);
        {
            LongWords packed = longWords("voxelize node keys", count);
            for (uint32_t key = 0; key < kNodeKeyCount; ++key) {
                SDAG_DISPATCH(backend_, packNodeKeys,
                              {std::as_const(children).view(), std::as_const(order).view(), key,
                               packed.view()});
                sort(packed, order);
            }
        }
        HeldRuns distinct(budget_, backend_, count);
        distinct.runs.next.resize(count + 1);
        SDAG_DISPATCH(backend_, markDistinctNodes,
                      {std::as_const(children).view(), std::as_const(order).view(),
                       distinct.runs.next.view()});
        listMarkedRuns(backend_, distinct.runs);
        Words nodes = words("voxelize nodes", distinct.runs.count() * kChildCount);
        SDAG_DISPATCH(backend_, listDistinctNodes,
                      {std::as_const(children).view(), std::as_const(order).view(),
                       distinct.runs.start.view(), nodes.view()});
        Words nodeOfAbove = words("voxelize node of cell", count);
        SDAG_DISPATCH(backend_, numberByRun,
                      {std::as_const(order).view(), distinct.runs.next.view(), nodeOfAbove.view()});
        nodeOfCell = std::move(nodeOfAbove);
        return nodes;
    }

    /// Adds a tile's nodes to those of the whole; returns the address of its root.
    uint32_t mergeNodes(const TileNodes& nodes, uint32_t level, DagBuilder& merged) const {
        if (!nodes.leaves)
            return kNoNode;
        std::vector<uint32_t> below, here;
        for (const uint64_t voxels : nodes.leaves->buffer().download())
            here.push_back(merged.addLeaf(voxels));
        for (uint32_t l = kLeafLog2 + 1; l <= level; ++l) {
            below.swap(here);
            here.clear();
            std::vector<uint32_t> children = nodes.inner[l - kLeafLog2 - 1].buffer().download();
            for (size_t n = 0; n < children.size(); n += kChildCount) {
                for (uint32_t c = 0; c < kChildCount; ++c)
                    if (children[n + c] != kNoNode)
                        children[n + c] = below[children[n + c]];
                here.push_back(merged.addInner(l, &children[n]));
            }
        }
        SDAG_ASSERT(here.size() == 1);
        return here[0];
    }

    /// One level in canonical order.
    struct OrderedLevel {
        Words order;
        std::optional<Words> first; ///< edges before each node; none of leaves
        uint32_t base = 0;

        LevelWords words() const { return {base, first ? first->view() : View<const uint32_t>{}}; }
    };
    /// Returns the words of the DAG of nodes whose top level holds the root alone.
    std::vector<uint32_t> wordsOf(const TileNodes& nodes) {
        if (!nodes.leaves)
            return {};
        // levels[0] is the root's; ranks[i] of the nodes of levels[i].
        std::vector<OrderedLevel> levels;
        std::vector<Words> ranks;
        levels.push_back({counting("voxelize canonical order", 1), {}, 0});
        ranks.push_back(counting("voxelize ranks", 1));
        uint64_t wordCount = 0;
        for (size_t i = nodes.inner.size(); i-- > 0;) {
            OrderedLevel& here = levels.back();
            const View<const uint32_t> children = nodes.inner[i].view();
            const View<const uint32_t> order = std::as_const(here.order).view();
            here.first.emplace(places("voxelize first edge", order.count));
            SDAG_DISPATCH(backend_, countEdges, {children, order, here.first->view()});
            const size_t edgeCount = scan(*here.first);
            here.base = nextBase(wordCount, order.count + edgeCount);
            const size_t belowCount =
                i > 0 ? nodes.inner[i - 1].size() / kChildCount : nodes.leaves->size();
            Words firstEdge = words("voxelize first visits", belowCount);
            firstEdge.buffer().fill(0xff);
            SDAG_DISPATCH(backend_, visitEdges,
                          {children, order, std::as_const(*here.first).view(), firstEdge.view()});
            Words below = counting("voxelize canonical order", belowCount);
            {
                const Reservation scratch(budget_, 2 * belowCount * sizeof(uint32_t));
                sortPairs(backend_, firstEdge.view(), below.view());
            }
            Words rank = words("voxelize ranks", belowCount);
            SDAG_DISPATCH(backend_, rankNodes, {std::as_const(below).view(), rank.view()});
            levels.push_back({std::move(below), {}, 0});
            ranks.push_back(std::move(rank));
        }
        levels.back().base = nextBase(wordCount, 2 * uint64_t(nodes.leaves->size()));
        Words all = words("voxelize words", wordCount);
        for (size_t k = 0; k + 1 < levels.size(); ++k)
            SDAG_DISPATCH(backend_, writeInnerNodes,
                          {nodes.inner[nodes.inner.size() - 1 - k].view(),
                           std::as_const(levels[k].order).view(), levels[k].words(),
                           levels[k + 1].words(), std::as_const(ranks[k + 1]).view(), all.view()});
        SDAG_DISPATCH(backend_, writeLeaves,
                      {nodes.leaves->view(), std::as_const(levels.back().order).view(),
                       levels.back().words(), all.view()});
        return all.buffer().download();
    }
    /// Returns where a level of `count` words begins, and moves on behind it.
    static uint32_t nextBase(uint64_t& wordCount, uint64_t count) {
        const uint64_t base = wordCount;
        wordCount += count;
        if (wordCount > kNoNode - 1)
            throwTooManyWords();
        return uint32_t(base);
    }

    Backend backend_;
    VoxelScene scene_;
    View<const uint32_t> which_;
    VoxelGrid grid_;
    PassBudget budget_;
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
        const PlacedScene scene(backend, triangles, which, grid);
        PassBuildCounts& filled = counts ? *counts : ignored;
        filled = {};
        return PassVoxelizer(backend, scene, grid, budgetBytes, progress, filled).build();
    } catch (const std::bad_alloc&) {
        throwOutOfMemory("voxelizing", grid);
    }
}

} // namespace shadowdag
