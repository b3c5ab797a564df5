// SPDX-License-Identifier: Apache-2.0
#include "tools/workspace/cost_file.h"

#include "cuda/error.h"
#include "tools/settings/camera_text.h"
#include "tools/settings/json_file.h"
#include "tools/settings/parse.h"
#include "tools/settings/provenance.h"
#include "tools/settings/setting.h"
#include "tools/settings/words.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string_view>
#include <tuple>

namespace shadowdag {

namespace {

constexpr const char* kRemedy =
    "give a cost file: costs.json of compare, or C.json of calibrate -o C.json";

/// Returns the message for a file whose JSON is something else or incomplete.
Error notACostFile(const std::string& path, const std::string& what) {
    return Error(ErrorKind::kInput, path + ": is not a cost file: " + what + "; " + kRemedy);
}

/// Returns the JSON library's message without its own name and number.
std::string detailOf(const Json::exception& error) {
    const std::string text = error.what();
    const size_t end = text.find("] ");
    return end == std::string::npos ? text : text.substr(end + 2);
}

/// Returns a member that is a whole number. Throws Error kInput naming it.
template <class Int> Int wholeNumber(const Json& json, const char* key, const std::string& where) {
    const Json& value = json.at(key);
    if (!value.is_number_unsigned() || value.get<uint64_t>() > std::numeric_limits<Int>::max())
        throw Error(ErrorKind::kInput, where + ": \"" + key + "\" is " + jsonLine(value) +
                                           "; it must be a whole number from 0 to " +
                                           std::to_string(std::numeric_limits<Int>::max()) +
                                           ": measure again");
    return value.get<Int>();
}

/// Larger times and counts are errors: products of them could leave the range of numbers.
constexpr double kMaxAmount = 1e15;

/// Returns a member that is a number from 0 to kMaxAmount. Throws Error kInput naming it.
double amount(const Json& json, const char* key, const std::string& where) {
    const Json& value = json.at(key);
    if (!value.is_number() || !(value.get<double>() >= 0 && value.get<double>() <= kMaxAmount))
        throw Error(ErrorKind::kInput, where + ": \"" + key + "\" is " + jsonLine(value) +
                                           "; it must be a number from 0 to 1e15: measure again");
    return value.get<double>();
}

const char* startName(FrameStart start) {
    return start == FrameStart::kWarm ? "warm" : "cold";
}

std::string keyText(const CostKey& key) {
    return key.scene + " frame " + std::to_string(key.frame) + ", " + startName(key.start);
}

CostTable tableFromJson(const Json& json, const std::string& path) {
    CostTable table;
    if (!json.is_object() || !json.contains("costs") || !json["costs"].is_array())
        throw notACostFile(path, "it has neither \"costs\", a list, nor \"calibration\"");
    try {
        for (const Json& entry : json.at("costs")) {
            FrameCosts costs;
            const std::string start = entry.value("start", startName(FrameStart::kCold));
            if (start != startName(FrameStart::kCold) && start != startName(FrameStart::kWarm))
                throw Error(ErrorKind::kInput, path + ": \"start\" is '" + start +
                                                   "'; it must be cold or warm: measure again");
            costs.frame = wholeNumber<uint32_t>(entry, "frame", path);
            costs.raysScale = entry.contains("rays_scale") ? amount(entry, "rays_scale", path) : 1;
            costs.mapsScale = entry.contains("maps_scale") ? amount(entry, "maps_scale", path) : 1;
            costs.degradeDivisor =
                entry.contains("degrade_divisor") ? amount(entry, "degrade_divisor", path) : 1;
            if (entry.contains("whole_frame"))
                costs.wholeFrameTexels = wholeFrameFromJson(entry["whole_frame"], path);
            std::tuple<int64_t, uint32_t> last{-1, 0};
            for (const Json& map : entry.at("maps")) {
                const MapCost cost{
                    wholeNumber<uint32_t>(map, "light", path),
                    map.contains("octave") ? wholeNumber<uint32_t>(map, "octave", path) : 0,
                    amount(map, "rays_ms", path), amount(map, "map_ms", path)};
                const std::tuple<int64_t, uint32_t> next{cost.light, cost.octave};
                if (next <= last)
                    throw Error(ErrorKind::kInput, path + ": light " + std::to_string(cost.light) +
                                                       ": lights must ascend; measure again");
                last = next;
                costs.maps.push_back(cost);
            }
            Json of = entry.value("of", Json());
            if (!of.is_object() && !of.is_null())
                throw Error(ErrorKind::kInput, path + ": \"of\" is " + jsonLine(of) +
                                                   "; it must be an object: measure again");
            const bool isWarm = start == startName(FrameStart::kWarm);
            const CostKey key{entry.at("scene").get<std::string>(), costs.frame,
                              isWarm ? FrameStart::kWarm : FrameStart::kCold};
            if (!table.emplace(key, TableCosts{std::move(costs), std::move(of)}).second)
                throw Error(ErrorKind::kInput,
                            path + ": has costs of " + keyText(key) + " twice; measure again");
        }
    } catch (const Json::exception& error) {
        throw notACostFile(path, detailOf(error));
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
            throw Error(ErrorKind::kInput, where + ": unknown term '" + name + "'; the terms are " +
                                               known + "; calibrate again");
        }
        if (!std::isfinite(summand.ms) || summand.ms < 0)
            throw Error(ErrorKind::kInput, where + ": the coefficient of '" + name + "' is " +
                                               entry.at("ms").dump() +
                                               " ms, which is not a cost; calibrate again");
        sum.push_back(summand);
    }
    if (sum.empty())
        throw Error(ErrorKind::kInput, where + ": a cost without terms; calibrate again");
    return sum;
}

Json toJson(const Regret& regret) {
    return {{"mean", regret.mean}, {"standard_error", regret.standardError}};
}

/// Returns null if nothing could be held out.
Json toJson(const std::optional<Regret>& regret) {
    return regret ? toJson(*regret) : Json();
}

/// The values of provenance on which times depend.
constexpr const char* kMachineKeys[] = {"cpu", "device", "backend", "thread_count",
                                        kVectorInstructions};

/// Returns the values that distinguish two machines, with their names. Of the vector instructions
/// older files say nothing.
std::string otherMachine(const Json& fitted, const Json& here) {
    std::string text;
    for (const char* key : kMachineKeys) {
        const Json there = fitted.value(key, Json()), now = here.value(key, Json());
        const bool isOlder = there.is_null() && key == std::string_view(kVectorInstructions);
        if (there != now && !isOlder)
            text += (text.empty() ? "" : ", ") + std::string(key) + " " + there.dump() +
                    " instead of " + now.dump();
    }
    return text;
}

} // namespace

