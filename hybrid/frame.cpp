// SPDX-License-Identifier: Apache-2.0
// The frame: the method, step by step. What each step does stands in the header of its pass.
#include "hybrid/frame.h"

#include "hybrid/frame/frame_state.h"

namespace shadowdag {

struct FrameRenderer::State : FrameState {
    using FrameState::FrameState;
};

namespace {

// With OpenGL the passes of the CPU copy nothing.
HostCopyCounts copiesSoFar(const FrameState& state) {
    return state.gl ? glCopyCounts() : hostCopyCounts();
}

} // namespace

FrameResult FrameRenderer::render(const Camera& camera, const CostModel& model,
                                  const FrameOptions& asked,
                                  const std::function<void()>& beforeStage) {
    State& state = *state_;
    const Backend backend = state.backend;
    checkOptions(state, asked);
    const FrameOptions options = state.followed(asked);
    const auto current = state.makeCurrent();
    FrameResult result;
    StageTimes& stages = result.stages;
    stages.beforeStage = result.counting.beforeStage = beforeStage;
    const HostCopyCounts before = copiesSoFar(state);

    // G-buffer -> clusters -> (cluster, light) pairs -> required resolution of every map.
    const ViewRays view = makeViewRays(camera, options.width, options.height);
    gatherFrame(state, view, options, stages);

    // The cost model routes each map: rays or pages.
    {
        const StageTimer timer(backend, stages, "routing");
        result.maps = describeMaps(state, options);
        countQuantities(state, options, model.counts(), result.maps, result.counting);
        const std::vector<Route> routes =
            model.route(quantitiesOf(result.maps), options.routeMargin);
        for (size_t i = 0; i < routes.size(); ++i)
            result.maps[i].route = routes[i];
    }

    // Page masks -> pool -> cull batches -> rasterize, for the maps that are drawn.
    buildMaps(state, result.maps, options, stages);

    // One pass shades with both: rays through the DAG, lookups in the maps.
    ShadeSamples shading = prepareShading(state, options);
    {
        const StageTimer timer(backend, stages, "shading");
        if (options.reorderLights)
            shading.lists = orderLights(backend, shading.lists, state.scene.lightBvh(),
                                        shading.lights.count, state.orderedLights);
        shade(state, shading);
    }

    // For reports, outside of the frame's time.
    stages.settle();
    result.counting.settle();
    const HostCopyCounts after = copiesSoFar(state);
    result.counts.hostCopies = {after.uploadCount - before.uploadCount,
                                after.readbackCount - before.readbackCount};
    const std::vector<uint32_t> records = state.lists.record.download();
    countFrame(state, records, result);
    if (backend == Backend::kCuda)
        result.counts.unsplitTriangleCount = state.gbuffer.large.grow();
    result.counts.listRerunCount = state.listRerunCount + result.counts.maps.listRerunCount;
    if (options.recordQuantities)
        countQuantities(state, options, kCountsAll & ~model.counts(), result.maps, result.counting);
    result.counting.settle();
    result.color = state.color.download();
    shading.lists = state.lists.view(); // pairs are recorded ascending
    if (options.recordPairs) {
        if (beforeStage)
            beforeStage();
        recordPairs(state, shading, records, result);
    }
    holdMaps(state, result.maps); // last: a frame that is given up holds nothing
    stages.beforeStage = result.counting.beforeStage = nullptr;
    return result;
}

PairList FrameRenderer::listPairs(const Camera& camera, const FrameOptions& options) {
    checkOptions(*state_, options);
    const auto current = state_->makeCurrent();
    StageTimes stages;
    gatherFrame(*state_, makeViewRays(camera, options.width, options.height), options, stages);
    return findPairs(*state_);
}

FrameCosts FrameRenderer::measureCosts(const Camera& camera, const FrameOptions& asked, int repeats,
                                       const std::function<void()>& beforeStage) {
    checkOptions(*state_, asked);
    const FrameOptions options = state_->followed(asked);
    const auto current = state_->makeCurrent();
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
                                       StageTimes* ofLevels) {
    StageTimes stages;
    state_->scene.update(movedInstances, stages, ofLevels != nullptr ? *ofLevels : stages);
    stages.settle();
    if (ofLevels != nullptr)
        ofLevels->settle();
    return stages;
}

void FrameRenderer::guessLengths(bool isOn, size_t spare) {
    state_->guessLengths(isOn, spare);
}

void FrameRenderer::reset() {
    state_->heldFaceTexels.clear();
    state_->heldRoutes.clear();
    for (SphereCount& sphere : state_->spheres)
        if (sphere.hasMoved)
            sphere.rangeWorld = -1; // what a light that moves costs is paid every frame
    state_->maps.forget();
}

GBufferView FrameRenderer::gbuffer() const {
    return hostGBuffer(*state_);
}

MoverView FrameRenderer::movers() const {
    return state_->scene.hostMovers();
}

ExactView FrameRenderer::exact() const {
    return state_->scene.hostExact();
}

void FrameRenderer::prepareExact() {
    if (state_->scene.hasDag())
        state_->scene.prepareExact();
}

uint64_t FrameRenderer::exactBytes() const {
    return exact().tree.words.count * sizeof(uint32_t);
}

ShadowMapView FrameRenderer::shadowMaps() const {
    return hostShadowMaps(*state_);
}

ClusterView FrameRenderer::clusters() const {
    return hostClusters(*state_);
}

ClusterLightsView FrameRenderer::clusterLights() const {
    return hostClusterLights(*state_);
}

View<const float> FrameRenderer::wantedSquared() const {
    return hostWantedSquared(*state_);
}

View<const uint32_t> FrameRenderer::projectionMaps() const {
    return hostProjectionMaps(*state_);
}

RayInputs FrameRenderer::rayInputs(const RayOptions& options) const {
    FrameScene& scene = state_->scene;
    return {options.lod == LodRule::kCoverage ? scene.hostCoveredDag() : scene.hostDag(), options,
            scene.hostMovers(), exact(), hostRayDetail(*state_)};
}

uint64_t FrameRenderer::dagBytes() const {
    const DagView dag = state_->scene.dag();
    return (dag.wide.words.empty() ? dag.words.count : dag.wide.words.count) * sizeof(uint32_t);
}

} // namespace shadowdag
