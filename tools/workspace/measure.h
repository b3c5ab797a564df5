// SPDX-License-Identifier: Apache-2.0
// The measurements of a compare: every configuration on every frame of a scene, answers first, then
// times.
//
// Results (errors, counts, pictures) are computed once per configuration. Times come from separate
// runs that record nothing else: `warmups` uncounted rounds, then `repeats`; a round runs every
// configuration once, each round starting with another one, so that a machine that slows down
// affects all equally. Frames are independent: hysteresis is forgotten before each run.
#pragma once

#include "tools/settings/experiment.h"
#include "tools/workspace/cost_file.h"
#include "tools/workspace/journal.h"
#include "tools/workspace/timing.h"
#include "tools/workspace/workspace.h"

#include <nlohmann/json.hpp>

#include <functional>
#include <string>
#include <vector>

namespace shadowdag {

/// The input of measureScene besides workspace and experiment.
struct MeasureContext {
    std::string directory;             ///< of the report; pictures go to directory/images
    const CostTable* costs = nullptr;  ///< to replay, or null: measured
    std::string costsPath;             ///< their source
    bool allowsStaleCosts = false;     ///< measured of another scene, size, camera or lights
    const Console* console = nullptr;  ///< of warnings about costs to replay; null without these
    const CostSource* given = nullptr; ///< of --costs: the calibration of model cost, or null
    Journal* journal = nullptr;        ///< never null
    std::vector<uint32_t> frames;      ///< frames to measure, a subset of the experiment's
    Progress progress;                 ///< of this scene
    bool writesPictures = true;
    /// Measures the maps' isolated costs also if no model routes by them.
    bool measuresMapCosts = true;
    /// The name of a frame's times in the journal; another name measures them again.
    std::string times = "times";
    /// Receives a message for each frame without pairs, which measureScene leaves out; if empty,
    /// the first such frame throws NothingToCompare, as it always does in measureSequence.
    std::function<void(const std::string&)> onLeftOut;
    /// Receives every frame's and configuration's runs after they were timed; may be empty.
    std::function<void(uint32_t frame, const RunParameters&, const Timing&)> onTiming;
};

/// The results of measuring a scene, in the form of results.json.
struct SceneMeasurement {
    Json runs = Json::array(); ///< one object a frame and configuration
    Json sequenceRuns =
        Json::array();             ///< the same of frames in sequence (tools/workspace/sequence.h)
    Json mapCosts = Json::array(); ///< one object a frame and map: quantities, rays_ms, map_ms
    Json lights = Json::array();   ///< one object a run and light: its maps and errors
    CostTable costs;               ///< measured or replayed
    Json truthImages = Json::array(); ///< {"scene", "frame", "file"}
};

/// Returns whether measureScene measures, or replays, the maps' isolated costs.
bool usesMapCosts(const std::vector<RunParameters>& runs);

/// Measures every configuration on the context's frames of the experiment. Results in the journal
/// are reused. With 0 repeats and 0 warm-ups no times are measured.
/// @param workspace with the voxels that the runs trace (Workspace::obtainVoxels)
SceneMeasurement measureScene(Workspace& workspace, const Experiment& experiment,
                              const std::vector<RunParameters>& runs,
                              const MeasureContext& context);

} // namespace shadowdag
