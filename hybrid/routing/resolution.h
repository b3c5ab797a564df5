// SPDX-License-Identifier: Apache-2.0
// The resolution that a shadow map must have: one texel for one pixel, on average over a cluster.
// Source: Olsson et al., More Efficient Virtual Shadow Maps for Many Lights, TVCG 2015, sec. IV-B,
// eq. 1.
//
// A cluster of S pixels whose bounding sphere (radius r, centre at distance d) fills the solid
// angle alpha wants
//     R^2 = (S / (alpha / 4 pi)) / 6,   alpha / 4 pi = (1 - sqrt(1 - x)) / 2,   x = r^2 / d^2,
// texels a face. Multiplied by 1 + sqrt(1 - x) this is S (1 + sqrt(1 - x)) / (3 x), which does not
// cancel for small x.
//
// The light inside the sphere (d <= r): alpha is taken as 2 pi, R^2 = S / 3. The pixels are on
// surfaces, and a surface in front of a light, however near, covers at most a half space; 4 pi
// would spread the pixels over twice the directions they can have. The rule continues the equation,
// whose alpha is 2 pi at d = r, so R never jumps as a light or the camera moves, and it never grows
// as the light comes nearer. (Octants of the box, S / 4 each, were considered: they request up to
// 2.1 times as much for a light at the sphere's border, but jump by that factor there, and the next
// clusters' equations decide at such a light anyway.)
//
// A deviation: r is the radius of the samples' box plus half a pixel's diagonal at the cluster's
// far end. A pixel is not a point; without this a cluster of one sample has r = 0 and requests an
// infinite resolution, with it one texel for its pixel.
#pragma once

#include "cuda/pass.h"
#include "hybrid/clusters/cluster_lights.h"
#include "hybrid/routing/pixel_footprint.h"
#include "shadowmap/directional_window.h"

#include <bit>

namespace shadowdag {

/// Returns R^2, texels squared, that a cluster of `sampleCount` > 0 pixels requests of a light.
/// @param radiusSquared,distanceSquared of the cluster's bounding sphere and of its centre from the
/// light, same unit
SDAG_HD inline float requiredResolutionSquared(uint32_t sampleCount, double radiusSquared,
                                               double distanceSquared) {
    const double samples = sampleCount;
    if (!(radiusSquared < distanceSquared))
        return float(samples / 3.0);
    const double x = radiusSquared / distanceSquared;
    return float(samples * (1.0 + glm::sqrt(1.0 - x)) / (3.0 * x));
}

/// Returns R^2 that a cluster requests of a directional light, in texels of the lattice of which R
/// make directionalExtentWorld: the limit of the equation for a light far away, for which the
/// sphere covers the disc pi r^2, and S texels are to cover that.
SDAG_HD inline float requiredDirectionalResolutionSquared(uint32_t sampleCount,
                                                          double radiusSquared,
                                                          double extentWorld) {
    constexpr double kInversePiDouble = 0.31830988618379067;
    return float(double(sampleCount) * kInversePiDouble * (extentWorld * extentWorld) /
                 radiusSquared);
}

/// Returns the squared radius of a cluster's bounding sphere, half a pixel's diagonal added.
/// @param pixelSize side of a pixel at distance 1 (ViewRays)
SDAG_HD inline double clusterRadiusSquared(const Box& box, const ViewRays& view) {
    const glm::dvec3 half = 0.5 * (glm::dvec3(box.max) - glm::dvec3(box.min));
    const glm::dvec3 center = 0.5 * (glm::dvec3(box.max) + glm::dvec3(box.min)) - view.origin;
    const double farthest = glm::dot(center, view.forward) + glm::dot(glm::abs(view.forward), half);
    constexpr double kHalfDiagonal = 0.70710678118654752;
    const double radius =
        glm::sqrt(glm::dot(half, half)) + kHalfDiagonal * view.pixelSize * farthest;
    return radius * radius;
}

/// The maximum number of maps per light, and the number of octaves by which requests are
/// distinguished.
constexpr uint32_t kMaxMapsPerLight = 16;

/// Returns floor(log2 R), 0 to kMaxMapsPerLight - 1, of a squared resolution.
SDAG_HD inline uint32_t octaveOf(float resolutionSquared) {
    const int exponent = int(std::bit_cast<uint32_t>(resolutionSquared) >> 23 & 255u) - 127;
    const int octave = exponent > 0 ? exponent / 2 : 0;
    return uint32_t(octave < int(kMaxMapsPerLight) ? octave : int(kMaxMapsPerLight) - 1);
}

/// Returns the octave of the map that serves requests of `octave`, which `occupied` (bits by
/// octave) includes: itself if it is among the `mapCount` (>= 1) highest occupied octaves, else the
/// lowest of these.
SDAG_HD inline uint32_t servingOctave(uint32_t occupied, uint32_t octave, uint32_t mapCount) {
    const uint32_t above = occupied >> octave >> 1;
    if (uint32_t(std::popcount(above)) < mapCount)
        return octave;
    uint32_t left = occupied;
    for (uint32_t k = 1; k < mapCount; ++k)
        left &= ~(1u << (31u - uint32_t(std::countl_zero(left))));
    return 31u - uint32_t(std::countl_zero(left));
}

/// The combined requests of lights' clusters.
/// A slot is light * kMaxMapsPerLight + octave. wantedSquared: one a (cluster, light) pair.
struct LightDemandView {
    View<uint32_t> resolutionSquaredBits; ///< by light: float bits of the maximum R^2
    View<uint32_t> occupiedOctaves;       ///< by light: bits of the octaves that are requested;
                                          ///< 0 with one map per light
    View<float> wantedSquared;            ///< R^2 of the pair
    View<uint32_t> mapSquaredBits;        ///< these three by slot: the maximum R^2,
    View<uint32_t> mapSampleCount;        ///< samples of its clusters,
    View<uint32_t> mapClusterCount;       ///< its clusters
};

/// Computes the request of every pair of a cluster, and raises the demand of its light (zero
/// before; order independent).
struct DemandResolution {
    ClusterView clusters;
    ClusterLightsView lists;
    View<const Light> lights;
    ViewRays view;
    LightDemandView demand;
    float scale;           ///< of R^2: 1 / undersample^2
    uint32_t mapsPerLight; ///< 1: octaves are not needed
    ResolutionRule rule = ResolutionRule::kSphere;
    GBufferView gbuffer = {}; ///< not read by kSphere

