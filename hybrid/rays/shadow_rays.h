// SPDX-License-Identifier: Apache-2.0
// Shadow rays of a frame: what they are asked for and what they are traced through. The one text
// that shading, its streams and the error analysis agree with.
#pragma once

#include "cuda/mutant.h"
#include "hybrid/rays/directional_rays.h"
#include "hybrid/rays/exact_ray.h"
#include "hybrid/rays/mover_rays.h"
#include "scenes/light.h"
#include "voxel/dag_lod.h"

#include <bit>
#include <limits>

namespace shadowdag {

class BeamCache;
class EmbreeScene;

/// How many rays are asked together on the CPU. Changes no answer.
enum class RayBatch : uint8_t {
    kSingle, ///< one by one
    kStream, ///< those of a cluster and a light in streams
};

/// What the rays of a frame may need. A kernel is compiled for one value and leaves out the code of
/// what is false; answers do not depend on it.
struct RayNeeds {
    bool voxels = true;    ///< some voxels are believed
    bool levels = true;    ///< levels of detail
    bool triangles = true; ///< some rays are left to the triangles
    bool movers = true;    ///< something moves
};

/// Who traces the rays that triangles decide.
enum class TriangleRays : uint8_t {
    kExact,  ///< we do: blocksTruthRay over a hierarchy, the truth's own answers
    kEmbree, ///< Embree as a renderer would use it (embree_scene.h); on the CPU, where all rays go
             ///< to triangles (believe 0)
};

/// How the rays of a frame are asked; the same for all of them.
struct RayOptions {
    float offset = 1.0f; ///< in units of the derived offset, dag_trace.h
    uint32_t level = 0;  ///< level of detail: cells of 2^level voxels; kFixed only
    /// Which voxels that a ray meets are believed to be its blocker, in pixel footprints by which a
    /// shadow's edge may be displaced (shortenToBelieved). Infinity: all; then triangles are never
    /// asked. 0: none. What is not believed, and what meets no voxel, is decided by the triangles:
    /// the truth's own ray, without offset or level of detail.
    float believe = std::numeric_limits<float>::infinity();
    TriangleRays triangleRays = TriangleRays::kExact;
    /// Memory for beams that exact rays keep from frame to frame while the view stands still
    /// (beams.h), at least 1 MiB; 0: none. Changes no answer. On the CPU, where no voxel is
    /// believed; not read elsewhere.
    uint64_t beamBytes = 0;
    /// Of level 0, kFixed; other rays through voxels go one by one.
    RayBatch batch = RayBatch::kStream;
    LodRule lod = LodRule::kFixed;
    float footprintScale = 1.0f; ///< kFootprint, kCoverage: footprints are multiplied by this
    float coverage = 0.75f;      ///< kCoverage: share of a cell's columns that stops a ray

