// SPDX-License-Identifier: Apache-2.0
#include "voxel/voxel_grid.h"

#include "cuda/error.h"

#include <algorithm>
#include <cmath>
#include <string>

namespace shadowdag {

VoxelGrid gridAround(const Box& boundsWorld, uint32_t resolutionLog2) {
    if (resolutionLog2 > kMaxResolutionLog2)
        throw Error(ErrorKind::kUsage, "voxel resolution 2^" + std::to_string(resolutionLog2) +
                                           " is above the limit of 2^" +
                                           std::to_string(kMaxResolutionLog2) +
                                           "; choose a lower resolution");
    const glm::dvec3 min(boundsWorld.min), max(boundsWorld.max);
    const glm::dvec3 extent = max - min;
    double side = std::max(extent.x, std::max(extent.y, extent.z));
    if (boundsWorld.empty() || !std::isfinite(side))
        throw Error(ErrorKind::kInput,
                    "the scene's bounds are empty or not finite, so no voxel grid fits them; "
                    "check its vertex positions");
    if (side == 0.0)
        side = 1.0;
    VoxelGrid grid;
    grid.resolutionLog2 = resolutionLog2;
    grid.voxelSizeWorld = std::ldexp(side, -int(resolutionLog2));
    grid.originWorld = (min + max) * 0.5 - glm::dvec3(side * 0.5);
    return grid;
}

} // namespace shadowdag
