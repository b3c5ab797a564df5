// SPDX-License-Identifier: Apache-2.0
// Loads the input of frames from SCENE and options: world, camera, voxels (built, cached or read).
#pragma once

#include "hybrid/frame.h"
#include "tools/settings/console.h"
#include "tools/settings/experiment.h"
#include "voxel/asset.h"

#include <memory>
#include <string>
#include <vector>

namespace shadowdag {

/// A scene, flattened. Movable: the world refers to the scene through the pointer.
struct LoadedScene {
    std::string argument; ///< as the user named it
    std::string name;     ///< as sceneNames() gives it
    std::string geometryHash;
    std::string contentHash; ///< at time 0
    std::unique_ptr<Scene> scene;
    std::unique_ptr<World> world;
};

/// Returns the names of scenes in results: the file's name without directories, or the path if that
/// does not distinguish two scenes. Throws Error kUsage when a scene is given twice.
std::vector<std::string> sceneNames(const std::vector<std::string>& arguments);

/// Loads SCENE and places lights. Warnings go to standard error. Throws as loadScene does; with
/// `needsLights`, Error kInput when there is no light.
LoadedScene loadSceneAndWorld(const std::string& sceneArgument, int lightCount, uint64_t lightSeed,
                              bool needsLights, const Console& console);

/// Loads a scene of an experiment, under its unique name, with its lights. Throws as
/// loadSceneAndWorld and checkCamera do.
LoadedScene openScene(const Experiment& experiment, size_t scene, const Console& console);

/// Returns a generated scene with its world, under its own name.
LoadedScene loadedScene(Scene scene, const WorldOptions& options = {});

/// Returns the camera of --camera, at the world's current time; "" is the scene's first, else auto.
/// Throws Error kUsage for an unknown name, listing the existing ones, for bad numbers, and for an
/// automatic camera beyond those that placeCameras finds.
/// @param console shows how far an automatic one is placed; may be null
Camera chooseCamera(const World& world, const std::string& text, const Console* console = nullptr);

/// Returns whether an animation moves the camera that chooseCamera returns for a text.
bool isCameraAnimated(const World& world, const std::string& text);

/// Throws as chooseCamera for an unknown name; places no camera.
void checkCamera(const World& world, const std::string& text);

/// Returns the names of the scene's cameras, in the order of World::cameras(); "" for one without a
/// name.
std::vector<std::string> cameraNames(const World& world);

/// The camera of a series of frames. Automatic ones are placed once, at the first frame requested,
/// because a view that follows moving objects would differ in every frame.
class FrameCamera {
public:
    /// @param viewCount number of automatic cameras that will be used, placed together
    explicit FrameCamera(std::string text, uint32_t viewCount = 1)
        : text_(std::move(text)), viewCount_(viewCount) {}
    /// Uses another camera from now on. @param text as --camera takes it
    void use(std::string text) { text_ = std::move(text); }
    /// Returns whether it is an automatic one. Throws Error kUsage for an auto-K that there cannot
    /// be.
    bool isAutomatic(const World& world) const;
    /// Returns the camera at the world's current time. Throws as chooseCamera.
    /// @param console as for chooseCamera
    Camera at(const World& world, const Console* console = nullptr);

private:
    std::string text_;
    uint32_t viewCount_;
    std::vector<Camera> placed_; ///< automatic ones
};

/// Returns the grid of a scene's voxels: around the static geometry, because only that is
/// voxelized.
VoxelGrid sceneGrid(const World& world, uint32_t resolutionLog2);

/// Where built assets are kept.
struct VoxelSource {
    std::vector<std::string> assetPaths; ///< instead of resolutions, when not empty
    std::string cacheDirectory;          ///< "" for the user's own
    bool allowStale = false;
};

/// Returns the directory of the cache: `asked`, or $XDG_CACHE_HOME/shadowdag, or
/// ~/.cache/shadowdag, or "" (no cache) if neither variable is set.
std::string cacheDirectory(const std::string& asked);

/// Returns the DAG of the scene's static triangles at a resolution, from the cache if it is there.
/// A cache file that is damaged or of another grid is reported and built again; a cache that cannot
/// be written is reported and not used.
Dag cachedDag(const LoadedScene& scene, uint32_t resolutionLog2, const VoxelSource& source,
              const Console& console);

/// Reads an asset for a scene. Throws Error kInput when it was built from another scene or around
/// another grid than the scene's, unless that is allowed.
Dag readDagFor(const LoadedScene& scene, const std::string& path, bool allowStale,
               const Console& console);

/// Returns the DAGs of a run: those of the given assets, else one per resolution. Throws Error
/// kUsage when two assets have the same resolution, which distinguishes runs.
std::vector<Dag> obtainDags(const LoadedScene& scene, const std::vector<uint32_t>& resolutionLog2,
                            const VoxelSource& source, const Console& console);

/// Returns the provenance for an asset of this scene.
AssetProvenance assetProvenance(const LoadedScene& scene);

/// Throws Error kResource unless a file can be created at `path`, so that long work does not fail
/// at its end. Creates an unfinished file there and removes it.
void checkWritable(const std::string& path);

/// Throws Error kUsage if an output is the file of another argument, so that no command replaces
/// what it reads. Names that differ by symbolic links and ".." are one file, hard links are not.
/// @param others files; what is no file, as builtin:atrium, is none of them
/// @param option that names the output, for the message
void refuseSameFile(const std::string& output, const std::vector<std::string>& others,
                    const std::string& option = "-o");

/// Throws Error kUsage unless the name of an output has one of the extensions. @param kinds says
/// which, and the remedy. First throws what outputTarget throws: every command refuses a device
/// alike.
void checkExtension(const std::string& path, const std::vector<std::string>& extensions,
                    const std::string& kinds);

} // namespace shadowdag
