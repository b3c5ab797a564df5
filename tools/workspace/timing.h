// SPDX-License-Identifier: Apache-2.0
// The clock: configurations run in turn, warm-ups, repeats, and what their times give.
#pragma once

#include "cuda/timer.h"
#include "tools/settings/json.h"

#include <chrono>
#include <functional>
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

/// Returns the time since then.
double msSince(std::chrono::steady_clock::time_point start);

/// Calls run(i) for each i below `count`, beginning with the i that `round` names: of rounds each
/// begins with another one, so that a machine that slows down slows all alike.
void runInTurn(size_t count, size_t round, const std::function<void(size_t i)>& run);

/// Runs `count` configurations in turn, `warmups` rounds that are not counted and `repeats` that
/// are, and returns the times of each.
std::vector<Timing> timeInTurn(size_t count, int warmups, int repeats,
                               const std::function<StageTimes(size_t i)>& run);

} // namespace shadowdag
