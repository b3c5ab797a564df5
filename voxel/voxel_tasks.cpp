// SPDX-License-Identifier: Apache-2.0
// Triangles are sorted down the octree, depth first, to bricks of 64^3 voxels; a brick is filled
// column by column and its 4^3 leaves are merged upwards in the table of its task. In memory at a
// time are one brick of voxels per thread, the triangle lists of one path down, and unique nodes.
#include "voxel/voxel_tasks.h"

#include "cuda/error.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <string>

namespace shadowdag {
namespace {

constexpr uint32_t kTaskLog2 = 8;
// A grid has 2^6 cells of tasks an axis at most: a surface then meets some ten thousand of them.
constexpr uint32_t kTasksPerAxisLog2 = 6;

constexpr int kLeavesPerBrickAxis = kBrickSize >> kLeafLog2;

/// Bit of voxel coordinate c & 3 on axis 0 in a leaf's mask; those of axes 1 and 2 are shifted by 1
/// and 2 more. (dag.h: bit 8 * octant + voxel, both x | y << 1 | z << 2.)
int leafBit(int c, int axis) {
    return ((c & 1) + ((c & 2) << 2)) << axis;
}

/// Spreads the low 4 bits of a leaf coordinate to every third bit.
int spread4(int c) {
    return (c & 1) | (c & 2) << 2 | (c & 4) << 4 | (c & 8) << 6;
}

/// The tables that turn a column's run of voxels into bits of Morton-ordered leaves.
struct ColumnTables {
    uint64_t run[3][4][4]; ///< [axis][first][last]: voxels first..last of a leaf's row at 0, 0
    int voxelShift[3][kBrickSize]; ///< [axis][coordinate]
    int leafNumber[3][kBrickSize]; ///< [axis][coordinate]: share of the leaf's Morton number

    ColumnTables() : run{} {
        for (int axis = 0; axis < 3; ++axis) {
            for (int first = 0; first < 4; ++first)
                for (int last = first; last < 4; ++last)
                    for (int c = first; c <= last; ++c)
                        run[axis][first][last] |= uint64_t(1) << leafBit(c, axis);
            for (int c = 0; c < kBrickSize; ++c) {
                voxelShift[axis][c] = leafBit(c, axis);
                leafNumber[axis][c] = spread4(c >> kLeafLog2) << axis;
            }
        }
    }
};

const ColumnTables kTables;

/// The voxels of one brick as leaves in Morton order.
struct Brick {
    std::vector<uint64_t> leaves =
        std::vector<uint64_t>(kLeavesPerBrickAxis * kLeavesPerBrickAxis * kLeavesPerBrickAxis);

    /// Returns a function that adds voxels first..last of column (u, v), along the axes of a setup.
    auto adder(const TriangleSetup& s) {
        const int* shiftU = kTables.voxelShift[s.axis[0]];
        const int* shiftV = kTables.voxelShift[s.axis[1]];
        const int* leafU = kTables.leafNumber[s.axis[0]];
        const int* leafV = kTables.leafNumber[s.axis[1]];
        const int* leafD = kTables.leafNumber[s.axis[2]];
        const auto& run = kTables.run[s.axis[2]];
        uint64_t* out = leaves.data();
        return [=](int u, int v, int first, int last) {
            const int shift = shiftU[u] + shiftV[v];
            uint64_t* column = out + leafU[u] + leafV[v];
            if ((first ^ last) < 4) {
                column[leafD[first]] |= run[first & 3][last & 3] << shift;
                return;
            }
            column[leafD[first]] |= run[first & 3][3] << shift;
            for (int d = (first | 3) + 1; d < (last & ~3); d += 4)
                column[leafD[d]] |= run[0][3] << shift;
            column[leafD[last]] |= run[0][last & 3] << shift;
        };
    }

    void add(const TriangleSetup& s, const glm::ivec3& corner, int size) {
        forEachColumn(s, corner, size, adder(s));
    }

