// SPDX-License-Identifier: Apache-2.0
#include "hybrid/frame/frame_clusters.h"

#include "hybrid/clusters/prune_pass.h"
#include "hybrid/frame/host_copy.h"

#include <utility>

namespace shadowdag {

void FrameClusters::guessLengths(bool isOn, size_t spare) {
    isGuessing_ = isOn;
    clusterGuess_.forget(spare);
    clusterLightGuess_.forget(spare);
}

void FrameClusters::forgetLengths() {
    clusterGuess_.forget();
    clusterLightGuess_.forget();
}

void FrameClusters::prunePairs(const VisibleSurface& surface, const FrameOptions& options) {
    FrameScene& scene = context_.scene;
    const PruneFacing work{surface.view(), view(), lists(), scene.lights(), lights_.record.view()};
    pruneFacing(context_.backend, work);
    if (options.pruning != PairPruning::kLit)
        return;
    if (!scene.hasDag())
        throw Error(ErrorKind::kUsage, "proofs of light need a voxel DAG; voxelize the scene, or "
                                       "prune by facing alone");
    if (context_.backend != Backend::kCpu)
        throw Error(ErrorKind::kUsage,
                    "proofs of light run on the CPU alone; use --backend cpu, or prune by facing");
    pruneLit(work, {scene.dag(), options.rays, scene.movers(), ExactView{}, rayDetail_});
}

/// Gathers once, and fetches the results that the host needs.
/// @param clusterGuess,clusterLightGuess the lists' lengths; both 0: waits for them
void FrameClusters::gatherLists(const VisibleSurface& surface, const ViewRays& view,
                                const FrameOptions& options, size_t clusterGuess,
                                size_t clusterLightGuess, StageTimes& stages) {
    const Backend backend = context_.backend;
    const FrameScene& scene = context_.scene;
    View<const uint32_t> clusterCount;
    {
        const StageTimer timer(backend, stages, "clusters");
        clusterCount = buildClusters(backend, surface.view(), view, options.clusterBounds,
                                     clusters_, options.normalClusters, clusterGuess);
    }
    bool isGuessed = false;
    {
        const StageTimer timer(backend, stages, "light assignment");
        isGuessed =
            assignLights(backend, std::as_const(clusters_.boxesWorld).view(), scene.lightBvh(),
                         scene.lights(), lights_, clusters_.view().normals, clusterLightGuess);
    }
    if (options.pruning != PairPruning::kNone) {
        const StageTimer timer(backend, stages, "pair pruning");
        prunePairs(surface, options);
    }
    const StageTimer timer(backend, stages, "resolution");
    gatherDemand(backend, clusters_.view(), lights_, scene.lights(), view, options.undersample,
                 options.mapsPerLight, demand_, options.resolutionRule, surface.view());
    if (clusterGuess > 0) {
        const size_t last = clusters_.cell.size();
        const auto at = [&](const Buffer<uint32_t>& of) {
            return View<const uint32_t>{of.view().data + last, 1};
        };
        noteLengths(backend, {clusterCount, at(clusters_.sampleStart),
                              isGuessed ? std::as_const(lights_.length).view() : at(lights_.start),
                              demand_.lengths()});
    }
    readback_.request(std::as_const(demand_.ofMaps).view());
    const View<const uint32_t> read = readback_.wait();
    ofMaps_.assign(read.begin(), read.end());
}

/// Removes the unused entries of the lists. Returns false if one of them was too short.
bool FrameClusters::trimLists() {
    const uint32_t* const lengths = ofMaps_.data() + 3 * demand_.slotCount();
    const size_t clusters = lengths[kClusterLength], samples = lengths[kSampleLength],
                 clusterLights = lengths[kClusterLightLength];
    if (clusters > clusters_.cell.size() || clusterLights > lights_.lights.size())
        return false;
    trimClusters(clusters, samples, clusters_);
    trimLights(clusters, clusterLights, lights_);
    demand_.wantedSquared.resize(clusterLights);
    return true;
}

void FrameClusters::gather(const VisibleSurface& surface, const ViewRays& view,
                           const FrameOptions& options, StageTimes& stages) {
    // The division by normals waits for lengths, so the host waits anyway.
    const bool mayGuess = isGuessing_ && options.normalClusters == 0 && clusterGuess_.get() > 0 &&
                          clusterLightGuess_.get() > 0;
    if (mayGuess)
        gatherLists(surface, view, options, clusterGuess_.get(), clusterLightGuess_.get(), stages);
    const bool isTooShort = mayGuess && !trimLists();
    if (!mayGuess || isTooShort)
        gatherLists(surface, view, options, 0, 0, stages);
    listRerunCount_ = isTooShort;
    clusterGuess_.note(clusters_.cell.size());
    clusterLightGuess_.note(lights_.lights.size());
    rayDetail_ = {view.origin, view.forward, view.pixelSize,
                  std::as_const(demand_.resolutionSquaredBits).view()};
}

ClusterLightsView FrameClusters::orderedLists() {
    return orderLights(context_.backend, lists(), context_.scene.lightBvh(),
                       context_.scene.lights().count, ordered_);
}

ClusterView FrameClusters::hostView() {
    const ClusterView view = clusters_.view();
    const auto onHost = [&](const auto& array, auto& copy) {
        return copyToHost(context_.backend, array, copy);
    };
    return {onHost(view.cell, host_.cell),
            onHost(view.boxesWorld, host_.boxesWorld),
            onHost(view.sampleStart, host_.sampleStart),
            onHost(view.samples, host_.samples),
            onHost(view.clusterOfSample, host_.clusterOfSample),
            {onHost(view.normals.cells, host_.normalCell), view.normals.k}};
}

ClusterLightsView FrameClusters::hostLists() {
    const ClusterLightsView view = lights_.view();
    return {copyToHost(context_.backend, view.start, host_.lightStart),
            copyToHost(context_.backend, view.lights, host_.lights),
            copyToHost(context_.backend, view.record, host_.record)};
}

View<const float> FrameClusters::hostWantedSquared() {
    return copyToHost(context_.backend, std::as_const(demand_.wantedSquared).view(),
                      host_.wantedSquared);
}

RayDetail FrameClusters::hostRayDetail() {
    RayDetail detail = rayDetail_;
    detail.resolutionSquaredBits =
        copyToHost(context_.backend, detail.resolutionSquaredBits, host_.resolutionSquaredBits);
    return detail;
}

} // namespace shadowdag