    size_t itemCount() const { return clusters.count(); }
    size_t grain() const { return 64; }
    SDAG_HD void operator()(size_t cluster) const { demandPart(cluster, 0, 1); }
    /// The same for entries part, part + partCount, ... of the cluster's list.
    SDAG_HD void demandPart(size_t cluster, uint32_t part, uint32_t partCount) const {
        if (lists.start[cluster] == lists.start[cluster + 1])
            return;
        const Box box = clusters.boxesWorld[cluster];
        const glm::dvec3 center = 0.5 * (glm::dvec3(box.max) + glm::dvec3(box.min));
        const double radiusSquared = clusterRadiusSquared(box, view);
        const uint32_t samples = clusters.sampleCount(cluster);
        ClusterPlane plane;
        if (rule == ResolutionRule::kPlane)
            plane = meanPlane(gbuffer, clusters, cluster, view);
        for (uint32_t i = lists.start[cluster] + part; i < lists.start[cluster + 1];
             i += partCount) {
            if (lists.record[i] == kProvenLit)
                continue;
            const uint32_t l = lists.lights[i];
            const Light& light = lights[l];
            const glm::dvec3 toLight = glm::dvec3(light.positionWorld) - center;
            float wanted =
                light.kind == Light::kSun
                    ? requiredDirectionalResolutionSquared(samples, radiusSquared,
                                                           directionalExtentWorld(light))
                    : requiredResolutionSquared(samples, radiusSquared, glm::dot(toLight, toLight));
            if (rule == ResolutionRule::kPlane) {
                const double share = pixelShare(view, plane.position, plane.normal, light);
                if (share > 0.0)
                    wanted = float(shareOfTexel(light) / share);
            }
            demand.wantedSquared[i] = wanted;
            // Positive floats order as their bits do.
            raiseOnceRelaxed(&demand.resolutionSquaredBits[l], std::bit_cast<uint32_t>(wanted));
            if (mapsPerLight > 1)
                orOnceRelaxed(&demand.occupiedOctaves[l], 1u << octaveOf(wanted * scale));
        }
    }
};
void launchPass(CudaTag, const DemandResolution& work); ///< by warps

/// Assigns every pair of a cluster to one of its light's maps, and raises that map's demand (zero
/// before; order independent). With several maps per light a pair goes by the octave of its
/// request; octaves below the mapsPerLight highest *occupied* ones are combined with the lowest of
/// these (servingOctave), so that one near cluster alone takes one map and leaves the others apart.
/// An octave's bounds do not move with the light's maximum, so a static cluster keeps its map
/// unless octaves above it fill or empty. Source: Olsson et al. 2015, sec. IV-C (histogram of
/// requested resolutions; its buckets are not given there). A directional light always has a map
/// for every two octaves, each the window of a clipmap: a single map over near and far receivers
/// would have the resolution of the nearest everywhere. (One per octave drew half as many triangles
/// again, 2.1 against 1.4 million with a directional light over `houses`, 0.79 against 0.48 in
/// `atrium`, on 101 % and 83 % of the pages.)
struct DemandMaps {
    ClusterView clusters;
    ClusterLightsView lists; ///< record not read
    LightDemandView demand;
    View<uint32_t> slot;   ///< one per pair; kProvenLit before: no request
    float scale;           ///< of R^2: 1 / undersample^2
    uint32_t mapsPerLight; ///< 1..kMaxMapsPerLight
    View<const Light> lights;