const char* routeName(Route route) {
    return route == Route::kRays ? "rays" : "map";
}

Json wholeFrameJson(float texels) {
    if (texels == 0.0f || std::isinf(texels))
        return routeName(texels == 0.0f ? Route::kMap : Route::kRays);
    return texels;
}

float wholeFrameFromJson(const Json& json, const std::string& where) {
    if (json == routeName(Route::kMap))
        return 0.0f;
    if (json == routeName(Route::kRays))
        return std::numeric_limits<float>::infinity();
    if (json.is_number() && json.get<double>() > 0 &&
        json.get<double>() <= double(std::numeric_limits<float>::max()))
        return json.get<float>();
    throw Error(ErrorKind::kInput,
                where + ": \"whole_frame\" is " + jsonLine(json) +
                    "; it must be \"rays\", \"map\" or a threshold in texels: measure again");
}

Json toJson(const CostTable& costs) {
    Json list = Json::array();
    for (const auto& [key, frameCosts] : costs) {
        Json maps = Json::array();
        for (const MapCost& map : frameCosts.maps)
            maps.push_back({{"light", map.light},
                            {"octave", map.octave},
                            {"rays_ms", map.raysMs},
                            {"map_ms", map.mapMs}});
        Json entry = {{"scene", key.scene},
                      {"frame", key.frame},
                      {"start", startName(key.start)},
                      {"rays_scale", frameCosts.raysScale},
                      {"maps_scale", frameCosts.mapsScale},
                      {"degrade_divisor", frameCosts.degradeDivisor}};
        if (frameCosts.wholeFrameTexels)
            entry["whole_frame"] = wholeFrameJson(*frameCosts.wholeFrameTexels);
        entry["maps"] = std::move(maps);
        if (!frameCosts.of.is_null())
            entry["of"] = frameCosts.of;
        list.push_back(std::move(entry));
    }
    return {{"costs", std::move(list)}};
}

