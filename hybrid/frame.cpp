// SPDX-License-Identifier: Apache-2.0
// The frame: the method, step by step. Each step is described in the header of its pass.
#include "hybrid/frame.h"

#include "cuda/mutant.h"
#include "hybrid/frame/frame_state.h"

#include <chrono>

namespace shadowdag {

struct FrameRenderer::State : FrameState {
    using FrameState::FrameState;
};

FrameResult FrameRenderer::render(const Camera& camera, const CostModel& model,
                                  const FrameOptions& asked,
                                  const std::function<void()>& beforeStage) {
    const auto start = std::chrono::steady_clock::now();
    State& state = *state_;
    const Backend backend = state.context.backend;
    const FrameOptions options = state.accept(asked);
    const auto current = state.device->makeCurrent();
    FrameResult result;
    StageTimes& stages = result.stages;
    stages.beforeStage = result.counting.beforeStage = beforeStage;
    const HostCopyCounts before = state.device->copyCounts();

    // G-buffer -> clusters -> (cluster, light) pairs -> required resolution of every map.
    ViewRays view = makeViewRays(camera, options.width, options.height);
    view.first = mutated(Mutant::kSampleMoved, view.first, view.first + view.stepX);
    state.gather(view, options, stages);

    // The cost model routes each map: rays or pages.
    const auto countQuantities = [&](uint32_t counts) {
        state.routing.count(state.surface, state.clusters, options, counts, result.maps,
                            result.counting);
    };
    {
        const StageTimer timer(backend, stages, "routing");
        result.maps = state.routing.describe(state.clusters, options);
        countQuantities(model.counts());
        const std::vector<Route> routes =
            model.route(quantitiesOf(result.maps), options.routeMargin);
        for (size_t i = 0; i < routes.size(); ++i)
            result.maps[i].route = routes[i];
    }

    // Page masks -> pool -> cull batches -> rasterize, for the maps that are drawn.
    state.maps.build(state.surface, state.clusters, result.maps, options, stages);

    // One pass shades with both: rays through the DAG, lookups in the maps.
    ShadeSamples shading = state.prepareShading(options);
    {
        const StageTimer timer(backend, stages, "shading");
        if (options.reorderLights)
            shading.lists = state.clusters.orderedLists();
        state.shading.beginBeams(view, options, shading);
        state.shading.shade(shading);
    }

    if (backend == Backend::kCuda)
        QueueMark().wait();
    result.wallMs =
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
    // For reports, not part of the frame's time.
    stages.settle();
    result.counting.settle();
    const HostCopyCounts after = state.device->copyCounts();
    result.counts.hostCopies = {after.uploadCount - before.uploadCount,
                                after.readbackCount - before.readbackCount};
    const std::vector<uint32_t> records = state.clusters.lights().record.download();
    if (options.recordQuantities)
        state.maps.maps().countSkipped();
    state.count(records, result);
    if (options.recordQuantities)
        countQuantities(kCountsAll & ~model.counts());
    result.counting.settle();
    result.color = state.shading.color().download();
    if (options.recordPairs) {
        if (beforeStage)
            beforeStage();
        shading.lists = state.clusters.lists(); // pairs are recorded ascending
        state.shading.recordPairs(state.surface, state.clusters, shading, records, result);
    }
    state.routing.hold(state.clusters,
                       result.maps); // last, so that a cancelled frame holds nothing
    stages.beforeStage = result.counting.beforeStage = nullptr;
    return result;
}

PairList FrameRenderer::listPairs(const Camera& camera, const FrameOptions& asked) {
    const FrameOptions options = state_->accept(asked);
    const auto current = state_->device->makeCurrent();
    StageTimes ignored;
    state_->gather(makeViewRays(camera, options.width, options.height), options, ignored);
    ignored.settle();
    return state_->shading.findPairs(state_->surface, state_->clusters);
}

FrameCosts FrameRenderer::measureCosts(const Camera& camera, const FrameOptions& asked, int repeats,
                                       const std::function<void()>& beforeStage) {
    const FrameOptions options = state_->accept(asked);
    const auto current = state_->device->makeCurrent();
    reset();
    try {
        FrameCosts costs =
            measureFrameCosts(*state_, makeViewRays(camera, options.width, options.height), options,
                              repeats, beforeStage);
        scaleToFrame(*this, camera, options, repeats, costs, beforeStage);
        return costs;
    } catch (...) {
        reset(); // the maps are those of one light alone
        throw;
    }
}

FrameRenderer::FrameRenderer(Backend backend, const World& world, const Dag& dag,
                             const BatchOptions& batchOptions)
    : state_(std::make_unique<State>(backend, world, dag, batchOptions)) {}

FrameRenderer::FrameRenderer(std::unique_ptr<State> state) : state_(std::move(state)) {}

FrameRenderer::~FrameRenderer() = default;

std::unique_ptr<FrameRenderer> FrameRenderer::shareScene() const {
    return std::unique_ptr<FrameRenderer>(
        new FrameRenderer(std::make_unique<State>(state_->sharedScene)));
}

StageTimes FrameRenderer::worldChanged(const std::vector<uint32_t>& movedInstances,
                                       StageTimes* ofLevels, StageTimes* ofRays) {
    StageTimes stages;
    queueWorldChange(movedInstances, stages, ofLevels ? *ofLevels : stages,
                     ofRays ? *ofRays : stages);
    for (StageTimes* times : {&stages, ofLevels, ofRays})
        if (times)
            times->settle();
    return stages;
}

void FrameRenderer::queueWorldChange(const std::vector<uint32_t>& movedInstances,
                                     StageTimes& stages, StageTimes& ofLevels, StageTimes& ofRays) {
    state_->sharedScene->update(movedInstances, stages, ofLevels, ofRays);
}

void FrameRenderer::guessLengths(bool isOn, size_t spare) {
    state_->guessLengths(isOn, spare);
}

void FrameRenderer::reset() {
    state_->forget();
}

GBufferView FrameRenderer::gbuffer() const {
    return state_->surface.hostView();
}

MoverView FrameRenderer::movers() const {
    return state_->sharedScene->hostMovers();
}

ExactView FrameRenderer::exact() const {
    return state_->sharedScene->hostExact();
}

void FrameRenderer::prepareExact() {
    state_->sharedScene->prepareExact();
}

uint64_t FrameRenderer::embreeBytes() const {
    return state_->sharedScene->embreeBytes();
}

uint64_t FrameRenderer::beamBytes() const {
    return state_->shading.beamBytes();
}

uint64_t FrameRenderer::exactBytes() const {
    return state_->sharedScene->exactBytes();
}

ShadowMapView FrameRenderer::shadowMaps() const {
    return state_->maps.hostView();
}

ClusterView FrameRenderer::clusters() const {
    return state_->clusters.hostView();
}

ClusterLightsView FrameRenderer::clusterLights() const {
    return state_->clusters.hostLists();
}

View<const float> FrameRenderer::wantedSquared() const {
    return state_->clusters.hostWantedSquared();
}

View<const uint32_t> FrameRenderer::projectionMaps() const {
    return state_->maps.hostProjectionMaps();
}

RayInputs FrameRenderer::rayInputs(const RayOptions& options) const {
    return state_->sharedScene->hostRayInputs(options, state_->clusters.hostRayDetail());
}

FrameResult renderFrom(FrameRenderer& renderer, const Camera& camera, const CostModel& model,
                       const FrameOptions& options, const std::function<void()>& beforeStage) {
    renderer.reset();
    if (options.start == FrameStart::kWarm) {
        FrameOptions before = options;
        before.recordPairs = before.recordQuantities = false;
        before.makeAllBeams = true;
        // Cells of surface are divided from frame to frame, so that beams are made in several.
        constexpr int kMostFrames = 8;
        for (int frame = 0; frame < kMostFrames; ++frame)
            if (renderer.render(camera, model, before, beforeStage).counts.beamMadeCount == 0)
                break;
    }
    return renderer.render(camera, model, options, beforeStage);
}

uint64_t FrameRenderer::dagBytes() const {
    const DagView dag = state_->sharedScene->dag();
    return (dag.wide.words.empty() ? dag.words.count : dag.wide.words.count) * sizeof(uint32_t);
}

} // namespace shadowdag
