// SPDX-License-Identifier: Apache-2.0
// The rays of a cluster and a light together, in streams: the CPU's faster kernel of isDarkByRays
// (shadow_rays.h), with its bits.
#pragma once

#include "hybrid/clusters/clusters.h"
#include "hybrid/clusters/pairs.h"
#include "hybrid/rays/beam_rays.h"
#include "hybrid/rays/embree_scene.h"
#include "hybrid/rays/exact_stream.h"
#include "hybrid/rays/mover_receivers.h"
#include "hybrid/rays/shadow_rays.h"
#include "voxel/receiver_groups.h"

#include <optional>
#include <vector>

namespace shadowdag {

/// Makes `receivers` those of a cluster's samples, in their order.
void setReceivers(const GBufferView& gbuffer, View<const uint32_t> samples, const RayInputs& rays,
                  ReceiverGroups& receivers);

/// Sets isAsked[i] to whether sample i of a cluster and the light are a pair.
void markPairs(const GBufferView& gbuffer, View<const uint32_t> samples, const Light& light,
               std::vector<uint8_t>& isAsked);

/// Answers the rays of one cluster after the other. Not thread-safe: one a thread.
class ClusterRays {
public:
    /// Returns whether rays of these options can be streamed: those through voxels at level 0, and
    /// those that believe none.
    static bool canStream(const RayOptions& options);

    /// @param rays canStream(rays.options), with exact.bvh or embree unless all is believed;
    /// outlives the answers
    ClusterRays(const GBufferView& gbuffer, const RayInputs& rays)
        : gbuffer_(gbuffer), rays_(rays), exact_(rays.exact.geometry, rays.exact.bvh) {
        if (rays.beams)
            beams_.emplace(rays.exact, *rays.beams);
    }

    /// Goes on to the samples of another cluster.
    void setCluster(View<const uint32_t> samples);
    /// Returns the cluster's samples in the order in which they are to be asked, and which all
    /// arrays by sample have; valid until the next setCluster.
    View<const uint32_t> samples() const { return samples_; }

    /// Sets isDark[i] to isDarkByRays of the pair of sample i, or, with TriangleRays::kEmbree, to
    /// EmbreeScene::trace or isDarkByMovers, for the samples with isAsked[i] != 0; others may
    /// become anything.
    /// @param isAsked,isDark by sample of the cluster
    RayCounts answer(uint32_t lightIndex, const Light& light, View<const uint8_t> isAsked,
                     View<uint8_t> isDark);

private:
    ShadowPair pairOf(uint32_t i, uint32_t lightIndex, const Light& light) const;
    void prepare();
    void makeStarts(bool withNormals);
    void traceVoxels(uint32_t lightIndex, const Light& light, View<uint8_t> isDark);
    /// @return how many rays were traced
    uint32_t traceTriangles(const Light& light, View<uint8_t> isDark);
    void traceBeams(uint32_t lightIndex, const Light& light, View<const uint8_t> isAsked,
                    View<uint8_t> isDark);
    uint32_t askMovers(uint32_t lightIndex, const Light& light, View<const uint8_t> isAsked,
                       View<uint8_t> isDark);

    const GBufferView& gbuffer_;
    const RayInputs& rays_;
    View<const uint32_t> samples_; ///< of the cluster
    bool isPrepared_ = false;      ///< receivers_ are those of the cluster
    ReceiverGroups receivers_;
    MoverReceivers movers_;
    ExactStream exact_;
    std::optional<BeamRays> beams_;
    std::vector<uint32_t> sorted_; ///< beams_: the samples of the cluster
    std::vector<uint8_t> isOpen_;
    // Of the cluster; empty until triangles are asked.
    std::vector<glm::vec3> positions_, normals_; ///< normals: TriangleRays::kEmbree
    std::vector<TruthStart> starts_;             ///< TriangleRays::kExact
    // Of the light that is asked for.
    std::vector<uint32_t> asked_; ///< samples of the cluster, in the order in which they are traced
    std::vector<uint32_t> traced_; ///< those that are traced now, of asked_
    std::vector<DagSegment> segments_;
    std::vector<uint8_t> blocked_;
};

} // namespace shadowdag