Json toJson(const CostTable& costs, const Json& provenance, const Json& experiment) {
    Json json = {{"provenance", provenance}, {"experiment", experiment}};
    json.update(toJson(costs));
    return json;
}

CostTable readCosts(const std::string& path) {
    return tableFromJson(readJsonFile(path, kRemedy), path);
}

Json costConditions(const LoadedScene& scene, const Camera& camera, const Experiment& experiment,
                    float timeSeconds) {
    Json of = {{"scene_hash", scene.geometryHash},
               {"size", std::to_string(experiment.width) + "x" + std::to_string(experiment.height)},
               {"camera_numbers", cameraText(camera)},
               {"time_s", timeSeconds},
               {"light_hash", scene.world->lightHash()},
               {"lights", experiment.lightCount}};
    if (experiment.lightCount >= 0)
        of["light_seed"] = experiment.lightSeed;
    return of;
}

const TableCosts& findCosts(const CostTable& costs, const std::string& path, const CostKey& key) {
    const auto found = costs.find(key);
    if (found == costs.end())
        throw Error(ErrorKind::kInput,
                    path + ": has no costs of " + keyText(key) +
                        "; measure them with the same scenes, frames and --start");
    return found->second;
}

std::string otherConditions(const TableCosts& costs, const std::string& path, const CostKey& key,
                            const Json& here) {
    std::string others;
    for (const auto& [name, value] : here.items())
        if (costs.of.contains(name) && costs.of[name] != value)
            others += (others.empty() ? "" : ", ") + name + " " + jsonLine(costs.of[name]) +
                      " instead of " + jsonLine(value);
    return others.empty()
               ? others
               : path + ": its costs of " + keyText(key) + " were measured with " + others;
}

const TableCosts& findCosts(const CostTable& costs, const std::string& path, const CostKey& key,
                            const Json& here, bool allowStale, const Console& console,
                            const char* permit) {
    const TableCosts& found = findCosts(costs, path, key);
    const std::string text = otherConditions(found, path, key, here);
    if (text.empty())
        return found;
    if (!allowStale)
        throw Error(ErrorKind::kInput, text + "; measure them again, or " + permit);
    console.note("warning: " + text + "; used nevertheless");
    return found;
}

void requireCosts(const CostTable& costs, const std::string& path,
                  const std::vector<std::string>& scenes, const std::vector<uint32_t>& frames,
                  const std::vector<FrameStart>& starts) {
    for (const std::string& scene : scenes)
        for (const uint32_t frame : frames)
            for (const FrameStart start : starts)
                static_cast<void>(findCosts(costs, path, {scene, frame, start}));
}

Json toJson(const CostCalibration& calibration) {
    return {{"rays", sumJson(calibration.rays)}, {"map", sumJson(calibration.map)}};
}

CostCalibration calibrationFromJson(const Json& json, const std::string& where) {
    try {
        return {sumFromJson(json.at("rays"), where), sumFromJson(json.at("map"), where)};
    } catch (const Json::exception& error) {
        throw Error(ErrorKind::kInput,
                    where + ": is not a calibration: " + detailOf(error) + "; calibrate again");
    }
}

