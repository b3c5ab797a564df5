// SPDX-License-Identifier: Apache-2.0
// `shadowdag compare`: measures the time and the error against Embree of every requested method and
// parameter, as a report.
#include "scenes/builtin.h"
#include "tools/commands/commands.h"
#include "tools/commands/compare_parts.h"
#include "tools/report/csv.h"
#include "tools/report/report_package.h"
#include "tools/report/results_identity.h"
#include "tools/report/results_table.h"
#include "tools/report/sequence_times.h"
#include "tools/report/verdict.h"
#include "tools/settings/command_line.h"
#include "tools/settings/common_options.h"
#include "tools/settings/gl_support.h"
#include "tools/settings/json_file.h"
#include "tools/settings/parse.h"
#include "tools/settings/provenance.h"
#include "tools/settings/unused_options.h"
#include "tools/settings/variants.h"
#include "tools/settings/words.h"
#include "tools/studies/study_file.h"
#include "tools/workspace/journal.h"
#include "tools/workspace/judge.h"
#include "tools/workspace/measure.h"
#include "tools/workspace/report_directory.h"
#include "tools/workspace/sequence.h"
#include "tools/workspace/whole_file.h"

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iomanip>
#include <iostream>
#include <limits>
#include <memory>
#include <optional>
#include <tuple>
#include <utility>

