// SPDX-License-Identifier: Apache-2.0
// Shading on the CPU: a thread takes a cluster at a time and goes through it light by light.
// Samples are marked and coloured in lanes (sample_lanes.h) and cube maps are read in lanes
// (lookup_lanes.h); voxel rays of level 0 and exact rays are answered for a cluster and a light at
// once, in streams: the bits of ShadeSamples::shadeCluster.
#include "cuda/mutant.h"
#include "hybrid/frame/shade_pass.h"

#include "cuda/parallel_for.h"
#include "hybrid/clusters/cluster_rays.h"
#include "hybrid/frame/lookup_lanes.h"
#include "hybrid/frame/sample_lanes.h"

#include <algorithm>

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
        const uint32_t count = work_.clusters.sampleCount(cluster);
        rays_.setCluster({work_.clusters.samples.data + work_.clusters.sampleStart[cluster],
                          mutated(Mutant::kMarkLost, count, count - 1)});
        samples_ = rays_.samples();
        lanes_.reset(uint32_t(samples_.count));
        for (uint32_t i = 0; i < samples_.count; ++i) {
            const uint32_t sample = samples_[i];
            lanes_.set(i, work_.gbuffer.positionWorld[sample], work_.gbuffer.normalWorld[sample],
                       work_.surfaceOf(sample).baseColor, work_.color[sample]);
        }
        for (uint32_t l = lists.start[cluster]; l < lists.start[cluster + 1]; ++l) {
            const uint32_t lightIndex = lists.lights[l];
            const Light light = work_.lights[lightIndex];
            const uint32_t askedCount = lanes_.mark(light);
            if (askedCount == 0)
                continue;
            const PairServer server = work_.serverOf(l);
            if (server.by() == ServedBy::kRays)
                trace(lightIndex, light, askedCount, counts);
            else if (server.isMap())
                lookUp(server.map(), askedCount, counts);
            else
                prove(askedCount, counts);
            record(server);
            lanes_.add();
        }
        for (uint32_t i = 0; i < samples_.count; ++i)
            work_.color[samples_[i]] = lanes_.color(i);
        work_.addCounts(cluster, counts);
    }

private:
    void trace(uint32_t lightIndex, const Light& light, uint32_t askedCount,
               VisibilityCounts& counts) {
        counts.rayCount += askedCount;
        const View<uint8_t> seen = lanes_.seen();
        counts.rays += rays_.answer(lightIndex, light, lanes_.isAsked(), seen); // dark: 1
        for (size_t i = 0; i < seen.count; ++i)
            seen[i] = seen[i] != 0 ? uint8_t(0) : kLit;
    }

    void lookUp(uint32_t map, uint32_t askedCount, VisibilityCounts& counts) {
        counts.lookupCount += askedCount;
        counts.missingTapCount += lookups_.lookUp(work_.visibility.maps, map, work_.visibility.bias,
                                                  lanes_.arrays(), lanes_.isAsked(), lanes_.seen());
    }

    void prove(uint32_t askedCount, VisibilityCounts& counts) {
        counts.provenCount += askedCount;
        const View<uint8_t> seen = lanes_.seen();
        std::fill_n(seen.data, seen.count, kLit);
    }

    void record(PairServer server) {
        if (!work_.recorder.isOn())
            return;
        const View<const uint8_t> isAsked = lanes_.isAsked();
        for (size_t i = 0; i < isAsked.count; ++i)
            if (isAsked[i])
                work_.recorder.add(samples_[i], lanes_.seen()[i], server);
    }

    const ShadeSamples& work_;
    ClusterRays rays_;
    SampleLanes lanes_;
    LookupLanes lookups_;
    View<const uint32_t> samples_; ///< of the cluster
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
