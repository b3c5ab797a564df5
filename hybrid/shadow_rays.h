// SPDX-License-Identifier: Apache-2.0
// Shadow rays of a frame: what they are asked for and what they are traced through. The one text
// that shading, its streams and the error analysis agree with.
#pragma once

#include "hybrid/mover_rays.h"
#include "scenes/light.h"
#include "voxel/dag_trace.h"

namespace shadowdag {

/// How the rays of a frame are asked; the same for all of them.
struct RayOptions {
    float offset = 1.0f; ///< in units of the derived offset, dag_trace.h
    uint32_t level = 0;  ///< level of detail: cells of 2^level voxels
};

/// What rays are traced through.
struct RayInputs {
    DagView dag;
    RayOptions options;
    MoverView movers = {};
};

/// A view sample that asks for a light.
/// receiver: the sample's world triangle; light: index into the frame's lights.
struct ShadowPair {
    glm::vec3 positionWorld;
    glm::vec3 normalWorld; ///< unit, geometric, on the light's side
    glm::vec3 lightWorld;
    uint32_t receiver;
    uint32_t light;
};

/// Returns whether the voxels, which hold what never moves, say that the pair is dark.
SDAG_HD inline bool isDarkByVoxels(const RayInputs& inputs, const ShadowPair& pair) {
    const DagSegment segment =
        shadowSegment(inputs.dag.grid, pair.positionWorld, pair.normalWorld, pair.lightWorld,
                      inputs.options.offset, inputs.options.level);
    return occluded(inputs.dag, segment, inputs.options.level);
}

/// Returns whether a moving triangle makes the pair dark; asked of pairs that the voxels leave lit
/// where movers.mayShadow(pair.light).
SDAG_HD inline bool isDarkByMovers(const MoverView& movers, const ShadowPair& pair) {
    return isBlockedByMovers(movers,
                             truthPairRay(movers.geometry, pair.positionWorld, pair.normalWorld,
                                          pair.receiver, pair.lightWorld));
}

/// Returns whether the rays' method says that the pair is dark: by voxels or by movers.
/// @param moverTestCount grows by one when movers were asked; may be null
SDAG_HD inline bool isDarkByRays(const RayInputs& inputs, const ShadowPair& pair,
                                 uint32_t* moverTestCount = nullptr) {
    if (isDarkByVoxels(inputs, pair))
        return true;
    if (!inputs.movers.mayShadow(pair.light))
        return false;
    if (moverTestCount)
        ++*moverTestCount;
    return isDarkByMovers(inputs.movers, pair);
}

} // namespace shadowdag
