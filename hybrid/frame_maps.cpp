// SPDX-License-Identifier: Apache-2.0
// From what lights ask for to the maps that are drawn: records, quantities, requests.
#include "hybrid/frame_state.h"

#include "cuda/parallel_for.h"
#include "hybrid/light_bvh.h"
#include "hybrid/resolution_steps.h"
#include "shadowmap/page_mask_pass.h"

#include <bit>
#include <cmath>

namespace shadowdag {

namespace {

// Calls add(cluster, light) for every (cluster, light) pair, on the host.
template <class Add> void forClusterLights(const ClusterLights& lists, const Add& add) {
    const std::vector<uint32_t> start = lists.start.download();
    const std::vector<uint32_t> lights = lists.lights.download();
    for (uint32_t cluster = 0; cluster + 1 < start.size(); ++cluster)
        for (uint32_t i = start[cluster]; i < start[cluster + 1]; ++i)
            add(cluster, lights[i]);
}

// Counts the pages that the clusters of every record touch at its allocated resolution, by the
// shadow maps' own marks; what a full pool does to them is left out.
void countPagesOf(FrameState& state, const FrameOptions& options, std::vector<MapRecord>& records) {
    const std::vector<Light>& lights = state.scene.world().lights();
    const uint32_t pageTexelsLog2 = uint32_t(std::countr_zero(options.maps.pageTexels));
    std::vector<uint32_t> mapOfLight(lights.size(), 0);
    std::vector<MapRequest> requests;
    for (const MapRecord& record : records) {
        const MapQuantities& map = record.quantities;
        mapOfLight[map.light] = uint32_t(requests.size());
        requests.push_back({lights[map.light].positionWorld, lights[map.light].rangeWorld,
                            map.light, map.faceTexels});
    }
    const MapLayout layout = layOutMaps(requests, options.maps.pageTexels);
    std::vector<MapReceiver> hostReceivers;
    forClusterLights(state.lists, [&](uint32_t cluster, uint32_t light) {
        hostReceivers.push_back({cluster, mapOfLight[light]});
    });

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
    markReceivers(state.backend,
                  {maps.view(), state.clusters.boxesWorld.view(), receivers.view(),
                   PageMaskView{pages.view(), projection.view(), faces.view(), depths.view()},
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

std::vector<MapRecord> describeMaps(const FrameState& state, const FrameOptions& options) {
    const std::vector<Light>& lights = state.scene.world().lights();
    const std::vector<uint32_t> bits = state.demand.resolutionSquaredBits.download();
    const std::vector<uint32_t> samples = state.demand.sampleCount.download();
    const std::vector<uint32_t> clusters = state.demand.clusterCount.download();
    const std::vector<uint32_t> steps = makeResolutionSteps(options.maxFaceTexels);
    std::vector<MapRecord> records;
    for (uint32_t light = 0; light < lights.size(); ++light) {
        if (clusters[light] == 0)
            continue;
        const double undersample = options.undersample;
        const double wantedSquared =
            double(std::bit_cast<float>(bits[light])) / (undersample * undersample);
        const uint32_t held = light < state.heldFaceTexels.size() ? state.heldFaceTexels[light] : 0;
        MapRecord record;
        record.quantities.light = light;
        record.quantities.texels = float(std::sqrt(wantedSquared));
        record.quantities.faceTexels =
            allocateResolution(steps, wantedSquared, options.minFaceTexels, held);
        record.quantities.samples = samples[light];
        record.quantities.clusters = clusters[light];
        record.quantities.range = lights[light].rangeWorld;
        records.push_back(record);
    }
    for (MapRecord& record : records)
        record.quantities.lights = uint32_t(records.size());
    return records;
}

void countGeometry(FrameState& state, const FrameOptions& options, std::vector<MapRecord>& maps) {
    if (maps.empty())
        return;
    countPagesOf(state, options, maps);
    const std::vector<Light>& lights = state.scene.world().lights();
    const BatchView batches = state.scene.hostBatches();
    parallelFor<CpuTag>(
        maps.size(),
        [&](size_t m) {
            MapQuantities& map = maps[m].quantities;
            const Light& light = lights[map.light];
            const float rangeSquared = light.rangeWorld * light.rangeWorld;
            map.batches = 0;
            map.triangles = 0;
            traverse(
                batches.bvh,
                [&](const Box& box) {
                    return distanceSquared(box, light.positionWorld) < rangeSquared;
                },
                [&](uint32_t batch) {
                    ++map.batches;
                    map.triangles += batches.batches[batch].count;
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

void holdResolutions(FrameState& state, const std::vector<MapRecord>& maps) {
    state.heldFaceTexels.assign(state.scene.world().lights().size(), 0);
    for (const MapRecord& map : maps)
        state.heldFaceTexels[map.quantities.light] = map.quantities.faceTexels;
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
        state.mapOfLight.assign(lights.size(), kNone);
        for (const MapRecord& record : records) {
            const uint32_t light = record.quantities.light;
            if (record.route == Route::kMap) {
                state.mapOfLight[light] = int(requests.size());
                requests.push_back({lights[light].positionWorld, lights[light].rangeWorld, light,
                                    record.quantities.faceTexels});
            } else if (!state.scene.hasDag()) {
                throw Error(ErrorKind::kUsage,
                            "light " + std::to_string(light) +
                                " is routed to rays, but there is no voxel DAG; voxelize the "
                                "scene, or route every light to maps with texels:0");
            }
        }
        state.mapOfLightOnBackend.set(state.mapOfLight);
        if (!requests.empty()) {
            boxes = state.clusters.boxesWorld.download();
            forClusterLights(state.lists, [&](uint32_t cluster, uint32_t light) {
                if (state.mapOfLight[light] >= 0)
                    receivers.push_back({cluster, uint32_t(state.mapOfLight[light])});
            });
        }
    }
    state.maps.build(requests, boxes, receivers, world.triangles(), state.scene.hostBatches(),
                     options.maps, stages);
}

} // namespace shadowdag
