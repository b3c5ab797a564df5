// SPDX-License-Identifier: Apache-2.0
// Where rays that go on beyond the scene end: a directional light's have no end of their own, and
// the voxel ray's margin grows with how far its ends lie (voxel/ray_slabs.h).
#pragma once

#include "voxel/dag.h"

namespace shadowdag {

/// Returns `to`, or the point where the segment leaves the grid grown by `beyond` voxels on all
/// sides, whichever comes first; `from` where it starts behind that. All in voxel space. What lies
/// in the grid meets the shortened segment where it met the whole.
SDAG_HD inline glm::dvec3 endWithinGrid(const VoxelGrid& grid, const glm::dvec3& from,
                                        const glm::dvec3& to, double beyond) {
    const glm::dvec3 way = to - from;
    const double far = double(grid.resolution()) + beyond;
    double t = 1.0;
    for (int axis = 0; axis < 3; ++axis) {
        if (way[axis] == 0.0)
            continue;
        const double leaves = ((way[axis] > 0.0 ? far : -beyond) - from[axis]) / way[axis];
        t = leaves < t ? leaves : t;
    }
    return t < 1.0 ? from + way * (t > 0.0 ? t : 0.0) : to;
}

} // namespace shadowdag
