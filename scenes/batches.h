// SPDX-License-Identifier: Apache-2.0
// Batches of 128 triangles by default: the unit in which geometry is culled and drawn
// into shadow maps. Source: Olsson et al., More Efficient Virtual Shadow Maps for Many Lights, TVCG
// 2015, sec. IV-G.
#pragma once

#include "cuda/timer.h"
#include "scenes/polygon_levels.h"
#include "scenes/wide_bvh.h"
#include "scenes/world.h"

namespace shadowdag {

constexpr uint32_t kMaxBatchTriangleCount = 512;

/// Where the tree of clusters is cut into batches.
enum class BatchCut : uint32_t {
    kFull,    ///< clusters that together would exceed a batch never merge: fewer, fuller batches
    kSubtree, ///< the tree is finished first; batches are its largest subtrees that fit (the paper)
};

/// How triangles are grouped into batches. This changes the batches drawn into maps, not the maps'
/// content.
struct BatchOptions {
    uint32_t maxTriangleCount = 128; ///< 1..kMaxBatchTriangleCount
    BatchCut cut = BatchCut::kFull;
};

/// A run of batchTriangles; all its triangles belong to one instance (one transform).
struct Batch {
    uint32_t first;    ///< into BatchSet::triangles
    uint32_t count;    ///< 1..kMaxBatchTriangleCount
    uint32_t instance; ///< of the world
};

/// The corners of a triangle: numbers of vertices of its batch.
struct BatchCorners {
    uint16_t of[3];
};
static_assert(3 * kMaxBatchTriangleCount <= 0x10000);

/// The positions that the triangles of each batch need, each once and side by side: a batch is read
/// from front to back, where following the indices of its triangles waits for memory scattered over
/// the whole world. On the host alone.
struct BatchVerticesView {
    /// So many more positions follow the last: lanes read up to the next multiple of eight.
    static constexpr uint32_t kPadding = 7;

    View<const uint32_t> first;       ///< batchCount + 1, into `positions`
    View<const glm::vec3> positions;  ///< world space, of the last update, and kPadding more
    View<const BatchCorners> corners; ///< by triangle in batch order

    SDAG_HD uint32_t count(size_t batch) const { return first[batch + 1] - first[batch]; }
};

struct BatchView {
    View<const Batch> batches;
    View<const Box> boxesWorld;     ///< batchCount, closed, of the current positions
    View<const uint32_t> triangles; ///< triangleCount; world triangle indices in batch order
    WideBvhView bvh;                ///< over boxesWorld
    uint32_t maxTriangleCount = 0;  ///< no batch holds more
    PolygonLevelsView levels;       ///< empty: all batches have the same level
    BatchVerticesView vertices;     ///< on the host; empty in views of another backend
};

/// Counts of the last update of a set of batches.
struct BatchUpdateCounts {
    uint32_t comparedBatchCount = 0; ///< batches of the instances named
    uint32_t boxCount = 0;           ///< batch boxes recomputed: those of movedBatches()
    BvhUpdateCounts hierarchy;       ///< codes sorted again, boxes of the hierarchy written
};

/// What an update changed in the arrays of a BatchView; ranges ascend.
struct MovedBatchRanges {
    std::vector<ArrayRange> boxes, bvhBoxes, bvhItems;
};

/// The batches of a world on the host: built offline once, kept current when instances move.
class BatchSet {
public:
    /// Partitions every triangle of the world into batches that are compact in space
    /// (deterministic).
    /// Throws Error kUsage for a size out of bounds.
    explicit BatchSet(const World& world, const BatchOptions& options = {});
    /// The same for bare triangles. @param triangleInstance one value a triangle
    /// @param isInstanceMoving one flag for every value of triangleInstance; empty: none is known
    /// to
    BatchSet(const TriangleView& geometry, const std::vector<uint32_t>& triangleInstance,
             const BatchOptions& options = {}, const std::vector<uint8_t>& isInstanceMoving = {});
    /// Follows World::setTime: takes the positions of the named instances, whose indices are those
    /// of construction; recomputes the boxes of those of their batches that moved, sorts again
    /// those that left their position along the Morton curve, and refits the boxes above them.
    /// Static batches cost nothing. The result is that of a set built now. @param stages receives
    /// the times of "batch boxes" and "batch hierarchy"; may be null
    void update(const World& world, const std::vector<uint32_t>& movedInstances,
                StageTimes* stages = nullptr);
    void update(const TriangleView& geometry, const std::vector<uint32_t>& movedInstances,
                StageTimes* stages = nullptr);
    /// Returns the batches with a corner that moved between the last two updates, at the first one
    /// since construction; ascending. An instance that was named but did not move moves none.
    const std::vector<uint32_t>& movedBatches() const { return movedBatches_; }
    /// Returns the world boxes of movedBatches() before the last update, one per batch.
    const std::vector<Box>& movedBoxesBefore() const { return movedBoxesBefore_; }
    const BatchUpdateCounts& updateCounts() const { return updateCounts_; }
    /// Returns what the last update changed, or a little more.
    MovedBatchRanges movedRanges() const;
    /// Returns views of this object's arrays; valid until the next update.
    BatchView view() const;
    size_t size() const { return batches_.size(); }

private:
    void updateBoxes(const TriangleView& geometry, const std::vector<uint32_t>& movedInstances);
    /// Finds the vertices of every batch.
    void gatherVertices(const TriangleView& geometry);
    /// Replaces the positions of a batch, and adds them to `box`; returns whether one differs.
    bool keepPositions(const TriangleView& geometry, uint32_t batch, Box& box);

    std::vector<Batch> batches_;
    std::vector<Box> boxes_;
    std::vector<uint32_t> triangles_;
    uint32_t maxTriangleCount_;
    std::vector<uint32_t> movedBatches_;
    std::vector<Box> movedBoxesBefore_;
    BatchUpdateCounts updateCounts_;
    std::vector<uint32_t> firstVertex_;      ///< as BatchVerticesView::first
    std::vector<uint32_t> vertices_;         ///< of the geometry
    std::vector<glm::vec3> positions_;       ///< as BatchVerticesView::positions
    std::vector<BatchCorners> corners_;      ///< by triangle in batch order
    std::vector<uint8_t> isUpdateCancelled_; ///< by batch: its last update
    WideBvh bvh_;
};

} // namespace shadowdag
