// SPDX-License-Identifier: Apache-2.0
// Joins parts level by level through files. In memory at a time are the table of one level and the
// new numbers of one part's nodes of the level below.
#pragma once

#include "voxel/memory_limit.h"
#include "voxel/part_file.h"
#include "voxel/scratch_folder.h"

#include <functional>
#include <vector>

namespace shadowdag {

/// The unique nodes of several parts, each level in a file of the scratch folder.
class LevelMerge {
public:
    /// Merges all levels up to that of tasks, from the leaves up. Throws Error kInput for parts
    /// that have a cell in common, kResource when the limit is too small or the disk is full.
    /// @param folder,limit outlive the merge
    /// @param check called regularly; an exception from it ends the merge
    LevelMerge(const std::vector<PartReader>& parts, const ScratchFolder& folder,
               const MemoryLimit& limit, const std::function<void()>& check);

    /// Returns the subtrees of all parts, ascending in cell; addresses are for visit().
    const std::vector<Subtree>& subtrees() const { return subtrees_; }
    /// Adds the levels above the tasks and returns the root for visit(), kNoNode when there is no
    /// voxel.
    uint32_t joinAbove(OctreeCounts& counts);
    const LevelCounts& counts(uint32_t level) const { return counts_[level]; }

    /// As DagBuilder::visit().
    std::vector<uint32_t> visit(uint32_t level, const std::vector<uint32_t>& roots,
                                NodeSink& sink) const;

private:
    std::string levelPath(uint32_t level) const;
    void mergeLevel(const std::vector<PartReader>& parts, uint32_t level);
    /// Writes the nodes of a table and returns each address's number.
    std::vector<uint32_t> writeLevel(uint32_t level, const std::vector<uint32_t>& words);
    template <class F>
    void forEachInOrder(uint32_t level, const std::vector<uint32_t>& rank, const F& f) const;

    VoxelGrid grid_;
    const ScratchFolder& folder_;
    const MemoryLimit& limit_;
    std::function<void()> check_;
    LevelCounts counts_[kMaxResolutionLog2 + 1] = {};
    std::vector<Subtree> subtrees_;
};

} // namespace shadowdag
