// SPDX-License-Identifier: Apache-2.0
// From what lights ask for to the maps that are drawn: records, quantities, requests.
#include "hybrid/frame_state.h"

#include "cuda/parallel_for.h"
#include "hybrid/light_bvh.h"
#include "hybrid/resolution_steps.h"
#include "shadowmap/cull.h"
#include "shadowmap/page_mask_pass.h"

#include <bit>
#include <cmath>

namespace shadowdag {

namespace {

// Returns a receiver for every (cluster, light) pair whose record has an entry >= 0 in
// `mapOfRecord`, on the host.
std::vector<MapReceiver> listReceivers(const ClusterLights& lists,
                                       const std::vector<int>& mapOfRecord) {
    const std::vector<uint32_t> start = lists.start.download();
    const std::vector<uint32_t> records = lists.record.download();
    std::vector<MapReceiver> receivers;
    for (uint32_t cluster = 0; cluster + 1 < start.size(); ++cluster)
        for (uint32_t i = start[cluster]; i < start[cluster + 1]; ++i)
            if (records[i] != kProvenLit && mapOfRecord[records[i]] >= 0)
                receivers.push_back({cluster, uint32_t(mapOfRecord[records[i]])});
    return receivers;
}

// Counts the pages that the clusters of every record touch at its allocated resolution, by the
// shadow maps' own marks; what a full pool does to them is left out.
void countPagesOf(FrameState& state, const FrameOptions& options, std::vector<MapRecord>& records) {
    const std::vector<Light>& lights = state.scene.world().lights();
    const uint32_t pageTexelsLog2 = uint32_t(std::countr_zero(options.maps.pageTexels));
    std::vector<MapRequest> requests;
    std::vector<int> mapOfRecord(records.size());
    for (size_t r = 0; r < records.size(); ++r) {
        mapOfRecord[r] = int(r);
        requests.push_back(requestOf(lights, records[r]));
    }
    const MapLayout layout = layOutMaps(requests, options.maps.pageTexels);
    const std::vector<MapReceiver> hostReceivers = listReceivers(state.lists, mapOfRecord);

    Buffer<ShadowMapInfo> maps(state.backend, "routing maps");
    Buffer<MapReceiver> receivers(state.backend, "routing receivers");
    Buffer<uint32_t> pages(state.backend, "routing pages", layout.maskWordCount);
    Buffer<uint32_t> projection(state.backend, "routing projection",
                                records.size() * kProjectionWordsPerMap);
    Buffer<uint32_t> faces(state.backend, "routing faces", records.size());
    Buffer<uint32_t> depths(state.backend, "routing depths", records.size() * kFaceCount);
    maps.upload(layout.maps);
    receivers.upload(hostReceivers);
    for (Buffer<uint32_t>* words : {&pages, &projection, &faces, &depths})
        words->fill(0);
    markReceivers(
        state.backend,
        {maps.view(), state.clusters.boxesWorld.view(), receivers.view(),
         PageMaskView{pages.view(), projection.view(), faces.view(), depths.view(), {}, {}},
         pageTexelsLog2, options.maps.taps});
    const std::vector<uint32_t> words = pages.download();
    for (size_t m = 0; m < records.size(); ++m) {
        const size_t endWord = m + 1 < records.size() ? layout.maps[m + 1].pageTableStart / 32
                                                      : size_t(layout.maskWordCount);
        uint32_t count = 0;
        for (size_t w = layout.maps[m].pageTableStart / 32; w < endWord; ++w)
            count += uint32_t(std::popcount(words[w]));
        records[m].quantities.pages = count;
    }
}

} // namespace

MapRequest requestOf(const std::vector<Light>& lights, const MapRecord& record) {
    const MapQuantities& map = record.quantities;
    const Light& light = lights[map.light];
    return {light.positionWorld,
            light.rangeWorld,
            map.light,
            map.faceTexels,
            map.octave,
            record.window,
            light.kind == Light::kSpot ? SpotCone{light.directionWorld, light.cosOuter}
                                       : SpotCone{}};
}

std::vector<MapRecord> describeMaps(const FrameState& state, const FrameOptions& options) {
    const std::vector<Light>& lights = state.scene.world().lights();
    const std::vector<uint32_t> bits = state.demand.mapSquaredBits.download();
    const std::vector<uint32_t> samples = state.demand.mapSampleCount.download();
    const std::vector<uint32_t> clusters = state.demand.mapClusterCount.download();
    const std::vector<uint32_t> steps = makeResolutionSteps(options.maxFaceTexels),
                                sunSteps = makeSunResolutionSteps();
    std::vector<MapRecord> records;
    uint32_t lightCount = 0;
    for (uint32_t slot = 0; slot < bits.size(); ++slot) {
        if (clusters[slot] == 0)
            continue;
        const uint32_t light = slot / kMaxMapsPerLight;
        const double undersample = options.undersample;
        const double wantedSquared =
            double(std::bit_cast<float>(bits[slot])) / (undersample * undersample);
        const uint32_t held = slot < state.heldFaceTexels.size() ? state.heldFaceTexels[slot] : 0;
        if (records.empty() || records.back().quantities.light != light)
            ++lightCount;
        MapRecord record;
        record.quantities.light = light;
        record.quantities.octave = slot % kMaxMapsPerLight;
        record.quantities.texels = float(std::sqrt(wantedSquared));
        record.heldTexels = allocateResolution(lights[light].kind == Light::kSun ? sunSteps : steps,
                                               wantedSquared, options.minFaceTexels, held);
        record.quantities.faceTexels = record.heldTexels;
        record.quantities.samples = samples[slot];
        record.quantities.clusters = clusters[slot];
        record.quantities.range = lights[light].rangeWorld;
        if (slot < state.heldRoutes.size())
            record.quantities.previous = state.heldRoutes[slot];
        records.push_back(record);
    }
    for (MapRecord& record : records)
        record.quantities.lights = lightCount;
    fitSunWindows(state, options, records);
    return records;
}

void countGeometry(FrameState& state, const FrameOptions& options, std::vector<MapRecord>& maps) {
    if (maps.empty())
        return;
    countPagesOf(state, options, maps);
    const std::vector<Light>& lights = state.scene.world().lights();
    const BatchView batches = state.scene.mapGeometry(options.maps.lodTexels).batches;
    parallelFor<CpuTag>(
        maps.size(),
        [&](size_t m) {
            MapQuantities& map = maps[m].quantities;
            const Light& light = lights[map.light];
            const ShadowMapInfo info{light.positionWorld, light.rangeWorld, map.faceTexels, 0, 0,
                                     maps[m].window};
            map.batches = 0;
            map.triangles = 0;
            traverse(
                batches.bvh, [&](const Box& box) { return reachesMap(info, box); },
                [&](uint32_t batch) {
                    const Batch& reached = batches.batches[batch];
                    if (levelOf(batches.levels, reached.instance) !=
                        levelFor(batches.levels, info, reached.instance))
                        return;
                    ++map.batches;
                    map.triangles += reached.count;
                });
        },
        1);
}

std::vector<MapQuantities> quantitiesOf(const std::vector<MapRecord>& maps) {
    std::vector<MapQuantities> quantities;
    quantities.reserve(maps.size());
    for (const MapRecord& map : maps)
        quantities.push_back(map.quantities);
    return quantities;
}

void holdMaps(FrameState& state, const std::vector<MapRecord>& maps) {
    state.heldFaceTexels.assign(state.demand.mapSquaredBits.size(), 0);
    state.heldRoutes.assign(state.demand.mapSquaredBits.size(), PreviousRoute::kNone);
    for (const MapRecord& map : maps) {
        const size_t slot = map.quantities.light * kMaxMapsPerLight + map.quantities.octave;
        state.heldFaceTexels[slot] = map.heldTexels;
        state.heldRoutes[slot] =
            map.route == Route::kRays ? PreviousRoute::kRays : PreviousRoute::kMap;
    }
}

void buildMaps(FrameState& state, const std::vector<MapRecord>& records,
               const FrameOptions& options, StageTimes& stages) {
    const World& world = state.scene.world();
    const std::vector<Light>& lights = world.lights();
    std::vector<MapRequest> requests;
    std::vector<MapReceiver> receivers;
    std::vector<Box> boxes;
    {
        const StageTimer timer(state.backend, stages, "routing");
        state.drawnMap.assign(records.size(), kByRays);
        for (size_t r = 0; r < records.size(); ++r) {
            if (records[r].route == Route::kMap) {
                state.drawnMap[r] = int(requests.size());
                requests.push_back(requestOf(lights, records[r]));
            } else if (!state.scene.hasDag()) {
                throw Error(ErrorKind::kUsage,
                            "light " + std::to_string(records[r].quantities.light) +
                                " is routed to rays, but there is no voxel DAG; voxelize the "
                                "scene, or route every light to maps with texels:0");
            }
        }
        state.drawnMapOnBackend.set(state.drawnMap);
        if (!requests.empty()) {
            boxes = state.clusters.boxesWorld.download();
            receivers = listReceivers(state.lists, state.drawnMap);
        }
    }
    const MapGeometry drawn = state.scene.mapGeometry(options.maps.lodTexels);
    const std::vector<uint32_t> moved = state.scene.takeMovedBatches(options.maps.lodTexels);
    state.maps.build(requests, boxes, receivers, drawn.triangles, drawn.batches, options.maps,
                     stages, viewOf(moved));
}

} // namespace shadowdag
