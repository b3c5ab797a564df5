// SPDX-License-Identifier: Apache-2.0
// The world on one backend, as the frame's passes read it.
#pragma once

#include "hybrid/gbuffer/shade_model.h"
#include "hybrid/rays/dynamic_geometry.h"
#include "hybrid/rays/embree_scene.h"
#include "hybrid/rays/exact_ray.h"
#include "hybrid/rays/shadow_rays.h"
#include "scenes/batches.h"
#include "scenes/polygon_lod.h"
#include "scenes/resident_base_colors.h"
#include "scenes/resident_geometry.h"
#include "scenes/world.h"
#include "voxel/dag.h"

#include <memory>
#include <vector>

namespace shadowdag {

/// The input of drawing shadow maps.
struct MapGeometry {
    TriangleView triangles;
    BatchView batches;
};

class SceneDevice;

/// Triangles, batches, lights, their hierarchy, materials and the DAG. World and dag outlive it.
/// Renderers that share one each have a MovedBatches of it.
class FrameScene {
public:
    FrameScene(Backend backend, const World& world, const Dag& dag,
               const BatchOptions& batchOptions = {});
    ~FrameScene();
    FrameScene(const FrameScene&) = delete;
    FrameScene& operator=(const FrameScene&) = delete;

    /// Follows World::setTime: batches of the moved instances, positions, all lights.
    /// @param stages receives the times of "batch boxes", "batch hierarchy" and "scene update", the
    /// rest
    /// @param ofLevels receives the times of the first two for levels of detail, if they are
    /// @param ofRays receives the "scene update" of the moving geometry, which only rays read. It
    /// is updated here if it was read since the last update, else when it is next read, in no stage
    void update(const std::vector<uint32_t>& movedInstances, StageTimes& stages,
                StageTimes& ofLevels, StageTimes& ofRays);

    /// Returns where passes run and buffers live.
    Backend backend() const { return backend_; }
    const World& world() const { return world_; }
    /// Returns the batches on the host, with their hierarchy.
    BatchView hostBatches() const { return batchSet_.view(); }
    /// Returns the geometry that maps draw, on the host. @param lodTexels as
    /// ShadowMapOptions::lodTexels; above 0: with levels of detail, made at the first request
    MapGeometry mapGeometry(float lodTexels);
    /// Returns the same on the backend; valid until the next update.
    MapGeometry mapGeometryOnBackend(float lodTexels);
    /// Returns the counts of the last update of the batches at full detail.
    const BatchUpdateCounts& batchUpdateCounts() const { return batchSet_.updateCounts(); }

    // On the backend:
    TriangleView triangles() const { return geometry_.triangles(); }
    BatchView batches() const { return geometry_.batches(batchSet_.view()); }
    View<const Light> lights() const { return lights_.view(); }
    WideBvhView lightBvh() const;
    View<const SurfaceColor> materials() const { return materials_.view(); }
    View<const uint32_t> triangleMaterial() const { return triangleMaterial_.view(); }
    /// Return the base colour textures and the instance of each triangle, which finds its texture
    /// coordinates; both empty in a world without textures.
    BaseColorView baseColors() const { return baseColors_.view(); }
    View<const uint32_t> triangleInstance() const { return triangleInstance_.view(); }
    DagView dag() const;
    /// Returns the DAG with coverages in its words (withCoverage), made at the first request.
    DagView coveredDag();
    /// Return both on the host.
    DagView hostDag() const { return hostDag_.view(); }
    DagView hostCoveredDag();
    /// Returns the moving geometry, which only rays read. This and the next three functions update
    /// it if update() has not.
    MoverView movers();
    /// Returns the moving geometry on the host.
    MoverView hostMovers();
    /// Returns the triangles for exact rays, with their hierarchy if it is prepared.
    ExactView exact() {
        readMovers();
        return {geometry(triangles()), {bvhNodes_.view(), bvhLeaves_.view(), bvh_.root}};
    }
    ExactView hostExact() {
        readMovers();
        return {geometry(world_.triangles()), bvh_.view()};
    }
    /// Builds the hierarchy over static triangles for exact rays, once.
    void prepareExact();
    /// Returns the bytes that exact rays read besides the DAG: the triangles and their hierarchy; 0
    /// until they are prepared.
    uint64_t exactBytes() const;
    /// Returns the bytes of Embree's structures and triangles; 0 until rays by Embree are prepared.
    uint64_t embreeBytes() const { return embree_ ? embree_->bytes() : 0; }
    /// Returns the scene on the device.
    SceneDevice& device() const { return *device_; }
    /// Returns the input of rays with these options; prepares what exact ones need. Throws Error
    /// kUsage for a level that the DAG does not have.
    /// @param isTraced false: no ray will be traced, so moving geometry and triangles are left out
    RayInputs rayInputs(const RayOptions& options, const RayDetail& detail, bool isTraced = true);
    /// Returns the same on the host, for single rays.
    /// @param detail on the host
    RayInputs hostRayInputs(const RayOptions& options, const RayDetail& detail);
    bool hasDag() const { return hostDag_.isBuilt(); }
    /// Returns whether rays with these options can be traced; a DAG without voxels blocks none.
    bool canTrace(const RayOptions& options) const { return options.believesNone() || hasDag(); }

private:
    friend class MovedBatches;
    void setMoved(const std::vector<uint32_t>& movedInstances);
    void setMoving();
    /// Copies the lights and the hierarchy over them to the backend if a light changed.
    void setLights();
    /// Makes what rays read besides the DAG follow the last update.
    void followMotion();
    void readMovers();
    void setBvh();
    /// Returns the bounds of all positions. Cost: those that move; the first time, all.
    Box boundsOfPositions();
    /// Builds what rays with these options read besides the DAG, once.
    void prepare(const RayOptions& options);
    TruthGeometry geometry(const TriangleView& triangles) const {
        return {triangles, space_.origin, space_.diagonal};
    }

