// SPDX-License-Identifier: Apache-2.0
// Cuts a cube at any position out of a DAG: moves voxels to another place of a grid without
// expanding them.
#pragma once

#include "voxel/dag.h"

namespace shadowdag {

/// The least and the greatest coordinates of occupied voxels, both included.
struct VoxelBounds {
    glm::uvec3 min{0}, max{0};
    bool operator==(const VoxelBounds&) const = default;
};

/// Returns the bounds of the occupied voxels; the DAG must not be empty. Cost: linear in nodes.
VoxelBounds occupiedBounds(const Dag& dag);

/// Returns the DAG over `grid` whose voxel v is voxel corner + v of `dag`; what lies outside `dag`
/// is empty. In canonical order. Cost: linear in the different neighbourhoods of 2^3 nodes that the
/// window meets, which is that of nodes when the corner is a multiple of a large power of two.
/// @param corner may lie outside `dag`, up to 2^30
/// @param grid at most as many voxels an axis as `dag` has, or as a leaf has
/// Throws Error kResource when the result outgrows 2^32 words.
Dag cutWindow(const Dag& dag, glm::uvec3 corner, const VoxelGrid& grid);

} // namespace shadowdag
