// SPDX-License-Identifier: Apache-2.0
// The measurements of a compare: every configuration on every frame of a scene, answers first, then
// times.
//
// Answers (errors, counts, pictures) come once per configuration. Times come from separate runs
// that record nothing else: `warmups` uncounted rounds, then `repeats`; a round runs every
// configuration once, each round starting with another one, so that a machine that slows down slows
// all alike. Frames are independent: hysteresis is forgotten before each run.
#pragma once

#include "tools/cost_file.h"
#include "tools/experiment.h"
#include "tools/journal.h"
#include "tools/scene_setup.h"

#include <string>
#include <vector>

namespace shadowdag {

/// What measureScene needs besides scene and experiment.
struct MeasureContext {
    Backend backend = Backend::kCpu;
    std::string directory;            ///< of the report; pictures go to directory/images
    const CostTable* costs = nullptr; ///< to replay, or null: measured
    std::string costsPath;            ///< where they came from
    const CostSource* given = nullptr; ///< of --costs: the calibration of model cost, or null
    Journal* journal = nullptr;       ///< never null
    std::vector<uint32_t> frames;     ///< to measure, some of the experiment's
    Progress progress;                ///< of this scene
};

/// What measuring a scene gave, as results.json holds it.
struct SceneMeasurement {
    Json runs = Json::array();         ///< one object a frame and configuration
    Json sequenceRuns = Json::array(); ///< the same of frames in sequence (tools/sequence.h)
    Json mapCosts = Json::array();     ///< one object a frame and map: quantities, rays_ms, map_ms
    Json lights = Json::array();       ///< one object a run and light: its maps and errors
    CostTable costs;                   ///< measured or replayed
    Json truthImages = Json::array();  ///< {"scene", "frame", "file"}
};

/// Measures every configuration on every frame of the experiment. `dags` are those that
/// RunParameters::dag counts.
SceneMeasurement measureScene(LoadedScene& scene, const std::vector<Dag>& dags,
                              const Experiment& experiment, const std::vector<RunParameters>& runs,
                              const MeasureContext& context);

} // namespace shadowdag
