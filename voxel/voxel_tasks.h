// SPDX-License-Identifier: Apache-2.0
// The work of voxelizing, divided into cells of the octree that can be built one by one, in any
// order, by any process.
#pragma once

#include "cuda/progress.h"
#include "scenes/world.h"
#include "voxel/cut_voxels.h"
#include "voxel/dag_builder.h"

#include <cstdint>
#include <functional>
#include <utility>
#include <vector>

namespace shadowdag {

/// Statistics of an octree before merging; sums over disjoint parts of it.
struct OctreeCounts {
    uint64_t voxelCount = 0;
    /// [level]: cells of side 2^level with a voxel in them; index 0 is not used
    uint64_t cellCount[kMaxResolutionLog2 + 1] = {};

    OctreeCounts& operator+=(const OctreeCounts& o) {
        voxelCount += o.voxelCount;
        for (uint32_t level = 0; level <= kMaxResolutionLog2; ++level)
            cellCount[level] += o.cellCount[level];
        return *this;
    }
};

/// A finished subtree.
struct Subtree {
    uint64_t cell = 0;          ///< Morton number of its cell, at the level of tasks
    uint32_t address = kNoNode; ///< of its root, in the builder that holds it
};

/// Returns the level of the root of a grid's DAG, at least that of leaves.
uint32_t rootLevelOf(const VoxelGrid& grid);
/// Returns the level of tasks: cells of 2^8 voxels, larger where the grid has more than 2^6 of
/// them an axis. A function of the resolution alone, so that parts built anywhere fit together.
uint32_t taskLevelOf(const VoxelGrid& grid);

/// The cells at the level of tasks that triangles touch, in Morton order, with their triangles.
class VoxelTasks {
public:
    /// Sorts the listed triangles down to the cells (see voxelize() for the arguments). `progress`
    /// is called with 0 so that it can end the work. Throws Error kInput naming a triangle whose
    /// position is not finite.
    VoxelTasks(const TriangleView& triangles, View<const uint32_t> which, const VoxelGrid& grid,
               const Progress& progress);

    size_t count() const { return tasks_.size(); }
    uint32_t level() const { return taskLevel_; }
    /// Returns the Morton number of the cell of task i; it grows with i.
    uint64_t cell(size_t i) const { return tasks_[i].cell; }
    /// Returns the expected cost of task i, without unit, above 0.
    double work(size_t i) const { return tasks_[i].work; }
    /// Returns the tasks [first, last) of part `part` (1..partCount): consecutive cells of about
    /// equal work. Every task is in one part. A function of scene, grid and count alone.
    std::pair<size_t, size_t> share(uint32_t part, uint32_t partCount) const;

    /// Builds task i in the builder (of topLevel level()) and returns the address of its root, or
    /// kNoNode when the triangles touch no voxel there after all. Concurrent calls are allowed
    /// with different builders.
    /// @param counts null, or what the subtree adds to
    /// @param check empty, or called after every few bricks; it may throw to end the work
    uint32_t build(size_t i, DagBuilder& builder, OctreeCounts* counts,
                   const std::function<void()>& check = {}) const;
    /// Removes the triangles of task i, which is done.
    void release(size_t i) { std::vector<uint32_t>().swap(tasks_[i].triangles); }

private:
    struct Task {
        uint64_t cell;
        glm::ivec3 corner;
        double work;
        std::vector<uint32_t> triangles;
    };
    struct Building;

    TriangleSetup setup(uint32_t t) const;
    void sortToChildren(uint32_t level, const glm::ivec3& corner, const std::vector<uint32_t>& list,
                        std::vector<uint32_t> lists[8]) const;
    void listTasks(uint32_t level, const glm::ivec3& corner, uint64_t cell,
                   std::vector<uint32_t> list, const Progress& progress);
    double expectedWork(const glm::ivec3& corner, const std::vector<uint32_t>& list) const;
    uint32_t buildCell(Building& b, uint32_t level, const glm::ivec3& corner,
                       const std::vector<uint32_t>& list) const;
    uint32_t buildBrick(Building& b, uint32_t level, const glm::ivec3& corner,
                        const std::vector<uint32_t>& list) const;

    TriangleView triangles_;
    MaskPyramids masks_; // of triangles_.masks
    VoxelGrid grid_;
    uint32_t taskLevel_;
    std::vector<Task> tasks_;
};

/// Sorts subtrees by cell. Throws Error kInput when two have the same: parts that overlap.
void sortSubtrees(std::vector<Subtree>& subtrees);

/// Adds the nodes above the subtrees, which stand at the level of tasks in a builder whose top is
/// the root's level, and returns the root's address, or kNoNode when there is no subtree.
/// @param subtrees ascending in cell, each cell once
/// @param counts null, or what the nodes above add to
uint32_t joinSubtrees(DagBuilder& builder, const VoxelGrid& grid,
                      const std::vector<Subtree>& subtrees, OctreeCounts* counts);

} // namespace shadowdag
