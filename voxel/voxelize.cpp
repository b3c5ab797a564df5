// SPDX-License-Identifier: Apache-2.0
// Triangles are sorted down the octree, depth first, to bricks of 64^3 voxels; a brick is filled
// column by column, its 4^3 leaves are merged upwards in the table of its task, and every finished
// task is merged into the whole. What is held at a time: one brick of voxels a thread, the triangle
// lists of one path down, and unique nodes.
#include "voxel/voxelize.h"

#include "cuda/error.h"
#include "cuda/parallel_for.h"
#include "voxel/dag_builder.h"
#include "voxel/triangle_voxels.h"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <new>
#include <string>

namespace shadowdag {
namespace {

// Tasks are cells of 2^8 voxels (larger where the grid is larger than 2^13): a thousand of them
// where Sponza is 4096^3.
constexpr uint32_t kTaskLog2 = 8;

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

    void add(const TriangleSetup& s, const glm::ivec3& corner, int size) {
        const int* shiftU = kTables.voxelShift[s.axis[0]];
        const int* shiftV = kTables.voxelShift[s.axis[1]];
        const int* leafU = kTables.leafNumber[s.axis[0]];
        const int* leafV = kTables.leafNumber[s.axis[1]];
        const int* leafD = kTables.leafNumber[s.axis[2]];
        const auto& run = kTables.run[s.axis[2]];
        uint64_t* out = leaves.data();
        forEachColumn(s, corner, size, [=](int u, int v, int first, int last) {
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
        });
    }
};

glm::ivec3 childCorner(const glm::ivec3& corner, uint32_t c, int size) {
    return corner + glm::ivec3(c & 1, c >> 1 & 1, c >> 2) * size;
}

/// A cell of the octree whose subtree is one unit of parallel work.
struct Task {
    glm::ivec3 corner;
    std::vector<uint32_t> triangles;
    uint32_t address = kNoNode; ///< in the merged builder, once done
};

class Voxelizer {
public:
    Voxelizer(const TriangleView& triangles, View<const uint32_t> which, const VoxelGrid& grid,
              const Progress& progress)
        : triangles_(triangles), which_(which), grid_(grid), progress_(progress),
          rootLevel_(std::max(grid.resolutionLog2, kLeafLog2)),
          taskLevel_(
              std::min(rootLevel_, std::max(kTaskLog2, rootLevel_ > 5 ? rootLevel_ - 5 : 0))),
          merged_(rootLevel_) {}

    Dag run() {
        std::vector<uint32_t> all;
        const double limit = double(grid_.resolution());
        for (const uint32_t t : which_) {
            const TriangleSetup s = setup(t);
            bool inside = true;
            for (int a = 0; a < 3; ++a) {
                if (!std::isfinite(s.p[a][0] + s.p[a][1] + s.p[a][2]))
                    throw Error(ErrorKind::kInput,
                                "triangle " + std::to_string(t) +
                                    " has a position that is not finite; repair the scene");
                inside = inside && s.least[a] <= limit && s.most[a] >= 0;
            }
            if (inside)
                all.push_back(t);
        }
        listTasks(rootLevel_, glm::ivec3(0), std::move(all));
        double workAll = 0, workDone = 0;
        for (const Task& task : tasks_)
            workAll += work(task);
        std::mutex mutex;
        cpuParallelRanges(tasks_.size(), 1, [&](size_t begin, size_t end) {
            for (size_t i = begin; i < end; ++i) {
                DagBuilder builder(taskLevel_);
                Brick brick;
                const uint32_t address =
                    build(builder, brick, taskLevel_, tasks_[i].corner, tasks_[i].triangles);
                const std::lock_guard<std::mutex> lock(mutex);
                tasks_[i].address = merged_.addSubtree(builder, taskLevel_, address);
                workDone += work(tasks_[i]);
                std::vector<uint32_t>().swap(tasks_[i].triangles);
                if (progress_)
                    progress_(std::min(1.0, workDone / workAll));
            }
        });
        size_t next = 0;
        const uint32_t root = joinTasks(rootLevel_, glm::ivec3(0), next);
        return merged_.finish(rootLevel_, root, grid_);
    }

private:
    static double work(const Task& task) { return 1000.0 + double(task.triangles.size()); }

