// SPDX-License-Identifier: Apache-2.0
// `shadowdag fit`: finds the cheapest model, in time or in bytes, that keeps an error bound.
#include "tools/commands/commands.h"
#include "tools/report/fit_report.h"
#include "tools/report/report_package.h"
#include "tools/report/results_identity.h"
#include "tools/settings/common_options.h"
#include "tools/settings/gl_support.h"
#include "tools/settings/json_file.h"
#include "tools/settings/parse.h"
#include "tools/settings/provenance.h"
#include "tools/settings/unused_options.h"
#include "tools/workspace/whole_file.h"

#include "cuda/error.h"
#include "scenes/scene_file.h"

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <iostream>
#include <memory>

namespace shadowdag {

namespace {

namespace fs = std::filesystem;

// The laws' slacks (FitSettings). Measured over the atrium and the failure scenes, errors of finer
// models exceeded those of coarser ones by less than a tenth of typical bounds; times of one frame
// differ between runs by less than a quarter on a machine in use.
constexpr double kErrorSlack = 0.1, kBytesSlack = 0.1, kTimeSlack = 0.25;

/// The beginning of the title of the experiment that a fit writes.
const std::string kTitle = "The least model in ";

/// Returns whether a file is an experiment that a fit wrote.
bool isExperimentOfFit(const std::string& path) {
    const Json json = readOwnJsonFile(path);
    return json.is_object() && json.contains("title") && json["title"].is_string() &&
           json["title"].get<std::string>().starts_with(kTitle);
}

struct FitOptions {
    GlobalOptions global;
    CommonOptions common;
    std::vector<std::string> scenes;
    std::string output, experimentOutput, metric = "false", bound = "0.02", objective = "time",
                                          costs;
    bool noCharts = false;

