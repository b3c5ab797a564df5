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

} // namespace shadowdag
