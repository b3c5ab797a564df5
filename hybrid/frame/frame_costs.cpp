// SPDX-License-Identifier: Apache-2.0
// Costs of maps: every map of a frame served alone, by each method, and scaled to whole frames.
#include "cuda/statistics.h"
#include "hybrid/frame/frame_state.h"

namespace shadowdag {

namespace {

// The clusters of one map alone, so that shading them costs nothing for the others.
struct OneMap {
    explicit OneMap(Backend backend) : clusters(backend), lists(backend) {}

    ClusterSet clusters; ///< sampleStart, samples and clusterOfSample only
    ClusterLights lists;
};

// The frame's clusters and lists on the host.
struct HostLists {
    HostLists(const FrameState& state, size_t recordCount)
        : sampleStart(state.clusters.sampleStart.download()),
          samples(state.clusters.samples.download()), clustersOfRecord(recordCount) {
        const std::vector<uint32_t> start = state.lists.start.download();
        const std::vector<uint32_t> records = state.lists.record.download();
        for (uint32_t c = 0; c + 1 < start.size(); ++c)
            for (uint32_t i = start[c]; i < start[c + 1]; ++i)
                if (records[i] != kProvenLit)
                    clustersOfRecord[records[i]].push_back(c);
    }

    std::vector<uint32_t> sampleStart, samples;
    std::vector<std::vector<uint32_t>> clustersOfRecord;
};

void isolate(const HostLists& host, uint32_t record, uint32_t light, size_t pixelCount,
             OneMap& one) {
    std::vector<uint32_t> cell, start{0}, samples, lightStart{0}, lights;
    std::vector<uint32_t> clusterOfSample(pixelCount, kNoCluster);
    for (const uint32_t c : host.clustersOfRecord[record]) {
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
    one.lists.record.upload(std::vector<uint32_t>(lights.size(), 0));
}

} // namespace

FrameCosts measureFrameCosts(FrameState& state, const ViewRays& view, const FrameOptions& options,
                             int repeats, const std::function<void()>& beforeStage) {
    if (repeats < 1)
        throw Error(ErrorKind::kUsage, "costs measured " + std::to_string(repeats) +
                                           " times; use at least one repeat");
    if (!state.scene.hasDag())
        throw Error(ErrorKind::kUsage, "costs of rays cannot be measured without a voxel DAG; "
                                       "voxelize the scene first");
    StageTimes ignored;
    gatherFrame(state, view, options, ignored);
    const std::vector<MapRecord> records = describeMaps(state, options);
    const HostLists host(state, records.size());
    const World& world = state.scene.world();
    OneMap one(state.backend);
    ShadowMapOptions mapOptions = options.maps;
    mapOptions.useStaticOptimization = false; // what a map costs, not what is left of it to do
    const BatchView hostBatches = state.scene.mapGeometry(options.maps.lodTexels).batches;
    const MapGeometry drawn = state.scene.mapGeometryOnBackend(options.maps.lodTexels);
    Buffer<MapReceiver> receivers(state.backend, "isolated map receivers");
    FrameCosts costs;

    for (uint32_t r = 0; r < records.size(); ++r) {
        const MapQuantities& map = records[r].quantities;
        isolate(host, r, map.light, state.gbuffer.view().count(), one);
        const std::vector<MapRequest> request{requestOf(world.lights(), records[r])};
        std::vector<MapReceiver> hostReceivers;
        for (const uint32_t cluster : host.clustersOfRecord[r])
            hostReceivers.push_back({cluster, 0});
        receivers.upload(hostReceivers);

        // Guessed lengths are those of the map before: forgotten, and found by a build that does
        // not count, or a map's cost would depend on who is measured first.
        if (state.isGuessing)
            state.maps.guessLengths(true);
        std::vector<double> raysMs, mapMs;
        for (int repeat = state.isGuessing ? -1 : 0; repeat < repeats; ++repeat)
            for (const Route route : {Route::kRays, Route::kMap}) {
                StageTimes times;
                times.beforeStage = beforeStage;
                state.servers.assign(1, PairServer::rays());
                if (route == Route::kMap) {
                    state.servers[0] = PairServer::drawnMap(0);
                    state.maps.build(request,
                                     {std::as_const(state.clusters.boxesWorld).view(),
                                      std::as_const(receivers).view(), drawn.triangles,
                                      drawn.batches},
                                     hostBatches, mapOptions, times);
                }
                state.serversOnBackend.set(state.servers);
                ShadeSamples shading = prepareShading(state, options);
                shading.clusters = one.clusters.view();
                shading.lists = one.lists.view();
                {
                    const StageTimer timer(state.backend, times, "shading");
                    shade(state, shading);
                }
                times.settle();
                if (repeat < 0)
                    continue;
                (route == Route::kRays ? raysMs : mapMs).push_back(times.totalMs());
            }
        costs.maps.push_back({map.light, map.octave, median(raysMs), median(mapMs)});
    }
    return costs;
}

double servingMs(const StageTimes& stages) {
    double sum = stages.stageMs("shading");
    for (const char* stage : kShadowMapStages)
        sum += stages.stageMs(stage);
    return sum;
}

void scaleToFrame(FrameRenderer& renderer, const Camera& camera, const FrameOptions& options,
                  int repeats, FrameCosts& costs, const std::function<void()>& beforeStage) {
    FrameOptions alone = options;
    alone.recordPairs = false;
    alone.routeMargin = 0;
    alone.maps.useStaticOptimization = false;
    const std::unique_ptr<CostModel> rays = makeCostModel("texels:inf"),
                                     maps = makeCostModel("texels:0");
    std::vector<double> raysMs, mapsMs;
    for (int repeat = 0; repeat < repeats; ++repeat) { // in turn, so that both see the same noise
        renderer.reset();
        raysMs.push_back(servingMs(renderer.render(camera, *rays, alone, beforeStage).stages));
        renderer.reset();
        FrameResult drawn = renderer.render(camera, *maps, alone, beforeStage);
        if (drawn.counts.listRerunCount > 0) { // lists were as long as those of a map alone
            renderer.reset();
            drawn = renderer.render(camera, *maps, alone, beforeStage);
        }
        mapsMs.push_back(servingMs(drawn.stages));
        costs.degradeDivisor = drawn.counts.maps.degradeDivisor;
    }
    renderer.reset();
    scaleCosts(costs, median(raysMs), median(mapsMs));
}

void scaleCosts(FrameCosts& costs, double raysMs, double mapsMs) {
    const auto scale = [&](double MapCost::*cost, double frameMs) {
        double sum = 0;
        for (const MapCost& map : costs.maps)
            sum += map.*cost;
        const double factor = sum > 0 ? frameMs / sum : 1;
        for (MapCost& map : costs.maps)
            map.*cost *= factor;
        return factor;
    };
    costs.raysScale = scale(&MapCost::raysMs, raysMs);
    costs.mapsScale = scale(&MapCost::mapMs, mapsMs);
}

} // namespace shadowdag
