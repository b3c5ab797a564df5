// SPDX-License-Identifier: Apache-2.0
// One method on single frames: what `render` and `validate` share.
#pragma once

#include "tools/settings/common_options.h"
#include "tools/workspace/cost_file.h"
#include "tools/workspace/judge.h"

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

/// One method on frames of a scene, and the judge of them.
class SingleFrames {
public:
    /// Loads and builds; says on standard error when --costs was calibrated on another machine.
    /// `options` were parsed to `experiment`; the DAG is obtained only when the
    /// method traces rays.
    SingleFrames(const std::string& sceneArgument, const CommonOptions& options,
                 const Experiment& experiment, const MethodOptions& method, Backend backend,
                 const Console& console);

    /// Renders the scene at a time. Every frame depends on its inputs alone (no hysteresis from
    /// frames before), unless routes are held (FrameOptions::routeMargin): then frames follow each
    /// other and resolutions, routes and maps are kept. Throws Error kUsage where routes are held
    /// and the model needs costs measured. Of `embree` returns the pairs alone.
    /// @param frame names the costs that oracle replays or measures
    const Answers& render(float timeSeconds, uint32_t frame);

    const World& world() const { return workspace_->world(); }
    const std::string& sceneName() const { return workspace_->scene().name; }
    /// Returns Embree's answers for the pairs of the last frame.
    const std::vector<uint8_t>& truthVisibility();
    /// Returns the truth of the last frame with its picture. @param exposure as Judge::picture
    const FrameTruth& truthPicture(float exposure);
    /// Returns the errors of the last frame.
    ErrorReport judge() { return judge_->judge(0, answers_); }

private:
    MethodOptions method_;
    CostSource costs_;
    std::unique_ptr<CostModel> model_;
    RunParameters run_;
    std::unique_ptr<Workspace> workspace_;
    std::unique_ptr<Judge> judge_; ///< of the last frame alone
    Answers answers_;
};

} // namespace shadowdag
