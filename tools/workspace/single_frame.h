// SPDX-License-Identifier: Apache-2.0
// One method on single frames: shared by `render` and `validate`.
#pragma once

#include "tools/settings/common_options.h"
#include "tools/workspace/cost_file.h"
#include "tools/workspace/judge.h"
#include "tools/workspace/self_checks.h"

#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace shadowdag {

/// Declares --method, --model, --costs and --variant.
struct MethodOptions {
    std::string method, model, costs, variant;
    std::optional<uint32_t> taps; ///< the defaults of --variant, as believe
    std::optional<float> believe;

    explicit MethodOptions(std::string defaultMethod) : method(std::move(defaultMethod)) {}
    void declare(CommandLine& commandLine, const std::string& methods);
    /// Sets method, model and taps to those of --variant; does nothing without it. Throws Error
    /// kUsage for a name that parseVariant refuses and for options that contradict it.
    void takeVariant(const CommandLine& commandLine);
    /// Returns the configuration that the options mean over the settings of an experiment; its
    /// resolution is 0.
    RunParameters run(const Experiment& experiment) const;
    /// Throws Error kUsage for an unknown method or contradicting options; notes given options
    /// that have no effect.
    void check(const CommandLine& commandLine, const Experiment& experiment,
               const std::vector<std::string>& allowed, const Console& console) const;
    /// Returns an experiment with this method alone in its sweep, in place of the lists that only a
    /// sweep runs; with none for the truth, which is measured by no method.
    Experiment ranAlone(Experiment experiment) const;
    /// Returns the method's cost model; embree's routes nothing.
    std::unique_ptr<CostModel> makeModel() const;
};

/// One method on frames of a scene, with their comparison with the truth.
class SingleFrames {
public:
    /// Loads and builds; prints on standard error if --costs was calibrated on another machine.
    /// `options` were parsed to `experiment`; the DAG is obtained only when the method traces rays.
    /// @param console receives progress; outlives it
    SingleFrames(const std::string& sceneArgument, const CommonOptions& options,
                 const Experiment& experiment, const MethodOptions& method, Backend backend,
                 const Console& console);

    /// Uses another camera, and names the scene after it as well. @param camera as --camera takes
    /// it
    void setView(const std::string& camera);
    bool isCameraAutomatic() const { return workspace_->isCameraAutomatic(); }

    /// Renders the scene at a time. Every frame depends on its inputs alone (no hysteresis from
    /// frames before), unless routes are held (FrameOptions::routeMargin): then frames form a
    /// sequence, and resolutions, routes and maps are kept. Throws Error kUsage if routes are held
    /// and the model needs measured costs. For `embree` returns the pairs alone.
    /// @param frame number of the costs that oracle replays or measures
    const PairResults& render(float timeSeconds, uint32_t frame);

    /// Renders the scene at a time as the next frame of a sequence: maps, resolutions and routes
    /// are kept from the frame before. Records nothing; returns its times, counts and colour. The
    /// stages and the wall clock contain the update of what moved. Throws Error kUsage for the
    /// method truth, and if the model measures each frame separately.
    FrameResult renderNext(float timeSeconds, uint32_t frame);

    const World& world() const { return workspace_->world(); }
    const std::string& sceneName() const { return workspace_->scene().name; }
    /// Returns what reproduces the last frame: {"scene", "scene_hash", "frame", "time_s",
    /// "camera_numbers", "method", "model", "parameters", "light_count", "experiment",
    /// "provenance"}.
    Json reproduction() const;
    /// Returns Embree's results for the pairs of the last frame.
    const std::vector<uint8_t>& truthVisibility();
    /// Returns the truth of the last frame with its picture. @param exposure as Judge::picture
    const FrameTruth& truthPicture(float exposure);
    /// Returns the errors of the last frame.
    ErrorReport judge();
    /// Returns what is wrong with the last frame itself (self_checks.h); nothing of the method
    /// truth. @param report of judge()
    SelfChecks checkItself(const ErrorReport& report);

private:
    const Console& console_;
    bool allowsStale_; ///< costs
    MethodOptions method_;
    CostSource costs_;
    std::unique_ptr<CostModel> model_;
    RunParameters run_;
    Experiment experiment_;
    uint32_t frame_ = 0;
    std::unique_ptr<Workspace> workspace_;
    std::unique_ptr<Judge> judge_; ///< of the last frame alone
    PairResults answers_;
};

} // namespace shadowdag
