// SPDX-License-Identifier: Apache-2.0
#include "tools/workspace/timing.h"

#include "cuda/statistics.h"

#include <algorithm>

namespace shadowdag {

void Timing::add(const StageTimes& stages) {
    totalMs.push_back(stages.totalMs());
    for (const auto& [name, timeMs] : stages.stagesMs) {
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
    return {{"time_ms", median(totalMs)},
            {"time_ms_min", *std::min_element(totalMs.begin(), totalMs.end())},
            {"time_ms_max", *std::max_element(totalMs.begin(), totalMs.end())},
            {"repeat_count", totalMs.size()},
            {"stages_ms", std::move(stages)}};
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
                               const std::function<StageTimes(size_t)>& run) {
    std::vector<Timing> timings(count);
    for (int round = 0; round < warmups + repeats; ++round)
        runInTurn(count, size_t(round), [&](size_t i) {
            const StageTimes stages = run(i);
            if (round >= warmups)
                timings[i].add(stages);
        });
    return timings;
}

} // namespace shadowdag
