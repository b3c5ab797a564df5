// SPDX-License-Identifier: Apache-2.0
// Polygon level of detail: every part of an instance at several triangle counts, over the same
// vertices, for maps that need no more. The view, rays and the truth always use the full detail.
#pragma once

#include "scenes/batches.h"
#include "scenes/polygon_levels.h"
#include "scenes/world.h"

#include <memory>
#include <vector>

namespace shadowdag {

/// Simplified triangles in their own space.
struct PolygonLevel {
    std::vector<glm::uvec3> triangles; ///< into the positions of the full ones
    float error;                       ///< distance to the full surface, object units
};

/// Returns levels of half the triangles each, finest first, without the full one: fewer than
/// kMaxPolygonLevels, none where less than a sixth of the triangles went. Simplified by edge
/// collapse (meshoptimizer; Garland and Heckbert, Surface Simplification Using Quadric Error
/// Metrics, SIGGRAPH 1997) that keeps vertices in place and the mesh's topology.
///
/// Errors ascend. Each is the greater of the simplifier's own and of distances measured both ways
/// at corners and centres of the full triangles, centres and middles of edges of the others. Points
/// in between may be farther; tests found at most a quarter more.
/// @param keepsBorder leaves every edge in place that only one triangle has
std::vector<PolygonLevel> simplify(const TriangleView& full, bool keepsBorder);

/// A compact part of a mesh, and its levels.
struct MeshPart {
    std::vector<uint32_t> triangles;  ///< of the mesh
    std::vector<PolygonLevel> levels; ///< into the mesh's positions
};

/// Returns the parts of a mesh, which contain each triangle once: the clusters of the agglomeration
/// (batches.h) at kMaxBatchTriangleCount triangles. A large mesh, such as a fence around a village,
/// is near to every light; its parts are not. Parts meet in edges that all levels keep, so
/// neighbours may be drawn at any two levels without a gap.
std::vector<MeshPart> simplifyMesh(const Mesh& mesh);

/// The levels of a world's instances, as triangles and batches of their own. The world outlives it.
class PolygonLod {
public:
    /// Simplifies each mesh once. An instance with a triangle that an alpha mask cuts keeps its
    /// full level alone: its holes are bound to its triangles. So does one whose mesh a skin or
    /// morph targets deform: errors are measured in the mesh's own space. Deterministic.
    /// @param options of the batches of all levels
    PolygonLod(const World& world, const BatchOptions& options = {});
    /// Follows World::setTime, as BatchSet::update. Errors grow with an instance's scale.
    /// @param stages as BatchSet::update has it
    void update(const std::vector<uint32_t>& movedInstances, StageTimes* stages = nullptr);

    /// Returns the world's triangles, followed by those of all other levels. Valid until the next
    /// update.
    TriangleView triangles() const;
    /// Returns the batches of all levels over triangles(), every level over its own batches, with
    /// their levels. @param allowedTexels of PolygonLevelsView
    BatchView batches(float allowedTexels) const;
    /// Returns the same with the moved batches.
    const BatchSet& batchSet() const { return *batchSet_; }
    size_t partCount() const { return parts_.size(); }
    /// Returns the instance of a part; those of an instance follow each other.
    uint32_t instanceOf(uint32_t part) const { return parts_[part].instance; }
    /// Returns how many triangles a part has at a level; 0 where it has no such level.
    uint32_t triangleCount(uint32_t part, uint32_t level) const {
        return groupTriangles_[level * parts_.size() + part];
    }

private:
    struct Part {
        uint32_t instance;
        uint32_t mesh;
        uint32_t inMesh;
    };
    void gather();
    void place(uint32_t part);

    const World& world_;
    std::vector<std::vector<MeshPart>> meshParts_; // triangles are dropped once gathered
    std::vector<Part> parts_;
    std::vector<uint32_t> firstPart_; // instanceCount + 1

    // Of all levels. Group: level * partCount + part.
    std::vector<glm::uvec3> triangles_;
    std::vector<uint32_t> cuts_;           // as AlphaMaskView::triangleCut; empty: none is cut
    std::vector<uint32_t> groupOf_;        // by triangle
    std::vector<uint32_t> groupTriangles_; // count of triangles
    std::vector<uint8_t> isGroupMoving_;

    std::unique_ptr<BatchSet> batchSet_;
    std::vector<uint32_t> firstBatch_; // partCount + 1, of level 0
    std::vector<Box> partBoxes_;
    std::vector<float> errorsWorld_;
};

} // namespace shadowdag
