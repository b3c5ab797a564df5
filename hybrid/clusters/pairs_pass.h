// SPDX-License-Identifier: Apache-2.0
// Lists the exact pairs of a frame, and estimates the number of each map.
#pragma once

#include "cuda/buffer.h"
#include "cuda/pass.h"
#include "cuda/scan_sort.h"
#include "hybrid/clusters/cluster_lights.h"
#include "hybrid/clusters/pairs.h"

namespace shadowdag {

/// Counts the pairs of a sample, or, where `light` is not empty, lists them from start[sample] on.
struct ListPairs {
    GBufferView gbuffer;
    ClusterView clusters;
    ClusterLightsView lists;
    View<const Light> lights;
    View<uint32_t> start; ///< width * height + 1; counts are written there, starts read
    View<uint32_t> light; ///< pairCount, or empty

    size_t itemCount() const { return gbuffer.count(); }
    size_t grain() const { return 1024; }
    SDAG_HD void operator()(size_t sample) const {
        const uint32_t cluster = clusters.clusterOfSample[sample];
        uint32_t count = 0;
        if (cluster != kNoCluster)
            for (uint32_t l = lists.start[cluster]; l < lists.start[cluster + 1]; ++l)
                if (isPair(lights[lists.lights[l]], gbuffer.positionWorld[sample],
                           gbuffer.normalWorld[sample])) {
                    if (!light.empty())
                        light[start[sample] + count] = lists.lights[l];
                    ++count;
                }
        if (light.empty())
            start[sample] = count;
    }
};

/// Stride of the samples of a cluster from which pairs are estimated: coprime to the blocks of
/// samples, so that they come from all over the cluster. Using all samples takes a tenth of the
/// rays of few lights; the remaining cost is within the noise of a frame.
constexpr uint32_t kPairStride = 31;

/// Adds to every map the pairs of a cluster, estimated from some of its samples: their share times
/// all samples, rounded. All integers, so that the order of clusters does not matter.
struct EstimatePairs {
    GBufferView gbuffer;
    ClusterView clusters;
    ClusterLightsView lists;
    View<const Light> lights;
    View<uint32_t> pairCount; ///< by record, zero before

    size_t itemCount() const { return clusters.count(); }
    size_t grain() const { return 16; }
    SDAG_HD void operator()(size_t cluster) const {
        const uint32_t first = clusters.sampleStart[cluster],
                       end = clusters.sampleStart[cluster + 1];
        for (uint32_t l = lists.start[cluster]; l < lists.start[cluster + 1]; ++l) {
            if (lists.record[l] == kProvenLit)
                continue;
            const Light& light = lights[lists.lights[l]];
            uint32_t facing = 0;
            for (uint32_t i = first; i < end; i += kPairStride) {
                const uint32_t sample = clusters.samples[i];
                facing += isPair(light, gbuffer.positionWorld[sample], gbuffer.normalWorld[sample]);
            }
            add(l, facing, end - first);
        }
    }
    /// Adds an entry's pairs, when `facing` of every kPairStride-th of its samples are pairs.
    SDAG_HD void add(size_t entry, uint32_t facing, uint32_t sampleCount) const {
        const uint32_t asked = (sampleCount + kPairStride - 1) / kPairStride;
        const uint64_t share = uint64_t(facing) * sampleCount;
        atomicAddRelaxed(&pairCount[lists.record[entry]], uint32_t((share + asked / 2) / asked));
    }
};
void launchPass(CudaTag, const EstimatePairs& work); ///< by warps

/// The pairs on one backend, as PairList holds them on the host.
struct PairSet {
    explicit PairSet(Backend backend)
        : start(backend, "pair start"), light(backend, "pair light") {}

    Buffer<uint32_t> start;
    Buffer<uint32_t> light;
};

/// Runs EstimatePairs for all clusters. All views are on the backend.
inline void estimatePairs(Backend backend, const EstimatePairs& work) {
    runPass(backend, work);
}

/// Replaces `set` by the pairs of a frame. Deterministic. Throws Error kResource when there are
/// 2^32 or more.
inline void listPairs(Backend backend, const GBufferView& gbuffer, const ClusterView& clusters,
                      const ClusterLightsView& lists, View<const Light> lights, PairSet& set) {
    set.start.resize(gbuffer.count() + 1);
    set.start.fill(0);
    runPass(backend, ListPairs{gbuffer, clusters, lists, lights, set.start.view(), {}});
    const uint64_t total = exclusiveScan(backend, set.start.view(), set.start.view());
    if (total > 0xffffffffull)
        throw Error(ErrorKind::kResource,
                    std::to_string(total) +
                        " (sample, light) pairs; at most 2^32 - 1 can be recorded: "
                        "use fewer lights or a smaller image");
    set.light.resize(total);
    if (total > 0)
        runPass(backend,
                ListPairs{gbuffer, clusters, lists, lights, set.start.view(), set.light.view()});
}

} // namespace shadowdag
