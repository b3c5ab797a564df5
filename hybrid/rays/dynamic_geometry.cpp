// SPDX-License-Identifier: Apache-2.0
#include "hybrid/rays/dynamic_geometry.h"

#include "cuda/mutant.h"
#include "cuda/parallel_for.h"
#include "cuda/pass.h"

#include <algorithm>
#include <utility>

namespace shadowdag {

DynamicGeometry::DynamicGeometry(Backend backend)
    : moving_(backend, "moving batches"), moverOf_(backend, "movers of batches"),
      runBoxes_(backend, "mover run boxes"), boxes_(backend, "mover boxes"),
      items_(backend, "mover items"), nearLight_(backend, "lights near movers") {}

void DynamicGeometry::update(const World& world, const BatchView& batches, const TruthSpace& space,
                             const TriangleView& trianglesOnBackend,
                             const BatchView& batchesOnBackend) {
    if (!empty() && isMutant(Mutant::kMoversStale))
        return;
    movingBatches_.clear();
    hostBoxes_.clear();
    for (uint32_t b = 0; b < batches.batches.count; ++b)
        if (world.instances()[batches.batches[b].instance].isMoving) {
            movingBatches_.push_back(b);
            hostBoxes_.push_back(batches.boxesWorld[b]);
        }
    if (empty())
        return;
    hostBvh_.build(viewOf(hostBoxes_));
    const WideBvhView bvh = hostBvh_.view();
    hostItems_.resize(bvh.items.count);
    for (size_t i = 0; i < hostItems_.size(); ++i)
        hostItems_[i] = movingBatches_[bvh.items[i]];

    // A pair is nearer than the range, its ray starts a few c of truth.h from it.
    const Box& bounds = world.boundsWorld();
    const glm::vec3 largest = glm::max(glm::abs(bounds.min), glm::abs(bounds.max));
    const float slack =
        1e-5f *
        float(std::max({double(largest.x), double(largest.y), double(largest.z), space.diagonal}));
    const std::vector<Light>& lights = world.lights();
    hostNearLight_.resize(lights.size());
    parallelFor<CpuTag>(lights.size(), [&](size_t l) {
        const float reach = lights[l].rangeWorld * 1.0001f + slack;
        const glm::vec3 centre = lights[l].positionWorld;
        bool isNear = false;
        traverse(
            bvh,
            [&](const Box& box) { return !isNear && distanceSquared(box, centre) < reach * reach; },
            [&](uint32_t) { isNear = true; });
        hostNearLight_[l] = isNear;
    });
    boxes_.set(bvh.boxes);
    items_.set(hostItems_);
    nearLight_.set(hostNearLight_);

    std::vector<uint32_t> moverOf(batches.batches.count, 0);
    for (size_t m = 0; m < movingBatches_.size(); ++m)
        moverOf[movingBatches_[m]] = uint32_t(m);
    moverOf_.take(std::move(moverOf));
    moving_.take(movingBatches_);
    runsPerBatch_ = (batches.maxTriangleCount + kMoverRun - 1) / kMoverRun;
    runBoxes_.resize(movingBatches_.size() * runsPerBatch_);
    runPass(runBoxes_.backend(),
            BoundMoverRuns{trianglesOnBackend, batchesOnBackend.batches, batchesOnBackend.triangles,
                           moving_.view(), runsPerBatch_, runBoxes_.view()});
}

MoverView DynamicGeometry::view(const TruthGeometry& geometry, View<const Batch> batches,
                                View<const uint32_t> batchTriangles) const {
    if (empty())
        return {};
    WideBvhView bvh = hostBvh_.view();
    bvh.boxes = boxes_.view();
    bvh.items = items_.view();
    return {geometry,          batches,         batchTriangles,   bvh,
            nearLight_.view(), moverOf_.view(), runBoxes_.view(), runsPerBatch_};
}

MoverView DynamicGeometry::hostView(const TruthGeometry& geometry, const BatchView& batches) const {
    if (empty())
        return {};
    WideBvhView bvh = hostBvh_.view();
    bvh.items = viewOf(hostItems_);
    const bool isHere = runBoxes_.backend() == Backend::kCpu;
    return {geometry,
            batches.batches,
            batches.triangles,
            bvh,
            viewOf(hostNearLight_),
            isHere ? moverOf_.view() : View<const uint32_t>{},
            isHere ? runBoxes_.view() : View<const Box>{},
            runsPerBatch_};
}

} // namespace shadowdag
