// SPDX-License-Identifier: Apache-2.0
// One pair asked again on the host, by whatever served it in the frame.
#pragma once

#include "hybrid/frame/shade.h"

namespace shadowdag {

/// Returns computePairResult, and for pairs served by rays of Embree (TriangleRays::kEmbree), which
/// the passes do not know, Embree's answer to a packet of this ray alone: at edges another one than
/// that of the frame's packet is possible. Thread-safe.
/// @param inputs on the host; with rays of Embree, inputs.rays.embree is not null
uint8_t computePairResultOnHost(const VisibilityInputs& inputs, PairServer server,
                                uint32_t lightIndex, const Light& light,
                                const glm::vec3& positionWorld, const glm::vec3& normalWorld,
                                uint32_t receiver, VisibilityCounts& counts);

} // namespace shadowdag
