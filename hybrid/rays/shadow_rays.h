// SPDX-License-Identifier: Apache-2.0
// Shadow rays of a frame: what they are asked for and what they are traced through. The one text
// that shading, its streams and the error analysis agree with.
#pragma once

#include "hybrid/rays/directional_rays.h"
#include "hybrid/rays/exact_tree.h"
#include "hybrid/rays/mover_rays.h"
#include "scenes/light.h"
#include "voxel/dag_lod.h"

#include <bit>

namespace shadowdag {

/// What a ray that meets a voxel is taken for.
enum class RayKind : uint8_t {
    kVoxels, ///< blocked: the voxels are the geometry, ends are offset out of the receiver's own
    kExact   ///< a question to the triangles there: the truth's own ray, no offset
};

/// How many rays are asked together on the CPU. Changes no answer.
enum class RayBatch : uint8_t {
    kSingle, ///< one by one
    kStream, ///< those of a cluster and a light in streams
};

/// How the rays of a frame are asked; the same for all of them.
struct RayOptions {
    float offset = 1.0f;             ///< in units of the derived offset, dag_trace.h
    uint32_t level = 0;              ///< level of detail: cells of 2^level voxels; kFixed only
    RayKind kind = RayKind::kVoxels; ///< exact rays use neither offset nor level of detail
    /// Of voxel rays of level 0, kFixed; others go one by one.
    RayBatch batch = RayBatch::kStream;
    LodRule lod = LodRule::kFixed;
    float footprintScale = 1.0f; ///< kFootprint, kCoverage: footprints are multiplied by this
    float coverage = 0.75f;      ///< kCoverage: share of a cell's columns that stops a ray