    /// Adds the voxels that the opaque part of a cut triangle touches.
    void add(const TriangleSetup& s, const CutSetup& cut, const glm::ivec3& corner, int size) {
        const auto add = adder(s);
        forEachColumn(s, corner, size, [&](int u, int v, int first, int last) {
            const double atU = corner[s.axis[0]] + u, atV = corner[s.axis[1]] + v;
            const MaskCover cover = coverOfColumn(s, cut, atU, atV);
            if (cover == MaskCover::kAll)
                add(u, v, first, last);
            for (int d = first; d <= last && cover == MaskCover::kSome; ++d)
                if (isOpaqueInVoxel(s, cut, atU, atV, corner[s.axis[2]] + d))
                    add(u, v, d, d);
        });
    }
};

glm::ivec3 childCorner(const glm::ivec3& corner, uint32_t c, int size) {
    return corner + glm::ivec3(c & 1, c >> 1 & 1, c >> 2) * size;
}

/// Adds the voxels, leaves and 2^3 cells of a brick's leaves.
void countLeaves(const uint64_t* leaves, uint32_t count, OctreeCounts& counts) {
    for (uint32_t i = 0; i < count; ++i) {
        const uint64_t voxels = leaves[i];
        if (voxels == 0)
            continue;
        ++counts.cellCount[kLeafLog2];
        counts.voxelCount += uint64_t(std::popcount(voxels));
        // The lowest bit of every byte that is not 0.
        uint64_t any = voxels | voxels >> 4;
        any |= any >> 2;
        any |= any >> 1;
        counts.cellCount[1] += uint64_t(std::popcount(any & 0x0101010101010101u));
    }
}

} // namespace

uint32_t rootLevelOf(const VoxelGrid& grid) {
    return std::max(grid.resolutionLog2, kLeafLog2);
}

uint32_t taskLevelOf(const VoxelGrid& grid) {
    const uint32_t root = rootLevelOf(grid);
    return std::min(root, std::max(kTaskLog2, root - std::min(root, kTasksPerAxisLog2)));
}

struct VoxelTasks::Building {
    DagBuilder& builder;
    OctreeCounts* counts;
    const std::function<void()>& check;
    uint32_t brickCount = 0;
    Brick brick = {};
};

VoxelTasks::VoxelTasks(const TriangleView& triangles, View<const uint32_t> which,
                       const VoxelGrid& grid, const Progress& progress)
    : triangles_(triangles), masks_(triangles.masks.masks, triangles.masks.words), grid_(grid),
      taskLevel_(taskLevelOf(grid)) {
    std::vector<uint32_t> inside;
    const double limit = double(grid_.resolution());
    for (const uint32_t t : which) {
        const TriangleSetup s = setup(t);
        bool meets = true;
        for (int a = 0; a < 3; ++a) {
            if (!std::isfinite(s.p[a][0] + s.p[a][1] + s.p[a][2]))
                throw Error(ErrorKind::kInput,
                            "triangle " + std::to_string(t) +
                                " has a position that is not finite; repair the scene");
            meets = meets && s.least[a] <= limit && s.most[a] >= 0;
        }
        if (meets)
            inside.push_back(t);
    }
    listTasks(rootLevelOf(grid), glm::ivec3(0), 0, std::move(inside), progress);
}

std::pair<size_t, size_t> VoxelTasks::share(uint32_t part, uint32_t partCount) const {
    SDAG_ASSERT(part >= 1 && part <= partCount);
    double all = 0;
    for (const Task& task : tasks_)
        all += task.work;
    // A task belongs to the part whose range of the work contains its middle.
    size_t first = tasks_.size(), last = tasks_.size();
    double before = 0;
    for (size_t i = 0; i < tasks_.size(); ++i) {
        const double middle = (before + 0.5 * tasks_[i].work) / all * partCount;
        before += tasks_[i].work;
        const auto of = std::min(uint32_t(middle), partCount - 1) + 1;
        if (of >= part)
            first = std::min(first, i);
        if (of > part)
            last = std::min(last, i);
    }
    return {first, last};
}

TriangleSetup VoxelTasks::setup(uint32_t t) const {
    const glm::vec3 corners[3] = {triangles_.vertex(t, 0), triangles_.vertex(t, 1),
                                  triangles_.vertex(t, 2)};
    return setupTriangle(grid_, corners);
}

// Appends to lists[c] the triangles that touch child c of the cell.
void VoxelTasks::sortToChildren(uint32_t level, const glm::ivec3& corner,
                                const std::vector<uint32_t>& list,
                                std::vector<uint32_t> lists[8]) const {
    const int half = 1 << (level - 1);
    const int limit = int(grid_.resolution());
    for (const uint32_t t : list) {
        const TriangleSetup s = setup(t);
        for (uint32_t c = 0; c < 8; ++c) {
            const glm::ivec3 child = childCorner(corner, c, half);
            if (child.x < limit && child.y < limit && child.z < limit &&
                touchesCube(s, child, half))
                lists[c].push_back(t);
        }
    }
}

// Estimate of the voxels that the triangles fill in the cell: a triangle has half its bounds' cross
// section across its normal.
double VoxelTasks::expectedWork(const glm::ivec3& corner, const std::vector<uint32_t>& list) const {
    double work = 1000;
    const double size = double(1u << taskLevel_);
    for (const uint32_t t : list) {
        const TriangleSetup s = setup(t);
        double inCell = 1, whole = 0.5;
        for (int a = 0; a < 2; ++a) {
            const double lo = corner[s.axis[a]];
            whole *= s.most[a] - s.least[a];
            inCell *= std::max(0.0, std::min(s.most[a], lo + size) - std::max(s.least[a], lo));
        }
        work += 16 + std::min(whole, inCell);
    }
    return work;
}

void VoxelTasks::listTasks(uint32_t level, const glm::ivec3& corner, uint64_t cell,
                           std::vector<uint32_t> list, const Progress& progress) {
    if (list.empty())
        return;
    if (level == taskLevel_) {
        const double work = expectedWork(corner, list);
        list.shrink_to_fit();
        tasks_.push_back({cell, corner, work, std::move(list)});
        return;
    }
    if (progress)
        progress(0);
    std::vector<uint32_t> lists[8];
    sortToChildren(level, corner, list, lists);
    std::vector<uint32_t>().swap(list);
    for (uint32_t c = 0; c < 8; ++c)
        listTasks(level - 1, childCorner(corner, c, 1 << (level - 1)), cell << 3 | c,
                  std::move(lists[c]), progress);
}

uint32_t VoxelTasks::build(size_t i, DagBuilder& builder, OctreeCounts* counts,
                           const std::function<void()>& check) const {
    Building b{builder, counts, check};
    return buildCell(b, taskLevel_, tasks_[i].corner, tasks_[i].triangles);
}

uint32_t VoxelTasks::buildCell(Building& b, uint32_t level, const glm::ivec3& corner,
                               const std::vector<uint32_t>& list) const {
    if (list.empty())
        return kNoNode;
    if (level <= uint32_t(kBrickLog2))
        return buildBrick(b, level, corner, list);
    std::vector<uint32_t> lists[8];
    sortToChildren(level, corner, list, lists);
    uint32_t children[8];
    for (uint32_t c = 0; c < 8; ++c)
        children[c] = buildCell(b, level - 1, childCorner(corner, c, 1 << (level - 1)), lists[c]);
    const uint32_t address = b.builder.addInner(level, children);
    if (b.counts && address != kNoNode)
        ++b.counts->cellCount[level];
    return address;
}

uint32_t VoxelTasks::buildBrick(Building& b, uint32_t level, const glm::ivec3& corner,
                                const std::vector<uint32_t>& list) const {
    constexpr uint32_t kBricksPerCheck = 64;
    if (b.check && b.brickCount++ % kBricksPerCheck == 0)
        b.check();
    // A grid smaller than a leaf fills only its own corner of it.
    const int size = std::min(1 << level, int(grid_.resolution()));
    uint32_t count = 1u << (3 * (level - kLeafLog2));
    std::fill_n(b.brick.leaves.begin(), count, 0);
    for (const uint32_t t : list) {
        const TriangleSetup s = setup(t);
        if (!triangles_.masks.isCut(t)) {
            b.brick.add(s, corner, size);
            continue;
        }
        const CutTriangle& cut = triangles_.masks.cuts[triangles_.masks.triangleCut[t]];
        b.brick.add(s, setupCut(s, cut.uv, masks_.view()[cut.mask]), corner, size);
    }
    if (b.counts)
        countLeaves(b.brick.leaves.data(), count, *b.counts);
    uint32_t nodes[kLeavesPerBrickAxis * kLeavesPerBrickAxis * kLeavesPerBrickAxis];
    for (uint32_t i = 0; i < count; ++i)
        nodes[i] = b.builder.addLeaf(b.brick.leaves[i]);
    for (uint32_t l = kLeafLog2 + 1; l <= level; ++l) {
        count >>= 3;
        for (uint32_t i = 0; i < count; ++i) {
            nodes[i] = b.builder.addInner(l, nodes + 8 * i);
            if (b.counts && nodes[i] != kNoNode)
                ++b.counts->cellCount[l];
        }
    }
    return nodes[0];
}

void sortSubtrees(std::vector<Subtree>& subtrees) {
    std::sort(subtrees.begin(), subtrees.end(),
              [](const Subtree& a, const Subtree& b) { return a.cell < b.cell; });
    for (size_t i = 1; i < subtrees.size(); ++i)
        if (subtrees[i].cell == subtrees[i - 1].cell)
            throw Error(ErrorKind::kInput,
                        "cell " + std::to_string(subtrees[i].cell) +
                            " is in two parts; they are damaged, build them again");
}

namespace {

/// Walks down the cells that hold subtrees; `next` is the first subtree not yet met.
uint32_t joinCell(DagBuilder& builder, uint32_t level, uint32_t taskLevel, uint64_t cell,
                  const std::vector<Subtree>& subtrees, size_t& next, OctreeCounts* counts) {
    const uint32_t shift = 3 * (level - taskLevel);
    if (next == subtrees.size() || subtrees[next].cell >> shift != cell)
        return kNoNode;
    if (level == taskLevel)
        return subtrees[next++].address;
    uint32_t children[8];
    for (uint32_t c = 0; c < 8; ++c)
        children[c] =
            joinCell(builder, level - 1, taskLevel, cell << 3 | c, subtrees, next, counts);
    const uint32_t address = builder.addInner(level, children);
    if (counts && address != kNoNode)
        ++counts->cellCount[level];
    return address;
}

} // namespace

uint32_t joinSubtrees(DagBuilder& builder, const VoxelGrid& grid,
                      const std::vector<Subtree>& subtrees, OctreeCounts* counts) {
    size_t next = 0;
    const uint32_t root =
        joinCell(builder, rootLevelOf(grid), taskLevelOf(grid), 0, subtrees, next, counts);
    SDAG_ASSERT(next == subtrees.size());
    return root;
}

} // namespace shadowdag
