// SPDX-License-Identifier: Apache-2.0
// Costs of maps: every map of a frame is measured alone, by each method, and scaled to whole
// frames.
#include "cuda/statistics.h"
#include "hybrid/frame/frame_state.h"

#include <algorithm>
#include <limits>
#include <memory>
#include <utility>

namespace shadowdag {

namespace {

// The clusters of one map alone, so that shading the others costs nothing.
struct OneMap {
    explicit OneMap(Backend backend) : clusters(backend), lists(backend) {}

    ClusterSet clusters; ///< sampleStart, samples and clusterOfSample only
    ClusterLights lists;
};

// The frame's clusters and lists on the host.
struct HostLists {
    HostLists(const FrameClusters& clusters, size_t recordCount)
        : sampleStart(clusters.clusters().sampleStart.download()),
          samples(clusters.clusters().samples.download()), clustersOfRecord(recordCount) {
        const std::vector<uint32_t> start = clusters.lights().start.download();
        const std::vector<uint32_t> records = clusters.lights().record.download();
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
    if (!state.context.scene.canTrace(options.rays))
        throw Error(ErrorKind::kUsage, "costs of rays cannot be measured without a voxel DAG; "
                                       "voxelize the scene first");
    StageTimes ignored;
    state.gather(view, options, ignored);
    const std::vector<MapRecord> records = state.routing.describe(state.clusters, options);
    const HostLists host(state.clusters, records.size());
    const World& world = state.context.scene.world();
    const bool isGuessing = state.clusters.isGuessing();
    OneMap one(state.context.backend);
    // Cold: the full cost of a map, not that of its remaining work.
    const bool isWarm = options.start == FrameStart::kWarm;
    FrameOptions aloneOptions = options;
    aloneOptions.maps.useStaticOptimization = isWarm && options.maps.useStaticOptimization;
    aloneOptions.makeAllBeams = true; // by the uncounted repeats, in which cells are divided
    const bool keepsBeams = isWarm && options.rays.keepsBeams();
    if (!isWarm)
        aloneOptions.rays.beamBytes = 0;
    Buffer<MapReceiver> receivers(state.context.backend, "isolated map receivers");
    FrameCosts costs;

    for (uint32_t r = 0; r < records.size(); ++r) {
        const MapQuantities& map = records[r].quantities;
        isolate(host, r, map.light, state.surface.view().count(), one);
        const MapRequest request = requestOf(world.lights(), records[r]);
        std::vector<MapReceiver> hostReceivers;
        for (const uint32_t cluster : host.clustersOfRecord[r])
            hostReceivers.push_back({cluster, 0});
        receivers.upload(hostReceivers);

        // Guessed lengths are those of the map before, so they are released and found again by a
        // build that does not count; otherwise a map's cost would depend on the order of
        // measurement.
        if (isGuessing)
            state.maps.maps().guessLengths(true);
        std::vector<double> raysMs, mapMs;
        for (int repeat = keepsBeams             ? -3
                          : isGuessing || isWarm ? -1
                                                 : 0;
             repeat < repeats; ++repeat)
            for (const Route route : {Route::kRays, Route::kMap}) {
                StageTimes times;
                times.beforeStage = beforeStage;
                if (route == Route::kMap)
                    state.maps.buildAlone(state.surface, state.clusters, request,
                                          std::as_const(receivers).view(), aloneOptions, times);
                state.maps.setServers(
                    {route == Route::kMap ? PairServer::drawnMap(0) : PairServer::rays()});
                ShadeSamples shading = state.prepareShading(aloneOptions);
                shading.clusters = one.clusters.view();
                shading.lists = one.lists.view();
                {
                    const StageTimer timer(state.context.backend, times, "shading");
                    state.shading.beginBeams(view, aloneOptions, shading);
                    state.shading.shade(shading);
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
    alone.maps.useStaticOptimization =
        options.start == FrameStart::kWarm && options.maps.useStaticOptimization;
    const std::unique_ptr<CostModel> rays = makeCostModel("texels:inf"),
                                     maps = makeCostModel("texels:0");
    const auto timeOf = [&](const CostModel& model) {
        return servingMs(renderFrom(renderer, camera, model, alone, beforeStage).stages);
    };
    std::vector<double> raysMs, mapsMs;
    std::vector<float> requests;
    for (int repeat = 0; repeat < repeats;
         ++repeat) { // alternately, so that both have the same noise
        raysMs.push_back(timeOf(*rays));
        const FrameResult drawn = renderFrom(renderer, camera, *maps, alone, beforeStage);
        mapsMs.push_back(servingMs(drawn.stages));
        costs.degradeDivisor = drawn.counts.maps.degradeDivisor;
        requests.clear();
        for (const MapRecord& map : drawn.maps)
            requests.push_back(map.quantities.texels);
    }
    scaleCosts(costs, median(raysMs), median(mapsMs));
    std::vector<std::unique_ptr<CostModel>> models;
    models.push_back(makeCostModel("oracle"));
    costs.wholeFrameTexels.reset();
    models.front()->setCosts(costs);
    const std::vector<float> thresholds = thresholdsBetween(requests);
    for (const float threshold : thresholds)
        models.push_back(makeTexelModel(threshold));
    std::vector<std::vector<double>> times(models.size());
    for (int repeat = 0; repeat < repeats; ++repeat)
        for (size_t i = 0; i < models.size(); ++i)
            times[i].push_back(timeOf(*models[i]));
    renderer.reset();
    std::vector<ThresholdTime> whole{{std::numeric_limits<float>::infinity(), median(raysMs)},
                                     {0.0f, median(mapsMs)}};
    for (size_t i = 0; i < thresholds.size(); ++i)
        whole.push_back({thresholds[i], median(times[i + 1])});
    takeWholeFrame(costs, whole, median(times.front()));
}

void takeWholeFrame(FrameCosts& costs, const std::vector<ThresholdTime>& thresholds,
                    double cheaperMs) {
    costs.wholeFrameTexels.reset();
    double leastMs = cheaperMs;
    for (const ThresholdTime& threshold : thresholds)
        if (threshold.timeMs < leastMs) {
            leastMs = threshold.timeMs;
            costs.wholeFrameTexels = threshold.texels;
        }
}

std::vector<float> thresholdsBetween(std::vector<float> requests) {
    constexpr size_t kMost = 6;
    std::sort(requests.begin(), requests.end());
    requests.erase(std::unique(requests.begin(), requests.end()), requests.end());
    // What is less than a threshold is traced: each of the others is one.
    std::vector<float> thresholds;
    for (size_t k = 1; k <= kMost && requests.size() > 1; ++k) {
        const size_t next = std::max<size_t>(k * requests.size() / (kMost + 1), 1);
        if (thresholds.empty() || requests[next] > thresholds.back())
            thresholds.push_back(requests[next]);
    }
    return thresholds;
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
