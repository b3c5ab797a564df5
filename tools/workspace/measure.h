// SPDX-License-Identifier: Apache-2.0
// The measurements of a compare: every configuration on every frame of a scene, answers first, then
// times.
//
// Answers (errors, counts, pictures) come once per configuration. Times come from separate runs
// that record nothing else: `warmups` uncounted rounds, then `repeats`; a round runs every
// configuration once, each round starting with another one, so that a machine that slows down slows
// all alike. Frames are independent: hysteresis is forgotten before each run.
#pragma once

#include "hybrid/judge/truth.h"
#include "tools/settings/experiment.h"
#include "tools/workspace/cost_file.h"
#include "tools/workspace/journal.h"
#include "tools/workspace/scene_setup.h"
#include "tools/workspace/timing.h"

#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace shadowdag {

/// What measureScene needs besides scene and experiment.
struct MeasureContext {
    Backend backend = Backend::kCpu;
    std::string directory;             ///< of the report; pictures go to directory/images
    const CostTable* costs = nullptr;  ///< to replay, or null: measured
    std::string costsPath;             ///< where they came from
    const CostSource* given = nullptr; ///< of --costs: the calibration of model cost, or null
    Journal* journal = nullptr;        ///< never null
    std::vector<uint32_t> frames;      ///< to measure, some of the experiment's
    Progress progress;                 ///< of this scene
    bool writesPictures = true;
    /// The maps' isolated costs are measured also where no model routes by them.
    bool measuresMapCosts = true;
    /// Under what name the journal keeps a frame's times; another name measures them anew.
    std::string times = "times";
    /// Receives every frame's and configuration's runs when they were timed; may be empty.
    std::function<void(uint32_t frame, const RunParameters&, const Timing&)> heedTiming;
};

/// What measuring a scene gave, as results.json holds it.
struct SceneMeasurement {
    Json runs = Json::array(); ///< one object a frame and configuration
    Json sequenceRuns =
        Json::array();             ///< the same of frames in sequence (tools/workspace/sequence.h)
    Json mapCosts = Json::array(); ///< one object a frame and map: quantities, rays_ms, map_ms
    Json lights = Json::array();   ///< one object a run and light: its maps and errors
    CostTable costs;               ///< measured or replayed
    Json truthImages = Json::array(); ///< {"scene", "frame", "file"}
};

/// Measures configurations on frames of one scene, call by call; renderers and truth are made once.
class SceneMeasurer {
public:
    /// @param dags those that RunParameters::dag counts; they and the scene outlive the measurer
    SceneMeasurer(LoadedScene& scene, const std::vector<Dag>& dags, Backend backend);
    ~SceneMeasurer();

    /// Measures the configurations on the context's frames of the experiment. Answers that the
    /// journal holds are taken from there. With 0 repeats and 0 warm-ups no times are taken.
    SceneMeasurement measure(const Experiment& experiment, const std::vector<RunParameters>& runs,
                             const MeasureContext& context);
    /// Returns the bytes that rays of this backend read of a DAG (FrameRenderer::dagBytes).
    uint64_t dagBytes(size_t dag) const { return renderers_[dag]->dagBytes(); }

private:
    LoadedScene& scene_;
    std::vector<std::unique_ptr<FrameRenderer>> renderers_;
    std::unique_ptr<Truth> truth_;
};

/// Measures every configuration on every frame of the experiment. `dags` are those that
/// RunParameters::dag counts.
SceneMeasurement measureScene(LoadedScene& scene, const std::vector<Dag>& dags,
                              const Experiment& experiment, const std::vector<RunParameters>& runs,
                              const MeasureContext& context);

} // namespace shadowdag
