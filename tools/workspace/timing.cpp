// SPDX-License-Identifier: Apache-2.0
#include "tools/workspace/timing.h"

#include "cuda/backend.h"
#include "cuda/macros.h"
#include "cuda/quantile_interval.h"
#include "cuda/statistics.h"

#include <nlohmann/json.hpp>

#include <sched.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <sstream>

namespace shadowdag {

void Timing::add(const RunTimes& run) {
    totalMs.push_back(run.stages.totalMs());
    if (run.wallMs > 0)
        wallMs.push_back(run.wallMs);
    for (const auto& [name, timeMs] : run.stages.stagesMs) {
        auto found = std::find_if(stagesMs.begin(), stagesMs.end(),
                                  [&](const auto& s) { return s.first == name; });
        if (found == stagesMs.end())
            found = stagesMs.insert(stagesMs.end(), {name, {}});
        found->second.push_back(timeMs);
    }
}

Json Timing::toJson() const {
    Json stages = Json::object();
    for (const auto& [name, times] : stagesMs)
        stages[name] = median(times);
    const QuantileInterval interval = medianInterval(totalMs);
    Json json = {{"time_ms", interval.value},
                 {"time_ms_low", interval.low},
                 {"time_ms_high", interval.high},
                 {"time_ms_confidence", interval.confidence},
                 {"time_ms_min", *std::min_element(totalMs.begin(), totalMs.end())},
                 {"time_ms_max", *std::max_element(totalMs.begin(), totalMs.end())}};
    if (!wallMs.empty())
        json["wall_ms"] = median(wallMs);
    json["repeat_count"] = totalMs.size();
    json["round_times_ms"] = totalMs;
    json["stages_ms"] = std::move(stages);
    return json;
}

Json ratioJson(const std::string& key, const Timing& timing, const Timing& base) {
    SDAG_ASSERT(timing.totalMs.size() == base.totalMs.size());
    std::vector<double> ratios;
    for (size_t round = 0; round < timing.totalMs.size(); ++round)
        ratios.push_back(timing.totalMs[round] / base.totalMs[round]);
    const QuantileInterval interval = medianInterval(std::move(ratios));
    return {{key, interval.value},
            {key + "_low", interval.low},
            {key + "_high", interval.high},
            {key + "_confidence", interval.confidence}};
}

namespace {

double ownCpuS() {
    timespec time{};
    return clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time) == 0
               ? double(time.tv_sec) + 1e-9 * double(time.tv_nsec)
               : 0;
}

cpu_set_t usableCores() {
    cpu_set_t cores;
    CPU_ZERO(&cores);
    static_cast<void>(sched_getaffinity(0, sizeof cores, &cores));
    return cores;
}

/// Returns the seconds that the usable cores were busy since the system started, by /proc/stat:
/// "cpuN user nice system idle iowait irq softirq steal ..."; nothing where it does not tell.
std::optional<double> busyCpuS() {
    const cpu_set_t cores = usableCores();
    std::ifstream file("/proc/stat");
    double ticks = 0;
    for (std::string line; std::getline(file, line) && line.starts_with("cpu");) {
        std::istringstream words(line.substr(3));
        unsigned core = 0;
        if (line[3] == ' ' || !(words >> core) || core >= CPU_SETSIZE || !CPU_ISSET(core, &cores))
            continue;
        constexpr int kIdle = 3, kIoWait = 4, kFieldCount = 8; // what follows is part of user
        double value = 0;
        for (int field = 0; field < kFieldCount && words >> value; ++field)
            ticks += field == kIdle || field == kIoWait ? 0 : value;
    }
    return ticks > 0 ? std::optional(ticks / double(sysconf(_SC_CLK_TCK))) : std::nullopt;
}

} // namespace

double shareOfOthers(double otherS, double wallS, int coreCount, int threads) {
    const int used = std::min(threads, coreCount);
    return std::clamp((otherS / wallS - (coreCount - used)) / used, 0.0, 1.0);
}

CpuUse::CpuUse() : start_(std::chrono::steady_clock::now()), ownS_(ownCpuS()), busyS_(busyCpuS()) {}

std::optional<double> CpuUse::otherShare() const {
    const double wallS = 1e-3 * msSince(start_);
    const cpu_set_t cores = usableCores();
    const std::optional<double> busyS = busyCpuS();
    if (wallS < 0.5 || CPU_COUNT(&cores) == 0 || !busyS || !busyS_) // a tick is 10 ms
        return std::nullopt;
    const double otherS = (*busyS - *busyS_) - (ownCpuS() - ownS_);
    return shareOfOthers(otherS, wallS, CPU_COUNT(&cores), threadCount());
}

Json otherShareJson(std::optional<double> share) {
    return share ? Json(*share) : Json();
}

std::optional<double> largerOtherShare(std::optional<double> share, const Json& row) {
    const auto found = row.find("other_cpu_share");
    if (found == row.end() || found->is_null())
        return share;
    return std::max(share, std::optional(found->get<double>())); // nothing is the least
}

std::string busyRemark(std::optional<double> otherShare) {
    if (!otherShare || *otherShare <= 0.1)
        return "";
    char text[160];
    std::snprintf(text, sizeof text,
                  "other processes took %.0f %% of the cores that this run uses while times were "
                  "measured; measure again on an idle machine",
                  100 * *otherShare);
    return text;
}

double msSince(std::chrono::steady_clock::time_point start) {
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
        .count();
}

void runInTurn(size_t count, size_t round, const std::function<void(size_t)>& run) {
    for (size_t i = 0; i < count; ++i)
        run((i + round) % count);
}

std::vector<Timing> timeInTurn(size_t count, int warmups, int repeats,
                               const std::function<RunTimes(size_t)>& run) {
    std::vector<Timing> timings(count);
    for (int round = 0; round < warmups + repeats; ++round)
        runInTurn(count, size_t(round), [&](size_t i) {
            const RunTimes times = run(i);
            if (round >= warmups)
                timings[i].add(times);
        });
    return timings;
}

} // namespace shadowdag
