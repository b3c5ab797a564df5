// SPDX-License-Identifier: Apache-2.0
// Marks the pages of shadow maps that the lookups of a frame's samples read.
#pragma once

#include "cuda/pass.h"
#include "hybrid/clusters/clusters.h"
#include "hybrid/clusters/pairs.h"
#include "shadowmap/page_mask.h"

namespace shadowdag {

/// Marks what the samples of each receiver's cluster read of its map: those that its light would
/// light without occluders. An item is one of kLanes parts of a receiver, so that neighbouring
/// threads of a device read neighbouring samples; the CPU takes a cluster at a time instead:
/// lookup_pages_cpu.cpp.
struct MarkLookupPages {
    GBufferView gbuffer;
    ClusterView clusters;
    View<const MapReceiver> receivers; ///< box: the cluster
    View<const Light> lights;
    PageDemand demand;

    static constexpr uint32_t kLanes = 32;

    size_t itemCount() const { return receivers.count * kLanes; }
    SDAG_HD void operator()(size_t item) const {
        const MapReceiver receiver = receivers[item / kLanes];
        if (receiver.map == kNoMap)
            return;
        const Light& light = lights[demand.maps[receiver.map].light];
        const uint32_t end = clusters.sampleStart[receiver.box + 1];
        for (uint32_t i = clusters.sampleStart[receiver.box] + uint32_t(item % kLanes); i < end;
             i += kLanes) {
            const uint32_t sample = clusters.samples[i];
            const glm::vec3 position = gbuffer.positionWorld[sample];
            const glm::vec3 normal = gbuffer.normalWorld[sample];
            if (!isPair(light, position, normal))
                continue;
            for (uint32_t step = 0; step < demand.stepCount; ++step)
                markLookup(demand, step * demand.mapCount + receiver.map, position, normal);
        }
    }
};
void launchPass(CpuTag, const MarkLookupPages& work);

} // namespace shadowdag
