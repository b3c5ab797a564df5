// SPDX-License-Identifier: Apache-2.0
// What moves in a world, kept current for rays.
#pragma once

#include "cuda/resident.h"
#include "hybrid/rays/mover_rays.h"

#include <vector>

namespace shadowdag {

/// The hierarchy over the moving batches and the lights that they may shadow.
class DynamicGeometry {
public:
    explicit DynamicGeometry(Backend backend);

    /// Follows World::setTime and BatchSet::update; builds the hierarchy anew, because what moves
    /// leaves its place along the curve. Nothing but a look at the instances where none moves.
    /// Cost: linear in moving triangles, and lights times a search among their batches.
    /// @param trianglesOnBackend,batchesOnBackend the world's triangles and `batches` on this
    /// object's backend, at the world's time
    void update(const World& world, const BatchView& batches, const TruthSpace& space,
                const TriangleView& trianglesOnBackend, const BatchView& batchesOnBackend);

    /// Returns whether anything moves.
    bool empty() const { return hostBoxes_.empty(); }

    /// Returns the movers with the backend's views of what the world and its batches hold.
    MoverView view(const TruthGeometry& geometry, View<const Batch> batches,
                   View<const uint32_t> batchTriangles) const;
    /// Returns the same on the host, without boxes of runs on another backend.
    MoverView hostView(const TruthGeometry& geometry, const BatchView& batches) const;

private:
    std::vector<uint32_t> movingBatches_;
    std::vector<Box> hostBoxes_;
    WideBvh hostBvh_;
    std::vector<uint32_t> hostItems_; ///< of the hierarchy, as indices of all batches
    std::vector<uint8_t> hostNearLight_;
    uint32_t runsPerBatch_ = 0;
    Resident<uint32_t> moving_;  // movingBatches_
    Resident<uint32_t> moverOf_; // MoverView::moverOf
    Buffer<Box> runBoxes_;
    Resident<Box> boxes_;
    Resident<uint32_t> items_;
    Resident<uint8_t> nearLight_;
};

} // namespace shadowdag
