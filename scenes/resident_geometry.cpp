// SPDX-License-Identifier: Apache-2.0
#include "scenes/resident_geometry.h"

namespace shadowdag {

ResidentGeometry::ResidentGeometry(Backend backend, const std::string& name)
    : backend_(backend), positions_(backend, name + " positions"),
      triangles_(backend, name + " triangles"), triangleCut_(backend, name + " triangle cuts"),
      cuts_(backend, name + " cut triangles"), masks_(backend, name + " alpha masks"),
      maskWords_(backend, name + " alpha mask words"), batches_(backend, name + " batches"),
      boxes_(backend, name + " batch boxes"), batchTriangles_(backend, name + " batch triangles"),
      bvhBoxes_(backend, name + " hierarchy boxes"), bvhItems_(backend, name + " hierarchy items"),
      partBoxes_(backend, name + " part boxes"), levelErrors_(backend, name + " level errors") {}

void ResidentGeometry::set(const TriangleView& triangles, const BatchView& batches) {
    triangles_.set(triangles.triangles);
    triangleCut_.set(triangles.masks.triangleCut);
    cuts_.set(triangles.masks.cuts);
    masks_.set(triangles.masks.masks);
    maskWords_.set(triangles.masks.words);
    batches_.set(batches.batches);
    batchTriangles_.set(batches.triangles);
    positions_.set(triangles.positions);
    boxes_.set(batches.boxesWorld);
    bvhBoxes_.set(batches.bvh.boxes);
    bvhItems_.set(batches.bvh.items);
    setLevels(batches);
}

void ResidentGeometry::setMoved(const TriangleView& triangles, const BatchView& batches,
                                const std::vector<ArrayRange>& movedPositions,
                                const MovedBatchRanges& movedBatches) {
    positions_.setChanged(triangles.positions, movedPositions);
    boxes_.setChanged(batches.boxesWorld, movedBatches.boxes);
    bvhBoxes_.setChanged(batches.bvh.boxes, movedBatches.bvhBoxes);
    bvhItems_.setChanged(batches.bvh.items, movedBatches.bvhItems);
    setLevels(batches);
}

void ResidentGeometry::setLevels(const BatchView& batches) {
    partBoxes_.set(batches.levels.partBoxes);
    levelErrors_.set(batches.levels.errorsWorld);
}

TriangleView ResidentGeometry::triangles() const {
    return {positions_.view(),
            triangles_.view(),
            {triangleCut_.view(), cuts_.view(), masks_.view(), maskWords_.view()}};
}

BatchView ResidentGeometry::batches(const BatchView& host) const {
    BatchView view = host;
    view.batches = batches_.view();
    view.boxesWorld = boxes_.view();
    view.triangles = batchTriangles_.view();
    view.bvh.boxes = bvhBoxes_.view();
    view.bvh.items = bvhItems_.view();
    view.levels.partBoxes = partBoxes_.view();
    view.levels.errorsWorld = levelErrors_.view();
    if (backend_ != Backend::kCpu)
        view.vertices = {};
    return view;
}

} // namespace shadowdag
