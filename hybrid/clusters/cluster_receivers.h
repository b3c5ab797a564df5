// SPDX-License-Identifier: Apache-2.0
// A cluster's samples as shafts and streams are asked about them. Not for other folders.
#pragma once

#include "hybrid/clusters/clusters.h"
#include "hybrid/clusters/pairs.h"
#include "hybrid/rays/shadow_rays.h"
#include "voxel/shaft_receivers.h"

#include <vector>

namespace shadowdag {

static_assert(ShaftReceivers::kTileSide == kTileSize);

/// Makes `receivers` those of a cluster's samples, in their order.
inline void setReceivers(const GBufferView& gbuffer, View<const uint32_t> samples,
                         const RayInputs& rays, ShaftReceivers& receivers) {
    receivers.reset(rays.dag.grid, rays.options.offset);
    for (const uint32_t s : samples)
        receivers.add(gbuffer.positionWorld[s], gbuffer.normalWorld[s],
                      s % gbuffer.width % kTileSize, s / gbuffer.width % kTileSize);
    receivers.build();
}

/// Sets isAsked[i] to whether sample i of a cluster and the light are a pair; returns how many are.
inline uint32_t markPairs(const GBufferView& gbuffer, View<const uint32_t> samples,
                          const Light& light, std::vector<uint8_t>& isAsked) {
    isAsked.resize(samples.count);
    uint32_t count = 0;
    for (size_t i = 0; i < samples.count; ++i) {
        isAsked[i] =
            isPair(light, gbuffer.positionWorld[samples[i]], gbuffer.normalWorld[samples[i]]);
        count += isAsked[i];
    }
    return count;
}

} // namespace shadowdag
