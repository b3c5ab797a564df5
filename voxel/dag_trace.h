// SPDX-License-Identifier: Apache-2.0
// Occlusion of a segment by the voxels of a DAG: the predicate, the traversal and the shadow segment.
//
// The predicate is defined box by box, not by an order of steps: a segment meets a box when the slab test
// below, in float, says so for the box grown by margin() on all sides. The test is monotone (the computed
// interval of a box encloses those of the boxes in it), so any traversal, in any order, on any processor, gives the bits that
// testing every occupied voxel would give; and because margin() bounds all rounding, no voxel that the exact
// segment touches is missed. There are no steps, hence no ray can stick or slip.
#pragma once

#include "voxel/dag.h"

namespace shadowdag {

/// What stopped a segment.
struct DagHit {
    glm::uvec3 cell{0};  ///< least voxel of the cell hit
    uint32_t level = 0;  ///< side of the cell is 2^level voxels
};

/// A segment in voxel space, ready for slab tests.
struct DagSegment {
    glm::vec3 from; ///< voxel space
    glm::vec3 to;   ///< voxel space
};

/// Returns whether the closed segment meets an occupied cell of side 2^level voxels (level 0: voxels). Ends may lie
/// anywhere, also outside the grid; a segment of length zero tests its point. NaN ends: returns true (dark, never
/// silently lit). `hit`, when not null, receives the first such cell in front-to-back order of the traversal.
/// Cost: no allocation; stack of resolutionLog2 entries.
SDAG_HD bool occluded(const DagView& dag, const DagSegment& segment, uint32_t level = 0, DagHit* hit = nullptr);

/// Returns the segment, in voxel space, by which a view sample asks for a light: both ends kept out of the voxels
/// that the sample's surface and the light's fixture lie in.
/// Start: lifted along the normal by offset * (|nx| + |ny| + |nz|) cells of side 2^level plus the predicate's margin: a plane's
/// closed voxels reach exactly that far above it, so with offset = 1 a planar receiver never shadows itself. End: drawn
/// back towards the sample by offset * sqrt(3) cells, never past the start. What it costs: blockers nearer than
/// the offset are not seen (contact shadows).
/// @param sampleWorld,normalWorld position and unit geometric normal on the light's side
/// @param offset in units of the derived offset; 1 is the default, 0 none
SDAG_HD DagSegment shadowSegment(const VoxelGrid& grid, const glm::vec3& sampleWorld, const glm::vec3& normalWorld,
                                 const glm::vec3& lightWorld, float offset, uint32_t level);

} // namespace shadowdag
