// SPDX-License-Identifier: Apache-2.0
// Where rays that go on beyond the scene end: a directional light's have no end of their own, and
// the voxel ray's margin grows with how far its ends lie (voxel/ray_slabs.h).
#pragma once

#include "voxel/dag.h"
#include "voxel/shadow_segment_leaf.h"

namespace shadowdag {

/// See endWithinCube.
SDAG_HD inline glm::dvec3 endWithinGrid(const VoxelGrid& grid, const glm::dvec3& from,
                                        const glm::dvec3& to, double beyond) {
    return endWithinCube(grid.resolution(), from, to, beyond);
}

} // namespace shadowdag