    TriangleSetup setup(uint32_t t) const {
        const glm::vec3 corners[3] = {triangles_.vertex(t, 0), triangles_.vertex(t, 1),
                                      triangles_.vertex(t, 2)};
        return setupTriangle(grid_, corners);
    }

    /// Appends to lists[c] the triangles that touch child c of the cell.
    void sortToChildren(uint32_t level, const glm::ivec3& corner, const std::vector<uint32_t>& list,
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

    void listTasks(uint32_t level, const glm::ivec3& corner, std::vector<uint32_t> list) {
        if (list.empty())
            return;
        if (level == taskLevel_) {
            tasks_.push_back({corner, std::move(list)});
            return;
        }
        std::vector<uint32_t> lists[8];
        sortToChildren(level, corner, list, lists);
        std::vector<uint32_t>().swap(list);
        for (uint32_t c = 0; c < 8; ++c)
            listTasks(level - 1, childCorner(corner, c, 1 << (level - 1)), std::move(lists[c]));
    }

    /// Returns the node over the tasks of a cell; walks as listTasks did, `next` is the first task
    /// not yet met.
    uint32_t joinTasks(uint32_t level, const glm::ivec3& corner, size_t& next) {
        const glm::ivec3 end = corner + glm::ivec3(1 << level);
        if (next == tasks_.size() || glm::any(glm::lessThan(tasks_[next].corner, corner)) ||
            glm::any(glm::greaterThanEqual(tasks_[next].corner, end)))
            return kNoNode;
        if (level == taskLevel_)
            return tasks_[next++].address;
        uint32_t children[8];
        for (uint32_t c = 0; c < 8; ++c)
            children[c] = joinTasks(level - 1, childCorner(corner, c, 1 << (level - 1)), next);
        return merged_.addInner(level, children);
    }

    uint32_t build(DagBuilder& builder, Brick& brick, uint32_t level, const glm::ivec3& corner,
                   const std::vector<uint32_t>& list) const {
        if (list.empty())
            return kNoNode;
        if (level <= uint32_t(kBrickLog2))
            return buildBrick(builder, brick, level, corner, list);
        std::vector<uint32_t> lists[8];
        sortToChildren(level, corner, list, lists);
        uint32_t children[8];
        for (uint32_t c = 0; c < 8; ++c)
            children[c] = build(builder, brick, level - 1, childCorner(corner, c, 1 << (level - 1)),
                                lists[c]);
        return builder.addInner(level, children);
    }

    uint32_t buildBrick(DagBuilder& builder, Brick& brick, uint32_t level, const glm::ivec3& corner,
                        const std::vector<uint32_t>& list) const {
        // A grid smaller than a leaf fills only its own corner of it.
        const int size = std::min(1 << level, int(grid_.resolution()));
        uint32_t count = 1u << (3 * (level - kLeafLog2));
        std::fill_n(brick.leaves.begin(), count, 0);
        for (const uint32_t t : list)
            brick.add(setup(t), corner, size);
        uint32_t nodes[kLeavesPerBrickAxis * kLeavesPerBrickAxis * kLeavesPerBrickAxis];
        for (uint32_t i = 0; i < count; ++i)
            nodes[i] = builder.addLeaf(brick.leaves[i]);
        for (uint32_t l = kLeafLog2 + 1; l <= level; ++l) {
            count >>= 3;
            for (uint32_t i = 0; i < count; ++i)
                nodes[i] = builder.addInner(l, nodes + 8 * i);
        }
        return nodes[0];
    }

    TriangleView triangles_;
    View<const uint32_t> which_;
    VoxelGrid grid_;
    const Progress& progress_;
    uint32_t rootLevel_;
    uint32_t taskLevel_;
    std::vector<Task> tasks_;
    DagBuilder merged_;
};

} // namespace

Dag voxelize(const TriangleView& triangles, View<const uint32_t> which, const VoxelGrid& grid,
             const Progress& progress) {
    try {
        return Voxelizer(triangles, which, grid, progress).run();
    } catch (const std::bad_alloc&) {
        throw Error(ErrorKind::kResource, "out of memory while voxelizing at " +
                                              std::to_string(grid.resolution()) +
                                              "^3; ask for a lower resolution");
    }
}

} // namespace shadowdag
