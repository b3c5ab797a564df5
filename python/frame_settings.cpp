// SPDX-License-Identifier: Apache-2.0
#include "python/frame_settings.h"

#include "cuda/error.h"
#include "python/call.h"
#include "python/callable_model.h"
#include "python/errors.h"
#include "python/json_object.h"
#include "tools/settings/json_file.h"
#include "tools/settings/provenance.h"
#include "tools/settings/unused_options.h"
#include "tools/settings/variants.h"

#include <algorithm>
#include <cmath>

namespace shadowdag::python {

namespace py = pybind11;

namespace {

/// The keys that are not of the table.
struct OwnKey {
    const char *key, *shown, *help;
};
constexpr OwnKey kOwnKeys[] = {
    {"method", "hybrid", "dag, maps, hybrid or embree"},
    {"model", "texels:96", "Of hybrid: texels:N, expr:EXPRESSION, cost, oracle, or a callable"},
    {"variant", "", "Instead of method and model: a variant by name, as in PMCD-EB-4SM-u2"},
    {"costs", "", "A file of calibrate for model cost, or of compare for model oracle"},
    {"allow_stale", "False",
     "Use costs of another size, camera, geometry or lights, with a warning"},
    {"time", "0", "Time of the scene's animations, seconds"},
    {"resolution", "1024", "Voxels an axis, where rays go through voxels"},
};

/// Returns whether a setting of the table is one of frames that are rendered by themselves.
bool isOfOneFrame(const Setting& setting) {
    return setting.key == "size" || setting.key == "camera" || setting.key == "exposure" ||
           (setting.isOfFrame() && setting.key != "route_margin");
}

std::string quoted(const std::string& key) {
    return "\"" + key + "\"";
}

[[noreturn]] void refuse(const std::string& text) {
    throw Error(ErrorKind::kUsage, "settings: " + text);
}

void refuseUnknown(const Json& json) {
    std::vector<std::string> known;
    for (const OwnKey& own : kOwnKeys)
        known.emplace_back(own.key);
    for (const Setting& setting : settings())
        if (isOfOneFrame(setting))
            known.push_back(setting.key);
    for (const auto& [key, value] : json.items()) {
        if (std::find(known.begin(), known.end(), key) != known.end())
            continue;
        if (key == "lights" || key == "light_seed")
            refuse(quoted(key) +
                   " belongs to the scene; give it to load(), or placed_lights to scene()");
        if (key == "backend")
            refuse(quoted(key) + " belongs to the scene; give it to load() or scene()");
        std::sort(known.begin(), known.end());
        refuse("unknown key " + quoted(key) + "; the keys are " + joinedNames(known));
    }
}

/// Returns the settings of the table among those given, as an experiment's.
Experiment experimentOf(const Json& json) {
    Json ofTable = Json::object();
    for (const auto& [key, value] : json.items()) {
        const bool isOwn =
            std::any_of(std::begin(kOwnKeys), std::end(kOwnKeys),
                        [&, &name = key](const OwnKey& own) { return name == own.key; });
        if (key == "resolution") {
            ofTable["resolutions"] = Json::array({value});
            continue;
        }
        if (isOwn)
            continue;
        if (value.is_array() && value.size() != 1)
            refuse(quoted(key) + " is " + jsonLine(value) +
                   "; a frame takes one value, compare takes a list");
        const auto setting =
            std::find_if(settings().begin(), settings().end(),
                         [&, &name = key](const Setting& one) { return one.key == name; });
        ofTable[key] = setting->isList && !value.is_array() ? Json::array({value}) : value;
    }
    try {
        return experimentFromJson(ofTable, "settings");
    } catch (const Error& error) { // of an argument, not of a file
        throw Error(ErrorKind::kUsage, error.what());
    }
}

std::string textAt(const Json& json, const char* key, const std::string& otherwise) {
    const auto found = json.find(key);
    if (found == json.end())
        return otherwise;
    if (!found->is_string())
        refuse("key " + quoted(key) + " is " + jsonLine(*found) + "; it must be a text");
    return found->get<std::string>();
}

RunParameters variantOf(const Json& json, const std::string& name, const Experiment& experiment) {
    for (const char* key : {"method", "model", "undersample", "maps_per_light", "polygon_lod"})
        if (json.contains(key))
            refuse(quoted(key) + " and \"variant\" contradict each other: the name sets it; drop "
                                 "one of them");
    const Variant parsed = parseVariant("settings: \"variant\"", name);
    if (parsed.taps != 0 && json.contains("taps"))
        refuse("\"taps\" and \"variant\" contradict each other: the name sets it; drop one of "
               "them");
    FrameOptions base = baseOptions(experiment);
    if (!json.contains("taps"))
        base.maps.taps = base.bias.taps = kPaperTaps;
    if (!json.contains("believe"))
        base.rays.believe = kPaperBelieve;
    RunParameters run = variantRun(parsed, base);
    if (run.frame.routeMargin > 0)
        refuse("\"variant\" '" + name +
               "': a margin of routes is for sequences of frames; drop RH");
    return run;
}

/// Takes the path of "costs" out of the settings: the name of a file may be any bytes, and texts of
/// JSON are UTF-8. "" if there is none; what is no path stays, and is refused as a setting.
std::string takeCostsPath(const py::dict& settings) {
    if (!settings.contains("costs"))
        return "";
    const py::object given = settings["costs"];
    if (!py::isinstance<py::str>(given) && !py::hasattr(given, "__fspath__"))
        return "";
    std::string path = pathOf(given);
    refuseZeroByte(path);
    settings["costs"] = "";
    return path;
}

void setModel(FrameRequest& request, const Json& json, const py::object& callable,
              const std::string& costs) {
    const Method& method = request.run.kind();
    if (!method.needs().routing && (json.contains("model") || !callable.is_none()))
        refuse("\"model\" is for method hybrid, not for '" + method.name() + "'; drop one of them");
    if (!callable.is_none()) {
        request.model = makeCallableModel(callable);
        request.run.model = py::hasattr(callable, "__name__")
                                ? std::string(py::str(callable.attr("__name__")))
                                : std::string(py::str(callable));
    } else {
        request.modelText = method.modelText(request.run.model);
        request.model = makeCostModel(request.modelText);
        request.run.model = request.modelText;
    }
    static_cast<void>(textAt(json, "costs", "")); // refuses what is no path
    if (!costs.empty()) {
        if (!request.model->needsCosts() && !request.model->needsCalibration())
            refuse("\"costs\" is for method hybrid with model cost or oracle; drop it");
        Call call("read " + costs, py::none());
        request.costs =
            call.run([&] { return readCostSource(costs, buildProvenance(Backend::kCpu)); });
        if (request.model->needsCosts() && !request.costs.table)
            refuse("\"costs\" " + costs +
                   ": is a calibration for model cost; model oracle replays "
                   "the costs.json of compare");
    }
    giveCalibration(*request.model, request.costs);
    if (const auto stale = json.find("allow_stale"); stale != json.end()) {
        if (!stale->is_boolean())
            refuse("\"allow_stale\" is " + jsonLine(*stale) + "; it must be True or False");
        if (!request.costs.table)
            refuse("\"allow_stale\" is for the \"costs\" of model oracle; drop it");
        request.allowsStaleCosts = stale->get<bool>();
    }
}

} // namespace

FrameRequest frameRequest(const py::dict& given) {
    py::object callable = py::none();
    const py::dict plain = given.attr("copy")();
    if (plain.contains("model")) {
        const py::object model = plain["model"];
        if (PyCallable_Check(model.ptr()) != 0)
            callable = plain.attr("pop")("model");
    }
    const std::string costs = takeCostsPath(plain);
    const Json json = jsonOf(plain, "settings");
    refuseUnknown(json);

    FrameRequest request;
    request.experiment = experimentOf(json);
    if (const auto time = json.find("time"); time != json.end()) {
        if (!time->is_number() || !(std::abs(time->get<double>()) <= 1e6))
            refuse("key \"time\" is " + jsonLine(*time) + "; it must be a number from -1e6 to 1e6");
        request.timeSeconds = time->get<float>();
    }
    RunParameters& run = request.run;
    if (const std::string variant = textAt(json, "variant", ""); !variant.empty()) {
        run = variantOf(json, variant, request.experiment);
    } else {
        run.method = textAt(json, "method", "hybrid");
        checkMethod("settings: \"method\"", run.method, measuredMethodNames());
        run.model = textAt(json, "model", methodOf(run.method).needs().routing ? "texels:96" : "");
        run.frame = baseOptions(request.experiment);
    }
    run.kind().takeOver(run.frame.rays);
    setModel(request, json, callable, costs);
    refuseUnread(run, [&](const Setting& setting) {
        return json.contains(setting.key) ? "settings: " + quoted(setting.key) : std::string();
    });
    return request;
}

py::list frameSettingTable() {
    py::list rows;
    const auto add = [&](const std::string& key, const std::string& shown,
                         const std::string& help) {
        py::dict row;
        row["key"] = key;
        row["default"] = shown;
        row["help"] = help;
        rows.append(row);
    };
    for (const OwnKey& own : kOwnKeys)
        add(own.key, own.shown, own.help);
    for (const Setting& setting : settings())
        if (isOfOneFrame(setting))
            add(setting.key,
                setting.shownDefault.empty() ? setting.defaultText() : setting.shownDefault,
                setting.help);
    return rows;
}

} // namespace shadowdag::python
