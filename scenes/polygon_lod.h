// SPDX-License-Identifier: Apache-2.0
// Polygon level of detail: every instance at several triangle counts, over the same vertices, for
// maps that need no more. Not for the view, rays or the truth: they see the full triangles.
#pragma once

#include "scenes/batches.h"
#include "scenes/polygon_levels.h"
#include "scenes/world.h"

#include <vector>

namespace shadowdag {

/// A simplified mesh in its own space.
struct MeshLevel {
    std::vector<glm::uvec3> triangles; ///< into the mesh's positions
    float error;                       ///< distance to the full surface, object units
};

/// Returns levels of half the triangles each, finest first, without the full one: fewer than
/// kMaxPolygonLevels, none where less than a sixth of the triangles went. Simplified by edge
/// collapse (meshoptimizer; Garland and Heckbert, Surface Simplification Using Quadric Error
/// Metrics, SIGGRAPH 1997) that keeps vertices in place and the mesh's topology.
///
/// Errors ascend. Each is the greater of the simplifier's own and of distances measured both ways
/// at corners and centres of the full triangles, centres and middles of edges of the others. Not
/// guaranteed: that no point in between is farther; what tests found there is within a quarter
/// more.
std::vector<MeshLevel> simplifyMesh(const Mesh& mesh);

/// The levels of a world's instances, as triangles and batches of their own. The world outlives it.
class PolygonLod {
public:
    /// Simplifies each mesh once. An instance with a triangle that an alpha mask cuts keeps its
    /// full level alone: its holes are bound to its triangles. Deterministic. @param options of the
    /// batches of all levels
    PolygonLod(const World& world, const BatchOptions& options = {});
    /// Follows World::setTime, as BatchSet::update. Errors grow with an instance's scale.
    void update(const std::vector<uint32_t>& movedInstances);

    /// Returns the world's triangles, followed by those of all other levels. Valid until the next
    /// update.
    TriangleView triangles() const;
    /// Returns the batches of all levels over triangles(), every level over its own batches, with
    /// their levels. @param allowedTexels of PolygonLevelsView
    BatchView batches(float allowedTexels) const;
    /// Returns the same with what moved.
    const BatchSet& batchSet() const { return batchSet_; }
    /// Returns how many triangles an instance has at a level; 0 where it has no such level.
    uint32_t triangleCount(uint32_t instance, uint32_t level) const;

private:
    struct Triangles {
        std::vector<glm::uvec3> triangles;
        std::vector<uint32_t> cuts;           ///< as AlphaMaskView::triangleCut; empty: none is cut
        std::vector<uint32_t> group;          ///< by triangle: level * instanceCount + instance
        std::vector<uint8_t> isGroupMoving;   ///< levels * instanceCount
        std::vector<uint32_t> groupTriangles; ///< count of triangles, the same
    };
    static Triangles gather(const World& world, const std::vector<std::vector<MeshLevel>>& levels);
    void place(uint32_t instance);

    const World& world_;
    std::vector<std::vector<MeshLevel>> meshLevels_; // triangles are dropped once placed
    Triangles all_;
    BatchSet batchSet_;
    std::vector<uint32_t> firstBatch_; // instanceCount + 1, of level 0
    std::vector<Box> instanceBoxes_;
    std::vector<float> errorsWorld_;
};

} // namespace shadowdag
