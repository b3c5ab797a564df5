// SPDX-License-Identifier: Apache-2.0
// `shadowdag calibrate`: fits the cost model `cost` to this machine.
#include "tools/commands/commands.h"
#include "tools/report/results_identity.h"
#include "tools/settings/camera_text.h"
#include "tools/settings/common_options.h"
#include "tools/settings/gl_support.h"
#include "tools/settings/json_file.h"
#include "tools/settings/parse.h"
#include "tools/settings/provenance.h"
#include "tools/workspace/calibration.h"
#include "tools/workspace/cost_file.h"
#include "tools/workspace/scene_setup.h"
#include "tools/workspace/timing.h"
#include "tools/workspace/whole_file.h"
#include "tools/workspace/workspace.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <initializer_list>
#include <iomanip>
#include <iostream>
#include <memory>
#include <sstream>
#include <utility>

namespace shadowdag {

namespace {

struct CalibrateOptions {
    GlobalOptions global;
    CommonOptions common;
    std::vector<std::string> scenes;
    std::string output, sizes = "320x180,640x360", observations, from, repeats = "3";
    bool quick = false;
};

/// The default measurements when no scene is named.
const std::vector<std::string> kScenes{"builtin:atrium", "builtin:houses", "builtin:necropolis"};
constexpr const char* kFrames = "0:300:100";
constexpr const char* kResolution = "4096";
/// A full pool divides all resolutions, so a map would not have its own cost.
constexpr const char* kPool = "1G";
// --quick: a fast trial, not a calibration for routing.
constexpr const char *kQuickSizes = "160x90", *kQuickFrames = "0:300:300",
                     *kQuickResolution = "256", *kQuickRepeats = "1";

/// The result of measuring: frames for the fit, and rows about them for reports.
struct Measured {
    std::vector<ObservedFrame> frames;
    Json rows = Json::array();
    Json experiment, sizes, repeats; ///< as read; null if the file does not contain it
};

Json rowOf(const CalibrationFrame& frame) {
    const ObservedFrame& o = frame.observed;
    Json countMs = Json::object();
    for (size_t k = 0; k < kCountNameCount; ++k)
        countMs[kCountNames[k]] = o.countMs[k];
    return {{"scene", o.scene},
            {"view", o.view},
            {"frame", o.frame},
            {"map_count", o.maps.size()},
            {"rays_ms", frame.raysMs},
            {"rays_scale", frame.raysScale},
            {"maps_ms", frame.mapsMs},
            {"maps_scale", frame.mapsScale},
            {"oracle_sum_ms", frame.oracleSumMs},
            {"oracle_ms", frame.oracleMs},
            {"count_ms", countMs}};
}

void printRow(std::ostream& out, const CalibrationFrame& frame) {
    char line[256];
    std::snprintf(line, sizeof line,
                  "%s frame %u %s: %zu maps; rays %.1f ms (%.2f of the sum of maps alone), maps "
                  "%.1f (%.2f), oracle %.1f (its maps' costs add to %.1f); counting pages %.2f, "
                  "triangles %.2f, pairs %.2f, movers %.2f",
                  frame.observed.scene.c_str(), frame.observed.frame, frame.observed.view.c_str(),
                  frame.observed.maps.size(), frame.raysMs, frame.raysScale, frame.mapsMs,
                  frame.mapsScale, frame.oracleMs, frame.oracleSumMs, frame.observed.countMs[0],
                  frame.observed.countMs[1], frame.observed.countMs[2], frame.observed.countMs[3]);
    out << line << std::endl;
}

Measured measure(const CalibrateOptions& options, const Experiment& e,
                 const std::vector<std::pair<uint32_t, uint32_t>>& sizes, int repeats,
                 Backend backend, const Console& console) {
    Measured measured;
    const std::vector<std::string> names = sceneNames(e.scenes);
    for (size_t s = 0; s < e.scenes.size(); ++s) {
        const VoxelSource source{options.common.voxels, options.common.cache,
                                 options.common.allowStale};
        Workspace workspace(openScene(e, s, console), {backend, e.camera, source, &console});
        if (e.believe.front() > 0.0f || !options.common.voxels.empty())
            workspace.obtainVoxels(e.resolutionLog2);
        FrameRenderer& renderer = workspace.renderer(RunParameters());
        std::vector<uint32_t> frames = e.frames;
        if (workspace.scene().scene->animations.empty()) // all are one, of which none is held out
            frames.resize(1);
        const Progress progress = console.progress("calibrate " + names[s]);
        size_t done = 0;
        for (const uint32_t frame : frames) {
            workspace.setTime(e.timeOfFrame(frame));
            const Camera view = workspace.camera();
            for (const auto& [width, height] : sizes) {
                FrameOptions frameOptions = baseOptions(e);
                frameOptions.width = width;
                frameOptions.height = height;
                CalibrationFrame row =
                    measureCalibrationFrame(renderer, view, frameOptions, repeats);
                if (row.degradeDivisor > 1)
                    throw Error(ErrorKind::kUsage,
                                names[s] + " frame " + std::to_string(frame) +
                                    ": the maps do not fit a pool of " +
                                    options.common.text("--pool") +
                                    " and would be measured coarser than requested; use "
                                    "a larger --pool, or a smaller --size");
                row.observed.scene = names[s];
                row.observed.view = std::to_string(width) + "x" + std::to_string(height);
                row.observed.frame = frame;
                printRow(console.people(), row);
                measured.rows.push_back(rowOf(row));
                measured.rows.back()["scene_hash"] = workspace.scene().geometryHash;
                measured.rows.back()["camera_numbers"] = cameraText(view);
                measured.frames.push_back(std::move(row.observed));
                progress(double(++done) / double(frames.size() * sizes.size()));
            }
        }
    }
    return measured;
}

/// Throws unless a map was measured, without which there is nothing to fit.
void requireMaps(const Measured& measured, const CalibrateOptions& options) {
    std::string scenes;
    for (const ObservedFrame& frame : measured.frames) {
        if (!frame.maps.empty())
            return;
        if (scenes.find(frame.scene) == std::string::npos)
            scenes += (scenes.empty() ? "" : ", ") + frame.scene;
    }
    throw Error(ErrorKind::kInput,
                (options.from.empty() ? scenes : options.from) +
                    ": no light reaches what the camera sees, so no map was measured; choose a "
                    "scene or a --camera that sees lit surfaces, or place lights with --lights");
}

std::string percent(const std::optional<Regret>& regret) {
    if (!regret)
        return "     -";
    char text[64];
    std::snprintf(text, sizeof text, "%6.2f +- %.2f %%", 100 * regret->mean,
                  100 * regret->standardError);
    return text;
}

void printFit(std::ostream& out, const CostFit& fit) {
    out << "\nheld-out regret: time lost against the cheaper method of every map, mean over frames "
           "+- standard error\n"
        << std::left << std::setw(58) << "form tried" << std::setw(20) << "scenes held out"
        << std::setw(20) << "frames held out"
        << "lowers it by\n";
    for (const FitTrial& trial : fit.trials)
        out << std::setw(58)
            << (std::string(trial.isKept ? "+ " : "  ") + "rays: " + formText(trial.form.rays) +
                "; map: " + formText(trial.form.map))
            << " " << std::setw(20) << percent(trial.byScene) << std::setw(20)
            << percent(trial.byFrame) << percent(trial.gain) << "\n";
    out << (!fit.judgedBy
                ? "one frame of one scene leaves nothing to hold out: the model is the "
                  "better single method; measure more scenes, or frames of one that moves\n"
            : *fit.judgedBy == HeldOut::kScenes
                ? "judged by scenes held out\n"
                : "judged by frames held out: fewer than two scenes gain by routing\n")
        << "in comparison: rays alone " << percent(fit.rays) << ", maps alone " << percent(fit.maps)
        << ", texels:96 " << percent(fit.texels96)
        << ",\n  best single threshold, held out by scene " << percent(fit.thresholdByScene)
        << ", by frame " << percent(fit.thresholdByFrame) << " (texels:" << fit.threshold
        << " over all)\n"
        << "chosen, ms: rays = " << formText(fit.calibration.rays)
        << "\n          map = " << formText(fit.calibration.map) << "\n";
}

Measured readObservations(const std::string& path, Json& provenance) {
    const std::string remedy = "give a file from calibrate --observations";
    const Json json = readJsonFile(path, remedy);
    if (!json.is_object() || !json.contains("observations") || !json["observations"].is_array() ||
        json["observations"].empty())
        throw Error(ErrorKind::kInput, path + ": contains no observations; " + remedy);
    Measured measured;
    measured.frames = observationsFromJson(json["observations"], path);
    measured.rows = json.value("frames", Json::array());
    measured.experiment = json.value("experiment", Json());
    measured.sizes = json.value("sizes", Json());
    measured.repeats = json.value("repeat_count", Json());
    provenance = json.value("provenance", Json::object()); // of the machine that measured
    return measured;
}

/// The settings that measuring uses.
constexpr SettingGroup kGroups[] = {SettingGroup::kLights, SettingGroup::kVoxels,
                                    SettingGroup::kRays, SettingGroup::kMaps};
constexpr const char* kViewOptions[] = {"--camera", "--frames", "--fps"};

Experiment experimentOf(CalibrateOptions& options, const CommandLine& commandLine) {
    if (!commandLine.given("--frames") && options.quick)
        options.common.text("--frames") = kQuickFrames;
    if (!commandLine.given("--resolution") && options.quick)
        options.common.text("--resolution") = kQuickResolution;
    if (!commandLine.given("--size") && options.quick)
        options.sizes = kQuickSizes;
    if (!commandLine.given("--repeats") && options.quick)
        options.repeats = kQuickRepeats;
    Experiment e = options.common.experiment(commandLine, true); // frames are a list, others not
    const auto refuseSeveral = [](const std::string& option, size_t count) {
        if (count > 1)
            throw Error(ErrorKind::kUsage,
                        option + ": calibrate takes one value; compare takes lists");
    };
    refuseSeveral("--voxels", options.common.voxels.size());
    refuseSeveral("--resolution", e.resolutionLog2.size());
    for (const Setting* setting : frameSettings())
        refuseSeveral(setting->option, setting->texts(e).size());
    e.scenes = options.scenes.empty() ? kScenes : options.scenes;
    return e;
}

/// Returns the options that define the measurements.
std::vector<std::string> optionsOfMeasuring() {
    std::vector<std::string> options{"SCENE",   "--size",  "--voxels",      "--repeats",
                                     "--quick", "--cache", "--allow-stale", "--observations"};
    for (const SettingGroup group : kGroups)
        for (const Setting& setting : settings())
            if (setting.group == group)
                options.push_back(setting.option);
    for (const char* option : kViewOptions)
        options.push_back(option);
    return options;
}

void runCalibrate(CalibrateOptions& options, const CommandLine& commandLine) {
    const Console console(options.global.json);
    if (!options.from.empty())
        for (const std::string& option : optionsOfMeasuring())
            if (commandLine.given(option))
                throw Error(ErrorKind::kUsage, option +
                                                   " and --from contradict each other: the maps "
                                                   "are measured; drop one of them");
    Experiment e = experimentOf(options, commandLine);
    std::vector<std::pair<uint32_t, uint32_t>> sizes;
    for (const std::string& size : parseList("--size", options.sizes))
        sizes.push_back(parseSize("--size", size));
    const int repeats = int(parseInteger("--repeats", options.repeats, 1, 1000));
    refuseSameFile(options.output, {options.observations});
    for (const auto& [option, path] :
         {std::pair("-o", options.output), std::pair("--observations", options.observations)})
        if (!path.empty()) {
            for (const std::vector<std::string>& inputs :
                 {options.scenes, options.common.voxels, {options.from}})
                refuseSameFile(path, inputs, option);
            checkWritable(path);
            refuseToReplaceResults(option, path, "calibrate");
        }
    const Backend backend =
        options.global.apply(console, options.from.empty(), options.from.empty());
    followGlPages(e, backend, commandLine);
    takeGlDefaults(e, options.global.backend, commandLine);
    refuseOnGl(e, backend, "");
    Json provenance = buildProvenance(backend);
    const CpuUse use;
    const Measured measured = options.from.empty()
                                  ? measure(options, e, sizes, repeats, backend, console)
                                  : readObservations(options.from, provenance);
    requireMaps(measured, options);
    if (!options.observations.empty())
        writeWholeFile(options.observations, jsonText({{"provenance", provenance},
                                                       {"experiment", toJson(e)},
                                                       {"sizes", options.sizes},
                                                       {"repeat_count", repeats},
                                                       {"frames", measured.rows},
                                                       {"observations", toJson(measured.frames)}}));
    const std::string busy = options.from.empty() ? busyRemark(use.otherShare()) : "";
    const CostFit fit = fitCosts(measured.frames);
    printFit(console.people(), fit);
    if (!busy.empty())
        console.note("warning: " + busy);
    Json scenes = Json::array();
    for (const ObservedFrame& frame : measured.frames)
        if (scenes.empty() || scenes.back() != frame.scene)
            scenes.push_back(frame.scene);
    const Json json = {{"calibration", toJson(fit.calibration)},
                       {"provenance", provenance},
                       {"scenes", scenes},
                       {"experiment", options.from.empty() ? toJson(e) : measured.experiment},
                       {"sizes", options.from.empty() ? Json(options.sizes) : measured.sizes},
                       {"repeat_count", options.from.empty() ? Json(repeats) : measured.repeats},
                       {"held_out_regret", toJson(fit)},
                       {"frames", measured.rows}};
    writeWholeFile(options.output, jsonText(json));
    console.people() << options.output << ": for --model cost --costs " << options.output << "\n";
    console.emit({{"output", options.output},
                  {"frame_count", measured.frames.size()},
                  {"calibration", toJson(fit.calibration)},
                  {"held_out_regret", toJson(fit)}});
}

} // namespace

std::function<void()> declareCalibrate(CommandLine& commandLine) {
    auto options = std::make_shared<CalibrateOptions>();
    commandLine.texts("SCENE", options->scenes, "",
                      "Scenes to measure: files, or builtin:NAME [builtin:atrium "
                      "builtin:houses builtin:necropolis]");
    commandLine.text("-o,--output", options->output, "C.json",
                     "The costs of maps on this machine, for --model cost --costs C.json", true);
    commandLine.flag(
        "--quick", options->quick,
        "Small pictures, coarse voxels, two frames: takes seconds instead of minutes, for a trial");
    commandLine.text("--repeats", options->repeats, "N", "Measurements of every map [3]");
    commandLine.text("--observations", options->observations, "F.json",
                     "Also write the measurements of every map");
    commandLine.text("--from", options->from, "F.json",
                     "Fit to the measurements in this file instead of measuring");
    commandLine.heading("View");
    commandLine.text("--size", options->sizes, "WxH,...",
                     "Picture sizes at which every frame is measured [320x180,640x360]");
    options->common.text("--frames") = kFrames;
    options->common.text("--resolution") = kResolution;
    options->common.text("--pool") = kPool;
    for (const char* option : kViewOptions)
        options->common.declare(commandLine, settingOf(option), true);
    options->common.declare(commandLine, {std::begin(kGroups), std::end(kGroups)}, false);
    options->global.declare(commandLine);
    return [options, &commandLine] { runCalibrate(*options, commandLine); };
}

} // namespace shadowdag
