// SPDX-License-Identifier: Apache-2.0
// Builds under a memory limit that can be resumed. Finished subtrees are written to part files in a
// scratch folder next to the output and merged from there, level by level. The results are the same
// bit for bit as those of voxelize(). Nodes cost several times the work, voxels none besides.
#pragma once

#include "voxel/part_file.h"
#include "voxel/scratch_folder.h"

#include <string>
#include <vector>

namespace shadowdag {

struct BuildLimits {
    uint64_t memoryBytes = 0; ///< resident size of the process; 0 for none
    /// Finished work is written to disk after this time, or earlier if memory is short.
    double checkpointSeconds = 60;
    AssetPacking packing = AssetPacking::kCompact; ///< how the asset will be written
};

/// A DAG with its statistics, whose separate computation would take more memory.
struct CountedDag {
    Dag dag;
    DagStats stats;
};

/// As voxelize(), resuming from what an earlier, identical build left in the scratch folder. The
/// limit includes the memory to write the asset. Throws Error kResource if the limit cannot be
/// kept, saying how much is needed as far as is known; kUsage if the folder holds parts of another
/// build; kInput if it holds damaged ones.
/// @param folder keep it until the asset is written
CountedDag voxelizeLimited(const TriangleView& triangles, View<const uint32_t> which,
                           const VoxelGrid& grid, const AssetProvenance& provenance,
                           const ScratchFolder& folder, const BuildLimits& limits,
                           const Progress& progress = {});

/// As voxelizePart(), with an identical file `path`.
PartHeader voxelizePartLimited(const TriangleView& triangles, View<const uint32_t> which,
                               const VoxelGrid& grid, const AssetProvenance& provenance,
                               uint32_t part, uint32_t partCount, const std::string& path,
                               const ScratchFolder& folder, const BuildLimits& limits,
                               const Progress& progress = {});

/// As mergeParts(). Only the memory limit is used.
CountedDag mergePartsLimited(const std::vector<PartReader>& parts, const ScratchFolder& folder,
                             const BuildLimits& limits, const Progress& progress = {});

} // namespace shadowdag
