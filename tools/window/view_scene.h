// SPDX-License-Identifier: Apache-2.0
// The scene that a window has open, with all that outlives a picture. Not for other files than
// view_*.
#pragma once

#include "hybrid/judge/truth.h"
#include "tools/window/view_renderer.h"
#include "tools/workspace/scene_setup.h"

#include <array>
#include <map>
#include <memory>
#include <optional>
#include <string>

namespace shadowdag {

/// What a view's maps cost, measured: for as long as nothing of this changes.
struct MeasuredCosts {
    std::string camera; ///< as a text, which with the frame means one
    uint32_t frame = 0;
    FrameOptions options;
    FrameCosts costs;
    double tookMs = 0;
};

/// Returns the most voxels an axis, log2, that memory should do for to build them: 12 at least, 17
/// at most. Every octave takes up to 4 times the words (they are surfaces), building 4 times the
/// DAG's (voxel/BUILDS.md).
/// @param log2,bytes of voxels of the same scene; 0 bytes: nothing is known
uint32_t largestVoxelsLog2(uint32_t log2, uint64_t bytes, uint64_t memoryBytes);

/// A scene with its voxels, the renderers of both sides, the truth.
struct ViewScene {
    uint64_t serial = 0;
    LoadedScene scene;
    std::string cameraText; ///< of the first view
    std::string assetPath;
    std::unique_ptr<Dag> dag; ///< where renderers find it, whoever owns it
    /// By side, sharing the scene: of whole pictures, which stand for themselves, and of those that
    /// are shown meanwhile, whose maps stay theirs when a whole one is made or given up. Each may
    /// keep a pool of pages; all but the first are made when they are first asked for.
    std::array<std::unique_ptr<FrameRenderer>, 2> wholeRenderers, quickRenderers;
    std::unique_ptr<FrameRenderer> observer; ///< of frozen views; made when first asked for
    std::map<std::string, std::unique_ptr<CostModel>> models;
    std::optional<MeasuredCosts> measured; ///< of the last view whose model needed them
    uint32_t frame = 0;
    float exposure = 0; ///< 0: not found yet

    /// Makes the renderers over a DAG, then takes it over; what was there stays when that throws.
    /// @param ofDag null: the DAG that is there
    void makeRenderers(Backend backend, std::unique_ptr<Dag> ofDag);
    /// Returns the renderer of a side.
    FrameRenderer& renderer(size_t side, bool isWhole);
    FrameRenderer& observerNow();
    /// Obtains voxels of a resolution or of a file, and renderers over them.
    void giveVoxels(const ViewSettings& settings, uint32_t resolutionLog2, const std::string& asset,
                    const Console& console);
    /// Shows another frame of the scene's animations.
    void moveTo(uint32_t frame, const Experiment& experiment);
    /// Returns the truth as the scene stands; made when first asked for.
    Truth& truthNow();
    /// Returns the model of a side. Throws Error kUsage for one that is none, or that needs costs
    /// which there are not.
    CostModel& model(const ViewSide& side, const CostSource& costs);
    /// Returns the camera that a text means; one that is placed stays, as it would jump with what
    /// moves, and takes a second to place.
    Camera camera(const std::string& text);
    /// Returns what the window is told of the scene.
    ViewSceneInfo info(const Experiment& experiment);

private:
    std::unique_ptr<Truth> truth_; // null until asked for
    bool isTruthOld_ = false;      // something moved since
    std::vector<uint32_t> moved_;  // instances that moved and that renderers were not told of
    FrameCamera placed_{"auto"};
};

} // namespace shadowdag