    Backend backend_;
    const World& world_;
    const Dag& hostDag_;
    WideDag wideDag_; // for rays on the CPU
    Dag coveredDag_;  // for LodRule::kCoverage; empty until then, as what follows
    std::vector<uint32_t> wideCoverage_;
    BatchOptions batchOptions_;
    BatchSet batchSet_;
    std::unique_ptr<PolygonLod> polygonLod_;     // for mapGeometry; null until then
    std::vector<class MovedBatches*> listeners_; // all that there are
    bool isUpdating_ = false;                    // true between updates: one was cancelled
    bool isFollowed_ = false;                    // by what rays read
    bool areMoversRead_ = false;                 // since the last update
    TruthSpace space_;
    Box stillBounds_; ///< of the positions of instances that never move, with hasStillBounds_
    bool hasStillBounds_ = false;
    DynamicGeometry movers_;
    TriangleBvh bvh_;
    bool hasBvh_ = false;
    std::unique_ptr<EmbreeScene> embree_; // null until TriangleRays::kEmbree is asked for
    WideBvh hostLightBvh_;
    std::vector<SurfaceColor> hostMaterials_;

    ResidentGeometry geometry_, levelGeometry_; // the second for polygonLod_
    Resident<Light> lights_;
    std::vector<Light> setLights_; // those of lights_ and its hierarchy
    bool areLightsSet_ = false;    // setLights_ are on the backend
    Resident<Box> lightBoxes_;
    Resident<uint32_t> lightItems_;
    Resident<SurfaceColor> materials_;
    Resident<uint32_t> triangleMaterial_;
    ResidentBaseColors baseColors_;
    Resident<uint32_t> triangleInstance_; // for baseColors_
    Resident<uint32_t> dagWords_;
    Resident<uint32_t> coveredWords_;
    Resident<TriangleBvhNode> bvhNodes_;
    Resident<TriangleBvhLeaf> bvhLeaves_;
    std::unique_ptr<SceneDevice> device_;
};

/// The motion that updates of a scene caused, for one of its renderers, which reads it when it
/// draws.
class MovedBatches {
public:
    /// @param scene outlives it
    explicit MovedBatches(FrameScene& scene);
    ~MovedBatches();
    MovedBatches(const MovedBatches&) = delete;
    MovedBatches& operator=(const MovedBatches&) = delete;

    /// Returns the batches of mapGeometry(lodTexels) that updates moved since the last call, each
    /// once, ascending.
    std::vector<uint32_t> take(float lodTexels);

private:
    friend class FrameScene;
    FrameScene& scene_;
    std::vector<uint32_t> full_, levels_; // ascending; until taken
};

} // namespace shadowdag
