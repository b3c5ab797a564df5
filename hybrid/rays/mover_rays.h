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

/// Triangles of a moving batch that have a box of their own, in the batch's order. Other numbers
/// were not measured.
constexpr uint32_t kMoverRun = 8;

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
    View<const uint32_t> moverOf; ///< by batch of `batches`: its number among the moving ones
    View<const Box> runBoxes;     ///< runsPerBatch a moving batch; empty: they are not known
    uint32_t runsPerBatch = 0;

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

/// Returns whether a triangle of a moving batch blocks the ray. @param segment moverSegment
SDAG_HD inline bool isBlockedByBatch(const MoverView& movers, uint32_t batchIndex,
                                     const BoxSegment& segment, const TruthRay& ray) {
    const Batch batch = movers.batches[batchIndex];
    const Box* const boxes =
        movers.runBoxes.empty()
            ? nullptr
            : &movers.runBoxes[size_t(movers.moverOf[batchIndex]) * movers.runsPerBatch];
    for (uint32_t first = 0; first < batch.count; first += kMoverRun) {
        if (boxes && !segment.touches(boxes[first / kMoverRun]))
            continue;
        const uint32_t end = glm::min(first + kMoverRun, batch.count);
        for (uint32_t i = first; i < end; ++i)
            if (blocksTruthRay(movers.geometry, ray, movers.batchTriangles[batch.first + i]))
                return true;
    }
    return false;
}

/// Returns whether a moving triangle blocks the ray.
SDAG_HD inline bool isBlockedByMovers(const MoverView& movers, const TruthRay& ray) {
    if (!(ray.tFar > 0.0f))
        return false;
    const BoxSegment segment = moverSegment(movers, ray);
    bool isBlocked = false;
    traverse(
        movers.bvh, [&](const Box& box) { return !isBlocked && segment.touches(box); },
        [&](uint32_t batch) {
            isBlocked = isBlocked || isBlockedByBatch(movers, batch, segment, ray);
        });
    return isBlocked;
}

/// Writes the box of run i: MoverView::runBoxes.
struct BoundMoverRuns {
    TriangleView triangles;
    View<const Batch> batches;
    View<const uint32_t> batchTriangles;
    View<const uint32_t> movingBatches;
    uint32_t runsPerBatch;
    View<Box> runBoxes;

    size_t itemCount() const { return runBoxes.count; }
    SDAG_HD void operator()(size_t i) const {
        const Batch batch = batches[movingBatches[i / runsPerBatch]];
        const uint32_t first = uint32_t(i % runsPerBatch) * kMoverRun;
        Box box;
        for (uint32_t t = first; t < glm::min(first + kMoverRun, batch.count); ++t)
            for (int corner = 0; corner < 3; ++corner)
                box.add(triangles.vertex(batchTriangles[batch.first + t], corner));
        runBoxes[i] = box;
    }
};

} // namespace shadowdag
