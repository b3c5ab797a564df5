// SPDX-License-Identifier: Apache-2.0
// Isolated costs: every map of a frame served alone, by each method.
#include "cuda/statistics.h"
#include "hybrid/frame_state.h"

namespace shadowdag {

namespace {

// The clusters of one light alone, so that shading them costs nothing for the others.
struct OneLight {
    explicit OneLight(Backend backend) : clusters(backend), lists(backend) {}

    ClusterSet clusters; ///< sampleStart, samples and clusterOfSample only
    ClusterLights lists;
};

// The frame's clusters and lists on the host.
struct HostLists {
    explicit HostLists(const FrameState& state)
        : sampleStart(state.clusters.sampleStart.download()),
          samples(state.clusters.samples.download()), lightStart(state.lists.start.download()),
          lights(state.lists.lights.download()), boxes(state.clusters.boxesWorld.download()),
          clustersOfLight(state.scene.world().lights().size()) {
        for (uint32_t c = 0; c + 1 < lightStart.size(); ++c)
            for (uint32_t i = lightStart[c]; i < lightStart[c + 1]; ++i)
                clustersOfLight[lights[i]].push_back(c);
    }

    std::vector<uint32_t> sampleStart, samples, lightStart, lights;
    std::vector<Box> boxes;
    std::vector<std::vector<uint32_t>> clustersOfLight;
};

void isolate(const HostLists& host, uint32_t light, size_t pixelCount, OneLight& one) {
    std::vector<uint32_t> cell, start{0}, samples, lightStart{0}, lights;
    std::vector<uint32_t> clusterOfSample(pixelCount, kNoCluster);
    for (const uint32_t c : host.clustersOfLight[light]) {
        for (uint32_t i = host.sampleStart[c]; i < host.sampleStart[c + 1]; ++i) {
            samples.push_back(host.samples[i]);
            clusterOfSample[host.samples[i]] = uint32_t(cell.size());
        }
        cell.push_back(c);
        start.push_back(uint32_t(samples.size()));
        lights.push_back(light);
        lightStart.push_back(uint32_t(lights.size()));
    }
    one.clusters.cell.upload(cell);
    one.clusters.sampleStart.upload(start);
    one.clusters.samples.upload(samples);
    one.clusters.clusterOfSample.upload(clusterOfSample);
    one.lists.start.upload(lightStart);
    one.lists.lights.upload(lights);
}

} // namespace

FrameCosts measureFrameCosts(FrameState& state, const ViewRays& view, const FrameOptions& options,
                             int repeats) {
    if (repeats < 1)
        throw Error(ErrorKind::kUsage, "costs measured " + std::to_string(repeats) +
                                           " times; use at least one repeat");
    if (!state.scene.hasDag())
        throw Error(ErrorKind::kUsage, "costs of rays cannot be measured without a voxel DAG; "
                                       "voxelize the scene first");
    StageTimes ignored;
    gatherFrame(state, view, options, ignored);
    const HostLists host(state);
    const World& world = state.scene.world();
    const std::vector<Light>& lights = world.lights();
    OneLight one(state.backend);
    FrameCosts costs;

    for (const MapRecord& record : describeMaps(state, options)) {
        const uint32_t light = record.quantities.light;
        isolate(host, light, state.gbuffer.view().count(), one);
        const std::vector<MapRequest> request{{lights[light].positionWorld,
                                               lights[light].rangeWorld, light,
                                               record.quantities.faceTexels}};
        std::vector<MapReceiver> receivers;
        for (const uint32_t cluster : host.clustersOfLight[light])
            receivers.push_back({cluster, 0});

        std::vector<double> raysMs, mapMs;
        for (int repeat = 0; repeat < repeats; ++repeat)
            for (const Route route : {Route::kRays, Route::kMap}) {
                StageTimes times;
                state.mapOfLight.assign(lights.size(), kNone);
                if (route == Route::kMap) {
                    state.mapOfLight[light] = 0;
                    state.maps.build(request, host.boxes, receivers, world.triangles(),
                                     state.scene.hostBatches(), options.maps, times);
                }
                state.mapOfLightOnBackend.set(state.mapOfLight);
                ShadeSamples shading = prepareShading(state, options);
                shading.clusters = one.clusters.view();
                shading.lists = one.lists.view();
                shadeUnlit(state.backend, shading);
                {
                    const StageTimer timer(state.backend, times, "shading");
                    shadeLights(state.backend, shading);
                }
                (route == Route::kRays ? raysMs : mapMs).push_back(times.totalMs());
            }
        costs.maps.push_back({light, median(raysMs), median(mapMs)});
    }
    return costs;
}

} // namespace shadowdag
