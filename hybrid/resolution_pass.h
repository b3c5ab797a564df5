// SPDX-License-Identifier: Apache-2.0
// Gathers what every light's clusters ask of its shadow map.
#pragma once

#include "cuda/buffer.h"
#include "hybrid/resolution.h"

namespace shadowdag {

/// The demands on one backend.
struct LightDemand {
    explicit LightDemand(Backend backend)
        : resolutionSquaredBits(backend, "demand resolution"),
          sampleCount(backend, "demand samples"), clusterCount(backend, "demand clusters") {}

    Buffer<uint32_t> resolutionSquaredBits;
    Buffer<uint32_t> sampleCount;
    Buffer<uint32_t> clusterCount;
};

namespace cpu {
void demandResolution(const DemandResolution& work);
}
namespace cuda {
void demandResolution(const DemandResolution& work);
}

/// Replaces the demands by those of these clusters. All integers, deterministic. All views live on
/// the backend.
inline void gatherDemand(Backend backend, const ClusterView& clusters,
                         const ClusterLightsView& lists, View<const Light> lights,
                         const ViewRays& view, LightDemand& demand) {
    for (Buffer<uint32_t>* buffer :
         {&demand.resolutionSquaredBits, &demand.sampleCount, &demand.clusterCount}) {
        buffer->resize(lights.count);
        buffer->fill(0);
    }
    SDAG_DISPATCH(backend, demandResolution,
                  {clusters, lists, lights, view,
                   LightDemandView{demand.resolutionSquaredBits.view(), demand.sampleCount.view(),
                                   demand.clusterCount.view()}});
}

} // namespace shadowdag