    bool operator==(const RayOptions&) const = default;
};

/// What the levels of rays follow: the pixels at the receivers and the texels at the lights.
/// resolutionSquaredBits: lightCount, as LightDemandView's; empty: no texels are asked for.
struct RayDetail {
    glm::dvec3 eyeWorld{0.0}, forward{0.0};
    double pixelSize = 0.0; ///< side of a pixel at distance 1 (ViewRays)
    View<const uint32_t> resolutionSquaredBits = {};
};

/// What rays are traced through.
struct RayInputs {
    DagView dag;
    RayOptions options;
    MoverView movers = {};
    ExactView exact = {};  ///< for RayKind::kExact
    RayDetail detail = {}; ///< of all but LodRule::kFixed
};

/// A view sample that asks for a light.
/// receiver: the sample's world triangle; light: index into the frame's lights.
struct ShadowPair {
    glm::vec3 positionWorld;
    glm::vec3 normalWorld; ///< unit, geometric, on the light's side
    glm::vec3 lightWorld;  ///< pointAtLight
    uint32_t receiver;
    uint32_t light;
    bool isDirectional = false;
};

/// A pair as rays through voxels ask it.
struct PairSegment {
    DagSegment segment;  ///< voxel space
    uint32_t startLevel; ///< level of detail at the receiver: what the offset is derived from
    Footprint footprint; ///< of all but LodRule::kFixed
};

/// Returns where a pair's ray through voxels ends: at the light, or, to a directional light, where
/// it has left the grid by more than the end is drawn back.
SDAG_HD inline glm::vec3 rayEnd(const RayInputs& inputs, const ShadowPair& pair,
                                uint32_t startLevel) {
    if (!pair.isDirectional)
        return pair.lightWorld;
    const VoxelGrid& grid = inputs.dag.grid;
    const double cell = double(1u << startLevel);
    const double beyond = cell * (4.0 + 2.0 * double(inputs.options.offset));
    return glm::vec3(grid.worldFromVoxel(
        endWithinGrid(grid, grid.voxelFromWorld(glm::dvec3(pair.positionWorld)),
                      grid.voxelFromWorld(glm::dvec3(pair.lightWorld)), beyond)));
}

/// Returns the footprint of a pair's ray, in voxels. A directional light's is the pixel's all
/// along: texels of its windows are no wider.
SDAG_HD inline Footprint footprintOf(const RayInputs& inputs, const ShadowPair& pair) {
    const RayDetail& detail = inputs.detail;
    const glm::dvec3 position(pair.positionWorld), toLight = glm::dvec3(pair.lightWorld) - position;
    const double length = sqrt(glm::dot(toLight, toLight));
    const double depth = glm::dot(position - detail.eyeWorld, detail.forward);
    const double resolution =
        detail.resolutionSquaredBits.empty() || pair.isDirectional
            ? 0.0
            : sqrt(double(std::bit_cast<float>(detail.resolutionSquaredBits[pair.light])));
    const double voxel = inputs.dag.grid.voxelSizeWorld;
    return makeFootprint(detail.pixelSize * depth / voxel, length / voxel, resolution,
                         inputs.options.footprintScale);
}

/// Returns a pair's segment, its offset going with the level at its start.
SDAG_HD inline PairSegment pairSegment(const RayInputs& inputs, const ShadowPair& pair) {
    PairSegment p;
    p.startLevel = inputs.options.level;
    if (inputs.options.lod != LodRule::kFixed) {
        p.footprint = footprintOf(inputs, pair);
        const uint32_t level = lodLevel(p.footprint.start);
        p.startLevel =
            level < inputs.dag.grid.resolutionLog2 ? level : inputs.dag.grid.resolutionLog2;
    }
    p.segment =
        shadowSegment(inputs.dag.grid, pair.positionWorld, pair.normalWorld,
                      rayEnd(inputs, pair, p.startLevel), inputs.options.offset, p.startLevel);
    return p;
}

/// Returns whether a voxel, or a cell of the level of detail, stops a pair's segment. `hit`, when
/// not null, receives the cell.
SDAG_HD inline bool isStopped(const RayInputs& inputs, const PairSegment& pair,
                              DagHit* hit = nullptr) {
    if (inputs.options.lod == LodRule::kFixed && pair.startLevel == 0)
        return occluded(inputs.dag, pair.segment, 0, hit);
    const LodTimes times = inputs.options.lod == LodRule::kFixed
                               ? fixedLodTimes(inputs.dag.grid, pair.startLevel)
                               : footprintLodTimes(inputs.dag.grid, pair.segment, pair.footprint);
    const uint32_t threshold =
        inputs.options.lod == LodRule::kCoverage ? coverageThreshold(inputs.options.coverage) : 0;
    return occludedByLevels(inputs.dag, pair.segment, times, threshold, hit);
}

/// Returns whether the voxels, which hold what never moves, say that the pair is dark.
SDAG_HD inline bool isDarkByVoxels(const RayInputs& inputs, const ShadowPair& pair) {
    return isStopped(inputs, pairSegment(inputs, pair));
}

/// Returns whether a moving triangle makes the pair dark; asked of pairs that the voxels leave lit
/// where movers.mayShadow(pair.light).
SDAG_HD inline bool isDarkByMovers(const MoverView& movers, const ShadowPair& pair) {
    return isBlockedByMovers(movers,
                             truthPairRay(movers.geometry, pair.positionWorld, pair.normalWorld,
                                          pair.receiver, pair.lightWorld));
}

/// Returns whether a triangle makes the pair dark; confirms what the voxels suspect.
/// @param moverTestCount as isDarkByRays @param blocker the last triangle that blocked, asked
/// first: it often blocks the next ray to the same light, too; may be null. Changes no answer.
SDAG_HD inline bool isDarkByTriangles(const RayInputs& inputs, const ShadowPair& pair,
                                      uint32_t* moverTestCount, uint32_t* blocker) {
    const ExactView& exact = inputs.exact;
    const TruthRay ray = truthPairRay(exact.geometry, pair.positionWorld, pair.normalWorld,
                                      pair.receiver, pair.lightWorld);
    if (!(ray.tFar > 0.0f))
        return false;
    if (blocker && *blocker != kBackground && blocksTruthRay(exact.geometry, ray, *blocker))
        return true;
    if (isBlockedExactly(inputs.dag, exact, ray, blocker))
        return true;
    if (!inputs.movers.mayShadow(pair.light))
        return false;
    if (moverTestCount)
        ++*moverTestCount;
    return isBlockedByMovers(inputs.movers, ray);
}

/// Returns whether the rays' method says that the pair is dark: by voxels or by movers.
/// @param moverTestCount grows by one when movers were asked; may be null
/// @param blocker of isDarkByTriangles; may be null
SDAG_HD inline bool isDarkByRays(const RayInputs& inputs, const ShadowPair& pair,
                                 uint32_t* moverTestCount = nullptr, uint32_t* blocker = nullptr) {
    if (inputs.options.kind == RayKind::kExact)
        return isDarkByTriangles(inputs, pair, moverTestCount, blocker);
    if (isDarkByVoxels(inputs, pair))
        return true;
    if (!inputs.movers.mayShadow(pair.light))
        return false;
    if (moverTestCount)
        ++*moverTestCount;
    return isDarkByMovers(inputs.movers, pair);
}

} // namespace shadowdag
