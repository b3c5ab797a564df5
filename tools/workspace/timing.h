// SPDX-License-Identifier: Apache-2.0
// The times of one configuration over repeated runs.
#pragma once

#include "cuda/timer.h"
#include "tools/settings/json.h"

#include <string>
#include <utility>
#include <vector>

namespace shadowdag {

/// Run by run: the whole, and every stage by name in order of first appearance.
struct Timing {
    std::vector<double> totalMs;
    std::vector<std::pair<std::string, std::vector<double>>> stagesMs;

    /// Adds a run: its whole is the sum of its stages.
    void add(const StageTimes& stages);
    /// Returns time_ms (median), time_ms_min, time_ms_max, repeat_count, stages_ms (medians of the
    /// runs that had the stage). At least one run must have been added.
    Json toJson() const;
};

} // namespace shadowdag
