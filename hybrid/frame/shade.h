// SPDX-License-Identifier: Apache-2.0
// Shading: one functor for lights that are traced and lights that have a map, in one pass.
#pragma once

#include "hybrid/clusters/cluster_lights.h"
#include "hybrid/clusters/pairs.h"
#include "hybrid/gbuffer/shade_model.h"
#include "hybrid/rays/shadow_rays.h"
#include "hybrid/routing/pair_server.h"
#include "shadowmap/shadow_map_lookup.h"

namespace shadowdag {

/// All data that decide whether a sample sees a light.
struct VisibilityInputs {
    RayInputs rays;
    ShadowMapView maps;
    ShadowMapBias bias;
};

/// What the pairs of a frame may need; kernels are compiled for it, as for RayNeeds.
struct PairNeeds {
    bool rays = true;        ///< pairs are served by rays
    bool maps = true;        ///< pairs are served by maps
    bool directional = true; ///< some lights are directional
    RayNeeds ofRays = {};
    uint32_t taps = 0; ///< of the maps' filter; 0: any number

    /// Returns whether code for these needs serves pairs of other needs.
    constexpr bool cover(const PairNeeds& other) const {
        const RayNeeds &a = ofRays, &b = other.ofRays;
        return (rays || !other.rays) && (maps || !other.maps) &&
               (directional || !other.directional) &&
               (!other.maps || taps == 0 || taps == other.taps) && (a.voxels || !b.voxels) &&
               (a.levels || !b.levels) && (a.triangles || !b.triangles) && (a.movers || !b.movers);
    }
};

/// Counts of the visibility tests, and state between pairs.
struct VisibilityCounts {
    uint32_t rayCount = 0;
    uint32_t lookupCount = 0;
    uint32_t provenCount = 0;
    uint32_t missingTapCount = 0;
    RayCounts rays;
    uint32_t lastBlocker = kBackground; ///< of exact rays
};

/// Returns the visibility of a pair by the method of its light, 255 lit .. 0 dark.
/// @tparam kNeeds what the pair needs, or more @param receiver the sample's world triangle
template <PairNeeds kNeeds = PairNeeds{}>
SDAG_HD inline uint8_t
computePairResult(const VisibilityInputs& inputs, PairServer server, uint32_t lightIndex,
                  const Light& light, const glm::vec3& positionWorld, const glm::vec3& normalWorld,
                  uint32_t receiver, VisibilityCounts& counts) {
    const ServedBy by = server.by();
    if (kNeeds.rays && by == ServedBy::kRays) {
        ++counts.rayCount;
        const ShadowPair pair{positionWorld,
                              normalWorld,
                              kNeeds.directional ? pointAtLight(light, positionWorld)
                                                 : light.positionWorld,
                              receiver,
                              lightIndex,
                              kNeeds.directional && light.kind == Light::kSun};
        return isDarkByRays<kNeeds.ofRays>(inputs.rays, pair, &counts.rays, &counts.lastBlocker)
                   ? uint8_t(0)
                   : kLit;
    }
    if (kNeeds.maps && by == ServedBy::kMap) {
        ++counts.lookupCount;
        return countedVisibility<kNeeds.directional, kNeeds.taps>(
            inputs.maps, server.map(), positionWorld, normalWorld, inputs.bias,
            counts.missingTapCount);
    }
    SDAG_ASSERT(by == ServedBy::kProof);
    ++counts.provenCount;
    return kLit;
}

/// Destination of recorded results, by pair; empty views: nothing is recorded. nextPair:
/// sampleCount, the sample's first pair before, one past its last after; visibility, server:
/// pairCount.
struct PairRecorder {
    View<uint32_t> nextPair;
    View<uint8_t> visibility;
    View<PairServer> server;

    SDAG_HD bool isOn() const { return !nextPair.empty(); }
    SDAG_HD void add(uint32_t sample, uint8_t value, PairServer by) const {
        if (!isOn())
            return;
        const uint32_t pair = nextPair[sample]++;
        visibility[pair] = value;
        server[pair] = by;
    }
};

/// Shades samples. The lights of a sample are added in ascending order, whether the pass iterates
/// sample by sample or light by light through a cluster, so both give the same bits.
struct ShadeSamples {
    GBufferView gbuffer;
    View<const uint32_t> triangleMaterial; ///< by world triangle
    View<const SurfaceColor> materials;
    ClusterView clusters;
    ClusterLightsView lists;
    View<const Light> lights;
    View<const PairServer> servers; ///< by record
    VisibilityInputs visibility;
    View<glm::vec3> color;   ///< width * height, linear radiance; zero where nothing is seen
    View<uint32_t> rayCount; ///< these six: clusterCount, zero before
    View<uint32_t> lookupCount;
    View<uint32_t> provenCount;
    View<uint32_t> missingTapCount;
    View<uint32_t> moverTestCount;
    View<uint32_t> exactCount;
    PairRecorder recorder;
    PairNeeds needs = {}; ///< of all pairs

    /// Returns the source of entry `entry` of the lists.
    SDAG_HD PairServer serverOf(uint32_t entry) const {
        const uint32_t record = lists.record[entry];
        return record == kProvenLit ? PairServer::proof() : servers[record];
    }

    /// Returns the colours of a sample that sees a surface.
    SDAG_HD SurfaceColor surfaceOf(size_t sample) const {
        SurfaceColor surface = materials[triangleMaterial[gbuffer.triangle[sample]]];
        surface.baseColor = gbuffer.baseColorOr(sample, surface.baseColor);
        return surface;
    }

