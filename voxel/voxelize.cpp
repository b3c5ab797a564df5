// SPDX-License-Identifier: Apache-2.0
// Every finished task is merged into the whole DAG at once, in memory.
#include "voxel/voxelize.h"

#include "cuda/buffer.h"
#include "cuda/error.h"
#include "cuda/parallel_for.h"
#include "voxel/dag_faults.h"
#include "voxel/voxel_tasks.h"
#include "voxel/voxelize_passes.h"

#include <algorithm>
#include <mutex>
#include <new>
#include <string>

namespace shadowdag {
namespace {

/// Builds the tasks [first, last) on all threads and returns their subtrees, merged in `merged`,
/// in order of cells.
std::vector<Subtree> buildTasks(VoxelTasks& tasks, size_t first, size_t last, DagBuilder& merged,
                                OctreeCounts* counts, const Progress& progress) {
    double workAll = 0, workDone = 0;
    for (size_t i = first; i < last; ++i)
        workAll += tasks.work(i);
    std::vector<Subtree> subtrees(last - first);
    size_t doneCount = 0;
    std::mutex mutex;
    cpuParallelRanges(last - first, 1, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; ++i) {
            const size_t task = first + i;
            DagBuilder builder(tasks.level());
            OctreeCounts added;
            const uint32_t address = tasks.build(task, builder, counts ? &added : nullptr);
            const std::lock_guard<std::mutex> lock(mutex);
            subtrees[i] = {tasks.cell(task), merged.addSubtree(builder, tasks.level(), address)};
            if (counts)
                *counts += added;
            workDone += tasks.work(task);
            tasks.release(task);
            ++doneCount;
            if (progress) // the sum's rounding depends on the order in which tasks end
                progress(doneCount == last - first ? 1.0 : std::min(1.0, workDone / workAll));
        }
    });
    return subtrees;
}

} // namespace

Dag voxelize(const TriangleView& triangles, View<const uint32_t> which, const VoxelGrid& grid,
             const Progress& progress, Backend backend) {
    if (backend == Backend::kCuda)
        return voxelizeByPasses(backend, triangles, which, grid, availableBytes(backend) / 4 * 3,
                                progress);
    try {
        VoxelTasks tasks(triangles, which, grid, progress);
        DagBuilder merged(rootLevelOf(grid));
        const std::vector<Subtree> subtrees =
            buildTasks(tasks, 0, tasks.count(), merged, nullptr, progress);
        return withVoxelFault(
            merged.finish(rootLevelOf(grid), joinSubtrees(merged, grid, subtrees, nullptr), grid));
    } catch (const std::bad_alloc&) {
        throwOutOfMemory("voxelizing", grid);
    }
}

PartHeader voxelizePart(const TriangleView& triangles, View<const uint32_t> which,
                        const VoxelGrid& grid, const AssetProvenance& provenance, uint32_t part,
                        uint32_t partCount, const std::string& path, const Progress& progress) {
    try {
        VoxelTasks tasks(triangles, which, grid, progress);
        const auto [first, last] = tasks.share(part, partCount);
        DagBuilder merged(tasks.level());
        PartHeader header{grid, provenance, part, partCount, tasks.count(), last - first, {}, {}};
        std::vector<Subtree> subtrees =
            buildTasks(tasks, first, last, merged, &header.counts, progress);
        header = writePart(header, merged, subtrees, path);
        return header;
    } catch (const std::bad_alloc&) {
        throwOutOfMemory("voxelizing", grid);
    }
}

Dag mergeParts(const std::vector<PartReader>& parts, const Progress& progress) {
    const VoxelGrid& grid = parts.front().header().grid;
    try {
        DagBuilder merged(rootLevelOf(grid));
        std::vector<Subtree> subtrees;
        for (size_t p = 0; p < parts.size(); ++p) {
            if (progress)
                progress(double(p) / double(parts.size()));
            const PartHeader& header = parts[p].header();
            // below[i]: the new address of node i of the level below.
            std::vector<uint32_t> below, here;
            for (uint32_t level = kLeafLog2; level <= taskLevelOf(grid); ++level) {
                here.clear();
                here.reserve(header.levels[level].nodeCount);
                NodeReader reader = parts[p].level(level);
                for (NodeWords node; reader.next(node);) {
                    for (uint32_t i = 1; level > kLeafLog2 && i < node.count; ++i)
                        node.words[i] = below[node.words[i]];
                    here.push_back(merged.addNode(level, node));
                }
                below.swap(here);
            }
            for (const Subtree& s : parts[p].subtrees())
                subtrees.push_back({s.cell, s.address == kNoNode ? kNoNode : below[s.address]});
        }
        sortSubtrees(subtrees);
        return merged.finish(rootLevelOf(grid), joinSubtrees(merged, grid, subtrees, nullptr),
                             grid);
    } catch (const std::bad_alloc&) {
        throwOutOfMemory("merging", grid);
    }
}

} // namespace shadowdag
