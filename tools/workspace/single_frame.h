// SPDX-License-Identifier: Apache-2.0
// One method on single frames: what `render` and `validate` share.
#pragma once

#include "hybrid/judge/error.h"
#include "tools/settings/common_options.h"
#include "tools/workspace/cost_file.h"
#include "tools/workspace/scene_setup.h"

#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace shadowdag {

/// Declares --method, --model, --costs and --variant.
struct MethodOptions {
    std::string method, model, costs, variant;
    std::optional<uint32_t> taps; ///< what --variant means where nothing says it

    explicit MethodOptions(std::string defaultMethod) : method(std::move(defaultMethod)) {}
    void declare(CommandLine& commandLine, const std::string& methods);
    /// Sets method, model and taps to what --variant names; nothing without it. Throws Error kUsage
    /// for a name that parseVariant refuses and for options that contradict it.
    void takeVariant(const CommandLine& commandLine);
    /// Returns the configuration that --variant names over `base`; nothing without it.
    std::optional<RunParameters> named(const FrameOptions& base) const;
    /// Throws Error kUsage for an unknown method or what contradicts it.
    void check(const CommandLine& commandLine, const std::vector<std::string>& allowed) const;
    /// Returns the cost model that the method means; embree's routes nothing.
    std::unique_ptr<CostModel> makeModel() const;
};

/// A scene, its voxels, the truth where asked for, and a renderer, moving through time together.
class SingleFrames {
public:
    /// Loads and builds; says on standard error when --costs was calibrated on another machine.
    /// `options` were parsed to `experiment`; the DAG is obtained only when the
    /// method traces rays.
    SingleFrames(const std::string& sceneArgument, const CommonOptions& options,
                 const Experiment& experiment, const MethodOptions& method, bool wantsTruth,
                 Backend backend, const Console& console);

    /// Renders the scene at a time. Every frame depends on its inputs alone (no hysteresis from
    /// frames before), unless routes are held (FrameOptions::routeMargin): then frames follow each
    /// other and resolutions, routes and maps are kept. Throws Error kUsage where routes are held
    /// and the model needs costs measured. Of `embree` returns the pairs alone.
    /// @param frame names the costs that oracle replays or measures
    const FrameResult& render(float timeSeconds, uint32_t frame);

    const World& world() const { return *scene_.world; }
    const LoadedScene& scene() const { return scene_; }
    const Camera& camera() const { return camera_; }
    const Truth& truth() const { return *truth_; }
    const FrameRenderer& renderer() const { return *renderer_; }
    const FrameOptions& frameOptions() const { return frameOptions_; }
    /// Returns the options of the error analysis that belong to the frames.
    ErrorOptions errorOptions() const;
    /// Returns Embree's answers for the pairs of the last frame.
    std::vector<uint8_t> truthVisibility(const FrameResult& frame) const;

private:
    LoadedScene scene_;
    FrameCamera frameCamera_;
    Dag dag_;
    MethodOptions method_;
    FrameOptions frameOptions_;
    uint64_t errorSeed_ = 1;
    CostSource costs_;
    std::unique_ptr<FrameRenderer> renderer_;
    std::unique_ptr<Truth> truth_;
    std::unique_ptr<CostModel> model_;
    Camera camera_;
    FrameResult result_;
};

} // namespace shadowdag
