// SPDX-License-Identifier: Apache-2.0
// Rays against what moves. The voxel DAG holds what never moves; a traced pair is dark when the
// DAG says so or when a moving triangle blocks the pair's own ray, which is the truth's
// (truth_ray.h): no offset, so what moves casts contact shadows.
#pragma once

#include "cuda/mutant.h"
#include "hybrid/rays/truth_ray.h"
#include "scenes/batches.h"
#include "scenes/segment_box.h"

namespace shadowdag {

/// The moving triangles of a world at its current time.
/// bvh: over the boxes of the moving batches alone; its items are indices into batches.
/// isNearLight: lightCount; 1 where the light's sphere touches the box of a moving batch. Empty:
/// nothing moves. Not covered: a receiver narrower than twice truth.h's c, whose ray may start far
/// from the sample.
struct MoverView {
    TruthGeometry geometry;
    View<const Batch> batches;           ///< all of the world
    View<const uint32_t> batchTriangles; ///< world triangles in batch order
    WideBvhView bvh;
    View<const uint8_t> isNearLight;

    /// Returns whether rays to this light have to be held against movers.
    SDAG_HD bool mayShadow(uint32_t light) const {
        return !isNearLight.empty() && isNearLight[light] != 0 && !isMutant(Mutant::kMoversIgnored);
    }
};

/// Returns the ray as the boxes of batches are held against it.
SDAG_HD inline BoxSegment moverSegment(const MoverView& movers, const TruthRay& ray) {
    const glm::dvec3 from = glm::dvec3(ray.startLocal) + movers.geometry.origin;
    return BoxSegment(from, from + glm::dvec3(ray.direction));
}

/// Returns whether a moving triangle blocks the ray.
SDAG_HD inline bool isBlockedByMovers(const MoverView& movers, const TruthRay& ray) {
    if (!(ray.tFar > 0.0f))
        return false;
    const BoxSegment segment = moverSegment(movers, ray);
    bool isBlocked = false;
    traverse(
        movers.bvh, [&](const Box& box) { return !isBlocked && segment.touches(box); },
        [&](uint32_t item) {
            const Batch batch = movers.batches[item];
            for (uint32_t i = batch.first; i < batch.first + batch.count && !isBlocked; ++i)
                isBlocked = blocksTruthRay(movers.geometry, ray, movers.batchTriangles[i]);
        });
    return isBlocked;
}

} // namespace shadowdag