    SDAG_HD bool believesAll() const { return believe == std::numeric_limits<float>::infinity(); }
    SDAG_HD bool believesNone() const { return believe == 0.0f; }
    /// Returns whether rays are tested against the triangles of an ExactView.
    SDAG_HD bool asksExact() const {
        return !believesAll() && triangleRays == TriangleRays::kExact;
    }
    /// Returns whether rays through voxels meet larger cells than voxels.
    SDAG_HD bool usesLevels() const { return lod != LodRule::kFixed || level != 0; }
    /// Returns whether rays keep beams.
    SDAG_HD bool keepsBeams() const {
        return beamBytes != 0 && believesNone() && triangleRays == TriangleRays::kExact &&
               batch == RayBatch::kStream;
    }
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
    ExactView exact = {}; ///< where options.asksExact()
    RayDetail detail =
        {}; ///< read by levels of detail, where some voxels are believed, and by the judge
    const EmbreeScene* embree = nullptr; ///< on the host; TriangleRays::kEmbree
    BeamCache* beams = nullptr;          ///< on the host, begun for the frame; null: none
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

/// Returns the side of a pixel at the pair's sample, world units.
SDAG_HD inline double pixelFootprintWorld(const RayDetail& detail, const glm::vec3& positionWorld) {
    const double depth = glm::dot(glm::dvec3(positionWorld) - detail.eyeWorld, detail.forward);
    return detail.pixelSize * depth;
}

/// Returns the footprint of a pair's ray, in voxels. A directional light's is the pixel's all
/// along: texels of its windows are no wider.
SDAG_HD inline Footprint footprintOf(const RayInputs& inputs, const ShadowPair& pair) {
    const RayDetail& detail = inputs.detail;
    const glm::dvec3 position(pair.positionWorld), toLight = glm::dvec3(pair.lightWorld) - position;
    const double length = sqrt(glm::dot(toLight, toLight));
    const double resolution =
        detail.resolutionSquaredBits.empty() || pair.isDirectional
            ? 0.0
            : sqrt(double(std::bit_cast<float>(detail.resolutionSquaredBits[pair.light])));
    const double voxel = inputs.dag.grid.voxelSizeWorld;
    return makeFootprint(pixelFootprintWorld(detail, pair.positionWorld) / voxel, length / voxel,
                         resolution, inputs.options.footprintScale);
}

/// Returns a pair's segment, its offset going with the level at its start.
template <RayNeeds kNeeds = RayNeeds{}>
SDAG_HD inline PairSegment pairSegment(const RayInputs& inputs, const ShadowPair& pair) {
    PairSegment p;
    p.startLevel = kNeeds.levels ? inputs.options.level : 0;
    if (kNeeds.levels && inputs.options.lod != LodRule::kFixed) {
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
template <RayNeeds kNeeds = RayNeeds{}>
SDAG_HD inline bool isStopped(const RayInputs& inputs, const PairSegment& pair,
                              DagHit* hit = nullptr) {
    if (!kNeeds.levels || (inputs.options.lod == LodRule::kFixed && pair.startLevel == 0))
        return occluded(inputs.dag, pair.segment, 0, hit);
    const LodTimes times = inputs.options.lod == LodRule::kFixed
                               ? fixedLodTimes(inputs.dag.grid, pair.startLevel)
                               : footprintLodTimes(inputs.dag.grid, pair.segment, pair.footprint);
    const uint32_t threshold =
        inputs.options.lod == LodRule::kCoverage ? coverageThreshold(inputs.options.coverage) : 0;
    return occludedByLevels(inputs.dag, pair.segment, times, threshold, hit);
}

/// Returns how far a point of a triangle in a voxel that a pair's segment meets is from the segment
/// at most, in world units: sqrt(3) voxels, with what shadowLift allows for rounding. The segment
/// starts within `offset` times that of the line from the sample to the light.
SDAG_HD inline double voxelReachWorld(const RayInputs& inputs, const ShadowPair& pair) {
    const glm::vec3 diagonal(0.57735027f); // whose components add to the most, sqrt(3)
    const VoxelGrid& grid = inputs.dag.grid;
    return grid.voxelSizeWorld *
           shadowLift(grid, pair.positionWorld, diagonal, rayEnd(inputs, pair, 0), 1.0f, 0);
}

/// Shortens a pair's segment to the part on which a voxel that it meets is believed; returns false
/// when there is none.
///
/// A voxel that the segment meets at the distance t from the light holds a point of a triangle
/// within r = voxelReachWorld of the segment. The segment starts where the sample was lifted, by at
/// most b = offset r, and ends on the line to the light. So the point's shadow falls
/// within r d / t + b of the sample, across the light's direction, d the sample's distance from the
/// light: no shadow that is believed is displaced by more. It is believed where that is at most
/// `believe` pixel footprints w, so where t / d is at least r / (believe w - b). Towards a
/// directional light t / d is 1.
SDAG_HD inline bool shortenToBelieved(const RayInputs& inputs, const ShadowPair& pair,
                                      DagSegment& segment) {
    const VoxelGrid& grid = inputs.dag.grid;
    const double reach = voxelReachWorld(inputs, pair);
    const double footprint = pixelFootprintWorld(inputs.detail, pair.positionWorld);
    const float believe =
        mutated(Mutant::kBeliefTooWide, inputs.options.believe, 4.0f * inputs.options.believe);
    const double room = double(believe) * footprint - double(inputs.options.offset) * reach;
    if (!(reach <= room))
        return false;
    const glm::dvec3 light = grid.voxelFromWorld(glm::dvec3(pair.lightWorld));
    const glm::dvec3 from(segment.from), to(segment.to);
    if (glm::dot(glm::dvec3(pair.normalWorld), light - from) <= 0.0)
        return false; // the segment was bent up to the plane through its start
    if (pair.isDirectional)
        return true;
    const double distance =
        glm::length(light - grid.voxelFromWorld(glm::dvec3(pair.positionWorld)));
    const double atStart = glm::length(light - from), atEnd = glm::length(light - to);
    const double nearest = reach / room * distance; // to the light
    if (nearest <= atEnd)
        return true;
    if (!(nearest < atStart))
        return false;
    segment.to = glm::vec3(from + (to - from) * ((atStart - nearest) / (atStart - atEnd)));
    return true;
}

/// Returns whether a voxel that is believed makes the pair dark. `hit`, when not null, receives it.
template <RayNeeds kNeeds = RayNeeds{}>
SDAG_HD inline bool isDarkByBelievedVoxel(const RayInputs& inputs, const ShadowPair& pair,
                                          DagHit* hit = nullptr) {
    if (!kNeeds.voxels || inputs.options.believesNone())
        return false;
    PairSegment believed = pairSegment<kNeeds>(inputs, pair);
    if (kNeeds.triangles && !inputs.options.believesAll() &&
        !shortenToBelieved(inputs, pair, believed.segment))
        return false;
    return isStopped<kNeeds>(inputs, believed, hit);
}

/// What the answers of rays took, counted.
struct RayCounts {
    uint32_t moverTestCount = 0; ///< rays that were tested against moving triangles
    uint32_t exactCount = 0;     ///< rays that were left to the triangles, static ones first

    SDAG_HD void operator+=(const RayCounts& other) {
        moverTestCount += other.moverTestCount;
        exactCount += other.exactCount;
    }
};

/// Returns whether a moving triangle makes the pair dark; asked of pairs that the voxels leave lit
/// where movers.mayShadow(pair.light).
SDAG_HD inline bool isDarkByMovers(const MoverView& movers, const ShadowPair& pair) {
    return isBlockedByMovers(movers,
                             truthPairRay(movers.geometry, pair.positionWorld, pair.normalWorld,
                                          pair.receiver, pair.lightWorld));
}

/// Returns whether a triangle makes the pair dark, a static or a moving one.
/// @param counts grows; may be null @param blocker the last triangle that blocked, asked
/// first: it often blocks the next ray to the same light, too; may be null. Changes no answer.
template <RayNeeds kNeeds = RayNeeds{}>
SDAG_HD inline bool isDarkByTriangles(const RayInputs& inputs, const ShadowPair& pair,
                                      RayCounts* counts, uint32_t* blocker) {
    if (counts)
        ++counts->exactCount;
    const ExactView& exact = inputs.exact;
    const TruthRay ray = truthPairRay(exact.geometry, pair.positionWorld, pair.normalWorld,
                                      pair.receiver, pair.lightWorld);
    if (!(ray.tFar > 0.0f))
        return false;
    if (blocker && *blocker != kBackground && blocksTruthRay(exact.geometry, ray, *blocker))
        return true;
    if (isBlockedExactly(exact, ray, blocker))
        return true;
    if (!kNeeds.movers || !inputs.movers.mayShadow(pair.light))
        return false;
    if (counts)
        ++counts->moverTestCount;
    return isBlockedByMovers(inputs.movers, ray);
}

/// Returns whether the rays' method says that the pair is dark: by voxels, triangles or movers.
/// Knows no TriangleRays::kEmbree, whose packets ClusterRays alone makes.
/// @tparam kNeeds what `inputs` need, or more
/// @param counts grows; may be null @param blocker of isDarkByTriangles; may be null
template <RayNeeds kNeeds = RayNeeds{}>
SDAG_HD inline bool isDarkByRays(const RayInputs& inputs, const ShadowPair& pair,
                                 RayCounts* counts = nullptr, uint32_t* blocker = nullptr) {
    if (isDarkByBelievedVoxel<kNeeds>(inputs, pair))
        return true;
    if (kNeeds.triangles && !inputs.options.believesAll())
        return isDarkByTriangles<kNeeds>(inputs, pair, counts, blocker);
    if (!kNeeds.movers || !inputs.movers.mayShadow(pair.light))
        return false;
    if (counts)
        ++counts->moverTestCount;
    return isDarkByMovers(inputs.movers, pair);
}

} // namespace shadowdag
