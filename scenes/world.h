// SPDX-License-Identifier: Apache-2.0
// The scene at one time, in world space: instanced triangles, lights, cameras. Every method and the
// truth read it, so that all of them have the same floats.
#pragma once

#include "cuda/view.h"
#include "scenes/posed_mesh.h"
#include "scenes/scene.h"

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace shadowdag {

/// Triangles in world space on one backend.
/// positions: vertexCount * vec3 world; triangles: triangleCount * uvec3 into positions. masks:
/// what is cut out of them; empty: nothing.
struct TriangleView {
    View<const glm::vec3> positions;
    View<const glm::uvec3> triangles;
    AlphaMaskView masks = {};

    SDAG_HD size_t count() const { return triangles.count; }
    SDAG_HD glm::vec3 vertex(size_t triangle, int corner) const {
        return positions[triangles[triangle][corner]];
    }
};

/// One placed mesh: a run of vertices and a run of triangles of the world arrays.
struct Instance {
    uint32_t node;
    uint32_t mesh;
    uint32_t firstVertex, vertexCount;
    uint32_t firstTriangle, triangleCount;
    bool isMoving; ///< an animation moves this node or an ancestor, or deforms the mesh
    glm::mat4 worldFromObject;
};

/// How missing lights and cameras of a scene are added.
struct WorldOptions {
    /// A light without an authored range gets the radius at which its strongest channel's
    /// intensity / d^2 falls to this, lux.
    float rangeCutoff = 0.05f;
    /// >= 0: all authored lights are replaced by this many seeded point lights, each in free space
    /// near surfaces; -1: authored lights only.
    int placedLightCount = -1;
    uint64_t seed = 1;
    /// More instanced triangles than this are refused before memory is taken for them.
    uint64_t maxTriangleCount = 200'000'000;
};

/// The scene in world space at one time. Triangles keep their index over time: only positions of
/// moving instances change. Degenerate triangles are kept (all later stages must handle them).
class World {
public:
    /// Flattens the default scene at time 0: nodes in index order, each mesh's triangles in their
    /// order, corners swapped where the node mirrors at time 0. Morph targets and skins deform
    /// meshes (posed_mesh.h). Matrices and positions are computed in double, positions then rounded
    /// once to float. Throws Error kInput when there is no triangle, or when a world position is
    /// not finite or beyond kMaxCoordinate; Error kResource when instancing exceeds
    /// options.maxTriangleCount. Lights that emit nothing are left out. The scene must outlive the
    /// world.
    World(const Scene& scene, const WorldOptions& options);

    /// Moves everything to `timeSeconds`; returns the indices of moving instances, ascending, whose
    /// vertices were recomputed. Corner order stays that of time 0. Depends on the time alone,
    /// not on earlier calls. Throws as the constructor does; the world is then unusable.
    std::vector<uint32_t> setTime(float timeSeconds);

    float timeSeconds() const { return timeSeconds_; }
    const Scene& scene() const { return *scene_; }
    TriangleView triangles() const {
        return {viewOf(positions_), viewOf(triangles_), masks_.view()};
    }
    /// Returns the triangles of instances that never move (indices into triangles()), ascending.
    const std::vector<uint32_t>& staticTriangles() const { return staticTriangles_; }
    const std::vector<uint32_t>& triangleMaterial() const { return triangleMaterial_; }
    const std::vector<uint32_t>& triangleInstance() const { return triangleInstance_; }
    /// Returns the base colour textures of all materials; empty if no triangle has one.
    BaseColorView baseColors() const;
    const std::vector<Instance>& instances() const { return instances_; }
    const std::vector<Light>& lights() const { return lights_; }
    /// Returns the cameras of the scene at the current time, in node order; may be empty.
    const std::vector<Camera>& cameras() const { return cameras_; }
    /// Returns the bounds of all triangles at the current time.
    const Box& boundsWorld() const { return bounds_; }
    /// Returns the bounds of staticTriangles(), the same at every time, which determine the voxel
    /// grid. If every instance moves, the bounds of all triangles at time 0.
    const Box& staticBoundsWorld() const { return staticBounds_; }

    /// Returns a 128-bit hash, 32 hex digits, of the corners of staticTriangles(), in order, as
    /// their bits, and of their masks. Together with a resolution it names a voxel asset of this
    /// scene, provided that its grid encloses staticBoundsWorld(): boundsWorld() also includes
    /// moving triangles, which the hash does not cover. Every scene without static triangles has
    /// the same hash.
    std::string geometryHash() const;
    /// Returns a 128-bit hash, 32 hex digits, of the vertices, triangles and lights at the current
    /// time: with geometryHash(), which has the masks of what stands still, of what the pairs of a
    /// view and their shadows depend on. Not of materials, cameras and animations.
    std::string contentHash() const;
    /// Returns a 128-bit hash, 32 hex digits, of the lights at the current time.
    std::string lightHash() const;

private:
    void placeSkins();
    void updateTransforms(bool movingOnly);
    bool isInstanceMoving(uint32_t node) const;
    std::span<const glm::dmat4> worldFromMeshOf(uint32_t node) const;
    MeshPose poseOf(uint32_t node) const;
    void placeVertices(const Instance& instance);
    void requireWithinReach(uint32_t node, const std::string& what) const;
    void refuseWithoutArea() const;
    void cutTriangles();
    void mapTextures();
    void updateLightsAndCameras();
    /// Moves what moves to the current time; returns setTime's instances.
    std::vector<uint32_t> moveInstances();
    void updateBounds();

    const Scene* scene_;
    WorldOptions options_;
    std::vector<uint32_t> placedNodes_; // of the default scene, and joints; parents before children
    std::vector<uint8_t> isNodeReachable_; // nodeCount
    std::vector<uint8_t> isNodeMoving_;    // nodeCount; an animation moves it or an ancestor
    std::vector<std::vector<uint32_t>> nodeChannels_;   // nodeCount; into channels_
    std::vector<std::vector<uint32_t>> weightChannels_; // nodeCount; the same, of morph targets
    std::vector<const AnimationChannel*> channels_;     // one a (node, path, morph target)
    std::vector<glm::dmat4> worldFromNode_;             // nodeCount
    /// skinCount; of each joint at the current time. Empty: no node of the scene has the skin.
    std::vector<std::vector<glm::dmat4>> worldFromMeshOfSkin_;
    std::vector<uint8_t> isSkinMoving_; // skinCount; an animation moves a joint
    std::vector<Light> placedLights_;   // replace the authored ones when asked for
    Box staticBounds_; // of staticTriangles_; of all triangles at time 0 when there are none
    float timeSeconds_ = 0;
    std::vector<glm::vec3> positions_;
    std::vector<glm::uvec3> triangles_;
    AlphaMaskSet masks_;
    std::vector<uint32_t> materialTexture_, instanceUv_; // empty without textures, as uv_
    std::vector<glm::vec2> uv_;
    std::vector<uint32_t> staticTriangles_;
    std::vector<uint32_t> triangleMaterial_;
    std::vector<uint32_t> triangleInstance_;
    std::vector<Instance> instances_;
    std::vector<Light> lights_;
    std::vector<Camera> cameras_;
    Box bounds_;
};

/// Returns the best automatic camera (camera_placement.h gives several). It stands in the scene's
/// open space (open_space.h: no gap, no solid, no outside of a sealed map) or near a light and sees
/// a large and varied part of it, or all of a scene without surroundings from outside. From up to
/// 350 places 80 directions are tried; each window of 3 x 3 rays is scored, and the best 80 again
/// with 16 x 9 rays of the actual field of view. The score is a product of
/// - how far the rays reach, d / (d + 2 typical openness) on average;
/// - variety: the chance that two rays differ in octave of distance or main axis of the normal, and
///   the share of neighbouring rays between which depth or normal jumps;
/// - one less the share of rays that are nearer than 3/10 of the typical openness, twice counted,
///   that escape more than is usual here, and that see more back faces than that, each squared;
/// - whole objects: what jumps of depth or normal enclose and the frame does not cut;
/// - lights, if the world has any: lights per sample (best up to 16), how many of them light
///   something, samples that none reaches or lights, the share of shadow rays that are blocked
///   (best from 3/10 to 6/10).
/// Deterministic in the triangles and lights as they stand now; assumes no scale; uses no libm but
/// the square root.
Camera placeCamera(const World& world);

} // namespace shadowdag
