// SPDX-License-Identifier: Apache-2.0
// From SCENE and options to what a frame needs: world, camera, voxels (built, cached or read).
#pragma once

#include "hybrid/frame.h"
#include "tools/settings/console.h"
#include "tools/settings/experiment.h"
#include "voxel/asset.h"

#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace shadowdag {

/// A scene, flattened. Movable: the world refers to the scene through the pointer.
struct LoadedScene {
    std::string argument; ///< as the user named it
    std::string name;     ///< as sceneNames() gives it
    std::string geometryHash;
    std::unique_ptr<Scene> scene;
    std::unique_ptr<World> world;
};

/// Returns what scenes are called in results: the file's name without directories, or the path
/// where that would not tell two scenes apart. Throws Error kUsage when a scene is named twice.
std::vector<std::string> sceneNames(const std::vector<std::string>& arguments);

/// Loads SCENE and places lights. Warnings go to standard error. Throws as loadScene does; with
/// `needsLights`, Error kInput when there is no light.
LoadedScene loadSceneAndWorld(const std::string& sceneArgument, int lightCount, uint64_t lightSeed,
                              bool needsLights, const Console& console);

/// Loads a scene of an experiment, under the name that tells it apart, with its lights. Throws as
/// loadSceneAndWorld and checkCamera do.
LoadedScene openScene(const Experiment& experiment, size_t scene, const Console& console);

/// Returns a scene that was made rather than read, with its world, under its own name.
LoadedScene loadedScene(Scene scene, const WorldOptions& options = {});

/// Returns the camera that --camera asks for, at the world's current time; "" is the scene's first,
/// else auto. Throws Error kUsage for an unknown name, listing those that are there, and for bad
/// numbers.
Camera chooseCamera(const World& world, const std::string& text);

/// Throws what chooseCamera throws for a name that the world lacks; places no camera.
void checkCamera(const World& world, const std::string& text);

/// Returns what the scene's cameras are called, in the order of World::cameras(); "" where one has
/// no name.
std::vector<std::string> cameraNames(const World& world);

/// The camera of a run of frames. One that is placed is placed once, at the first frame asked for:
/// a view that jumps with what moves would be another view every frame.
class FrameCamera {
public:
    explicit FrameCamera(std::string text) : text_(std::move(text)) {}
    /// Returns the camera at the world's current time. Throws as chooseCamera.
    Camera at(const World& world);

private:
    std::string text_;
    std::optional<Camera> placed_;
};

/// Returns the grid of a scene's voxels: around what never moves, as nothing else is voxelized.
VoxelGrid sceneGrid(const World& world, uint32_t resolutionLog2);

/// Where built assets are kept.
struct VoxelSource {
    std::vector<std::string> assetPaths; ///< instead of resolutions, when not empty
    std::string cacheDirectory;          ///< "" for the user's own
    bool allowStale = false;
};

/// Returns the directory of the cache: `asked`, or $XDG_CACHE_HOME/shadowdag, or
/// ~/.cache/shadowdag, or "" (no cache) where neither variable is set.
std::string cacheDirectory(const std::string& asked);

/// Returns the DAG of the scene's static triangles at a resolution, from the cache where it is
/// there. A damaged cache file, or one of another grid, is said and built anew; a cache that cannot
/// be written is said and done without.
Dag cachedDag(const LoadedScene& scene, uint32_t resolutionLog2, const VoxelSource& source,
              const Console& console);

/// Reads an asset for a scene. Throws Error kInput when it was built from another scene or around
/// another grid than the scene's and that is not allowed.
Dag readDagFor(const LoadedScene& scene, const std::string& path, bool allowStale,
               const Console& console);

/// Throws Error kUsage where exact rays are asked for and stale assets allowed: voxels of other
/// triangles would answer for the scene's, and nothing would tell.
void refuseStaleExact(bool isExact, bool allowStale);

/// Returns the DAGs of a run: those of the assets given, else one a resolution. Throws Error kUsage
/// when two assets have the same resolution: runs are told apart by it.
std::vector<Dag> obtainDags(const LoadedScene& scene, const std::vector<uint32_t>& resolutionLog2,
                            const VoxelSource& source, const Console& console);

/// Returns the provenance that an asset of this scene carries.
AssetProvenance assetProvenance(const LoadedScene& scene);

/// Throws Error kResource unless a file can be made at `path`: so that hours of work do not end in
/// a bad directory.
void checkWritable(const std::string& path);

} // namespace shadowdag
