// SPDX-License-Identifier: Apache-2.0
// World points in voxel space. A leaf text (gl/leaf.h).
#pragma once

#include "gl/leaf.h"

SDAG_LEAF_BEGIN

/// Returns a world point in voxel space. @param origin,voxelSizeWorld of the grid
SDAG_LEAF dvec3 voxelAt(SDAG_IN(dvec3) world, SDAG_IN(dvec3) origin, double voxelSizeWorld) {
    SDAG_EXACT dvec3 voxel = (world - origin) / voxelSizeWorld;
    return voxel;
}

/// Returns a point of voxel space in the world.
SDAG_LEAF dvec3 worldAt(SDAG_IN(dvec3) voxel, SDAG_IN(dvec3) origin, double voxelSizeWorld) {
    SDAG_EXACT dvec3 world = origin + voxel * voxelSizeWorld;
    return world;
}

SDAG_LEAF_END