namespace shadowdag {

namespace {

namespace fs = std::filesystem;

/// The options as given; numbers and lists are text until they are parsed.
struct CompareOptions {
    GlobalOptions global;
    CommonOptions common;
    std::vector<std::string> scenes;
    std::string output, experiment, costs, part;
    bool resume = false, noCharts = false, noOracle = false, join = false;
};

/// Returns the options that an experiment file fixes: settings and --no-oracle.
std::vector<std::string> optionsOfExperiments() {
    std::vector<std::string> options{"--no-oracle"};
    for (const Setting& setting : settings())
        if (!setting.option.empty())
            options.push_back(setting.option);
    return options;
}

Experiment experimentOf(const CompareOptions& options, const CommandLine& commandLine) {
    if (options.experiment.empty()) {
        Experiment e = options.common.experiment(commandLine, true);
        takeGlDefaults(e, options.global.backend, commandLine);
        e.scenes = options.scenes;
        if (commandLine.given("--variants")) {
            if (!commandLine.given("--taps"))
                e.taps = {kPaperTaps};
            if (!commandLine.given("--believe"))
                e.believe = {kPaperBelieve};
            const auto refuseVariantKeys = [&](const std::string& option) {
                if (commandLine.given(option))
                    throw Error(ErrorKind::kUsage,
                                option + " and --variants contradict each other: the names set "
                                         "it; drop one of them");
            };
            for (const Setting& setting : settings())
                if (setting.isSetByVariant)
                    refuseVariantKeys(setting.option);
            refuseVariantKeys("--no-oracle");
            e.variants = parseVariants("--variants",
                                       parseList("--variants", options.common.text("--variants")),
                                       baseOptions(e));
            e.methods = {"embree"};
            e.thresholds.clear();
            e.models.clear();
        }
        // Frames of a sequence have no measured costs.
        if (options.common.models().empty() && (options.noOracle || e.isSequence))
            e.models.clear();
        if (e.scenes.empty())
            throw Error(
                ErrorKind::kUsage,
                "compare needs a SCENE or --experiment F.json; see shadowdag compare --help");
        refuseUnused(e, options.common.voxels.size(), options.experiment, commandLine);
        return e;
    }
    Json content;
    Experiment e = readExperiment(options.experiment, &content);
    for (const std::string& option : optionsOfExperiments())
        if (commandLine.given(option))
            throw Error(ErrorKind::kUsage,
                        option + " and --experiment contradict each other: " + options.experiment +
                            " fixes it; edit a copy of the file or drop one");
    if (!content.contains("believe")) // a default, not a request
        takeGlDefaults(e, options.global.backend, commandLine);
    if (!content.contains("models") && e.isSequence) // whose frames have no measured costs
        e.models.clear();
    if (!e.scenes.empty() && !options.scenes.empty())
        throw Error(ErrorKind::kUsage, "SCENE '" + options.scenes[0] +
                                           "' and --experiment contradict each other: " +
                                           options.experiment + " names its scenes; drop one");
    if (e.scenes.empty())
        e.scenes = options.scenes;
    if (e.scenes.empty())
        throw Error(ErrorKind::kUsage,
                    options.experiment + " names no scenes: give SCENE... on the command line");
    refuseUnused(e, options.common.voxels.size(), options.experiment, commandLine);
    options.common.checkVoxels();
    return e;
}

/// Throws Error kUsage if --resume finds a complete report: everything would be measured again.
void refuseFinished(const std::string& directory) {
    std::error_code ignored; // of a directory that cannot be, which is refused where it is made
    if (fs::exists(directory + "/partial/journal.json", ignored))
        return;
    for (const char* name : {"results.json", "part.json"})
        if (fs::exists(directory + "/" + name, ignored))
            throw Error(ErrorKind::kUsage, "--resume: " + directory + "/" + name +
                                               " is finished, so there is nothing to resume; "
                                               "to measure again, run without --resume");
}

/// Throws Error kUsage if a part of a compare would replace another part.
void refuseOtherPart(const CompareOptions& options, const CompareShare& share) {
    const Json there = readOwnJsonFile(options.output + "/part.json");
    if (!there.is_object() || !there.contains("part") || !there.contains("part_count") ||
        (there["part"] == share.part && there["part_count"] == share.partCount))
        return;
    throw Error(ErrorKind::kUsage, "--part '" + options.part + "': " + options.output +
                                       " holds part " + jsonLine(there["part"]) + " of " +
                                       jsonLine(there["part_count"]) +
                                       ", which this part would replace; name a directory for "
                                       "each part");
}

/// Prints a note, before anything is replaced, if a report of another command or experiment will
/// be.
void noteReplaced(const std::string& directory, const Json& experiment, const Console& console) {
    const std::string remark = remarkOnReplaced(
        directory,
        {{"runs", Json::array()}, {"map_costs", Json::array()}, {"experiment", experiment}});
    if (!remark.empty())
        console.note(remark);
}

/// Returns the resolutions of an experiment's DAGs.
std::vector<uint32_t> resolutionsOf(const Experiment& experiment) {
    std::vector<uint32_t> resolutions;
    for (const uint32_t log2 : allResolutions(experiment))
        resolutions.push_back(1u << log2);
    return resolutions;
}

/// Returns whether any run of an experiment needs a DAG.
bool usesVoxels(const Experiment& e) {
    const std::vector<RunParameters> runs = configurations(
        e, std::vector<uint32_t>(std::min<size_t>(e.resolutionLog2.size(), 1), 1), 1);
    return std::any_of(runs.begin(), runs.end(),
                       [](const RunParameters& run) { return run.usesVoxels(); });
}

/// Begins the warnings about frames and scenes that are not in the results.
constexpr const char* kLeftOut = "left out: ";

/// Returns the warnings of the findings, and one for every scene and frame that has few pairs.
Json warningsOf(const CompareFindings& found) {
    Json warnings = found.results["warnings"];
    for (const char* list : {"runs", "sequence_runs"})
        for (const Json& run : found.results[list]) {
            const Json text =
                fewPairsWarning(run["scene"].get<std::string>() + ", frame " + run["frame"].dump(),
                                run["pair_count"].get<uint64_t>());
            if (text != "" && std::find(warnings.begin(), warnings.end(), text) == warnings.end())
                warnings.push_back(text);
        }
    return warnings;
}

/// Throws NothingToCompare if all frames were left out, of which the first warning tells.
void requireRuns(const CompareFindings& found) {
    const Json& warnings = found.results["warnings"];
    if (!found.results["runs"].empty() || !found.results["sequence_runs"].empty() ||
        warnings.empty())
        return;
    std::string text = warnings[0];
    if (text.starts_with(kLeftOut))
        text.erase(0, std::string_view(kLeftOut).size());
    if (warnings.size() > 1)
        text += "; " + std::to_string(warnings.size() - 1) + " more could not be compared either";
    throw NothingToCompare(text);
}

/// Prints the verdict and the tables of the findings, writes the report into `partial`, moves it to
/// its place and prints its path.
void publish(const CompareOptions& options, CompareFindings& found, const ReportPackage& package,
             std::chrono::steady_clock::time_point start, const Console& console) {
    const std::string partial = options.output + "/partial";
    const size_t saidCount = options.join ? 0 : found.results["warnings"].size();
    found.results["warnings"] = warningsOf(found);
    for (size_t i = saidCount; i < found.results["warnings"].size(); ++i)
        console.note("warning: " + found.results["warnings"][i].get<std::string>());
    found.results["sequence_times"] = sequenceTimes(found.results["sequence_runs"]);
    nameMeasuredRoutes(found.results);
    Json results = {{"verdict", verdictOf(found.results)}};
    results.update(found.results);
    console.people() << results["verdict"]["text"].get<std::string>() << "\n\n";
    printRuns(console.people(), found.results["runs"]);
    printSequences(console.people(), found.results["sequence_runs"]);
    console.people() << std::flush; // charts take seconds
    writeWholeFile(partial + "/results.json", jsonText(results));
    writeWholeFile(partial + "/experiment.json", jsonText(found.results["experiment"]));
    writeWholeFile(partial + "/results.csv", runsCsv(found.results["runs"]));
    if (!found.results["sequence_runs"].empty())
        writeWholeFile(partial + "/sequence.csv", runsCsv(found.results["sequence_runs"]));
    writeWholeFile(partial + "/lights.csv", flatCsv(found.lights));
    writeWholeFile(
        partial + "/costs.json",
        jsonText(toJson(found.costs, found.results["provenance"], found.results["experiment"])));
    const Json charts = package.writePage("compare", partial);
    for (const std::string& line : leftOutLines(charts))
        console.note(line);
    checkInterrupted();
    swapReport(options.output);
    const std::string resultsPath = options.output + "/results.json",
                      reportPath = package.hasPage() ? options.output + "/index.html" : resultsPath;

    const double wall =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    console.people() << "report: " << reportPath << "\n";
    console.emit({{"report", reportPath},
                  {"results", resultsPath},
                  {"run_count", found.results["runs"].size()},
                  {"sequence_run_count", found.results["sequence_runs"].size()},
                  {"chart_count", charts["charts"].size()},
                  {"warnings", found.results["warnings"]},
                  {"wall_s", wall}});
}

/// Moves a part of a report to its place and prints its path.
void publishPart(const CompareOptions& options, const CompareFindings& found,
                 const CompareShare& share, const Json& key,
                 std::chrono::steady_clock::time_point start, const Console& console) {
    const std::string partial = options.output + "/partial";
    writeWholeFile(
        partial + "/costs.json",
        jsonText(toJson(found.costs, found.results["provenance"], found.results["experiment"])));
    // In one line: a part with the lights of many runs is long.
    writeWholeFile(partial + "/part.json", jsonLine(toJson(found, share, key, partial)) + "\n");
    checkInterrupted();
    swapReport(options.output);
    const std::string path = options.output + "/part.json";
    const double wall =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    console.people() << "part " << share.part << " of " << share.partCount << ", "
                     << countText(found.results["runs"].size(), "run") << ": " << path
                     << "; compare --join makes the report of all parts\n";
    console.emit({{"part_file", path},
                  {"part", share.part},
                  {"part_count", share.partCount},
                  {"run_count", found.results["runs"].size()},
                  {"wall_s", wall}});
}

/// Makes the report of parts that were measured elsewhere.
void runJoin(const CompareOptions& options, const CommandLine& commandLine) {
    const auto start = std::chrono::steady_clock::now();
    const Console console(options.global.json);
    std::vector<std::string> measured = optionsOfExperiments();
    measured.insert(measured.end(), {"--experiment", "--part", "--resume", "--voxels", "--costs",
                                     "--cache", "--allow-stale"});
    for (const std::string& option : measured)
        if (commandLine.given(option))
            throw Error(ErrorKind::kUsage,
                        option + " and --join contradict each other: the parts are measured; "
                                 "drop one");
    if (options.scenes.empty())
        throw Error(ErrorKind::kUsage, "compare --join needs the directories of all parts");
    options.global.apply(console, false, false);
    const ReportPackage package(!options.noCharts, console);
    CompareFindings found = joinParts(options.scenes);
    requireRuns(found);
    for (const std::string& directory : options.scenes)
        if (fs::weakly_canonical(directory) == fs::weakly_canonical(options.output))
            throw Error(ErrorKind::kUsage, "-o '" + options.output +
                                               "': is one of the parts, which the report would "
                                               "replace; name another directory");
    noteReplaced(options.output, found.results["experiment"], console);
    const ReportDirectory held(options.output, false, false);
    for (const std::string& directory : options.scenes)
        if (fs::is_directory(directory + "/images"))
            fs::copy(directory + "/images", options.output + "/partial/images",
                     fs::copy_options::recursive | fs::copy_options::overwrite_existing);
    publish(options, found, package, start, console);
}

/// Throws Error kUsage if a scene has the name of a study instead of a file.
void refuseStudies(const std::vector<std::string>& scenes) {
    for (const std::string& scene : scenes) {
        const std::string name = scene == "mechanisms" ? "ablation" : scene; // its earlier name
        for (const StudyFile& study : shippedStudies())
            if (name == study.name && !fs::exists(scene))
                throw Error(ErrorKind::kUsage,
                            "SCENE '" + scene +
                                "': there is no such file; the study of that name "
                                "is run by shadowdag study " +
                                name + " -o DIR");
    }
}

/// Throws Error kUsage where no run is left, or one that cannot be measured, before anything is
/// deleted or built.
void refuseUnmeasurable(const Experiment& e, const std::vector<RunParameters>& asked,
                        const CompareOptions& options) {
    if (asked.empty())
        throw Error(ErrorKind::kUsage,
                    options.experiment.empty()
                        ? "nothing to compare: --methods and --thresholds select no run"
                        : "nothing to compare: \"methods\", \"thresholds\" and \"models\" select "
                          "no run");
    if (options.common.voxels.empty())
        refuseLods(asked);
    if (e.isSequence)
        refuseModelsOfCosts(asked);
}

/// Calls what checks the settings of an experiment; what it throws as wrong usage is of the file,
/// if one fixes them. Throws Error kInput then.
void checkSettings(const std::string& file, const std::function<void()>& check) {
    try {
        check();
    } catch (const Error& error) {
        if (file.empty() || error.kind() != ErrorKind::kUsage)
            throw;
        throw Error(ErrorKind::kInput, file + ": " + error.what());
    }
}

/// Returns whether any method of an experiment routes its maps.
bool usesRouting(const Experiment& experiment) {
    return std::any_of(experiment.methods.begin(), experiment.methods.end(),
                       [](const std::string& name) { return methodOf(name).needs().routing; });
}

/// Returns the thresholds of an experiment on a scene: its own, or those that the maps of its first
/// frame with any require, with maps and rays alone.
std::vector<float> thresholdsOn(Workspace& workspace, const Experiment& experiment) {
    if (!experiment.areThresholdsAutomatic() || !usesRouting(experiment))
        return experiment.thresholds;
    checkInterrupted();
    FrameRenderer& renderer = workspace.renderer(RunParameters{});
    FrameOptions options = baseOptions(experiment);
    options.recordPairs = false;
    std::vector<float> requests;
    for (size_t i = 0; i < experiment.frames.size() && requests.empty(); ++i) {
        workspace.setTime(experiment.timeOfFrame(experiment.frames[i]));
        for (const MapRecord& map :
             renderer.render(workspace.camera(), *makeCostModel("texels:0"), options).maps)
            requests.push_back(map.quantities.texels);
    }
    workspace.resetRenderers();
    std::vector<float> thresholds = automaticThresholds(std::move(requests));
    thresholds.insert(thresholds.begin(), 0.0f);
    thresholds.push_back(std::numeric_limits<float>::infinity());
    return thresholds;
}

void runCompare(const CompareOptions& options, const CommandLine& commandLine) {
    const auto start = std::chrono::steady_clock::now();
    const Console console(options.global.json);
    CompareShare share;
    if (commandLine.given("--part"))
        std::tie(share.part, share.partCount) =
            parseShare("--part", options.part, kMaxRunPartCount);
    Experiment experiment = experimentOf(options, commandLine);
    if (!options.experiment.empty() && experiment.lightCount >= 0)
        console.note(options.experiment + " replaces the lights of every scene by " +
                     std::to_string(experiment.lightCount) +
                     " placed ones; to keep the scenes' own, set \"lights\" to -1 in a copy");
    const Backend backend = options.global.apply(console, true);
    followGlPages(experiment, backend, commandLine);
    const std::vector<std::string> leftOut = leaveOutUnsupported(
        experiment, backend, commandLine,
        commandLine.given("--variants") ? parseList("--variants", options.common.text("--variants"))
                                        : std::vector<std::string>{},
        console);
    if (experiment.isSequence && !options.part.empty())
        throw Error(ErrorKind::kUsage,
                    "--part '" + options.part +
                        "': frames of a sequence depend on each other and cannot "
                        "be divided; drop it");
    std::optional<ReportPackage> package; // a part has no page
    if (options.part.empty())
        package.emplace(!options.noCharts, console);
    CostSource costs;
    if (!options.costs.empty())
        costs = readCostSource(options.costs, buildProvenance(backend));
    // The resolutions of assets are known once they are read.
    const std::vector<RunParameters> asked =
        configurations(experiment, resolutionsOf(experiment), experiment.resolutionLog2.size());
    checkSettings(options.experiment, [&] { refuseUnmeasurable(experiment, asked, options); });
    refuseUnusedOptions(costs, asked);
    for (const std::string& remark : remarksOn(costs, asked))
        console.note(remark);
    for (const std::string& remark :
         {oneValueRemark(experiment, asked), noVoxelsRemark(asked, commandLine)})
        if (!remark.empty())
            console.note(remark);
    for (const std::string& model : experiment.models)
        giveCalibration(*makeCostModel(model), costs);
    const std::vector<std::string> names = sceneNames(experiment.scenes);
    if (costs.table && !experiment.isSequence && usesMapCosts(asked))
        for (size_t i = 0; i < names.size(); ++i)
            for (uint32_t view = 0; view < experiment.viewCount; ++view)
                requireCosts(*costs.table, options.costs, {experiment.viewName(names[i], view)},
                             share.frames(experiment, i, view), experiment.start);
    if (options.resume)
        refuseFinished(options.output);
    // Before anything is moved: missing scenes, a wrong camera, no lights.
    checkSettings(options.scenes.empty() ? options.experiment : "", [&] {
        for (const std::string& scene : experiment.scenes)
            requireScene(scene);
    });
    std::optional<LoadedScene> firstScene;
    const Console silent(Console::Listener{[](const std::string&) {}, {}});
    for (size_t i = 0; i < names.size(); ++i)
        if (!share.has(experiment, i))
            continue;
        else if (!firstScene)
            firstScene = openScene(experiment, i, console);
        else // loaded again for its measurements, because two scenes take more memory than one
            openScene(experiment, i, silent);
    if (!options.part.empty())
        refuseOtherPart(options, share);
    const ReportDirectory directory(options.output, options.resume, !options.part.empty());
    const std::string partial = options.output + "/partial";
    const Json experimentJson = toJson(experiment);

    noteReplaced(options.output, experimentJson, console);

    Json provenance = buildProvenance(backend);
    provenance["experiment_hash"] = textHash(jsonLine(experimentJson));
    provenance["seed"] = experiment.lightSeed;
    if (!leftOut.empty())
        provenance["left_out"] = leftOut;
    Json key = provenance;
    key["experiment"] = experimentJson; // whose hash would hide which setting differs
    key.erase("experiment_hash");
    key["scenes"] = experiment.scenes;
    std::vector<std::string> files = options.common.voxels;
    if (!options.costs.empty())
        files.push_back(options.costs);
    key["inputs"] = inputHashes(experiment.scenes, files);
    const Json ofParts = partKey(provenance, experiment, key["inputs"]);
    if (!options.part.empty())
        key["part"] = options.part;
    Journal journal(partial + "/journal.json", key, options.resume);
    if (const std::string remark = remarkOn(journal); !remark.empty())
        console.note("resume: " + remark);

    CompareFindings found(provenance, experimentJson);
    const auto leaveOut = [&](const std::string& why) {
        found.results["warnings"].push_back(kLeftOut + why);
        console.note("warning: " + (kLeftOut + why));
    };
    for (size_t i = 0; i < names.size(); ++i) {
        if (!share.has(experiment, i))
            continue;
        checkInterrupted();
        LoadedScene loaded = firstScene ? std::move(*std::exchange(firstScene, std::nullopt))
                                        : openScene(experiment, i, console);
        const VoxelSource source{options.common.voxels, options.common.cache,
                                 options.common.allowStale};
        Workspace workspace(std::move(loaded),
                            {backend, experiment.camera, source, &console, experiment.viewCount});
        std::vector<uint32_t> resolutions;
        if (usesVoxels(experiment))
            for (const uint32_t log2 : workspace.obtainVoxels(allResolutions(experiment)))
                resolutions.push_back(1u << log2);
        const size_t fullCount =
            options.common.voxels.empty() ? experiment.resolutionLog2.size() : resolutions.size();
        refuseLods(configurations(experiment, resolutions, fullCount)); // of assets
        MeasureContext context;
        context.directory = partial;
        context.costs = costs.table ? &*costs.table : nullptr;
        context.given = &costs;
        context.costsPath = options.costs;
        context.allowsStaleCosts = options.common.allowStale;
        context.console = &console;
        context.journal = &journal;
        context.onLeftOut = leaveOut;
        for (uint32_t view = 0; view < experiment.viewCount; ++view) {
            context.frames = share.frames(experiment, i, view);
            if (context.frames.empty())
                continue;
            Experiment ofView = experiment;
            ofView.camera = experiment.viewCamera(view);
            if (experiment.viewCount > 1)
                workspace.setView(ofView.camera, experiment.viewName(names[i], view));
            const LoadedScene& scene = workspace.scene();
            ofView.thresholds = thresholdsOn(workspace, experiment);
            const std::vector<RunParameters> runs = configurations(ofView, resolutions, fullCount);
            context.progress = console.progress("compare " + scene.name);
            try {
                const std::string unrouted =
                    scene.name + ": all its maps require the same resolution, so that no threshold "
                                 "routes a part of them; ";
                if (runs.empty())
                    throw NothingToCompare(
                        unrouted + "compare with dag and maps, or give --thresholds or --model");
                if (experiment.areThresholdsAutomatic() && usesRouting(experiment) &&
                    std::none_of(runs.begin(), runs.end(),
                                 [](const RunParameters& run) { return run.isRouted(); }))
                    leaveOut(unrouted + "hybrid has no row; give --thresholds or --model");
                SceneMeasurement measured = experiment.isSequence
                                                ? measureSequence(workspace, ofView, runs, context)
                                                : measureScene(workspace, ofView, runs, context);
                const bool isLeftOut = measured.runs.empty() && measured.sequenceRuns.empty();
                found.add(std::move(measured));
                if (isLeftOut)
                    continue;
            } catch (const NothingToCompare& error) {
                leaveOut(
                    (experiment.isSequence ? "a sequence, whose frames belong together: " : "") +
                    std::string(error.what()));
                continue;
            }
            found.results["scenes"].push_back(
                {{"scene", scene.name},
                 {"scene_hash", scene.geometryHash},
                 {"content_hash", scene.contentHash},
                 {"camera", ofView.camera},
                 {"thresholds", settingOf("--thresholds").json(ofView)},
                 {"triangle_count", scene.world->triangles().count()},
                 {"light_count", scene.world->lights().size()}});
        }
    }
    if (!options.part.empty()) // which may have no other frames than those that are left out
        return publishPart(options, found, share, ofParts, start, console);
    requireRuns(found);
    publish(options, found, *package, start, console);
}

} // namespace

std::function<void()> declareCompare(CommandLine& commandLine) {
    auto options = std::make_shared<CompareOptions>();
    commandLine.texts("SCENE", options->scenes, "",
                      "Scenes to compare on; none when the experiment names them");
    commandLine.text(
        "-o,--output", options->output, "DIR",
        "The report: index.html, results.json, results.csv, lights.csv, costs.json, charts, images",
        true);
    commandLine.text(
        "--experiment", options->experiment, "F.json",
        "A file that fixes scenes, view, lights, sweeps and repeats; see scenes/experiments");
    commandLine.flag("--resume", options->resume, "Resume an interrupted compare in DIR");
    commandLine.text("--part", options->part, "K/N",
                     "Measure only part K of N of the frames of all scenes, into DIR/part.json; "
                     "parts may run on several machines");
    commandLine.flag("--join", options->join,
                     "Make the report of all parts: SCENE... are their directories");
    commandLine.flag("--no-charts", options->noCharts,
                     "Omit the charts (they need python3-matplotlib and python3-jinja2)");
    commandLine.text(
        "--costs", options->costs, "F",
        "Replay the maps' isolated costs of a costs.json instead of measuring them; or, "
        "for --model cost, what calibrate wrote");
    commandLine.flag("--no-oracle", options->noOracle,
                     "Leave out the model oracle where --model is not given");
    options->common.declare(commandLine,
                            {SettingGroup::kSweep, SettingGroup::kRoutes, SettingGroup::kView,
                             SettingGroup::kViews, SettingGroup::kPictures, SettingGroup::kLights,
                             SettingGroup::kVoxels, SettingGroup::kRays, SettingGroup::kMaps},
                            true);
    options->global.declare(commandLine);
    return [options, &commandLine] {
        refuseStudies(options->scenes);
        options->join ? runJoin(*options, commandLine) : runCompare(*options, commandLine);
    };
}

} // namespace shadowdag
