// SPDX-License-Identifier: Apache-2.0
// Batches of at most 128 triangles: the unit in which geometry is culled and drawn into shadow
// maps. Source: Olsson et al., More Efficient Virtual Shadow Maps for Many Lights, TVCG 2015, sec.
// IV-G.
#pragma once

#include "scenes/wide_bvh.h"
#include "scenes/world.h"

namespace shadowdag {

constexpr uint32_t kMaxBatchTriangleCount = 128;

/// A run of batchTriangles; all its triangles belong to one instance (one transform).
struct Batch {
    uint32_t first;    ///< into BatchSet::triangles
    uint32_t count;    ///< 1..kMaxBatchTriangleCount
    uint32_t instance; ///< of the world
};

struct BatchView {
    View<const Batch> batches;
    View<const Box> boxesWorld;     ///< batchCount, closed, of the current positions
    View<const uint32_t> triangles; ///< triangleCount; world triangle indices in batch order
    WideBvhView bvh;                ///< over boxesWorld
};

/// The batches of a world on the host, rebuilt offline once and refitted when instances move.
class BatchSet {
public:
    /// Partitions every triangle of the world into batches that are compact in space
    /// (deterministic).
    explicit BatchSet(const World& world);
    /// The same for bare triangles. @param triangleInstance one value a triangle
    BatchSet(const TriangleView& geometry, const std::vector<uint32_t>& triangleInstance);
    /// Recomputes boxes (and hierarchy) of the batches of these instances after World::setTime.
    void update(const World& world, const std::vector<uint32_t>& movedInstances);
    void update(const TriangleView& geometry, const std::vector<uint32_t>& movedInstances);
    /// Returns the batches with a corner that the last update found elsewhere than the one before,
    /// ascending. An instance that was named but stands where it stood moves none. Of an instance
    /// that no animation moves (World), or of bare triangles, the first update knows no corners
    /// from before: it takes all its batches for moved.
    const std::vector<uint32_t>& movedBatches() const { return movedBatches_; }
    /// Returns the world boxes of movedBatches() before the last update, one a batch.
    const std::vector<Box>& movedBoxesBefore() const { return movedBoxesBefore_; }
    /// Returns views of this object's arrays; valid while it lives.
    BatchView view() const;
    size_t size() const { return batches_.size(); }

private:
    bool keepCorners(const TriangleView& geometry, uint32_t batch);

    std::vector<Batch> batches_;
    std::vector<Box> boxes_;
    std::vector<uint32_t> triangles_;
    std::vector<uint32_t> movedBatches_;
    std::vector<Box> movedBoxesBefore_;
    /// By batch: where its corners at the last update stand in corners_, kNoCorners before any.
    std::vector<size_t> firstCorner_;
    std::vector<glm::vec3> corners_; ///< three a triangle of the batches that were ever updated
    WideBvh bvh_;
};

} // namespace shadowdag
