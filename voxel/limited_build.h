// SPDX-License-Identifier: Apache-2.0
// Builds that hold a memory limit and can be gone on with: finished subtrees go to part files in a
// scratch folder next to the output and are merged from there, level by level. Several times the
// work of voxelize() on nodes, none on voxels; the results are the same bit for bit.
#pragma once

#include "voxel/part_file.h"
#include "voxel/scratch_folder.h"

#include <string>
#include <vector>

namespace shadowdag {

struct BuildLimits {
    uint64_t memoryBytes = 0; ///< resident size of the process; 0 for none
    /// Finished work goes to disk after so long, if not earlier for want of memory.
    double checkpointSeconds = 60;
    AssetPacking packing = AssetPacking::kCompact; ///< how the asset will be written
};

/// A DAG with its numbers, which would take more memory to compute from it.
struct CountedDag {
    Dag dag;
    DagStats stats;
};

/// As voxelize(), going on from what an earlier build of the same left in the scratch folder. The
/// limit leaves room to write the asset. Throws Error kResource saying how much is needed, as far
/// as is known by then, where the limit cannot be held, kInput where the folder holds files of
/// another build.
/// @param folder keep it until the asset is written
CountedDag voxelizeLimited(const TriangleView& triangles, View<const uint32_t> which,
                           const VoxelGrid& grid, const AssetProvenance& provenance,
                           const ScratchFolder& folder, const BuildLimits& limits,
                           const Progress& progress = {});

/// As voxelizePart(), to the very same file `path`.
PartHeader voxelizePartLimited(const TriangleView& triangles, View<const uint32_t> which,
                               const VoxelGrid& grid, const AssetProvenance& provenance,
                               uint32_t part, uint32_t partCount, const std::string& path,
                               const ScratchFolder& folder, const BuildLimits& limits,
                               const Progress& progress = {});

/// As mergeParts(). Only the memory limit is used.
CountedDag mergePartsLimited(const std::vector<PartReader>& parts, const ScratchFolder& folder,
                             const BuildLimits& limits, const Progress& progress = {});

} // namespace shadowdag
