// SPDX-License-Identifier: Apache-2.0
// A cluster's samples against what moves, all at once for a light: the CPU's faster kernel of
// isDarkByMovers (shadow_rays.h), with its bits.
//
// Where rays start is found once a cluster, not once a pair. The boxes of moving batches are
// searched once a cluster and light, by all rays as one bundle; most bundles touch none, and then
// no ray is made. A ray is held against the few batches that its bundle touches.
#pragma once

#include "hybrid/gbuffer/gbuffer.h"
#include "hybrid/rays/mover_rays.h"

#include <vector>

namespace shadowdag {

/// The samples of one cluster; reused from cluster to cluster. Not thread-safe: one a thread.
class MoverReceivers {
public:
    /// Forgets the samples: the next answer() makes them anew.
    void reset() { starts_.clear(); }

    /// Darkens the pairs of a light that movers block.
    /// @param samples of the cluster, the same from reset() to reset()
    /// @param isAsked by sample of the cluster: is it a pair of the light
    /// @param isDark by sample of the cluster: is the pair dark already, by voxels; set where a
    /// moving triangle blocks the pair's own ray
    /// @return the pairs that were held against movers: asked, not dark
    uint32_t answer(const MoverView& movers, const GBufferView& gbuffer,
                    View<const uint32_t> samples, const glm::vec3& lightWorld,
                    View<const uint8_t> isAsked, View<uint8_t> isDark);

private:
    struct Candidate {
        uint32_t batch;
        Box boxWorld;
    };

    void makeStarts(const MoverView& movers, const GBufferView& gbuffer,
                    View<const uint32_t> samples);
    void findCandidates(const MoverView& movers, const glm::dvec3& lightLocal);
    bool isBlocked(const MoverView& movers, const TruthRay& ray);

    std::vector<TruthStart> starts_;    ///< by sample of the cluster
    std::vector<uint32_t> asked_;       ///< samples of the cluster that are in question
    std::vector<Candidate> candidates_; ///< batches that a ray of the bundle may touch
};

} // namespace shadowdag
