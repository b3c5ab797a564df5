// SPDX-License-Identifier: Apache-2.0
#include "tools/cost_file.h"

#include "cuda/error.h"

#include <cmath>
#include <fstream>
#include <sstream>
#include <tuple>

namespace shadowdag {

namespace {

Json readJson(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    if (!file)
        throw Error(ErrorKind::kInput,
                    path + ": cannot be opened; give a cost file, as compare writes costs.json and "
                           "calibrate -o C.json");
    std::stringstream text;
    text << file.rdbuf();
    try {
        return Json::parse(text.str());
    } catch (const Json::exception& error) {
        throw Error(ErrorKind::kInput, path + ": not a cost file: " + error.what());
    }
}

CostTable tableFromJson(const Json& json, const std::string& path) {
    CostTable table;
    try {
        for (const Json& entry : json.at("costs")) {
            FrameCosts costs;
            costs.frame = entry.at("frame").get<uint32_t>();
            std::tuple<int64_t, uint32_t> last{-1, 0};
            for (const Json& map : entry.at("maps")) {
                const MapCost cost{map.at("light").get<uint32_t>(), map.value("octave", 0u),
                                   map.at("rays_ms").get<double>(), map.at("map_ms").get<double>()};
                const std::tuple<int64_t, uint32_t> next{cost.light, cost.octave};
                if (next <= last || !(cost.raysMs >= 0) || !(cost.mapMs >= 0))
                    throw Error(ErrorKind::kInput,
                                path + ": light " + std::to_string(cost.light) +
                                    ": lights must ascend and times be 0 or more; measure anew");
                last = next;
                costs.maps.push_back(cost);
            }
            table[{entry.at("scene").get<std::string>(), costs.frame}] = std::move(costs);
        }
    } catch (const Json::exception& error) {
        throw Error(ErrorKind::kInput, path + ": not a cost file: " + error.what());
    }
    return table;
}

Json sumJson(const std::vector<CostSummand>& sum) {
    Json list = Json::array();
    for (const CostSummand& summand : sum)
        list.push_back({{"term", summand.term->name}, {"ms", summand.ms}});
    return list;
}

std::vector<CostSummand> sumFromJson(const Json& json, const std::string& where) {
    std::vector<CostSummand> sum;
    for (const Json& entry : json) {
        const std::string name = entry.at("term").get<std::string>();
        const CostSummand summand{findCostTerm(name), entry.at("ms").get<double>()};
        if (summand.term == nullptr) {
            std::string known;
            for (const CostTerm& term : costTerms())
                known += (known.empty() ? "" : ", ") + std::string(term.name);
            throw Error(ErrorKind::kInput, where + ": unknown term '" + name + "'; there are " +
                                               known + "; calibrate again");
        }
        if (!std::isfinite(summand.ms) || summand.ms < 0)
            throw Error(ErrorKind::kInput, where + ": a unit of '" + name + "' takes " +
                                               entry.at("ms").dump() +
                                               " ms, which is no cost; calibrate again");
        sum.push_back(summand);
    }
    if (sum.empty())
        throw Error(ErrorKind::kInput, where + ": a cost without terms; calibrate again");
    return sum;
}

Json toJson(const Regret& regret) {
    return {{"mean", regret.mean}, {"standard_error", regret.standardError}};
}

/// Returns what tells two machines apart, and what they call it.
std::string otherMachine(const Json& fitted, const Json& here) {
    std::string text;
    for (const char* key : {"cpu", "device", "backend", "thread_count"}) {
        const Json there = fitted.value(key, Json()), now = here.value(key, Json());
        if (there != now)
            text += (text.empty() ? "" : ", ") + std::string(key) + " " + there.dump() +
                    " instead of " + now.dump();
    }
    return text;
}

} // namespace

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
    return tableFromJson(readJson(path), path);
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

Json toJson(const CostCalibration& calibration) {
    return {{"rays", sumJson(calibration.rays)}, {"map", sumJson(calibration.map)}};
}

CostCalibration calibrationFromJson(const Json& json, const std::string& where) {
    try {
        return {sumFromJson(json.at("rays"), where), sumFromJson(json.at("map"), where)};
    } catch (const Json::exception& error) {
        throw Error(ErrorKind::kInput, where + ": not a calibration: " + error.what());
    }
}

CostSource readCostSource(const std::string& path, const Json& provenance) {
    const Json json = readJson(path);
    CostSource source;
    source.path = path;
    if (json.is_object() && json.contains("calibration")) {
        source.calibration = calibrationFromJson(json["calibration"], path);
        const Json fitted = json.value("provenance", Json::object());
        source.otherMachine =
            otherMachine(fitted.is_object() ? fitted : Json::object(), provenance);
    } else {
        source.table = tableFromJson(json, path);
    }
    return source;
}

void giveCalibration(CostModel& model, const CostSource& source) {
    if (!model.needsCalibration())
        return;
    if (!source.calibration)
        throw Error(ErrorKind::kUsage,
                    source.path.empty()
                        ? std::string("--model cost routes by measured costs; give --costs C.json, "
                                      "as shadowdag calibrate -o C.json writes it")
                        : "--costs " + source.path +
                              ": holds costs of maps for --model oracle; --model cost needs what "
                              "shadowdag calibrate -o C.json writes");
    model.setCalibration(*source.calibration);
}

Json toJson(const std::vector<ObservedFrame>& frames) {
    Json list = Json::array();
    for (const ObservedFrame& frame : frames) {
        Json maps = Json::array();
        for (size_t m = 0; m < frame.maps.size(); ++m) {
            const MapQuantities& q = frame.maps[m];
            maps.push_back({{"light", q.light},
                            {"octave", q.octave},
                            {"texels", q.texels},
                            {"face_texels", q.faceTexels},
                            {"pages", q.pages},
                            {"samples", q.samples},
                            {"clusters", q.clusters},
                            {"triangles", q.triangles},
                            {"batches", q.batches},
                            {"lights", q.lights},
                            {"range", q.range},
                            {"rays_ms", frame.costs[m].raysMs},
                            {"map_ms", frame.costs[m].mapMs}});
        }
        list.push_back({{"scene", frame.scene},
                        {"view", frame.view},
                        {"frame", frame.frame},
                        {"geometry_ms", frame.geometryMs},
                        {"maps", std::move(maps)}});
    }
    return list;
}

std::vector<ObservedFrame> observationsFromJson(const Json& json, const std::string& where) {
    std::vector<ObservedFrame> frames;
    try {
        for (const Json& entry : json) {
            ObservedFrame frame;
            frame.scene = entry.at("scene").get<std::string>();
            frame.view = entry.at("view").get<std::string>();
            frame.frame = entry.at("frame").get<uint32_t>();
            frame.geometryMs = entry.at("geometry_ms").get<double>();
            for (const Json& map : entry.at("maps")) {
                MapQuantities q;
                q.light = map.at("light").get<uint32_t>();
                q.octave = map.at("octave").get<uint32_t>();
                q.texels = map.at("texels").get<float>();
                q.faceTexels = map.at("face_texels").get<uint32_t>();
                q.pages = map.at("pages").get<uint32_t>();
                q.samples = map.at("samples").get<uint64_t>();
                q.clusters = map.at("clusters").get<uint32_t>();
                q.triangles = map.at("triangles").get<uint64_t>();
                q.batches = map.at("batches").get<uint32_t>();
                q.lights = map.at("lights").get<uint32_t>();
                q.range = map.at("range").get<float>();
                const MapCost cost{q.light, q.octave, map.at("rays_ms").get<double>(),
                                   map.at("map_ms").get<double>()};
                if (!(cost.raysMs >= 0) || !(cost.mapMs >= 0))
                    throw Error(ErrorKind::kInput, where + ": light " + std::to_string(q.light) +
                                                       ": times must be 0 or more; measure anew");
                frame.maps.push_back(q);
                frame.costs.push_back(cost);
            }
            frames.push_back(std::move(frame));
        }
    } catch (const Json::exception& error) {
        throw Error(ErrorKind::kInput, where + ": holds no observations: " + error.what());
    }
    return frames;
}

Json toJson(const CostFit& fit) {
    Json trials = Json::array();
    for (const FitTrial& trial : fit.trials)
        trials.push_back({{"rays", formText(trial.form.rays)},
                          {"map", formText(trial.form.map)},
                          {"by_scene", toJson(trial.byScene)},
                          {"by_frame", toJson(trial.byFrame)},
                          {"gain", toJson(trial.gain)},
                          {"is_kept", trial.isKept}});
    Json others = {{"rays", toJson(fit.rays)},
                   {"maps", toJson(fit.maps)},
                   {"texels:96", toJson(fit.texels96)},
                   {"best_threshold_by_scene", toJson(fit.thresholdByScene)},
                   {"best_threshold_by_frame", toJson(fit.thresholdByFrame)}};
    return {
        {"judged_by", fit.judgedBy == HeldOut::kScenes ? "scene" : "frame"},
        {"by_scene", toJson(fit.byScene)},
        {"by_frame", toJson(fit.byFrame)},
        {"others", std::move(others)},
        {"best_threshold_texels", std::isinf(fit.threshold) ? Json("inf") : Json(fit.threshold)},
        {"trials", std::move(trials)}};
}

} // namespace shadowdag
