// SPDX-License-Identifier: Apache-2.0
// The open scene of a window, with all data that are kept between pictures. Internal to view_*.
#pragma once

#include "tools/window/view_renderer.h"
#include "tools/workspace/workspace.h"

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>

namespace shadowdag {

/// The measured costs of a view's maps: valid while none of these values changes.
struct MeasuredCosts {
    std::string camera; ///< as a text, which with the frame means one
    uint32_t frame = 0;
    FrameOptions options;
    FrameCosts costs;
    double tookMs = 0;
};

/// Returns the largest number of voxels per axis, log2, for which memory should be enough to build
/// them: 12 at least, 17 at most. Every octave takes up to 4 times the words (they are surfaces),
/// building 4 times the DAG's (voxel/BUILDS.md).
/// @param log2,bytes of voxels of the same scene; 0 bytes: unknown
uint32_t largestVoxelsLog2(uint32_t log2, uint64_t bytes, uint64_t memoryBytes);

/// A workspace with the window's additional state.
struct ViewScene {
    uint64_t serial = 0;
    Workspace workspace;
    std::string cameraText; ///< of the first view
    std::string assetPath;
    std::map<std::string, std::unique_ptr<CostModel>> models;
    std::optional<MeasuredCosts> measured; ///< of the last view whose model needed them
    uint32_t frame = 0;
    float exposure = 0;                        ///< 0: not found yet
    std::vector<TourStop> tour;                ///< of the demo; empty: not found yet
    std::map<std::string, FrameCamera> placed; ///< automatic cameras but the first, by their texts

    ViewScene(LoadedScene scene, Backend backend)
        : workspace(std::move(scene), {backend, "auto", {}, nullptr}) {}

    const World& world() const { return workspace.world(); }
    /// Returns the voxels that rays trace.
    const Dag& dag() { return workspace.dag(workspace.voxelsOf({})); }
    /// Switches to another backend; the previous one stays if that throws.
    void setBackend(Backend backend);
    /// Returns the renderer of a side: of complete pictures, which are independent, or of
    /// intermediate ones, whose maps are kept when a complete one is made or cancelled. Each may
    /// keep a pool of pages; made at the first call.
    FrameRenderer& renderer(size_t side, bool isWhole) {
        return workspace.renderer(RunParameters{}, side + (isWhole ? 0 : 2));
    }
    /// Returns the renderer of frozen views.
    FrameRenderer& observer() { return workspace.renderer(RunParameters{}, 4); }
    /// Obtains voxels of a resolution or of a file, and renderers over them.
    void giveVoxels(const ViewSettings& settings, uint32_t resolutionLog2, const std::string& asset,
                    const Console& console);
    /// Shows another frame of the scene's animations.
    void moveTo(uint32_t frame, const Experiment& experiment);
    /// Returns the model of a side. Throws Error kUsage for an invalid one, or one that needs
    /// missing costs.
    CostModel& model(const ViewSide& side, const CostSource& costs);
    /// Returns the camera that a text denotes. A camera that is placed automatically is kept: it
    /// would jump with moving objects, and takes a second to place.
    Camera camera(const std::string& text);
    /// Returns the scene's information for the window.
    ViewSceneInfo info(const Experiment& experiment);
};

} // namespace shadowdag
