// SPDX-License-Identifier: Apache-2.0
// The segment that is tested for a view sample and a light, in voxel space; dag_trace.h explains
// it. A leaf text (gl/leaf.h).
#pragma once

#include "voxel/ray_slabs_leaf.h"

SDAG_LEAF_BEGIN

/// 2^-19: twice the predicate's margin, in units of a segment's scale.
SDAG_CONST double kTwiceSlabMargin = 1.0f / 524288.0f;
/// 2^-21: a sample interpolated in float is off its plane by a few 2^-24 of its coordinates.
SDAG_CONST double kSampleRounding = 1.0f / 2097152.0f;

/// Returns by how many voxels the start is lifted along the normal.
/// @param resolution of the grid @param sampleVoxel,lightVoxel in voxel space @param cell side of a
/// cell in voxels; the rest as shadowSegment's
SDAG_LEAF double shadowLiftVoxels(uint resolution, double voxelSizeWorld, SDAG_IN(vec3) sampleWorld,
                                  SDAG_IN(dvec3) n, SDAG_IN(dvec3) sampleVoxel,
                                  SDAG_IN(dvec3) lightVoxel, float offset, double cell) {
    double scale = double(resolution), world = 0.0f;
    for (int a = 0; a < 3; ++a) {
        scale = greater(greater(scale, magnitude(sampleVoxel[a])), magnitude(lightVoxel[a]));
        world = greater(world, magnitude(double(sampleWorld[a])));
    }
    SDAG_EXACT double slack = scale * kTwiceSlabMargin + world / voxelSizeWorld * kSampleRounding;
    SDAG_EXACT double lift =
        double(offset) * (magnitude(n.x) + magnitude(n.y) + magnitude(n.z)) * (cell + slack);
    return lift;
}

/// Returns shadowSegment's result for a start that is lifted already, all in voxel space.
SDAG_LEAF DagSegment segmentFromLifted(SDAG_IN(dvec3) from, SDAG_IN(dvec3) n, SDAG_IN(dvec3) light,
                                       double offset, double cell) {
    SDAG_EXACT dvec3 way = light - from;
    SDAG_EXACT double length2 = way.x * way.x + way.y * way.y + way.z * way.z;
    SDAG_EXACT double distance = squareRoot(length2);
    SDAG_EXACT double back = offset * squareRoot(double(3.0f)) * cell;
    SDAG_EXACT dvec3 to = from;
    if (distance > back)
        to = from + way * ((distance - back) / distance);
    SDAG_EXACT double height =
        (to.x - from.x) * n.x + (to.y - from.y) * n.y + (to.z - from.z) * n.z;
    DagSegment segment;
    segment.from = vec3(from);
    if (height < 0.0f) {
        to = to - n * height;
        segment.to = vec3(to);
        return segment;
    }
    SDAG_EXACT double middle = 0.5f * (distance - back), whole = offset * cell;
    SDAG_EXACT double ahead = middle < whole ? middle : whole;
    if (ahead > 0.0f) {
        SDAG_EXACT dvec3 start = from + way * (ahead / distance);
        segment.from = vec3(start);
    }
    segment.to = vec3(to);
    return segment;
}

/// Returns `to`, or the point where the segment leaves the grid grown by `beyond` voxels on all
/// sides, whichever comes first; `from` if it starts behind that. All in voxel space. The shortened
/// segment meets the same cells of the grid as the whole one.
SDAG_LEAF dvec3 endWithinCube(uint resolution, SDAG_IN(dvec3) from, SDAG_IN(dvec3) to,
                              double beyond) {
    SDAG_EXACT dvec3 way = to - from;
    SDAG_EXACT double most = double(resolution) + beyond;
    SDAG_EXACT double t = 1.0f;
    for (int a = 0; a < 3; ++a) {
        if (way[a] == 0.0f)
            continue;
        SDAG_EXACT double leaves = ((way[a] > 0.0f ? most : -beyond) - from[a]) / way[a];
        t = leaves < t ? leaves : t;
    }
    SDAG_EXACT dvec3 last = from + way * (t > 0.0f ? t : double(0.0f));
    return t < 1.0f ? last : to;
}

SDAG_LEAF_END
