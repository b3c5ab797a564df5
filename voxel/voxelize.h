// SPDX-License-Identifier: Apache-2.0
// Triangles to a sparse voxel DAG, conservatively; as a whole or in parts that are joined later.
#pragma once

#include "cuda/backend.h"
#include "cuda/progress.h"
#include "scenes/world.h"
#include "voxel/part_file.h"

#include <string>
#include <vector>

namespace shadowdag {

/// Returns the DAG of every voxel of the grid that one of the listed triangles touches (closed
/// voxel against closed triangle; no touching pair is ever missed, ties count as touching;
/// degenerate triangles count as the segment or point that they are). Of triangles that an alpha
/// mask cuts, the opaque part counts (cut_voxels.h). Parts of triangles outside
/// the grid are ignored. Deterministic: independent of thread count and of triangle order.
/// @param triangles world space
/// @param which indices into triangles (World::staticTriangles() for an asset)
/// @param progress may be empty
/// @param backend builds it, with the same words: the CPU by tasks, CUDA by passes
/// (voxelize_passes.h) in three quarters of the memory that is free on the device
/// Throws Error kResource when the DAG needs more than 2^32 words or memory is short.
Dag voxelize(const TriangleView& triangles, View<const uint32_t> which, const VoxelGrid& grid,
             const Progress& progress = {}, Backend backend = Backend::kCpu);

/// Builds one of several parts of voxelize()'s work and writes it to `path`, completely or not at
/// all. The file depends on scene, grid and part alone. Returns its header; Error kResource as
/// voxelize(), or if it cannot be written.
/// @param provenance,part,partCount go into the file
PartHeader voxelizePart(const TriangleView& triangles, View<const uint32_t> which,
                        const VoxelGrid& grid, const AssetProvenance& provenance, uint32_t part,
                        uint32_t partCount, const std::string& path, const Progress& progress = {});

/// Returns the DAG that all parts of a build form together, identical to that of voxelize().
/// @param parts at least one; see checkParts()
Dag mergeParts(const std::vector<PartReader>& parts, const Progress& progress = {});

} // namespace shadowdag
