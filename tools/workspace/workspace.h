// SPDX-License-Identifier: Apache-2.0
// A scene with its world, voxels, renderers and truth, each created at first use, all at the same
// time of the animation. Commands, studies and the window use it. Comparison of frames with the
// truth: judge.h; times: timing.h; progress of a run: journal.h.
#pragma once

#include "hybrid/judge/truth.h"
#include "tools/workspace/scene_setup.h"

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace shadowdag {

/// In place of a resolution for runs without voxels.
inline constexpr uint32_t kNoVoxels = UINT32_MAX;

/// The settings of a workspace besides its scene.
struct WorkspaceOptions {
    Backend backend = Backend::kCpu;
    std::string camera; ///< as --camera takes it
    /// The source of voxels; none: they are built in memory.
    std::optional<VoxelSource> voxels;
    const Console* console = nullptr; ///< receives progress; needed with voxels
    uint32_t viewCount = 1;           ///< number of automatic cameras that setView will request
};

/// The times of the last update in renderers of one resolution.
struct FollowTimes {
    StageTimes stages;   ///< FrameRenderer::queueWorldChange
    StageTimes ofLevels; ///< additional time of levels of detail, for renderers that draw them
    StageTimes ofRays;   ///< additional time of moving geometry, for renderers that trace rays

    /// Adds those that a run's frames need; on CUDA it waits until the device has passed them, so
    /// call it after the frame.
    void addTo(StageTimes& times, const RunParameters& run) const;
};

/// One scene with everything that renders it. Not thread safe.
class Workspace {
public:
    /// Takes ownership of a scene (loadSceneAndWorld, worldOf).
    explicit Workspace(LoadedScene scene, WorkspaceOptions options = {});
    ~Workspace();
    Workspace(Workspace&&) noexcept;
    Workspace& operator=(Workspace&&) noexcept;

    const LoadedScene& scene() const { return scene_; }
    const World& world() const { return *scene_.world; }
    Backend backend() const { return options_.backend; }
    /// Returns the camera at the world's time. An automatic one is placed at the first call and
    /// then kept. Throws as chooseCamera.
    Camera camera() { return camera_.at(world(), options_.console); }
    /// Returns whether that is an automatic one.
    bool isCameraAutomatic() const { return camera_.isAutomatic(world()); }
    /// Uses another camera, and gives the scene another name, under which results of the view
    /// stand.
    /// @param camera as --camera takes it
    void setView(const std::string& camera, const std::string& name);

    /// Obtains voxels of all resolutions, or those of the source's assets if there are any, and
    /// returns the resolutions (log2) in this order. Runs without rays use the renderers of the
    /// first. Throws as obtainDags.
    std::vector<uint32_t> obtainVoxels(const std::vector<uint32_t>& resolutionLog2);
    /// Returns the grid of voxels of a resolution, obtained or not.
    VoxelGrid grid(uint32_t resolutionLog2) const { return sceneGrid(world(), resolutionLog2); }
    /// Returns the voxels of a resolution (log2), obtained at the first call; none for kNoVoxels.
    const Dag& dag(uint32_t resolutionLog2);
    /// Replaces all voxels by these: the others are dropped with their renderers, once the first
    /// renderer over the new ones is created. An exception leaves everything as it was.
    void replaceVoxels(Dag dag);
    /// Drops voxels of a resolution and renderers over them.
    void drop(uint32_t resolutionLog2);
    /// Switches to another backend: one renderer of each resolution is created again and all others
    /// are dropped. An exception leaves everything as it was.
    void setBackend(Backend backend);

    /// Returns a renderer over voxels of a resolution (log2) or kNoVoxels, created at the first
    /// call. Those of one resolution share the scene's data; each role keeps its own frames. Valid
    /// until drop(), replaceVoxels() or setBackend().
    FrameRenderer& renderer(uint32_t resolutionLog2, size_t role = 0);
    /// Returns the renderer of a run: over its voxels, or, for a run without rays, over the first
    /// that were obtained.
    FrameRenderer& renderer(const RunParameters& run, size_t role = 0) {
        return renderer(voxelsOf(run), role);
    }
    /// Returns the resolution (log2) of the renderers of a run.
    uint32_t voxelsOf(const RunParameters& run) const;

    /// Sets the world's time. Does nothing if it is the current time.
    void setTime(float timeSeconds);
    /// The same, but updates everything even if the time is the same: for measuring updates.
    void advance(float timeSeconds);
    /// Returns the times of the last update in renderers of a resolution; nothing if there were
    /// none.
    const FollowTimes& followTimes(uint32_t resolutionLog2);
    /// Releases the frames' state in all renderers, in all roles.
    void resetRenderers();

    /// Returns Embree over the world at its time, built at the first call. The object stays the
    /// same; it is updated when it is requested here.
    const Truth& truth();

private:
    /// Voxels of one resolution with the renderers over them, by role.
    struct Voxels {
        std::unique_ptr<Dag> dag; ///< stable address for renderers
        std::vector<std::unique_ptr<FrameRenderer>> renderers;
        std::vector<uint32_t> moved; ///< moved instances that were not passed to the renderers yet
        bool isReported = true;      ///< whether the renderers know the world's time
        FollowTimes followTimes;
    };

    Dag obtain(uint32_t resolutionLog2) const;
    Voxels& voxels(uint32_t resolutionLog2);
    std::unique_ptr<FrameRenderer> makeRenderer(Backend backend, const Dag& dag) const;

    LoadedScene scene_;
    WorkspaceOptions options_;
    FrameCamera camera_;
    std::map<uint32_t, Voxels> voxels_; ///< by resolution, log2
    uint32_t firstVoxels_ = kNoVoxels;
    std::unique_ptr<Truth> truth_;
    bool isTruthStale_ = false;
};

} // namespace shadowdag
