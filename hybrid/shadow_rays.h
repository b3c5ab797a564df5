// SPDX-License-Identifier: Apache-2.0
// Shadow rays of a frame: what they are asked for and what they are traced through. The one text
// that shading, its streams and the error analysis agree with.
#pragma once

#include "hybrid/exact_tree.h"
#include "hybrid/mover_rays.h"
#include "scenes/light.h"
#include "voxel/dag_trace.h"

namespace shadowdag {

/// What a ray that meets a voxel is taken for.
enum class RayKind : uint8_t {
    kVoxels, ///< blocked: the voxels are the geometry, ends are offset out of the receiver's own
    kExact   ///< a question to the triangles there: the truth's own ray, no offset
};

/// How the rays of a frame are asked; the same for all of them.
struct RayOptions {
    float offset = 1.0f; ///< in units of the derived offset, dag_trace.h
    uint32_t level = 0;  ///< level of detail: cells of 2^level voxels
    RayKind kind = RayKind::kVoxels; ///< exact rays use neither offset nor level
};

/// What rays are traced through.
struct RayInputs {
    DagView dag;
    RayOptions options;
    MoverView movers = {};
    ExactView exact = {}; ///< for RayKind::kExact
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

/// Returns whether a triangle makes the pair dark; confirms what the voxels suspect.
/// @param moverTestCount as isDarkByRays @param blocker the last triangle that blocked, asked
/// first: it often blocks the next ray to the same light, too; may be null. Changes no answer.
SDAG_HD inline bool isDarkByTriangles(const RayInputs& inputs, const ShadowPair& pair,
                                      uint32_t* moverTestCount, uint32_t* blocker) {
    const ExactView& exact = inputs.exact;
    const TruthRay ray = truthPairRay(exact.geometry, pair.positionWorld, pair.normalWorld,
                                      pair.receiver, pair.lightWorld);
    if (!(ray.tFar > 0.0f))
        return false;
    if (blocker && *blocker != kBackground && blocksTruthRay(exact.geometry, ray, *blocker))
        return true;
    if (isBlockedExactly(inputs.dag, exact, ray, blocker))
        return true;
    if (!inputs.movers.mayShadow(pair.light))
        return false;
    if (moverTestCount)
        ++*moverTestCount;
    return isBlockedByMovers(inputs.movers, ray);
}

/// Returns whether the rays' method says that the pair is dark: by voxels or by movers.
/// @param moverTestCount grows by one when movers were asked; may be null
/// @param blocker of isDarkByTriangles; may be null
SDAG_HD inline bool isDarkByRays(const RayInputs& inputs, const ShadowPair& pair,
                                 uint32_t* moverTestCount = nullptr, uint32_t* blocker = nullptr) {
    if (inputs.options.kind == RayKind::kExact)
        return isDarkByTriangles(inputs, pair, moverTestCount, blocker);
    if (isDarkByVoxels(inputs, pair))
        return true;
    if (!inputs.movers.mayShadow(pair.light))
        return false;
    if (moverTestCount)
        ++*moverTestCount;
    return isDarkByMovers(inputs.movers, pair);
}

} // namespace shadowdag