    size_t itemCount() const { return clusters.count(); }
    size_t grain() const { return 64; }
    SDAG_HD void operator()(size_t cluster) const { demandPart(cluster, 0, 1); }
    /// The same for entries part, part + partCount, ... of the cluster's list.
    SDAG_HD void demandPart(size_t cluster, uint32_t part, uint32_t partCount) const {
        const uint32_t samples = clusters.sampleCount(cluster);
        for (uint32_t i = lists.start[cluster] + part; i < lists.start[cluster + 1];
             i += partCount) {
            if (slot[i] == kProvenLit)
                continue;
            const uint32_t light = lists.lights[i];
            uint32_t octave = 0;
            if (lights[light].kind == Light::kSun) {
                octave = octaveOf(demand.wantedSquared[i] * scale) | 1u;
            } else if (mapsPerLight > 1) {
                octave = servingOctave(demand.occupiedOctaves[light],
                                       octaveOf(demand.wantedSquared[i] * scale), mapsPerLight);
            }
            const uint32_t s = light * kMaxMapsPerLight + octave;
            slot[i] = s;
            raiseOnceRelaxed(&demand.mapSquaredBits[s],
                             std::bit_cast<uint32_t>(demand.wantedSquared[i]));
            atomicAddRelaxed(&demand.mapSampleCount[s], samples);
            atomicAddRelaxed(&demand.mapClusterCount[s], 1);
        }
    }
};
void launchPass(CudaTag, const DemandMaps& work); ///< by warps

/// Marks occupied slots with 1: an exclusive scan of the marks numbers the maps.
struct MarkOccupiedSlots {
    View<const uint32_t> mapClusterCount;
    View<uint32_t> recordOfSlot;

    size_t itemCount() const { return recordOfSlot.count; }
    size_t grain() const { return 4096; }
    SDAG_HD void operator()(size_t slot) const { recordOfSlot[slot] = mapClusterCount[slot] != 0; }
};

/// The lengths of the gathered lists, in the order in which they are stored.
enum GatheredLength : uint32_t {
    kClusterLength,
    kSampleLength,       ///< of the clusters in the list
    kClusterLightLength, ///< (cluster, light) pairs of these
    kGatheredLengths
};

/// Copies the lengths to where they are fetched together.
struct NoteLengths {
    View<const uint32_t> clusterCount, sampleCount, clusterLightCount; ///< 1 each
    View<uint32_t> lengths;                                            ///< kGatheredLengths

    size_t itemCount() const { return 1; }
    SDAG_HD void operator()(size_t) const {
        lengths[kClusterLength] = clusterCount[0];
        lengths[kSampleLength] = sampleCount[0];
        lengths[kClusterLightLength] = clusterLightCount[0];
    }
};

/// Replaces the slot of every pair by the number of its map.
struct NumberPairs {
    View<const uint32_t> recordOfSlot;
    View<uint32_t> record; ///< a slot before

    size_t itemCount() const { return record.count; }
    size_t grain() const { return 4096; }
    SDAG_HD void operator()(size_t i) const {
        if (record[i] != kProvenLit)
            record[i] = recordOfSlot[record[i]];
    }
};

} // namespace shadowdag
