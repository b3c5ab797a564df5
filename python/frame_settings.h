// SPDX-License-Identifier: Apache-2.0
// The settings of a frame as a dict: checked by the settings' table, with the program's messages.
#pragma once

#include "tools/settings/experiment.h"
#include "tools/workspace/cost_file.h"

#include <pybind11/pybind11.h>

#include <memory>
#include <string>
#include <vector>

namespace shadowdag::python {

/// What a frame is rendered with.
struct FrameRequest {
    Experiment experiment;
    RunParameters run;     ///< its resolution is 0 until voxels are there
    std::string modelText; ///< as makeCostModel takes it; "" for a callable
    std::shared_ptr<CostModel> model;
    CostSource costs; ///< of "costs"
    bool allowsStaleCosts = false;
    float timeSeconds = 0;
};

/// Returns the request of a dict: "method" (hybrid), "model" (a text as --model takes it, or a
/// callable), "variant", "costs" (a file), "allow_stale" (of them), "time" in seconds,
/// "resolution", and every setting of frames under its key of experiment files. Throws Error
/// kUsage, beginning with "settings", for unknown keys, bad values, and settings that the method
/// does not read.
FrameRequest frameRequest(const pybind11::dict& settings);

/// Returns the keys that frameRequest takes, each with its default and help, in their order.
pybind11::list frameSettingTable();

} // namespace shadowdag::python
