// SPDX-License-Identifier: Apache-2.0
// Gathers the requests of every light's clusters to its shadow maps, and numbers the maps.
#pragma once

#include "cuda/fill_pass.h"
#include "cuda/pass.h"
#include "cuda/scan_sort.h"
#include "hybrid/clusters/light_assign_pass.h"
#include "hybrid/routing/resolution.h"

namespace shadowdag {

/// The demands on one backend; arrays as in LightDemandView.
struct LightDemand {
    explicit LightDemand(Backend backend)
        : resolutionSquaredBits(backend, "demand resolution"),
          occupiedOctaves(backend, "demand octaves"), wantedSquared(backend, "demand of pairs"),
          ofMaps(backend, "demand of maps"), recordOfSlot(backend, "demand maps") {}

    Buffer<uint32_t> resolutionSquaredBits;
    Buffer<uint32_t> occupiedOctaves;
    Buffer<float> wantedSquared;
    /// The three arrays by slot, one after the other, and kGatheredLengths: fetched in one copy.
    Buffer<uint32_t> ofMaps;
    Buffer<uint32_t> recordOfSlot;

    LightDemandView view() {
        return {resolutionSquaredBits.view(),
                occupiedOctaves.view(),
                wantedSquared.view(),
                ofMap(0),
                ofMap(1),
                ofMap(2)};
    }
    size_t slotCount() const {
        return ofMaps.size() < kGatheredLengths ? 0 : (ofMaps.size() - kGatheredLengths) / 3;
    }
    /// The destination of the lengths of gathering.
    View<uint32_t> lengths() { return {ofMaps.view().data + 3 * slotCount(), kGatheredLengths}; }

private:
    View<uint32_t> ofMap(size_t array) {
        return {ofMaps.view().data + array * slotCount(), slotCount()};
    }
};

/// Copies the lengths of gathering's lists to where they are fetched.
inline void noteLengths(Backend backend, const NoteLengths& work) {
    runPass(backend, work);
}

/// Replaces the demands by those of these clusters and writes lists.record, which assignLights
/// created and pruning may have filled in. Maps are numbered by light, then by octave. All
/// integers, deterministic. All views are on the backend.
/// @param undersample > 0, divides resolutions; @param mapsPerLight 1..kMaxMapsPerLight
/// @param gbuffer of the clusters' samples; not needed by kSphere
inline void gatherDemand(Backend backend, const ClusterView& clusters, ClusterLights& lists,
                         View<const Light> lights, const ViewRays& view, float undersample,
                         uint32_t mapsPerLight, LightDemand& demand,
                         ResolutionRule rule = ResolutionRule::kSphere,
                         const GBufferView& gbuffer = {}) {
    const size_t slotCount = lights.count * kMaxMapsPerLight;
    demand.resolutionSquaredBits.resize(lights.count);
    demand.occupiedOctaves.resize(lights.count);
    demand.ofMaps.resize(3 * slotCount + kGatheredLengths);
    fillAll(backend, {demand.resolutionSquaredBits, demand.occupiedOctaves, demand.ofMaps});
    demand.wantedSquared.resize(lists.lights.size());
    const float scale = 1.0f / (undersample * undersample);
    runPass(backend, DemandResolution{clusters, lists.view(), lights, view, demand.view(), scale,
                                      mapsPerLight, rule, gbuffer});
    runPass(backend, DemandMaps{clusters, lists.view(), demand.view(), lists.record.view(), scale,
                                mapsPerLight, lights});
    demand.recordOfSlot.resize(slotCount);
    runPass(backend, MarkOccupiedSlots{demand.view().mapClusterCount, demand.recordOfSlot.view()});
    prefixSums(backend, demand.recordOfSlot.view(), demand.recordOfSlot.view());
    runPass(backend, NumberPairs{demand.recordOfSlot.view(), lists.record.view()});
}

} // namespace shadowdag
