// SPDX-License-Identifier: Apache-2.0
// Measures times: configurations run in turn, warm-ups, repeats, and statistics.
#pragma once

#include "cuda/timer.h"
#include "tools/settings/json.h"

#include <chrono>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace shadowdag {

/// The times of one run.
struct RunTimes {
    RunTimes(StageTimes stages, double wallMs = 0) : stages(std::move(stages)), wallMs(wallMs) {}

    StageTimes stages;
    double wallMs = 0; ///< by the wall clock, with what no stage counts; 0: not taken
};

/// Run by run: the total, and every stage by name in order of first appearance.
struct Timing {
    std::vector<double> totalMs;
    std::vector<double> wallMs; ///< of the runs for which it was taken
    std::vector<std::pair<std::string, std::vector<double>>> stagesMs;

    /// Adds a run; its total is the sum of its stages.
    void add(const RunTimes& run);
    /// Returns time_ms (median), time_ms_low and time_ms_high (its interval by order statistics),
    /// time_ms_confidence (of that interval: below 0.95 where the runs are few), time_ms_min,
    /// time_ms_max, wall_ms (median; of runs for which it was taken), repeat_count, round_times_ms
    /// (every run), stages_ms (medians of the runs that had the stage). At least one run must have
    /// been added.
    Json toJson() const;
};

/// Returns `key` (the median over rounds of the time over that of `base` in the same round),
/// `key`_low, `key`_high and `key`_confidence. What slows a round down affects both of its times,
/// so the interval is narrower than that of the times. Both were run in turn, as often.
Json ratioJson(const std::string& key, const Timing& timing, const Timing& base);

/// Returns the share, 0 to 1, of the time of this run's cores that others took from it: what other
/// processes, or other guests of the machine, used beyond the cores that this run leaves idle.
/// @param otherS seconds that they used of the cores that this process may use
/// @param wallS seconds, not 0 @param coreCount cores that this process may use, at least 1
/// @param threads of this run, at least 1; it uses as many of these cores
double shareOfOthers(double otherS, double wallS, int coreCount, int threads);

/// The use of the processor from its construction on.
class CpuUse {
public:
    CpuUse();
    /// Returns shareOfOthers since construction, for as many threads as threadCount(); nothing in
    /// the first half second and where the system does not tell.
    std::optional<double> otherShare() const;

private:
    std::chrono::steady_clock::time_point start_;
    double ownS_ = 0;             ///< CPU seconds before
    std::optional<double> busyS_; ///< the same of all
};

/// Returns a share of CpuUse as results hold it: null if it is not known.
Json otherShareJson(std::optional<double> share);

/// Returns the larger of a share and that of a row of results, of those that are known.
std::optional<double> largerOtherShare(std::optional<double> share, const Json& row);

/// Returns a remark about times that were measured while other processes used this share of the
/// processor (shareOfOthers): "" up to a tenth and if it is not known.
std::string busyRemark(std::optional<double> otherShare);

/// Returns the time since then.
double msSince(std::chrono::steady_clock::time_point start);

/// Calls run(i) for each i below `count`, beginning with the i that `round` selects: each round
/// begins with another one, so that a machine that slows down affects all equally.
void runInTurn(size_t count, size_t round, const std::function<void(size_t i)>& run);

/// Runs `count` configurations in turn, `warmups` uncounted rounds and `repeats` counted ones, and
/// returns the times of each.
std::vector<Timing> timeInTurn(size_t count, int warmups, int repeats,
                               const std::function<RunTimes(size_t i)>& run);

} // namespace shadowdag
