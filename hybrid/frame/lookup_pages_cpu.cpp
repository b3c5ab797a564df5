// SPDX-License-Identifier: Apache-2.0
// Marking pages on the CPU: a thread takes some receivers, which are ordered by cluster, and marks
// the samples of each in lanes (lookup_lanes.h): the bits of MarkLookupPages.
#include "cuda/parallel_for.h"
#include "hybrid/frame/lookup_lanes.h"
#include "hybrid/frame/lookup_pages_pass.h"
#include "hybrid/frame/sample_lanes.h"

namespace shadowdag {

namespace {

/// Receivers that share their working memory.
constexpr size_t kReceiverGrain = 64;

/// Marks receivers one after the other.
class ReceiverMarker {
public:
    explicit ReceiverMarker(const MarkLookupPages& work) : work_(work) {}

    void mark(const MapReceiver& receiver) {
        if (receiver.map == kNoMap)
            return;
        const PageDemand& demand = work_.demand;
        setCluster(receiver.box);
        if (lanes_.mark(work_.lights[demand.maps[receiver.map].light]) == 0)
            return;
        for (uint32_t step = 0; step < demand.stepCount; ++step)
            lookups_.markPages(demand, step * demand.mapCount + receiver.map, lanes_.arrays(),
                               lanes_.isAsked());
    }

private:
    void setCluster(uint32_t cluster) {
        if (cluster == cluster_)
            return;
        cluster_ = cluster;
        const uint32_t count = work_.clusters.sampleCount(cluster);
        const uint32_t* samples = work_.clusters.samples.data + work_.clusters.sampleStart[cluster];
        lanes_.reset(count);
        for (uint32_t i = 0; i < count; ++i)
            lanes_.set(i, work_.gbuffer.positionWorld[samples[i]],
                       work_.gbuffer.normalWorld[samples[i]]);
    }

    const MarkLookupPages& work_;
    SampleLanes lanes_;
    LookupLanes lookups_;
    uint32_t cluster_ = ~0u; ///< whose samples the lanes hold
};

} // namespace

void launchPass(CpuTag, const MarkLookupPages& work) {
    cpuParallelRanges(work.receivers.count, kReceiverGrain, [&](size_t begin, size_t end) {
        ReceiverMarker marker(work);
        for (size_t i = begin; i < end; ++i)
            marker.mark(work.receivers[i]);
    });
}

} // namespace shadowdag
