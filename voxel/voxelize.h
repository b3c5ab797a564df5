// SPDX-License-Identifier: Apache-2.0
// Triangles to a sparse voxel DAG, conservatively.
#pragma once

#include "cuda/progress.h"
#include "scenes/world.h"
#include "voxel/dag.h"

namespace shadowdag {

/// Returns the DAG of every voxel of the grid that one of the listed triangles touches (closed
/// voxel against closed triangle; no touching pair is ever missed, ties count as touching;
/// degenerate triangles count as the segment or point that they are). Parts of triangles outside
/// the grid are ignored. Deterministic: independent of thread count and of triangle order.
/// @param triangles world space
/// @param which indices into triangles (World::staticTriangles() for an asset)
/// @param progress may be empty
/// Throws Error kResource when the DAG outgrows 2^32 words or memory is short.
Dag voxelize(const TriangleView& triangles, View<const uint32_t> which, const VoxelGrid& grid,
             const Progress& progress = {});

} // namespace shadowdag
