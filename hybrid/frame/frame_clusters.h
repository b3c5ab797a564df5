// SPDX-License-Identifier: Apache-2.0
// The first half of a frame, up to the input of routing on the host: clusters, their lights, and
// their requests of maps. On CUDA by guessed lengths (cuda/list_length.h), so that the host need
// not wait before.
#pragma once

#include "cuda/readback.h"
#include "hybrid/clusters/cluster_pass.h"
#include "hybrid/clusters/light_assign_pass.h"
#include "hybrid/frame/visible_surface.h"
#include "hybrid/routing/resolution_pass.h"

namespace shadowdag {

/// The clusters of a frame, the lights of each, and the demand of all.
class FrameClusters {
public:
    explicit FrameClusters(const FrameContext& context)
        : context_(context), clusters_(context.backend), lights_(context.backend),
          ordered_(context.backend), demand_(context.backend), readback_(context.backend) {}

    /// Sets whether lists have guessed lengths; forgets the guesses. @param spare as
    /// LengthGuess::forget
    void guessLengths(bool isOn, size_t spare);
    /// Forgets the guesses alone.
    void forgetLengths();
    bool isGuessing() const { return isGuessing_; }
    /// Returns how many lists of the last frame were guessed too short.
    uint64_t listRerunCount() const { return listRerunCount_; }

    /// Gathers clusters, assigns lights, gathers the lights' requests of maps, and fetches these;
    /// adds the stages' times. Lists have no unused entries afterwards.
    void gather(const VisibleSurface& surface, const ViewRays& view, const FrameOptions& options,
                StageTimes& stages);

    const ClusterSet& clusters() const { return clusters_; }
    const ClusterLights& lights() const { return lights_; }
    const LightDemand& demand() const { return demand_; }
    ClusterView view() const { return clusters_.view(); }
    ClusterLightsView lists() const { return lights_.view(); }
    /// Returns the lists ordered for coherence (orderLights); valid until the next frame.
    ClusterLightsView orderedLists();
    const OrderedLights& ordered() const { return ordered_; }

    /// Returns LightDemand::ofMaps on the host.
    const std::vector<uint32_t>& demandOfMaps() const { return ofMaps_; }
    /// Returns the requests that the levels of rays follow, on the backend.
    const RayDetail& rayDetail() const { return rayDetail_; }

    /// Return the last frame's clusters, their lights and their requests on the host; valid until
    /// the next frame.
    ClusterView hostView();
    ClusterLightsView hostLists();
    View<const float> hostWantedSquared();
    RayDetail hostRayDetail();

private:
    void prunePairs(const VisibleSurface& surface, const FrameOptions& options);
    void gatherLists(const VisibleSurface& surface, const ViewRays& view,
                     const FrameOptions& options, size_t clusterGuess, size_t clusterLightGuess,
                     StageTimes& stages);
    bool trimLists();

    FrameContext context_;
    ClusterSet clusters_;
    ClusterLights lights_;
    OrderedLights ordered_; ///< of FrameOptions::reorderLights
    LightDemand demand_;
    std::vector<uint32_t> ofMaps_;
    Readback readback_; // of ofMaps_
    RayDetail rayDetail_;

    /// The estimated lengths of the lists.
    bool isGuessing_ = false;
    LengthGuess clusterGuess_, clusterLightGuess_;
    uint64_t listRerunCount_ = 0;

    struct HostCopies {
        std::vector<uint32_t> cell, sampleStart, samples, clusterOfSample, normalCell;
        std::vector<Box> boxesWorld;
        std::vector<uint32_t> lightStart, lights, record, resolutionSquaredBits;
        std::vector<float> wantedSquared;
    } host_;
};

} // namespace shadowdag
