// SPDX-License-Identifier: Apache-2.0
// A scene at work: its world, voxels, renderers and truth, each made when first asked for, all
// moving through time together. Commands, studies and the window have no stage of their own. How
// frames are judged: judge.h; how they are timed: timing.h; how far a run came: journal.h.
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

/// Stands for a resolution where no voxels are wanted: rays then have nothing to trace.
inline constexpr uint32_t kNoVoxels = UINT32_MAX;

/// What a workspace is made with beside its scene.
struct WorkspaceOptions {
    Backend backend = Backend::kCpu;
    std::string camera; ///< as --camera takes it
    /// Where voxels come from; nothing: they are built in memory, without a word.
    std::optional<VoxelSource> voxels;
    const Console* console = nullptr; ///< hears of what takes time; needed with voxels
};

/// What following the last change of time took in renderers of one resolution.
struct FollowTimes {
    StageTimes stages;   ///< FrameRenderer::worldChanged
    StageTimes ofLevels; ///< what levels of detail took beside that, for those who draw them
};

/// One scene with all that renders it. Not thread safe.
class Workspace {
public:
    /// Takes over a scene (loadSceneAndWorld, worldOf).
    explicit Workspace(LoadedScene scene, WorkspaceOptions options = {});
    ~Workspace();
    Workspace(Workspace&&) noexcept;
    Workspace& operator=(Workspace&&) noexcept;

    const LoadedScene& scene() const { return scene_; }
    const World& world() const { return *scene_.world; }
    Backend backend() const { return options_.backend; }
    /// Returns the camera at the world's time. One that is placed is placed at the first call and
    /// stays. Throws as chooseCamera.
    Camera camera() { return camera_.at(world()); }

    /// Obtains voxels of all resolutions, or those of the assets instead where the source names
    /// some, and returns the resolutions (log2) in this order. The first are also those of runs
    /// that trace none. Throws as obtainDags.
    std::vector<uint32_t> obtainVoxels(const std::vector<uint32_t>& resolutionLog2);
    /// Returns the grid of voxels of a resolution, there or not.
    VoxelGrid grid(uint32_t resolutionLog2) const { return sceneGrid(world(), resolutionLog2); }
    /// Returns the voxels of a resolution (log2), obtained at the first call; none for kNoVoxels.
    const Dag& dag(uint32_t resolutionLog2);
    /// Replaces all voxels by these: the others are dropped with their renderers, once the first
    /// renderer over the new ones is made. Where that throws all stays as it was.
    void replaceVoxels(Dag dag);
    /// Drops voxels of a resolution and renderers over them.
    void drop(uint32_t resolutionLog2);
    /// Makes frames on another backend from now on: one renderer of each resolution is made anew
    /// and all others are dropped. Where that throws all stays as it was.
    void setBackend(Backend backend);

    /// Returns a renderer over voxels of a resolution (log2) or kNoVoxels, made at the first call.
    /// Those of one resolution share what stands for the scene; each role keeps frames of its own.
    /// Valid until drop(), replaceVoxels() or setBackend().
    FrameRenderer& renderer(uint32_t resolutionLog2, size_t role = 0);
    /// Returns the renderer that a run means: over its voxels; of one that traces none, the first
    /// that were obtained.
    FrameRenderer& renderer(const RunParameters& run, size_t role = 0) {
        return renderer(voxelsOf(run), role);
    }
    /// Returns the resolution (log2) whose renderers serve a run.
    uint32_t voxelsOf(const RunParameters& run) const;

    /// Shows the world at a time. Nothing happens where it is shown at this time already.
    void setTime(float timeSeconds);
    /// The same, but all follow anew even where the time is the same: for those who time it.
    void advance(float timeSeconds);
    /// Returns what the last change of time took in renderers of a resolution; nothing where there
    /// were none.
    const FollowTimes& followTimes(uint32_t resolutionLog2);
    /// Forgets what frames left in all renderers, roles too.
    void resetRenderers();

    /// Returns Embree over the world as it is shown, built at the first call. The object stays the
    /// same one; it follows the world when it is asked for here.
    const Truth& truth();

private:
    /// Voxels of one resolution with the renderers over them, by role.
    struct Voxels {
        std::unique_ptr<Dag> dag; ///< where renderers find it
        std::vector<std::unique_ptr<FrameRenderer>> renderers;
        std::vector<uint32_t> moved; ///< instances of which renderers were not told yet
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