CostSource readCostSource(const std::string& path, const Json& provenance) {
    const Json json = readJsonFile(path, kRemedy);
    CostSource source;
    source.path = path;
    if (json.is_object() && json.contains("calibration")) {
        source.calibration = calibrationFromJson(json["calibration"], path);
        const Json fitted = json.value("provenance", Json::object());
        source.otherMachine =
            otherMachine(fitted.is_object() ? fitted : Json::object(), provenance);
        if (json.contains("experiment") && json["experiment"].is_object()) {
            source.fittedWith = json["experiment"];
            source.fittedWith["sizes"] = json.value("sizes", Json());
        }
    } else {
        source.table = tableFromJson(json, path);
        if (json.contains("provenance") && json["provenance"].is_object())
            source.otherMachine = otherMachine(json["provenance"], provenance);
    }
    return source;
}

std::string otherSettings(const CostSource& source, const RunParameters& run) {
    std::string text;
    const auto compare = [&](const std::string& name, const Json& fitted, const Json& here) {
        if (!fitted.is_array() || fitted.empty() ||
            std::find(fitted.begin(), fitted.end(), here) != fitted.end())
            return;
        const auto shown = [](const Json& value) {
            return value.is_string() ? value.get<std::string>() : jsonLine(value);
        };
        std::vector<std::string> values;
        for (const Json& value : fitted)
            values.push_back(shown(value));
        text +=
            (text.empty() ? "" : ", ") + name + " " + shown(here) + " instead of " + orText(values);
    };
    if (!source.fittedWith.is_object())
        return text;
    const auto find = [](const Json& json, const std::string& key) {
        return json.contains(key) ? json[key] : Json();
    };
    Json sizes = Json::array();
    if (const Json fitted = find(source.fittedWith, "sizes"); fitted.is_string())
        for (const std::string& size : parseList("sizes", fitted.get<std::string>()))
            sizes.push_back(size);
    compare("size", sizes,
            std::to_string(run.frame.width) + "x" + std::to_string(run.frame.height));
    if (run.usesVoxels())
        compare("resolution", find(source.fittedWith, "resolutions"), Json(run.resolution));
    for (const Setting* setting : frameSettings()) {
        if (setting->readBy == ReadBy::kHybrid || !reads(run, setting->readBy))
            continue; // of routing: changes no map's cost
        Experiment own;
        setting->set(own, setting->option, {setting->frameText(run.frame)});
        const auto asList = [](const Json& json) {
            return json.is_array() || json.is_null() ? json : Json::array({json});
        };
        const Json here = asList(setting->json(own));
        Json fitted = asList(find(source.fittedWith, setting->key));
        if (setting->key == "believe" && fitted.is_null())
            fitted = {"all"}; // a file from before the setting
        compare(setting->key, fitted, here[0]);
    }
    return text;
}

namespace {

bool needsCalibration(const RunParameters& run) {
    return run.isRouted() && makeCostModel(run.model)->needsCalibration();
}

} // namespace

void refuseUnusedOptions(const CostSource& source, const std::vector<RunParameters>& runs) {
    if (source.calibration && std::none_of(runs.begin(), runs.end(), needsCalibration))
        throw Error(ErrorKind::kUsage, "--costs " + source.path +
                                           ": is a calibration, which no run uses for routing; add "
                                           "--model cost, or give a costs.json of compare, or "
                                           "drop it");
}

