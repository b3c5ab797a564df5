// SPDX-License-Identifier: Apache-2.0
// Voxelizes and builds the DAG by passes alone, on either backend: the algorithm for devices.
// VoxelTasks and DagBuilder are faster on the CPU.
#pragma once

#include "cuda/buffer.h"
#include "cuda/progress.h"
#include "scenes/world.h"
#include "voxel/dag.h"

namespace shadowdag {

/// Statistics of a build by passes.
struct PassBuildCounts {
    uint32_t tileCount = 0; ///< cells that were built separately; 1: the grid as a whole
    uint64_t peakBytes = 0; ///< of all lists held at a time, scratch of sorts counted as two lists
};

/// Returns a DAG identical to that of voxelize() on the CPU (see there for the arguments and
/// errors), built by passes on `backend`. A cell of the octree whose lists would take more than
/// `budgetBytes` is split into its children, which are built one after the other and merged on the
/// host; this does not affect the result. Throws Error kResource if not even a brick of 64^3 voxels
/// fits.
/// @param triangles on the host; @param budgetBytes for lists, besides the triangles themselves and
/// the alpha masks, which are copied to the backend
/// @param counts null, or what is filled in
Dag voxelizeByPasses(Backend backend, const TriangleView& triangles, View<const uint32_t> which,
                     const VoxelGrid& grid, uint64_t budgetBytes, const Progress& progress = {},
                     PassBuildCounts* counts = nullptr);

} // namespace shadowdag
