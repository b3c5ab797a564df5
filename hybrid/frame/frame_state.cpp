// SPDX-License-Identifier: Apache-2.0
// Options, shading inputs, recording, counts and host copies of a frame.
#include "hybrid/frame/frame_state.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

namespace shadowdag {

namespace {

void check(bool ok, const std::string& what) {
    if (!ok)
        throw Error(ErrorKind::kUsage, what);
}

uint64_t sum(const Buffer<uint32_t>& counts) {
    const std::vector<uint32_t> host = counts.download();
    return std::accumulate(host.begin(), host.end(), uint64_t(0));
}

template <class T>
View<const T> copyToHost(Backend backend, View<const T> from, std::vector<T>& to) {
    if (backend == Backend::kCpu)
        return from;
    to.resize(from.count);
    detail::copyBytes(Backend::kCpu, to.data(), backend, from.data, from.count * sizeof(T));
    return viewOf(to);
}

} // namespace

FrameState::FrameState(Backend backend, const World& world, const Dag& dag,
                       const BatchOptions& batchOptions)
    : FrameState(std::make_shared<FrameScene>(backend, world, dag, batchOptions)) {}

FrameState::FrameState(std::shared_ptr<FrameScene> ofScene)
    : backend(ofScene->backend()), sharedScene(std::move(ofScene)), scene(*sharedScene),
      gl(scene.gl() ? std::make_unique<GlFrame>(*scene.gl()) : nullptr), movedBatches(scene),
      gbuffer(backend), clusters(backend), lists(backend), orderedLights(backend), demand(backend),
      receivers(backend), maps(backend, gl ? &gl->maps() : nullptr), routing(backend),
      color(backend, "colour"), rayCount(backend, "ray counts"),
      lookupCount(backend, "lookup counts"), provenCount(backend, "proven pair counts"),
      missingTapCount(backend, "missing tap counts"), moverTestCount(backend, "mover test counts"),
      pairs(backend), nextPair(backend, "pair cursor"), pairVisibility(backend, "pair visibility"),
      pairServer(backend, "pair servers"), serversOnBackend(backend, "servers of maps") {
    guessLengths(backend == Backend::kCuda);
}

void FrameState::guessLengths(bool isOn, size_t spare) {
    isGuessing = isOn;
    clusterGuess.forget(spare);
    clusterLightGuess.forget(spare);
    maps.guessLengths(isOn, spare);
}

void checkOptions(const FrameState& state, const FrameOptions& options) {
    if (state.gl)
        checkGlOptions(options, state.gl->scene().context().info());
    check(std::isfinite(options.undersample) && options.undersample > 0.0f,
          "undersampling divisor " + std::to_string(options.undersample) +
              "; use a number above 0, 1 for none");
    check(options.maxFaceTexels >= 1 && options.maxFaceTexels <= kMaxFaceTexels,
          "largest face resolution " + std::to_string(options.maxFaceTexels) + "; use 1 to " +
              std::to_string(kMaxFaceTexels) + " texels");
    check(options.minFaceTexels >= 1 && options.minFaceTexels <= options.maxFaceTexels,
          "least face resolution " + std::to_string(options.minFaceTexels) +
              "; use 1 to the largest, " + std::to_string(options.maxFaceTexels) + " texels");
    check(options.mapsPerLight >= 1 && options.mapsPerLight <= kMaxMapsPerLight,
          std::to_string(options.mapsPerLight) + " shadow maps a light; use 1 to " +
              std::to_string(kMaxMapsPerLight));
    check(options.normalClusters <= kMaxNormalCellsPerEdge,
          "normal clustering by " + std::to_string(options.normalClusters) +
              " cells an edge; use 0 for none to " + std::to_string(kMaxNormalCellsPerEdge));
    check(options.pruning != PairPruning::kLit ||
              (options.rays.level == 0 && options.rays.lod == LodRule::kFixed),
          "proofs of light hold for voxel rays of level 0; use no other level of detail with them");
    check(options.bias.taps <= options.maps.taps,
          "lookups with " + std::to_string(options.bias.taps) + " taps in maps marked for " +
              std::to_string(options.maps.taps) +
              " would read pages without memory; give the maps as many taps");
    check(std::isfinite(options.routeMargin) && options.routeMargin >= 0.0f,
          "margin of routing " + std::to_string(options.routeMargin) +
              "; use a number >= 0, 0 to route every frame anew");
    check(std::isfinite(options.rays.offset) && options.rays.offset >= 0.0f,
          "ray offset " + std::to_string(options.rays.offset) + "; use a number >= 0");
    check(options.rays.lod == LodRule::kFixed || options.rays.level == 0,
          "level of detail " + std::to_string(options.rays.level) +
              " and one by footprint contradict each other; use level 0 with footprints");
    check(std::isfinite(options.rays.footprintScale) && options.rays.footprintScale > 0.0f,
          "footprint scale " + std::to_string(options.rays.footprintScale) +
              "; use a number above 0, 1 for the pixel's");
    check(options.rays.coverage > 0.0f && options.rays.coverage <= 1.0f,
          "coverage " + std::to_string(options.rays.coverage) +
              "; use a share above 0, at most 1 (footprint is what counts every voxel)");
}

ShadeSamples prepareShading(FrameState& state, const FrameOptions& options) {
    state.color.resize(state.gbuffer.view().count());
    for (Buffer<uint32_t>* counts : {&state.rayCount, &state.lookupCount, &state.provenCount,
                                     &state.missingTapCount, &state.moverTestCount}) {
        counts->resize(state.clusters.cell.size());
        counts->fill(0);
    }
    const bool isExact = options.rays.kind == RayKind::kExact;
    if (isExact)
        state.scene.prepareExact();
    FrameScene& scene = state.scene;
    check(options.rays.level <= scene.dag().grid.resolutionLog2,
          "level of detail " + std::to_string(options.rays.level) + " of a voxel DAG of " +
              std::to_string(scene.dag().grid.resolutionLog2) + " levels; use at most as many");
    return {state.gbuffer.view(),
            scene.triangleMaterial(),
            scene.materials(),
            state.clusters.view(),
            state.lists.view(),
            scene.lights(),
            state.serversOnBackend.view(),
            VisibilityInputs{
                RayInputs{options.rays.lod == LodRule::kCoverage ? scene.coveredDag() : scene.dag(),
                          options.rays, scene.movers(), isExact ? scene.exact() : ExactView{},
                          state.detail},
                state.maps.view(), options.bias},
            state.color.view(),
            state.rayCount.view(),
            state.lookupCount.view(),
            state.provenCount.view(),
            state.missingTapCount.view(),
            state.moverTestCount.view(),
            {}};
}

namespace {

/// Clusters and their lists of lights on the host.
struct HostLists {
    explicit HostLists(const FrameState& state)
        : sampleStart(state.clusters.sampleStart.download()),
          samples(state.clusters.samples.download()), lightStart(state.lists.start.download()),
          lights(state.lists.lights.download()), lightCount(state.scene.world().lights().size()) {}