std::vector<std::string> remarksOn(const CostSource& source,
                                   const std::vector<RunParameters>& runs) {
    std::vector<std::string> remarks;
    if (!source.otherMachine.empty())
        remarks.push_back(
            source.path + ": was " + (source.calibration ? "calibrated" : "measured") +
            " elsewhere (" + source.otherMachine + "); " +
            (source.calibration ? "calibrate" : "measure") + " on this machine for good routes");
    if (source.table && std::any_of(source.table->begin(), source.table->end(),
                                    [](const auto& entry) { return entry.second.of.is_null(); }))
        remarks.push_back("warning: " + source.path +
                          ": does not record the geometry, size, camera and lights of its "
                          "costs, so they cannot be checked; measure again");
    for (const RunParameters& run : runs)
        if (const std::string other = otherSettings(source, run);
            needsCalibration(run) && !other.empty()) {
            const std::string remark = source.path + ": was calibrated with other settings (" +
                                       other + "); calibrate with these for good routes";
            if (std::find(remarks.begin(), remarks.end(), remark) == remarks.end())
                remarks.push_back(remark);
        }
    return remarks;
}

void giveCalibration(CostModel& model, const CostSource& source) {
    if (!model.needsCalibration())
        return;
    if (!source.calibration)
        throw Error(ErrorKind::kUsage,
                    source.path.empty()
                        ? std::string("--model cost routes by measured costs; give --costs C.json, "
                                      "which shadowdag calibrate -o C.json writes")
                        : "--costs " + source.path +
                              ": contains costs of maps for --model oracle; --model cost needs the "
                              "file that "
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
                            {"pairs", q.pairs},
                            {"movers", q.movers},
                            {"mover_crossings", q.moverCrossings},
                            {"rays_ms", frame.costs[m].raysMs},
                            {"map_ms", frame.costs[m].mapMs}});
        }
        Json countMs = Json::object();
        for (size_t k = 0; k < kCountNameCount; ++k)
            countMs[kCountNames[k]] = frame.countMs[k];
        list.push_back({{"scene", frame.scene},
                        {"view", frame.view},
                        {"frame", frame.frame},
                        {"count_ms", std::move(countMs)},
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
            frame.frame = wholeNumber<uint32_t>(entry, "frame", where);
            for (size_t k = 0; k < kCountNameCount; ++k)
                frame.countMs[k] = amount(entry.at("count_ms"), kCountNames[k], where);
            for (const Json& map : entry.at("maps")) {
                MapQuantities q;
                q.light = wholeNumber<uint32_t>(map, "light", where);
                q.octave = wholeNumber<uint32_t>(map, "octave", where);
                q.texels = float(amount(map, "texels", where));
                q.faceTexels = wholeNumber<uint32_t>(map, "face_texels", where);
                q.pages = wholeNumber<uint32_t>(map, "pages", where);
                q.samples = wholeNumber<uint64_t>(map, "samples", where);
                q.clusters = wholeNumber<uint32_t>(map, "clusters", where);
                q.triangles = wholeNumber<uint64_t>(map, "triangles", where);
                q.batches = wholeNumber<uint32_t>(map, "batches", where);
                q.lights = wholeNumber<uint32_t>(map, "lights", where);
                q.range = float(amount(map, "range", where));
                q.pairs = wholeNumber<uint64_t>(map, "pairs", where);
                q.movers = wholeNumber<uint32_t>(map, "movers", where);
                q.moverCrossings = float(amount(map, "mover_crossings", where));
                const MapCost cost{q.light, q.octave, amount(map, "rays_ms", where),
                                   amount(map, "map_ms", where)};
                frame.maps.push_back(q);
                frame.costs.push_back(cost);
            }
            frames.push_back(std::move(frame));
        }
    } catch (const Json::exception& error) {
        throw Error(ErrorKind::kInput, where +
                                           ": is not a list of observations: " + detailOf(error) +
                                           "; measure again with calibrate "
                                           "--observations");
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
        {"judged_by", !fit.judgedBy                       ? Json()
                      : *fit.judgedBy == HeldOut::kScenes ? Json("scene")
                                                          : Json("frame")},
        {"by_scene", toJson(fit.byScene)},
        {"by_frame", toJson(fit.byFrame)},
        {"others", std::move(others)},
        {"best_threshold_texels", std::isinf(fit.threshold) ? Json("inf") : Json(fit.threshold)},
        {"trials", std::move(trials)}};
}

} // namespace shadowdag
