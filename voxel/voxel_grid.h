// SPDX-License-Identifier: Apache-2.0
// The position of the voxels: the cubic grid that maps world space to voxel space and back.
#pragma once

#include "scenes/box.h"
#include "voxel/voxel_grid_leaf.h"

#include <cstdint>

namespace shadowdag {

/// The grid has 2^17 cells an axis at most: coordinates and the ray predicate's margin
/// (dag_trace.h) then fit the 24 bits of a float's mantissa.
constexpr uint32_t kMaxResolutionLog2 = 17;

/// A cube of 2^resolutionLog2 voxels an axis. Voxel (i, j, k) is the closed cube [i, i+1] x [j,
/// j+1] x [k, k+1] in voxel space; voxel = (world - originWorld) / voxelSizeWorld.
struct VoxelGrid {
    glm::dvec3 originWorld{0.0};
    double voxelSizeWorld = 1.0;
    uint32_t resolutionLog2 = 0;

    SDAG_HD uint32_t resolution() const { return 1u << resolutionLog2; }
    SDAG_HD glm::dvec3 voxelFromWorld(const glm::dvec3& world) const {
        return voxelAt(world, originWorld, voxelSizeWorld);
    }
    SDAG_HD glm::dvec3 worldFromVoxel(const glm::dvec3& voxel) const {
        return worldAt(voxel, originWorld, voxelSizeWorld);
    }
    bool operator==(const VoxelGrid& o) const {
        return originWorld == o.originWorld && voxelSizeWorld == o.voxelSizeWorld &&
               resolutionLog2 == o.resolutionLog2;
    }
};

/// Returns the grid of 2^resolutionLog2 voxels whose cube is centred on the bounds and as long as
/// their longest side (1 m for a single point).
VoxelGrid gridAround(const Box& boundsWorld, uint32_t resolutionLog2);

} // namespace shadowdag
