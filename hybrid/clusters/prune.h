// SPDX-License-Identifier: Apache-2.0
// (cluster, light) pairs that need neither a page nor a ray: those in which no sample faces the
// light, and those that the voxel DAG proves completely lit. They are removed before resolutions
// are gathered, so that they raise no map's resolution and mark no page.
#pragma once

#include "cuda/mutant.h"
#include "cuda/pass.h"
#include "hybrid/clusters/cluster_lights.h"
#include "hybrid/clusters/pairs.h"

namespace shadowdag {

/// Which (cluster, light) pairs are removed.
enum class PairPruning : uint8_t {
    kNone,
    /// Those without an exact pair (pairs.h). No pair loses its result, but maps may become coarser
    /// without their requests and give other results.
    kFacing,
    /// And those whose every voxel ray a shaft proves unblocked and that no moving object may
    /// shadow: their pairs get the result of voxel rays of level 0. Not applied to directional
    /// lights.
    kLit,
};

/// Returns whether any sample of the cluster and the light are a pair.
SDAG_HD inline bool hasPair(const GBufferView& gbuffer, const ClusterView& clusters, size_t cluster,
                            const Light& light) {
    for (uint32_t i = clusters.sampleStart[cluster]; i < clusters.sampleStart[cluster + 1]; ++i) {
        const uint32_t sample = clusters.samples[i];
        if (isPair(light, gbuffer.positionWorld[sample], gbuffer.normalWorld[sample]))
            return true;
        if (isMutant(Mutant::kFacingLost))
            return false;
    }
    return false;
}

/// Gives every entry of a cluster without a pair the record kProvenLit, all others 0.
struct PruneFacing {
    GBufferView gbuffer;
    ClusterView clusters;
    ClusterLightsView lists; ///< record not read
    View<const Light> lights;
    View<uint32_t> record;

    size_t itemCount() const { return clusters.count(); }
    size_t grain() const { return 16; }
    SDAG_HD void operator()(size_t cluster) const {
        for (uint32_t i = lists.start[cluster]; i < lists.start[cluster + 1]; ++i)
            record[i] =
                hasPair(gbuffer, clusters, cluster, lights[lists.lights[i]]) ? 0 : kProvenLit;
    }
};

/// On CUDA a block takes a cluster and its warps the entries: a cluster may have a thousand samples
/// and as many lights.
void launchPass(CudaTag, const PruneFacing& work);

} // namespace shadowdag
