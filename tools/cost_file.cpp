// SPDX-License-Identifier: Apache-2.0
#include "tools/cost_file.h"

#include "cuda/error.h"

#include <cmath>
#include <fstream>
#include <sstream>

namespace shadowdag {

Json toJson(const CostTable& costs) {
    Json list = Json::array();
    for (const auto& [key, frameCosts] : costs) {
        Json maps = Json::array();
        for (const MapCost& map : frameCosts.maps)
            maps.push_back({{"light", map.light},
                            {"octave", map.octave},
                            {"rays_ms", map.raysMs},
                            {"map_ms", map.mapMs}});
        list.push_back({{"scene", key.first}, {"frame", key.second}, {"maps", std::move(maps)}});
    }
    return {{"costs", std::move(list)}};
}

CostTable readCosts(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    if (!file)
        throw Error(ErrorKind::kInput,
                    path + ": cannot be opened; give a cost file, as compare writes costs.json");
    std::stringstream text;
    text << file.rdbuf();
    CostTable table;
    try {
        const Json json = Json::parse(text.str());
        for (const Json& entry : json.at("costs")) {
            FrameCosts costs;
            costs.frame = entry.at("frame").get<uint32_t>();
            int64_t lastLight = -1;
            for (const Json& map : entry.at("maps")) {
                const MapCost cost{map.at("light").get<uint32_t>(), map.value("octave", 0u),
                                   map.at("rays_ms").get<double>(), map.at("map_ms").get<double>()};
                if (int64_t(cost.light) <= lastLight || !(cost.raysMs >= 0) || !(cost.mapMs >= 0))
                    throw Error(ErrorKind::kInput,
                                path + ": light " + std::to_string(cost.light) +
                                    ": lights must ascend and times be 0 or more; measure anew");
                lastLight = cost.light;
                costs.maps.push_back(cost);
            }
            table[{entry.at("scene").get<std::string>(), costs.frame}] = std::move(costs);
        }
    } catch (const Json::exception& error) {
        throw Error(ErrorKind::kInput, path + ": not a cost file: " + error.what());
    }
    return table;
}

const FrameCosts& findCosts(const CostTable& costs, const std::string& path,
                            const std::string& scene, uint32_t frame) {
    const auto found = costs.find({scene, frame});
    if (found == costs.end())
        throw Error(ErrorKind::kInput, path + ": has no costs of " + scene + " frame " +
                                           std::to_string(frame) +
                                           "; measure them with the same scenes and frames");
    return found->second;
}

} // namespace shadowdag