    /// Returns whether a sample and a light are a pair.
    SDAG_HD bool isPairOf(uint32_t sample, const Light& light) const {
        return isPair(light, gbuffer.positionWorld[sample], gbuffer.normalWorld[sample]);
    }

    /// Returns the contribution of a light to a sample, which are a pair.
    template <PairNeeds kNeeds = PairNeeds{}>
    SDAG_HD glm::vec3 shadePair(uint32_t sample, PairServer server, uint32_t lightIndex,
                                const Light& light, VisibilityCounts& counts) const {
        const glm::vec3 position = gbuffer.positionWorld[sample];
        const glm::vec3 normal = gbuffer.normalWorld[sample];
        const uint8_t seen =
            computePairResult<kNeeds>(visibility, server, lightIndex, light, position, normal,
                                      gbuffer.triangle[sample], counts);
        return shadeAnswered(sample, server, light, seen);
    }

    /// Records the visibility of a pair and returns the light's contribution to the sample.
    SDAG_HD glm::vec3 shadeAnswered(uint32_t sample, PairServer server, const Light& light,
                                    uint8_t seen) const {
        recorder.add(sample, seen, server);
        if (seen == 0)
            return glm::vec3(0.0f);
        const SurfaceColor surface = surfaceOf(sample);
        return reflectedRadiance(light, gbuffer.positionWorld[sample], gbuffer.normalWorld[sample],
                                 surface, seen);
    }

    /// Sets a sample to its radiance without lights.
    SDAG_HD void shadeUnlit(size_t sample) const {
        const uint32_t triangle = gbuffer.triangle[sample];
        color[sample] =
            triangle == kBackground ? glm::vec3(0.0f) : unlitRadiance(surfaceOf(sample));
    }

    /// Adds all lights to all samples of a cluster, light by light: consecutive rays start close
    /// together and end at one light. For the CPU.
    SDAG_HD void shadeCluster(size_t cluster) const {
        VisibilityCounts counts;
        for (uint32_t l = lists.start[cluster]; l < lists.start[cluster + 1]; ++l) {
            const uint32_t lightIndex = lists.lights[l];
            const Light light = lights[lightIndex];
            const PairServer server = serverOf(l);
            for (uint32_t i = clusters.sampleStart[cluster]; i < clusters.sampleStart[cluster + 1];
                 ++i) {
                const uint32_t sample = clusters.samples[i];
                if (isPairOf(sample, light))
                    color[sample] += shadePair(sample, server, lightIndex, light, counts);
            }
        }
        addCounts(cluster, counts);
    }

    /// Adds all lights to one sample, in cluster order: neighbouring items walk the same lights.
    /// For CUDA.
    /// @tparam kNeeds covers needs @param i index into clusters.samples
    template <PairNeeds kNeeds = PairNeeds{}> SDAG_HD void shadeSample(size_t i) const {
        const uint32_t sample = clusters.samples[i];
        const uint32_t cluster = clusters.clusterOfSample[sample];
        VisibilityCounts counts;
        glm::vec3 sum = color[sample];
        const uint32_t end = lists.start[cluster + 1];
        if constexpr (kNeeds.rays) {
            for (uint32_t l = lists.start[cluster]; l < end; ++l) {
                // Each lane finds its own next pair, then all trace.
                while (l < end && !isPairOf(sample, lights[lists.lights[l]]))
                    ++l;
                if (l < end)
                    sum += shadePair<kNeeds>(sample, serverOf(l), lists.lights[l],
                                             lights[lists.lights[l]], counts);
            }
        } else { // without rays, registers are left for the sample
            const glm::vec3 position = gbuffer.positionWorld[sample],
                            normal = gbuffer.normalWorld[sample];
            const SurfaceColor surface = surfaceOf(sample);
            for (uint32_t l = lists.start[cluster]; l < end; ++l) {
                const uint32_t lightIndex = lists.lights[l];
                const Light light = lights[lightIndex];
                if (!isPair(light, position, normal))
                    continue;
                const PairServer server = serverOf(l);
                const uint8_t seen =
                    computePairResult<kNeeds>(visibility, server, lightIndex, light, position,
                                              normal, gbuffer.triangle[sample], counts);
                recorder.add(sample, seen, server);
                if (seen != 0)
                    sum += reflectedRadiance(light, position, normal, surface, seen);
            }
        }
        color[sample] = sum;
        addCounts(cluster, counts);
    }

    SDAG_HD void addCounts(size_t cluster, const VisibilityCounts& counts) const {
        if (counts.rayCount)
            atomicAddRelaxed(&rayCount[cluster], counts.rayCount);
        if (counts.lookupCount)
            atomicAddRelaxed(&lookupCount[cluster], counts.lookupCount);
        if (counts.provenCount)
            atomicAddRelaxed(&provenCount[cluster], counts.provenCount);
        if (counts.missingTapCount)
            atomicAddRelaxed(&missingTapCount[cluster], counts.missingTapCount);
        if (counts.rays.moverTestCount)
            atomicAddRelaxed(&moverTestCount[cluster], counts.rays.moverTestCount);
        if (counts.rays.exactCount)
            atomicAddRelaxed(&exactCount[cluster], counts.rays.exactCount);
    }
};

} // namespace shadowdag
