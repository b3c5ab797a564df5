// SPDX-License-Identifier: Apache-2.0
#include "hybrid/judge/own_segment.h"

#include <bit>

namespace shadowdag {

namespace {

/// Returns the level of the cells that are no wider than `voxels`.
uint32_t levelOf(double voxels) {
    return voxels >= 2.0 ? uint32_t(std::min(std::floor(std::log2(voxels)), 31.0)) : 0;
}

/// Returns where the way from a sample to a directional light leaves the grid grown by `beyond`.
glm::dvec3 whereGridIsLeft(const glm::dvec3& from, const glm::dvec3& to, double resolution,
                           double beyond) {
    double t = 1.0;
    for (int a = 0; a < 3; ++a) {
        const double way = to[a] - from[a];
        if (way != 0.0)
            t = std::min(t, ((way > 0.0 ? resolution + beyond : -beyond) - from[a]) / way);
    }
    return from + (to - from) * std::max(t, 0.0);
}

} // namespace

uint32_t OwnSegment::coarsestLevelAt(const glm::dvec3& middleVoxel, double sideVoxels) const {
    if (!followsFootprint)
        return startLevel;
    // Somewhere in the cell, which is where the ray was stopped.
    const double distance = glm::length(middleVoxel - lightVoxel) + 0.5 * kSqrt3 * sideVoxels;
    constexpr double kRounding = 1.0 + 0x1p-16; // of times in float
    return levelOf(std::min(startFootprint, footprintSlope * distance) * kRounding);
}

OwnSegment makeOwnSegment(const RayInputs& inputs, const ShadowPair& pair) {
    const VoxelGrid& grid = inputs.dag.grid;
    const RayOptions& options = inputs.options;
    const double voxel = grid.voxelSizeWorld, offset = double(options.offset);
    const glm::dvec3 position(pair.positionWorld), n(pair.normalWorld);
    OwnSegment own;
    own.lightVoxel = grid.voxelFromWorld(glm::dvec3(pair.lightWorld));
    own.startLevel = options.level;
    own.followsFootprint = options.lod != LodRule::kFixed;
    if (own.followsFootprint) {
        const RayDetail& detail = inputs.detail;
        const double pixel =
            detail.pixelSize * glm::dot(position - detail.eyeWorld, detail.forward) / voxel;
        const double length = glm::length(glm::dvec3(pair.lightWorld) - position) / voxel;
        const bool hasTexels = !detail.resolutionSquaredBits.empty() && !pair.isDirectional;
        const double squared =
            hasTexels ? double(std::bit_cast<float>(detail.resolutionSquaredBits[pair.light]))
                      : 0.0;
        const double texel = squared > 0.0 ? 2.0 / std::sqrt(squared) : 0.0;
        own.startFootprint = double(options.footprintScale) * pixel;
        own.footprintSlope = double(options.footprintScale) * std::max(pixel / length, texel);
        own.startLevel = std::min(levelOf(own.startFootprint), grid.resolutionLog2);
    }
    const double cell = std::exp2(double(own.startLevel));
    const glm::dvec3 sample = grid.voxelFromWorld(position);
    const glm::dvec3 light =
        pair.isDirectional ? whereGridIsLeft(sample, own.lightVoxel, double(grid.resolution()),
                                             cell * (4.0 + 2.0 * offset))
                           : own.lightVoxel;

    const double scale =
        std::max({double(grid.resolution()), largestMagnitude(sample), largestMagnitude(light)});
    // As the method documents (shadow_segment_leaf.h), written apart: twice the margin of its tests
    // of voxels, and the rounding of the sample's floats.
    const double rounding = 0x1p-19 * scale + 0x1p-21 * largestMagnitude(position) / voxel;
    const double lift =
        offset * (std::fabs(n.x) + std::fabs(n.y) + std::fabs(n.z)) * (cell + rounding);
    const glm::dvec3 start = sample + n * lift, way = light - start;
    const double distance = glm::length(way);
    const double back = std::min(offset * kSqrt3 * cell, distance);
    glm::dvec3 end = distance > 0.0 ? start + way * ((distance - back) / distance) : start;
    glm::dvec3 moved = n * lift;
    if (const double height = glm::dot(end - start, n); height < 0.0)
        end -= n * height;
    else if (distance > back)
        moved += way * (std::min(0.5 * (distance - back), offset * cell) / distance);
    own.liftWorld = lift * voxel;
    own.startOffsetWorld = glm::length(moved) * voxel;
    own.endOffsetWorld = pair.isDirectional ? 0.0 : glm::length(end - light) * voxel;
    return own;
}

} // namespace shadowdag
