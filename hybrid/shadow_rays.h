// SPDX-License-Identifier: Apache-2.0
// Shadow rays of a frame: what they are asked for and what they are traced through. The one text
// that shading, its streams and the error analysis agree with.
#pragma once

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

/// Returns whether the rays' method says that the pair is dark.
SDAG_HD inline bool isDarkByRays(const RayInputs& inputs, const ShadowPair& pair) {
    const DagSegment segment =
        shadowSegment(inputs.dag.grid, pair.positionWorld, pair.normalWorld, pair.lightWorld,
                      inputs.options.offset, inputs.options.level);
    return occluded(inputs.dag, segment, inputs.options.level);
}

} // namespace shadowdag
