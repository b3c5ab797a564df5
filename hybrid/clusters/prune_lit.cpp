// SPDX-License-Identifier: Apache-2.0
// Pruning by proofs of light, on the CPU only.
#include "hybrid/clusters/prune_pass.h"

#include "cuda/parallel_for.h"
#include "hybrid/clusters/cluster_rays.h"
#include "voxel/lit_proof.h"

#include <vector>

namespace shadowdag {

namespace {

/// Proves light cluster by cluster; one object per thread.
class LitPruner {
public:
    LitPruner(const PruneFacing& work, const RayInputs& rays) : work_(work), rays_(rays) {}

    void prune(size_t cluster) {
        samples_ = {work_.clusters.samples.data + work_.clusters.sampleStart[cluster],
                    work_.clusters.sampleCount(cluster)};
        bool isPrepared = false;
        for (uint32_t i = work_.lists.start[cluster]; i < work_.lists.start[cluster + 1]; ++i) {
            const uint32_t light = work_.lists.lights[i];
            if (work_.record[i] == kProvenLit || rays_.movers.mayShadow(light) ||
                work_.lights[light].kind == Light::kSun) // a shaft ends at one point
                continue;
            if (!isPrepared) {
                setReceivers(work_.gbuffer, samples_, rays_, receivers_);
                proof_.reset(receivers_);
            }
            isPrepared = true;
            if (isLit(work_.lights[light]))
                work_.record[i] = kProvenLit;
        }
    }

private:
    bool isLit(const Light& light) {
        markPairs(work_.gbuffer, samples_, light, isAsked_);
        return proof_.provesLit(rays_.dag, light.positionWorld, viewOf(isAsked_));
    }

    const PruneFacing& work_;
    const RayInputs& rays_;
    ReceiverGroups receivers_;
    LitProof proof_;
    View<const uint32_t> samples_; ///< of the cluster
    std::vector<uint8_t> isAsked_;
};

} // namespace

void pruneLit(const PruneFacing& work, const RayInputs& rays) {
    if (rays.dag.wide.words.empty())
        return;
    RayInputs byVoxels = rays; // whatever the rays of the frame believe
    byVoxels.options.believe = RayOptions{}.believe;
    cpuParallelRanges(work.clusters.count(), 4, [&](size_t begin, size_t end) {
        LitPruner pruner(work, byVoxels);
        for (size_t cluster = begin; cluster < end; ++cluster)
            pruner.prune(cluster);
    });
}

} // namespace shadowdag
