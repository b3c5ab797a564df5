// SPDX-License-Identifier: Apache-2.0
// Shading on the CPU: a thread takes a cluster at a time and goes through it light by light. Voxel
// rays of level 0 are answered for a cluster and a light at once, in streams: the bits of
// ShadeSamples::shadeCluster.
#include "hybrid/frame/shade_pass.h"

#include "cuda/parallel_for.h"
#include "hybrid/clusters/cluster_rays.h"

#include <vector>

namespace shadowdag {

namespace {

/// Clusters that share their working memory.
constexpr size_t kGrain = 4;

/// Shades clusters one after the other.
class ClusterShader {
public:
    explicit ClusterShader(const ShadeSamples& work)
        : work_(work), rays_(work.gbuffer, work.visibility.rays) {}

    void shade(size_t cluster) {
        const ClusterLightsView& lists = work_.lists;
        VisibilityCounts counts;
        samples_ = {work_.clusters.samples.data + work_.clusters.sampleStart[cluster],
                    work_.clusters.sampleCount(cluster)};
        rays_.setCluster(samples_);
        for (uint32_t l = lists.start[cluster]; l < lists.start[cluster + 1]; ++l) {
            const uint32_t lightIndex = lists.lights[l];
            const Light light = work_.lights[lightIndex];
            const PairServer server = work_.serverOf(l);
            if (server.by() == ServedBy::kRays) {
                shadeTraced(lightIndex, light, counts);
                continue;
            }
            for (const uint32_t sample : samples_)
                work_.color[sample] += work_.shadePair(sample, server, lightIndex, light, counts);
        }
        work_.addCounts(cluster, counts);
    }

private:
    void shadeTraced(uint32_t lightIndex, const Light& light, VisibilityCounts& counts) {
        const uint32_t askedCount = markPairs(work_.gbuffer, samples_, light, isAsked_);
        if (askedCount == 0)
            return;
        counts.rayCount += askedCount;
        isDark_.resize(samples_.count);
        counts.rays += rays_.answer(lightIndex, light, viewOf(isAsked_), viewOf(isDark_));
        for (size_t i = 0; i < samples_.count; ++i)
            if (isAsked_[i])
                work_.color[samples_[i]] += work_.shadeAnswered(
                    samples_[i], PairServer::rays(), light, isDark_[i] ? uint8_t(0) : kLit);
    }

    const ShadeSamples& work_;
    ClusterRays rays_;
    View<const uint32_t> samples_; ///< of the cluster
    std::vector<uint8_t> isAsked_, isDark_;
};

} // namespace

void launchPass(CpuTag, const ShadeLights& pass) {
    const ShadeSamples& work = pass.work;
    const RayOptions& rays = work.visibility.rays.options;
    const bool byEmbree = rays.triangleRays == TriangleRays::kEmbree; // has no single rays here
    if (!byEmbree && (rays.batch == RayBatch::kSingle || !ClusterRays::canStream(rays))) {
        parallelFor<CpuTag>(
            work.clusters.count(), [&work](size_t c) { work.shadeCluster(c); }, 1);
        return;
    }
    cpuParallelRanges(work.clusters.count(), kGrain, [&](size_t begin, size_t end) {
        ClusterShader shader(work);
        for (size_t cluster = begin; cluster < end; ++cluster)
            shader.shade(cluster);
    });
}

} // namespace shadowdag
