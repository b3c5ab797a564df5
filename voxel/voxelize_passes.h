// SPDX-License-Identifier: Apache-2.0
// Voxelize and build by passes alone, on either backend: what a device does instead of VoxelTasks
// and DagBuilder, which are faster on the CPU.
#pragma once

#include "cuda/buffer.h"
#include "cuda/progress.h"
#include "scenes/world.h"
#include "voxel/dag.h"

namespace shadowdag {

/// What a build by passes did.
struct PassBuildCounts {
    uint32_t tileCount = 0; ///< cells that were built by themselves; 1: the grid as a whole
    uint64_t peakBytes = 0; ///< of all lists held at a time, scratch of sorts counted as two lists
};

/// Returns the very DAG that voxelize() returns on the CPU (see there for the arguments and
/// errors), built by passes on `backend`. A cell of the octree whose lists would take more than
/// `budgetBytes` is split into its children, which are built one after the other and merged on the
/// host; the result depends on none of that. Throws Error kResource when not even a brick of 64^3
/// voxels fits.
/// @param triangles on the host; @param budgetBytes for lists, besides the triangles themselves and
/// the alpha masks, which are copied to the backend
/// @param counts null, or what is filled in
Dag voxelizeByPasses(Backend backend, const TriangleView& triangles, View<const uint32_t> which,
                     const VoxelGrid& grid, uint64_t budgetBytes, const Progress& progress = {},
                     PassBuildCounts* counts = nullptr);

} // namespace shadowdag
