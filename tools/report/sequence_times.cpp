// SPDX-License-Identifier: Apache-2.0
#include "tools/report/sequence_times.h"

#include "cuda/quantile_interval.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

namespace shadowdag {

namespace {

/// The times of a configuration on a scene.
struct Times {
    std::string scene, label;
    std::vector<double> medians, all;
};

void add(Json& to, const std::string& key, const QuantileInterval& interval) {
    to[key] = interval.value;
    to[key + "_low"] = interval.low;
    to[key + "_high"] = interval.high;
    to[key + "_confidence"] = interval.confidence;
}

} // namespace

Json sequenceTimes(const Json& rows) {
    std::vector<Times> groups;
    for (const Json& row : rows) {
        const std::string scene = row.at("scene"), label = row.at("label");
        auto found = std::find_if(groups.begin(), groups.end(), [&](const Times& times) {
            return times.scene == scene && times.label == label;
        });
        if (found == groups.end())
            found = groups.insert(groups.end(), {scene, label, {}, {}});
        const double timeMs = row.at("time_ms");
        found->medians.push_back(timeMs);
        const std::vector<double> rounds = row.value("round_times_ms", std::vector{timeMs});
        found->all.insert(found->all.end(), rounds.begin(), rounds.end());
    }
    Json list = Json::array();
    for (Times& times : groups) {
        double sum = 0;
        for (const double timeMs : times.medians)
            sum += timeMs;
        Json json = {{"scene", times.scene},
                     {"label", times.label},
                     {"frame_count", times.medians.size()},
                     {"value_count", times.all.size()},
                     {"time_ms_mean", sum / double(times.medians.size())}};
        add(json, "time_ms", medianInterval(times.all));
        add(json, "time_ms_p99", quantileInterval(std::move(times.all), kWorstFrameQuantile));
        list.push_back(std::move(json));
    }
    return list;
}

} // namespace shadowdag
