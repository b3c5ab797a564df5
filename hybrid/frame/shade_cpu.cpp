// SPDX-License-Identifier: Apache-2.0
// Shading on the CPU: a thread takes a cluster at a time and goes through it light by light. Voxel
// rays of level 0 are answered for a cluster and a light at once, by shafts and streams: the bits
// of ShadeSamples::shadeCluster.
#include "hybrid/frame/shade_pass.h"

#include "cuda/parallel_for.h"
#include "hybrid/clusters/cluster_receivers.h"
#include "hybrid/rays/mover_receivers.h"

#include <mutex>
#include <vector>

namespace shadowdag {

namespace {

/// Clusters that share their working memory.
constexpr size_t kGrain = 4;

bool isBatched(const RayOptions& options) {
    return options.kind == RayKind::kVoxels && options.lod == LodRule::kFixed &&
           options.level == 0 && options.batch != RayBatch::kSingle;
}

/// Shades clusters one after the other.
class ClusterShader {
public:
    explicit ClusterShader(const ShadeSamples& work)
        : work_(work), hasShafts_(work.visibility.rays.options.batch == RayBatch::kShaft) {}

    void shade(size_t cluster) {
        const ClusterLightsView& lists = work_.lists;
        VisibilityCounts counts;
        isPrepared_ = false;
        movers_.reset();
        samples_ = {work_.clusters.samples.data + work_.clusters.sampleStart[cluster],
                    work_.clusters.sampleCount(cluster)};
        for (uint32_t l = lists.start[cluster]; l < lists.start[cluster + 1]; ++l) {
            const uint32_t lightIndex = lists.lights[l];
            const Light light = work_.lights[lightIndex];
            const int map = work_.mapOf(l);
            if (map == kByRays && light.kind != Light::kSun) { // streams end at one point
                shadeTraced(lightIndex, light, counts);
                continue;
            }
            for (const uint32_t sample : samples_)
                work_.color[sample] += work_.shadePair(sample, map, lightIndex, light, counts);
        }
        work_.addCounts(cluster, counts);
    }

    const ShaftCounts& shaftCounts() const { return shaftCounts_; }

private:
    void shadeTraced(uint32_t lightIndex, const Light& light, VisibilityCounts& counts) {
        const GBufferView& gbuffer = work_.gbuffer;
        const uint32_t askedCount = markPairs(gbuffer, samples_, light, isAsked_);
        blocked_.resize(samples_.count);
        if (askedCount == 0)
            return;
        counts.rayCount += askedCount;
        prepare();
        const RayInputs& rays = work_.visibility.rays;
        receivers_.answer(rays.dag, light.positionWorld, viewOf(isAsked_), viewOf(blocked_),
                          shaftCounts_,
                          hasShafts_ ? ShaftReceivers::kProofsAndRays : ShaftReceivers::kRays);
        if (rays.movers.mayShadow(lightIndex))
            counts.moverTestCount +=
                movers_.answer(rays.movers, gbuffer, samples_, light.positionWorld,
                               viewOf(isAsked_), viewOf(blocked_));
        for (size_t i = 0; i < samples_.count; ++i)
            if (isAsked_[i])
                work_.color[samples_[i]] += work_.shadeAnswered(samples_[i], kByRays, light,
                                                                blocked_[i] ? uint8_t(0) : kLit);
    }

    /// Makes the cluster's samples ready, once a cluster.
    void prepare() {
        if (isPrepared_)
            return;
        isPrepared_ = true;
        setReceivers(work_.gbuffer, samples_, work_.visibility.rays, receivers_);
    }

    const ShadeSamples& work_;
    const bool hasShafts_;
    ShaftReceivers receivers_;
    ShaftCounts shaftCounts_;
    MoverReceivers movers_;
    bool isPrepared_ = false;
    View<const uint32_t> samples_; ///< of the cluster
    std::vector<uint8_t> isAsked_, blocked_;
};

} // namespace

void launchPass(CpuTag, const ShadeLights& pass) {
    const ShadeSamples& work = pass.work;
    if (!isBatched(work.visibility.rays.options)) {
        parallelFor<CpuTag>(
            work.clusters.count(), [&work](size_t c) { work.shadeCluster(c); }, 1);
        return;
    }
    std::mutex mutex; // sums of integers: any order
    cpuParallelRanges(work.clusters.count(), kGrain, [&](size_t begin, size_t end) {
        ClusterShader shader(work);
        for (size_t cluster = begin; cluster < end; ++cluster)
            shader.shade(cluster);
        if (work.shaftCounts) {
            const std::lock_guard lock(mutex);
            work.shaftCounts->add(shader.shaftCounts());
        }
    });
}

} // namespace shadowdag
