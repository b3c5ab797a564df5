// SPDX-License-Identifier: Apache-2.0
#include "tools/settings/experiment.h"

#include "cuda/error.h"
#include "hybrid/gbuffer/tone_map.h"
#include "tools/settings/json_file.h"
#include "tools/settings/setting.h"
#include "tools/settings/variants.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <limits>
#include <set>
#include <utility>

namespace shadowdag {

namespace {

/// Returns a value of an experiment file as the text of an option. Throws Error kUsage, beginning
/// with the quoted key, for a value of another type.
std::string textOf(const std::string& name, const Json& value, JsonForm form) {
    const auto refuse = [&](const std::string& right) {
        throw Error(ErrorKind::kUsage, name + " is " + jsonLine(value) + "; it must be " + right);
    };
    switch (form) {
    case JsonForm::kText:
        if (!value.is_string())
            refuse("a text");
        break;
    case JsonForm::kFlag:
        if (!value.is_boolean())
            refuse("true or false");
        break;
    case JsonForm::kNumber:
        if (!value.is_number())
            refuse("a number");
        break;
    case JsonForm::kNumberOrText:
        if (!value.is_number() && !value.is_string())
            refuse("a number or a text");
        break;
    }
    return value.is_string() ? value.get<std::string>() : value.dump();
}

/// Returns the texts of a setting's value: one, or those of a list.
std::vector<std::string> textsOf(const Setting& setting, const std::string& name,
                                 const Json& value) {
    const bool mayBeList = setting.isList || setting.isVaried;
    if (setting.isList && !value.is_array())
        throw Error(ErrorKind::kUsage, name + " is " + jsonLine(value) + "; it must be a list");
    std::vector<std::string> texts;
    if (mayBeList && value.is_array())
        for (const Json& item : value)
            texts.push_back(textOf(name, item, setting.form));
    else
        texts.push_back(textOf(name, value, setting.form));
    return texts;
}

/// Applies the names of variants: throws Error kUsage for a key that contradicts them.
void applyVariants(Experiment& e, const Json& json) {
    for (const Setting& setting : settings()) {
        if (!setting.isSetByVariant || !json.contains(setting.key))
            continue;
        const Json& value = json[setting.key];
        const bool takesPlace = setting.mayBeEmpty;
        if (setting.key == "methods" ? value == Json::array() || value == Json{"embree"}
            : takesPlace             ? value.empty()
                                     : value == setting.json(Experiment()))
            continue;
        throw Error(ErrorKind::kUsage, "\"" + setting.key + "\" is " + jsonLine(value) +
                                           "; it contradicts \"variants\", whose names set it: "
                                           "drop one");
    }
    if (!json.contains("methods"))
        e.methods = {"embree"};
    if (!json.contains("taps"))
        e.taps = {kPaperTaps};
    if (!json.contains("believe"))
        e.believe = {kPaperBelieve};
    e.thresholds.clear();
    e.models.clear();
    e.variants = parseVariants("\"variants\"", e.variants, baseOptions(e));
}

/// Throws Error kInput for a key that is not a setting.
void refuseUnknownKeys(const Json& json, const std::string& where) {
    std::set<std::string> known;
    for (const Setting& setting : settings())
        known.insert(setting.key);
    for (const auto& [key, value] : json.items())
        if (!known.contains(key))
            throw Error(ErrorKind::kInput, where + ": unknown key \"" + key + "\"; the keys are " +
                                               joinedNames({known.begin(), known.end()}));
}

void readSettings(Experiment& e, const Json& json) {
    for (const Setting& setting : settings()) {
        const std::string name = "\"" + setting.key + "\"";
        if (const auto found = json.find(setting.key); found != json.end())
            setting.set(e, name, textsOf(setting, name, *found));
    }
    if (!e.variants.empty())
        applyVariants(e, json);
    refuseCameraOfViews(e, "\"views\"", "\"camera\"");
    if (e.holdsRoutes() && !e.isSequence)
        throw Error(ErrorKind::kUsage, "\"route_margin\" is for frames in \"sequence\": otherwise "
                                       "frames are independent");
    if (e.isSequence && e.start != Experiment().start)
        throw Error(ErrorKind::kUsage,
                    "\"start\" is for single frames: a \"sequence\" keeps what its "
                    "frames before have left");
}

} // namespace

bool Experiment::holdsRoutes() const {
    return std::any_of(routeMargin.begin(), routeMargin.end(), [](float m) { return m > 0; });
}

std::string Experiment::viewCamera(uint32_t view) const {
    if (viewCount == 1)
        return camera;
    return view == 0 ? "auto" : "auto-" + std::to_string(view + 1);
}

std::string Experiment::viewName(const std::string& scene, uint32_t view) const {
    return viewCount > 1 ? scene + " " + viewCamera(view) : scene;
}

void refuseCameraOfViews(const Experiment& e, const std::string& by, const std::string& camera) {
    if (e.viewCount > 1 && !e.camera.empty() && e.camera != "auto")
        throw Error(ErrorKind::kUsage, by + " and " + camera + " '" + e.camera +
                                           "' contradict each other: several views are automatic; "
                                           "drop one");
}

void checkMethod(const std::string& option, const std::string& method,
                 const std::vector<std::string>& allowed) {
    if (std::find(allowed.begin(), allowed.end(), method) != allowed.end())
        return;
    throw Error(ErrorKind::kUsage,
                option + " '" + method + "': must be one of " + joinedNames(allowed));
}

float Experiment::exposureOf(const std::vector<glm::vec3>& linear) const {
    return exposure > 0 ? float(exposure) : autoExposure(linear);
}

Experiment experimentFromJson(const Json& json, const std::string& where) {
    if (!json.is_object())
        throw Error(ErrorKind::kInput, where + ": must contain one JSON object");
    refuseUnknownKeys(json, where);
    Experiment e;
    try {
        readSettings(e, json);
    } catch (const Error&
                 error) { // options and files have the same messages, except for the kind of error
        throw Error(ErrorKind::kInput, where + ": key " + error.what());
    }
    return e;
}

Experiment readExperiment(const std::string& path, Json* content) {
    Json json = readJsonFile(path, "give an experiment file, as in scenes/experiments/atrium.json");
    Experiment experiment = experimentFromJson(json, path);
    if (content)
        *content = std::move(json);
    return experiment;
}

Json toJson(const Experiment& e) {
    Json json = Json::object();
    for (const Setting& setting : settings())
        if (!setting.key.empty())
            json[setting.key] = setting.json(e);
    return json;
}

FrameOptions baseOptions(const Experiment& e) {
    FrameOptions base;
    base.width = e.width;
    base.height = e.height;
    for (const Setting* setting : frameSettings())
        setting->apply(e, 0, base);
    return base;
}

std::vector<uint32_t> allResolutions(const Experiment& e) {
    std::vector<uint32_t> all = e.resolutionLog2;
    for (const uint32_t log2 : e.dagResolutionLog2)
        if (std::find(all.begin(), all.end(), log2) == all.end())
            all.push_back(log2);
    return all;
}

} // namespace shadowdag
