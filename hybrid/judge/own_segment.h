// SPDX-License-Identifier: Apache-2.0
// What a ray through voxels may do to a pair, made in double from the documented rules alone
// (docs/method.md, "How far a voxel displaces a shadow"; the heads of voxel/dag_trace.h and
// voxel/dag_lod.h), without any of the method's code: how far its ends are moved, and how coarse
// the cell that stops it may be. A fault of the method then widens neither its own contact nor its
// own rho.
#pragma once

#include "hybrid/rays/shadow_rays.h"

#include <algorithm>
#include <cmath>

namespace shadowdag {

/// The diagonal of a cell of side 1.
constexpr double kSqrt3 = 1.7320508075688772;

/// Returns the largest coordinate, without its sign.
inline double largestMagnitude(const glm::dvec3& v) {
    return std::max({std::fabs(v.x), std::fabs(v.y), std::fabs(v.z)});
}

/// The ends of a pair's ray, and its levels.
struct OwnSegment {
    /// How far the start and the end are moved, world units: the start along the normal by
    ///     lift = offset (|nx| + |ny| + |nz|) (cell + rounding)
    /// and by `offset` cells, halfway at most, along the ray; the end back by offset sqrt(3) cells,
    /// never past the start. A ray that would fall under the start's plane is only lifted.
    double startOffsetWorld = 0.0, endOffsetWorld = 0.0;
    double liftWorld = 0.0;
    uint32_t startLevel = 0; ///< of the cells that the offsets are derived from

    /// Returns the coarsest level of a cell that may stop the ray. @param middleVoxel of the cell
    /// that did @param sideVoxels its side
    uint32_t coarsestLevelAt(const glm::dvec3& middleVoxel, double sideVoxels) const;

    glm::dvec3 lightVoxel{0.0};
    bool followsFootprint = false;
    double startFootprint = 0.0, footprintSlope = 0.0; ///< voxels; a voxel farther from the light
};

/// Returns the segment of a pair. @param inputs grid, options and detail are read
OwnSegment makeOwnSegment(const RayInputs& inputs, const ShadowPair& pair);

} // namespace shadowdag