    std::vector<uint32_t> sampleStart, samples, lightStart, lights;
    size_t lightCount; ///< of the world
};

/// Counts the traced pairs by whether their light lights its cluster wholly, not at all, in part.
void countWholeClusters(const HostLists& lists, FrameResult& result) {
    const auto& [sampleStart, samples, lightStart, lights, lightCount] = lists;
    std::vector<uint64_t> lit(lightCount, 0), dark = lit;
    FrameCounts& counts = result.counts;
    for (size_t c = 0; c + 1 < sampleStart.size(); ++c) {
        for (uint32_t i = sampleStart[c]; i < sampleStart[c + 1]; ++i)
            for (uint64_t p = result.pairs.sampleStart[samples[i]];
                 p < result.pairs.sampleStart[samples[i] + 1]; ++p)
                if (result.pairRoute[p] == Route::kRays)
                    ++(result.visibility[p] < kHalfLit ? dark : lit)[result.pairs.light[p]];
        for (uint32_t l = lightStart[c]; l < lightStart[c + 1]; ++l) {
            uint64_t &ofLit = lit[lights[l]], &ofDark = dark[lights[l]];
            (ofDark == 0  ? counts.wholeLitPairCount
             : ofLit == 0 ? counts.wholeDarkPairCount
                          : counts.mixedPairCount) += ofLit + ofDark;
            ofLit = ofDark = 0;
        }
    }
}

/// Counts the pairs of every map; those that are proven lit belong to none.
void countPairsOfMaps(const HostLists& lists, const std::vector<uint32_t>& records,
                      FrameResult& result) {
    const auto& [sampleStart, samples, lightStart, lights, lightCount] = lists;
    std::vector<uint32_t> recordOfLight(lightCount, kProvenLit);
    for (size_t c = 0; c + 1 < sampleStart.size(); ++c) {
        for (uint32_t l = lightStart[c]; l < lightStart[c + 1]; ++l)
            recordOfLight[lights[l]] = records[l];
        for (uint32_t i = sampleStart[c]; i < sampleStart[c + 1]; ++i)
            for (uint64_t p = result.pairs.sampleStart[samples[i]];
                 p < result.pairs.sampleStart[samples[i] + 1]; ++p) {
                const uint32_t by = recordOfLight[result.pairs.light[p]];
                if (by != kProvenLit)
                    ++result.maps[by].pairCount;
            }
    }
}

} // namespace

void shade(FrameState& state, const ShadeSamples& shading) {
    if (state.gl) {
        state.gl->scene().shading().shade(shading, state.gl->maps(),
                                          std::as_const(state.pairs.light).view());
        return;
    }
    shadeUnlit(state.backend, shading);
    shadeLights(state.backend, shading);
}

PairList findPairs(FrameState& state) {
    listPairs(state.backend, state.gbuffer.view(), state.clusters.view(), state.lists.view(),
              state.scene.lights(), state.pairs);
    PairList pairs;
    const std::vector<uint32_t> start = state.pairs.start.download();
    pairs.sampleStart.assign(start.begin(), start.end());
    pairs.light = state.pairs.light.download();
    return pairs;
}

void recordPairs(FrameState& state, const ShadeSamples& shading,
                 const std::vector<uint32_t>& records, FrameResult& result) {
    result.pairs = findPairs(state);
    state.nextPair.upload(state.pairs.start.download());
    state.pairVisibility.resize(result.pairs.count());
    state.pairServer.resize(result.pairs.count());
    ShadeSamples recording = shading;
    recording.recorder = {state.nextPair.view(), state.pairVisibility.view(),
                          state.pairServer.view()};
    shade(state, recording);
    result.visibility = state.pairVisibility.download();
    result.pairServer = state.pairServer.download();
    result.pairRoute.clear();
    result.pairRoute.reserve(result.pairServer.size());
    for (const PairServer& server : result.pairServer)
        result.pairRoute.push_back(server.isMap() ? Route::kMap : Route::kRays);
    const HostLists lists(state);
    countPairsOfMaps(lists, records, result);
    countWholeClusters(lists, result);
}

void countFrame(const FrameState& state, const std::vector<uint32_t>& records,
                FrameResult& result) {
    FrameCounts& counts = result.counts;
    counts.sampleCount = state.clusters.samples.size();
    counts.clusterCount = state.clusters.cell.size();
    counts.clusterLightCount = state.lists.lights.size();
    for (const uint32_t record : records)
        counts.prunedClusterLightCount += record == kProvenLit;
    counts.rayCount = sum(state.rayCount);
    counts.lookupCount = sum(state.lookupCount);
    counts.provenPairCount = sum(state.provenCount);
    counts.pairCount = counts.rayCount + counts.lookupCount + counts.provenPairCount;
    counts.missingTapCount = sum(state.missingTapCount);
    counts.moverTestCount = sum(state.moverTestCount);
    std::vector<uint8_t> served(state.scene.world().lights().size(), 0); // bit 0: rays, 1: maps
    for (const MapRecord& map : result.maps) {
        const bool isTraced = map.route == Route::kRays;
        ++(isTraced ? counts.tracedMapCount : counts.drawnMapCount);
        served[map.quantities.light] |= isTraced ? 1 : 2;
    }
    for (const uint8_t by : served) {
        counts.tracedLightCount += by & 1;
        counts.mappedLightCount += by >> 1;
    }
    counts.maps = state.maps.counts();
}

GBufferView hostGBuffer(FrameState& state) {
    const GBufferView view = state.gbuffer.view();
    FrameState::HostCopies& host = state.host;
    return {copyToHost(state.backend, view.positionWorld, host.positionWorld),
            copyToHost(state.backend, view.normalWorld, host.normalWorld),
            copyToHost(state.backend, view.depthView, host.depthView),
            copyToHost(state.backend, view.triangle, host.triangle),
            view.width,
            view.height};
}

ClusterView hostClusters(FrameState& state) {
    const ClusterView view = state.clusters.view();
    FrameState::HostCopies& host = state.host;
    return {copyToHost(state.backend, view.cell, host.cell),
            copyToHost(state.backend, view.boxesWorld, host.boxesWorld),
            copyToHost(state.backend, view.sampleStart, host.sampleStart),
            copyToHost(state.backend, view.samples, host.samples),
            copyToHost(state.backend, view.clusterOfSample, host.clusterOfSample),
            {copyToHost(state.backend, view.normals.cells, host.normalCell), view.normals.k}};
}

ClusterLightsView hostClusterLights(FrameState& state) {
    const ClusterLightsView view = state.lists.view();
    FrameState::HostCopies& host = state.host;
    return {copyToHost(state.backend, view.start, host.lightStart),
            copyToHost(state.backend, view.lights, host.lights),
            copyToHost(state.backend, view.record, host.record)};
}

View<const float> hostWantedSquared(FrameState& state) {
    return copyToHost(state.backend, std::as_const(state.demand.wantedSquared).view(),
                      state.host.wantedSquared);
}

View<const uint32_t> hostProjectionMaps(FrameState& state) {
    return copyToHost(state.backend, state.maps.projectionMaps(), state.host.projection);
}

RayDetail hostRayDetail(FrameState& state) {
    RayDetail detail = state.detail;
    detail.resolutionSquaredBits =
        copyToHost(state.backend, detail.resolutionSquaredBits, state.host.resolutionSquaredBits);
    return detail;
}

ShadowMapView hostShadowMaps(FrameState& state) {
    const ShadowMapView view = state.maps.view();
    FrameState::HostCopies& host = state.host;
    if (state.gl) {
        const auto current = state.makeCurrent();
        host.depths = state.gl->maps().downloadDepths();
        return {view.maps, view.pageTable, viewOf(std::as_const(host.depths)), view.pageTexelsLog2};
    }
    return {copyToHost(state.backend, view.maps, host.maps),
            copyToHost(state.backend, view.pageTable, host.pageTable),
            copyToHost(state.backend, view.depths, host.depths), view.pageTexelsLog2};
}

} // namespace shadowdag