    FitOptions() {
        for (const auto& [option, text] :
             std::initializer_list<std::pair<const char*, const char*>>{
                 {"--size", "320x180"},
                 {"--frames", "0,60,120"},
                 {"--resolution", "256,512,1024,2048,4096"},
                 {"--lod", "0"}, // levels above do not reduce time: voxel/LAYOUT.md
                 {"--undersample", "1,2,4"},
                 {"--taps", "1,4,9"},
                 {"--maps-per-light", "1,4"},
                 {"--thresholds", "128,512"},
                 {"--methods", "dag,maps,hybrid"},
                 {"--believe", "none,all"}})
            common.text(option) = text;
    }
};

/// Returns the scenes of SCENE...: for a folder those in it (scenesIn).
std::vector<std::string> expandFolders(const std::vector<std::string>& arguments) {
    std::vector<std::string> scenes;
    for (const std::string& argument : arguments) {
        if (argument.starts_with("builtin:") || !fs::is_directory(argument)) {
            scenes.push_back(argument);
            continue;
        }
        const std::vector<std::string> found = scenesIn(argument);
        if (found.empty())
            throw Error(ErrorKind::kInput,
                        argument + ": contains no file of a scene, such as .glb or .gltf" +
                            (readsOtherScenes() ? ", .obj, .ply or .fbx" : "") +
                            "; give a folder of scenes, a scene's file or builtin:NAME");
        scenes.insert(scenes.end(), found.begin(), found.end());
    }
    return scenes;
}

template <class T>
T choiceOf(const char* option, const std::string& text,
           const std::vector<std::pair<std::string, T>>& choices) {
    std::string known;
    for (const auto& [name, value] : choices) {
        if (text == name)
            return value;
        known += (known.empty() ? "" : ", ") + name;
    }
    throw Error(ErrorKind::kUsage,
                std::string(option) + " '" + text + "': must be one of " + known);
}

/// Returns the sweep of the options; lists of the model space, all other settings single.
Experiment sweepOf(const FitOptions& options, const CommandLine& commandLine) {
    Experiment e = options.common.experiment(commandLine, true);
    e.scenes = expandFolders(options.scenes);
    for (const std::string& method : e.methods)
        checkMethod("--methods", method, {"dag", "maps", "hybrid"});
    for (const char* option :
         {"--bias", "--offset", "--polygon-lod", "--pool", "--max-face", "--beams", "--start"})
        if (settingOf(option).texts(e).size() > 1)
            throw Error(ErrorKind::kUsage,
                        std::string(option) + ": fit does not vary it; give one value");
    if (e.areThresholdsAutomatic())
        throw Error(ErrorKind::kUsage,
                    "--thresholds 'auto': fit takes numbers of texels, because a model is for "
                    "all scenes; compare takes auto");
    std::sort(e.resolutionLog2.begin(), e.resolutionLog2.end());
    if (e.repeats < 2)
        throw Error(ErrorKind::kUsage, "--repeats '" + options.common.text("--repeats") +
                                           "': must be a whole number from 2 to 1000");
    e.models = options.common.models();
    if (!options.costs.empty() && e.models.empty())
        e.models = {"cost"};
    refuseUnused(e, 0, "", commandLine);
    for (const std::string& model : e.models)
        if (makeCostModel(model)->needsCosts())
            throw Error(ErrorKind::kUsage,
                        "--model '" + model +
                            "': routes by measurements of the same frame, which a "
                            "reusable model does not have; use cost, texels:N or expr:EXPRESSION");
    return e;
}

/// Runs the search; returns the choice, SIZE_MAX if no model keeps the bound.
size_t findLeast(FitSearch& search, FitMeasurer& measurer, const FitModels& models,
                 FitObjective objective, const Experiment& sweep) {
    const auto measure = [&](const std::vector<FitRequest>& requests, const std::string& what) {
        checkInterrupted();
        measurer.measure(requests, what);
        for (const FitRequest& request : requests)
            search.record(request.model, measurer.observation(request.model));
    };
    for (;;) {
        for (std::vector<FitRequest> requests; !(requests = search.next()).empty();)
            measure(requests, models.groups[models.space.models[requests[0].model].group]);
        // A hybrid that draws no map is the same as rays alone, so that model replaces it: noise
        // must not decide between the two.
        std::vector<size_t> finalists;
        std::vector<FitRequest> stands;
        for (const size_t model : search.finalists()) {
            const size_t rays = measurer.raysAlone(model);
            const size_t finalist = rays == SIZE_MAX ? model : rays;
            const FitObservation* seen = search.observation(finalist);
            if (seen == nullptr || !seen->isComplete)
                stands.push_back({finalist, true});
            if (std::find(finalists.begin(), finalists.end(), finalist) == finalists.end())
                finalists.push_back(finalist);
        }
        if (!stands.empty()) {
            measure(stands, "rays alone");
            continue;
        }
        if (objective == FitObjective::kTime &&
            std::any_of(finalists.begin(), finalists.end(),
                        [&](size_t model) { return !measurer.finalTime(model); }))
            measurer.time(finalists, sweep.repeats, sweep.warmups, "times");
        std::vector<FitCandidate> candidates;
        for (const size_t model : finalists)
            if (objective == FitObjective::kBytes)
                candidates.push_back({model, search.observation(model)->cost, 0});
            else if (const auto time = measurer.finalTime(model))
                candidates.push_back({model, time->medianMs, time->standardErrorMs});
        const size_t choice =
            candidates.empty() ? SIZE_MAX : chooseLeast(models.space, candidates).model;
        const std::vector<FitRequest> beside =
            search.unmeasuredNeighbours(candidates.empty() ? search.leastError() : choice);
        if (beside.empty())
            return choice;
        measure(beside, "neighbours");
    }
}

/// Throws, before any work, if the files that a fit writes cannot all be written: kUsage if two of
/// them are the same, or one would replace an experiment, a page or a chart that no fit wrote.
void checkOutputs(const FitOptions& options, const std::string& experimentPath,
                  const std::string& stem) {
    const std::string page = stem + ".html";
    std::vector<std::pair<std::string, std::string>> files{
        {"-o '" + options.output + "'", options.output},
        {options.experimentOutput.empty() ? "the experiment " + experimentPath
                                          : "--experiment-out '" + experimentPath + "'",
         experimentPath},
        {"the page " + page, page}};
    if (!options.noCharts)
        for (const char* extension : {".svg", ".png"})
            files.push_back({"the chart " + stem + extension, stem + extension});
    for (const auto& [name, path] : files)
        checkWritable(path);
    const auto refuse = [&](size_t file) {
        throw Error(ErrorKind::kUsage, files[file].first +
                                           ": is a file that no fit wrote and that this fit would "
                                           "replace; choose another name");
    };
    if (fs::exists(experimentPath) && !isExperimentOfFit(experimentPath))
        refuse(1);
    if (!isFitResult(readOwnJsonFile(options.output))) // whose page is beside it
        for (size_t file = 2; file < files.size(); ++file)
            if (fs::exists(files[file].second))
                refuse(file);
    for (size_t a = 0; a < files.size(); ++a)
        for (size_t b = a + 1; b < files.size(); ++b)
            if (fs::weakly_canonical(files[a].second) == fs::weakly_canonical(files[b].second))
                throw Error(ErrorKind::kUsage,
                            files[a].first + " and " + files[b].first +
                                " are one file; choose another, as in -o F.json");
}

void runFit(const FitOptions& options, const CommandLine& commandLine) {
    const auto start = std::chrono::steady_clock::now();
    const Console console(options.global.json);
    const auto metric = choiceOf<FitMetric>("--metric", options.metric,
                                            {{"false", FitMetric::kFalse},
                                             {"visibility", FitMetric::kVisibility},
                                             {"flip", FitMetric::kFlip}});
    const auto objective =
        choiceOf<FitObjective>("--minimise", options.objective,
                               {{"time", FitObjective::kTime}, {"bytes", FitObjective::kBytes}});
    const double bound = parseNumber("--max", options.bound, 0, 1);
    for (const char* option : {"--repeats", "--warmups"})
        if (objective == FitObjective::kBytes && commandLine.given(option))
            throw Error(ErrorKind::kUsage, std::string(option) +
                                               " is for times, which --minimise bytes does not "
                                               "take; drop one of them");
    Experiment sweep = sweepOf(options, commandLine);
    const fs::path output = options.output;
    const std::string stem = (output.parent_path() / output.stem()).string();
    const std::string experimentPath =
        options.experimentOutput.empty() ? stem + ".experiment.json" : options.experimentOutput;
    std::vector<std::string> inputs = sweep.scenes;
    inputs.push_back(options.costs);
    for (const std::string& path : {options.output, experimentPath})
        refuseSameFile(path, inputs, path == options.output ? "-o" : "--experiment-out");
    refuseToReplaceResults("-o", options.output, "fit");
    checkOutputs(options, experimentPath, stem);
    const ReportPackage package(!options.noCharts, console);
    const Backend backend = options.global.apply(console, true);
    followGlPages(sweep, backend, commandLine);
    const std::vector<std::string> leftOut =
        leaveOutUnsupported(sweep, backend, commandLine, {}, console);
    CostSource costs;
    if (!options.costs.empty())
        costs = readCostSource(options.costs, buildProvenance(backend));
    for (const std::string& model : sweep.models)
        giveCalibration(*makeCostModel(model), costs);

    FitModels models = makeFitModels(sweep, objective);
    if (models.runs.empty())
        throw Error(ErrorKind::kUsage, "--methods and --thresholds select no model");
    refuseUnusedOptions(costs, models.runs);
    refuseLods(models.runs);
    for (const std::string& remark : remarksOn(costs, models.runs))
        console.note(remark);
    FitMeasurer measurer(sweep, metric, objective, backend, options.common.cache, costs, console);
    measurer.setModels(models);
    if (objective == FitObjective::kBytes)
        setKnownBytes(models, measurer.dagBytes());
    const bool isTime = objective == FitObjective::kTime;
    const FitSettings settings{bound, kErrorSlack, isTime ? kTimeSlack : kBytesSlack,
                               isTime ? kTimeSlack : 0};
    FitSearch search(models.space, settings);
    const size_t choice = findLeast(search, measurer, models, objective, sweep);
    if (objective == FitObjective::kBytes && choice != SIZE_MAX) // reported, no part of the choice
        measurer.time({choice}, sweep.repeats, sweep.warmups, "time of the choice");
    checkInterrupted();

    Json result = {{"provenance", buildProvenance(backend)}, {"sweep", toJson(sweep)}};
    if (!leftOut.empty())
        result["provenance"]["left_out"] = leftOut;
    result["other_cpu_share"] = otherShareJson(measurer.otherCpuShare());
    result.update(fitJson({metric, objective, bound, settings, models, search, measurer, choice}));
    Experiment replay;
    if (choice != SIZE_MAX) {
        replay = models.experiments[choice];
        replay.title = kTitle + options.objective + " with " + options.metric + " error at most " +
                       numberText(bound);
        result["experiment"] = toJson(replay);
        writeWholeFile(experimentPath, jsonText(result["experiment"]));
    } else if (isExperimentOfFit(experimentPath)) { // beside this result it would be wrong
        fs::remove(experimentPath);
        console.note(experimentPath +
                     ": removed, because it belongs to an earlier fit and this one has no result");
    }
    writeWholeFile(options.output, jsonText(result));
    if (package.hasPage()) {
        const std::string directory = fs::path(stem).parent_path().string();
        std::vector<std::string> command{"fit", options.output, "-o",
                                         directory.empty() ? "." : directory};
        if (options.noCharts)
            command.push_back("--no-charts");
        package.run(command);
    }
    printFit(console.people(), result);
    if (const std::string busy = busyRemark(measurer.otherCpuShare()); !busy.empty())
        console.note("warning: " + busy);
    if (choice == SIZE_MAX) {
        const Json& least = result["least_error"];
        throw Error(ErrorKind::kUsage, "--max '" + options.bound +
                                           "': no model keeps it; the least " + options.metric +
                                           " error reached is " +
                                           numberText(least["error"].get<double>()) + ", by " +
                                           least["label"].get<std::string>() +
                                           "; allow more, or extend --methods, "
                                           "--resolution or the lists of the maps (" +
                                           options.output + " has all measurements)");
    }
    console.people() << "result: " << options.output << "\n"
                     << (package.hasPage() ? "page: " + stem + ".html\n" : "")
                     << "replay: shadowdag compare --experiment " << experimentPath
                     << (options.costs.empty() ? "" : " --costs " + options.costs) << " -o DIR\n";
    const double wall =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    console.emit({{"result", options.output},
                  {"experiment", experimentPath},
                  {"chosen", result["chosen"]},
                  {"model_count", result["model_count"]},
                  {"measured_count", result["measured_count"]},
                  {"wall_s", wall}});
}

} // namespace

std::function<void()> declareFit(CommandLine& commandLine) {
    auto options = std::make_shared<FitOptions>();
    commandLine.texts("SCENE", options->scenes, "",
                      "Scenes to fit the model to, or a folder: all scenes in it, of every kind "
                      "that is read",
                      true);
    commandLine.text("-o,--output", options->output, "F.json",
                     "The result: every model with its measurements and its status; the "
                     "page is written beside it as F.html, the chart as F.svg and F.png",
                     true);
    commandLine.text("--experiment-out", options->experimentOutput, "E.json",
                     "The choice as an experiment that compare replays [F.experiment.json]");
    commandLine.flag("--no-charts", options->noCharts,
                     "Do not draw the chart (which needs python3-matplotlib and python3-jinja2)");
    commandLine.heading("Goal");
    commandLine.text(
        "--metric", options->metric, "false|visibility|flip",
        "Error, of the worst frame of all scenes: share of pairs that are false shadow "
        "or false light; mean absolute error of visibility; mean FLIP of the picture [false]");
    commandLine.text("--max", options->bound, "E", "The largest allowed error, 0 to 1 [0.02]");
    commandLine.text("--minimise", options->objective, "time|bytes",
                     "Minimise the mean time of all frames (the first frame of the first scene "
                     "decides which models are timed in all: put the most important scene "
                     "first), or the bytes of voxels, maps and, where rays ask triangles, the "
                     "triangles with their hierarchy, the maximum of all frames. Of "
                     "models equal within one "
                     "standard error the simpler is taken: see simplicity_order in the result "
                     "[time]");
    commandLine.heading("Models");
    options->common.text("--thresholds") = "0,8,16,32,64,96,192,inf";
    for (const char* option :
         {"--methods", "--resolution", "--thresholds", "--model", "--repeats", "--warmups"})
        options->common.declare(commandLine, settingOf(option), true);
    commandLine.text("--costs", options->costs, "C.json",
                     "A calibration by calibrate; without --model it implies model cost");
    options->common.declareCache(commandLine);
    options->common.declare(
        commandLine,
        {SettingGroup::kView, SettingGroup::kLights, SettingGroup::kRays, SettingGroup::kMaps},
        true);
    options->global.declare(commandLine);
    return [options, &commandLine] { runFit(*options, commandLine); };
}

} // namespace shadowdag
