// SPDX-License-Identifier: Apache-2.0
// The first half of a frame, up to what the host makes routes of: G-buffer, clusters, their lights,
// what these ask for. On CUDA by guessed lengths (cuda/list_length.h), so that nobody waits before.
#include "hybrid/frame/frame_state.h"

namespace shadowdag {

namespace {

void prunePairs(FrameState& state, const FrameOptions& options) {
    FrameScene& scene = state.scene;
    const PruneFacing work{state.gbuffer.view(), state.clusters.view(), state.lists.view(),
                           scene.lights(), state.lists.record.view()};
    pruneFacing(state.backend, work);
    if (options.pruning != PairPruning::kLit)
        return;
    if (!scene.hasDag())
        throw Error(ErrorKind::kUsage, "proofs of light need a voxel DAG; voxelize the scene, or "
                                       "prune by facing alone");
    if (state.backend != Backend::kCpu)
        throw Error(ErrorKind::kUsage,
                    "proofs of light run on the CPU alone; use --backend cpu, or prune by facing");
    pruneLit(work, {scene.dag(), options.rays, scene.movers(), ExactView{}, state.detail});
}

/// Gathers from the G-buffer on, once, and fetches what the host needs of it.
/// @param clusterGuess,clusterLightGuess the lists' lengths; both 0: asks for them
void gatherLists(FrameState& state, const ViewRays& view, const FrameOptions& options,
                 size_t clusterGuess, size_t clusterLightGuess, StageTimes& stages) {
    const Backend backend = state.backend;
    const FrameScene& scene = state.scene;
    View<const uint32_t> clusterCount;
    {
        const StageTimer timer(backend, stages, "clusters");
        clusterCount = buildClusters(backend, state.gbuffer.view(), view, options.clusterBounds,
                                     state.clusters, options.normalClusters, clusterGuess);
    }
    bool isGuessed = false;
    {
        const StageTimer timer(backend, stages, "light assignment");
        isGuessed = assignLights(backend, state.clusters.boxesWorld.view(), scene.lightBvh(),
                                 scene.lights(), state.lists, state.clusters.view().normals,
                                 clusterLightGuess);
    }
    if (options.pruning != PairPruning::kNone) {
        const StageTimer timer(backend, stages, "pair pruning");
        prunePairs(state, options);
    }
    const StageTimer timer(backend, stages, "resolution");
    gatherDemand(backend, state.clusters.view(), state.lists, scene.lights(), view,
                 options.undersample, options.mapsPerLight, state.demand, options.resolutionRule,
                 state.gbuffer.view());
    if (clusterGuess > 0) {
        const size_t last = state.clusters.cell.size();
        const auto at = [&](const Buffer<uint32_t>& of) {
            return View<const uint32_t>{of.view().data + last, 1};
        };
        noteLengths(backend,
                    {clusterCount, at(state.clusters.sampleStart),
                     isGuessed ? std::as_const(state.lists.length).view() : at(state.lists.start),
                     state.demand.lengths()});
    }
    state.ofMaps = state.demand.ofMaps.download();
}

/// Takes the room to spare off the lists. Returns false when one of them had too little.
bool trimLists(FrameState& state) {
    const uint32_t* const lengths = state.ofMaps.data() + 3 * state.demand.slotCount();
    const size_t clusters = lengths[kClusterLength], samples = lengths[kSampleLength],
                 clusterLights = lengths[kClusterLightLength];
    if (clusters > state.clusters.cell.size() || clusterLights > state.lists.lights.size())
        return false;
    trimClusters(clusters, samples, state.clusters);
    trimLights(clusters, clusterLights, state.lists);
    state.demand.wantedSquared.resize(clusterLights);
    return true;
}

} // namespace

void gatherFrame(FrameState& state, const ViewRays& view, const FrameOptions& options,
                 StageTimes& stages) {
    const Backend backend = state.backend;
    const FrameScene& scene = state.scene;
    {
        const StageTimer timer(backend, stages, "g-buffer");
        if (state.gl)
            state.gl->scene().gbuffer().draw(scene.triangles(), scene.batches(), view,
                                             state.gbuffer);
        else
            drawGBuffer(backend, scene.triangles(), scene.batches(), view, state.gbuffer);
    }
    // Normals are parted by lengths that are asked for; the host then waits anyway.
    const bool mayGuess = state.isGuessing && options.normalClusters == 0 &&
                          state.clusterGuess.get() > 0 && state.clusterLightGuess.get() > 0;
    if (mayGuess)
        gatherLists(state, view, options, state.clusterGuess.get(), state.clusterLightGuess.get(),
                    stages);
    const bool isTooShort = mayGuess && !trimLists(state);
    if (!mayGuess || isTooShort)
        gatherLists(state, view, options, 0, 0, stages);
    state.listRerunCount = isTooShort;
    state.clusterGuess.note(state.clusters.cell.size());
    state.clusterLightGuess.note(state.lists.lights.size());
    state.detail = {view.origin, view.forward, view.pixelSize,
                    state.demand.resolutionSquaredBits.view()};
}

} // namespace shadowdag
