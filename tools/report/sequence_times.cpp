// SPDX-License-Identifier: Apache-2.0
#include "tools/report/sequence_times.h"

#include "cuda/quantile_interval.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace shadowdag {

namespace {

/// The times of a configuration on a scene.
struct Times {
    std::string scene, label;
    std::vector<double> medians, all, overEmbree;
};

/// Returns the times of a row, by round.
std::vector<double> roundsOf(const Json& row) {
    return row.value("round_times_ms", std::vector{row.at("time_ms").get<double>()});
}

/// Embree's times by scene and frame; of two configurations those of the first, as in all
/// other ratios.
using EmbreeRounds = std::map<std::pair<std::string, Json>, std::vector<double>>;

EmbreeRounds embreeRoundsOf(const Json& rows) {
    EmbreeRounds rounds;
    for (const Json& row : rows)
        if (row.value("method", "") == "embree")
            rounds.try_emplace({row.at("scene"), row.value("frame", Json())}, roundsOf(row));
    return rounds;
}

void add(Json& to, const std::string& key, const QuantileInterval& interval) {
    to[key] = interval.value;
    to[key + "_low"] = interval.low;
    to[key + "_high"] = interval.high;
    to[key + "_confidence"] = interval.confidence;
}

} // namespace

Json sequenceTimes(const Json& rows) {
    const EmbreeRounds embree = embreeRoundsOf(rows);
    std::vector<Times> groups;
    for (const Json& row : rows) {
        const std::string scene = row.at("scene"), label = row.at("label");
        auto found = std::find_if(groups.begin(), groups.end(), [&](const Times& times) {
            return times.scene == scene && times.label == label;
        });
        if (found == groups.end())
            found = groups.insert(groups.end(), {scene, label, {}, {}, {}});
        found->medians.push_back(row.at("time_ms"));
        const std::vector<double> rounds = roundsOf(row);
        found->all.insert(found->all.end(), rounds.begin(), rounds.end());
        const auto base = embree.find({scene, row.value("frame", Json())});
        if (base != embree.end() && base->second.size() == rounds.size())
            for (size_t round = 0; round < rounds.size(); ++round)
                found->overEmbree.push_back(rounds[round] / base->second[round]);
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
        if (times.overEmbree.size() == json["value_count"].get<size_t>())
            add(json, "time_over_embree", medianInterval(std::move(times.overEmbree)));
        list.push_back(std::move(json));
    }
    return list;
}

} // namespace shadowdag
