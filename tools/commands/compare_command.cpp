// SPDX-License-Identifier: Apache-2.0
// `shadowdag compare`: every method and parameter asked for, timed and held against Embree, as a
// report.
#include "scenes/builtin.h"
#include "tools/commands/commands.h"
#include "tools/commands/compare_parts.h"
#include "tools/report/csv.h"
#include "tools/report/report_package.h"
#include "tools/report/results_table.h"
#include "tools/settings/command_line.h"
#include "tools/settings/common_options.h"
#include "tools/settings/gl_support.h"
#include "tools/settings/json_file.h"
#include "tools/settings/parse.h"
#include "tools/settings/provenance.h"
#include "tools/settings/unused_options.h"
#include "tools/settings/variants.h"
#include "tools/workspace/journal.h"
#include "tools/workspace/measure.h"
#include "tools/workspace/report_directory.h"
#include "tools/workspace/sequence.h"
#include "tools/workspace/whole_file.h"

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <iostream>
#include <memory>
#include <optional>
#include <sstream>
#include <tuple>
#include <utility>

namespace shadowdag {

namespace {

namespace fs = std::filesystem;

/// The options as given; numbers and lists are texts until they are read.
struct CompareOptions {
    GlobalOptions global;
    CommonOptions common;
    std::vector<std::string> scenes;
    std::string output, experiment, costs, part;
    bool resume = false, noCharts = false, noOracle = false, join = false;
};

/// Returns the options that an experiment file fixes: those of settings, and --no-oracle.
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
        e.scenes = options.scenes;
        if (commandLine.given("--variants")) {
            if (!commandLine.given("--taps"))
                e.taps = {kPaperTaps};
            const auto refuseSaid = [&](const std::string& option) {
                if (commandLine.given(option))
                    throw Error(ErrorKind::kUsage,
                                option + " and --variants contradict each other: the names say "
                                         "it; drop one of them");
            };
            for (const Setting& setting : settings())
                if (setting.isSaidByVariants)
                    refuseSaid(setting.option);
            refuseSaid("--no-oracle");
            e.variants = parseVariants("--variants",
                                       parseList("--variants", options.common.text("--variants")),
                                       baseOptions(e));
            e.methods = {"embree"};
            e.thresholds.clear();
            e.models.clear();
        }
        // No frame of a sequence has its costs measured.
        if (options.common.models().empty() && (options.noOracle || e.isSequence))
            e.models.clear();
        if (e.scenes.empty())
            throw Error(
                ErrorKind::kUsage,
                "compare needs a SCENE or --experiment F.json; see shadowdag compare --help");
        refuseUnused(e, options.common.voxels.size(), options.experiment, commandLine);
        return e;
    }
    for (const std::string& option : optionsOfExperiments())
        if (commandLine.given(option))
            throw Error(ErrorKind::kUsage,
                        option + " and --experiment contradict each other: " + options.experiment +
                            " fixes it; edit a copy of the file or drop one");
    Experiment e = readExperiment(options.experiment);
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
    return e;
}

/// Throws Error kUsage where --resume finds a report and nothing unfinished: all would be measured
/// anew.
void refuseFinished(const std::string& directory) {
    if (fs::exists(directory + "/partial/journal.json"))
        return;
    for (const char* name : {"results.json", "part.json"})
        if (fs::exists(directory + "/" + name))
            throw Error(ErrorKind::kUsage, "--resume: " + directory + "/" + name +
                                               " is finished and nothing is left to go on with; "
                                               "to measure anew, run without --resume");
}

/// Returns the resolutions of an experiment's DAGs.
std::vector<uint32_t> resolutionsOf(const Experiment& experiment) {
    std::vector<uint32_t> resolutions;
    for (const uint32_t log2 : allResolutions(experiment))
        resolutions.push_back(1u << log2);
    return resolutions;
}

/// Returns whether any run of an experiment needs a DAG.
bool asksVoxels(const Experiment& e) {
    return std::any_of(e.methods.begin(), e.methods.end(),
                       [](const std::string& name) { return methodOf(name).needs().voxels; }) ||
           std::any_of(e.variants.begin(), e.variants.end(), [](const std::string& name) {
               return variantRun(parseVariant("variants", name), {}).usesRays();
           });
}

/// Writes the report of what was found into `partial`, puts it in its place and says so.
void publish(const CompareOptions& options, const CompareFindings& found,
             const ReportPackage& package, std::chrono::steady_clock::time_point start,
             const Console& console) {
    const std::string partial = options.output + "/partial";
    writeWholeFile(partial + "/results.json", jsonText(found.results));
    writeWholeFile(partial + "/experiment.json", jsonText(found.results["experiment"]));
    writeWholeFile(partial + "/results.csv", runsCsv(found.results["runs"]));
    if (!found.results["sequence_runs"].empty())
        writeWholeFile(partial + "/sequence.csv", runsCsv(found.results["sequence_runs"]));
    writeWholeFile(partial + "/lights.csv", flatCsv(found.lights));
    writeWholeFile(partial + "/costs.json",
                   jsonText(toJson(found.costs, found.results["provenance"])));
    const Json charts = package.writePage("compare", partial);
    for (const std::string& line : leftOutLines(charts))
        console.note(line);
    std::ostringstream table;
    printRuns(table, found.results["runs"]);
    printSequences(table, found.results["sequence_runs"]);
    checkInterrupted();
    swapReport(options.output);
    const std::string resultsPath = options.output + "/results.json",
                      reportPath = package.hasPage() ? options.output + "/index.html" : resultsPath;

    const double wall =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    console.people() << table.str() << "report: " << reportPath << "\n";
    console.emit({{"report", reportPath},
                  {"results", resultsPath},
                  {"run_count", found.results["runs"].size()},
                  {"sequence_run_count", found.results["sequence_runs"].size()},
                  {"chart_count", charts["charts"].size()},
                  {"wall_s", wall}});
}

/// Puts a part of a report in its place and says so.
void publishPart(const CompareOptions& options, const CompareFindings& found,
                 const CompareShare& share, const Json& key,
                 std::chrono::steady_clock::time_point start, const Console& console) {
    const std::string partial = options.output + "/partial";
    writeWholeFile(partial + "/costs.json",
                   jsonText(toJson(found.costs, found.results["provenance"])));
    writeWholeFile(partial + "/part.json", jsonText(toJson(found, share, key, partial)));
    checkInterrupted();
    swapReport(options.output);
    const std::string path = options.output + "/part.json";
    const double wall =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    console.people() << "part " << share.part << " of " << share.partCount << ", "
                     << found.results["runs"].size() << " runs: " << path
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
    measured.insert(measured.end(), {"--experiment", "--part", "--resume", "--voxels", "--costs"});
    for (const std::string& option : measured)
        if (commandLine.given(option))
            throw Error(ErrorKind::kUsage,
                        option + " and --join contradict each other: the parts are measured; "
                                 "drop one");
    if (options.scenes.empty())
        throw Error(ErrorKind::kUsage, "compare --join needs the directories of all parts");
    options.global.apply(console, false, false);
    const ReportPackage package(!options.noCharts, console);
    const CompareFindings found = joinParts(options.scenes);
    for (const std::string& directory : options.scenes)
        if (fs::weakly_canonical(directory) == fs::weakly_canonical(options.output))
            throw Error(ErrorKind::kUsage, "-o '" + options.output +
                                               "': is one of the parts, which the report would "
                                               "replace; name another directory");
    const ReportDirectory held(options.output, false, false);
    for (const std::string& directory : options.scenes)
        if (fs::is_directory(directory + "/images"))
            fs::copy(directory + "/images", options.output + "/partial/images",
                     fs::copy_options::recursive | fs::copy_options::overwrite_existing);
    publish(options, found, package, start, console);
}

/// Throws Error kUsage where a scene is the name of a study instead of a file's.
void refuseStudies(const std::vector<std::string>& scenes) {
    for (const std::string& scene : scenes)
        for (const char* name : {"ablation", "failures", "mechanisms", "real", "stability"})
            if (scene == name && !fs::exists(scene))
                throw Error(ErrorKind::kUsage,
                            "SCENE '" + scene +
                                "': there is no such file; the study of that name "
                                "is run by shadowdag study " +
                                (scene == "mechanisms" ? "ablation" : scene) + " -o DIR");
}

void runCompare(const CompareOptions& options, const CommandLine& commandLine) {
    const auto start = std::chrono::steady_clock::now();
    const Console console(options.global.json);
    CompareShare share;
    if (commandLine.given("--part"))
        std::tie(share.part, share.partCount) = parseShare("--part", options.part, kMaxPartCount);
    Experiment experiment = experimentOf(options, commandLine);
    const Backend backend = options.global.apply(console, true);
    followGlPages(experiment, backend, commandLine);
    const std::vector<std::string> leftOut = leaveOutOnGl(
        experiment, backend, commandLine,
        commandLine.given("--variants") ? parseList("--variants", options.common.text("--variants"))
                                        : std::vector<std::string>{},
        console);
    if (experiment.isSequence && !options.part.empty())
        throw Error(ErrorKind::kUsage, "--part '" + options.part +
                                           "': frames of a sequence follow each other and cannot "
                                           "be shared out; drop it");
    std::optional<ReportPackage> package; // a part has no page
    if (options.part.empty())
        package.emplace(!options.noCharts, console);
    CostSource costs;
    if (!options.costs.empty())
        costs = readCostSource(options.costs, buildProvenance(backend));
    // Which resolutions assets have is told once they are read.
    const std::vector<RunParameters> asked =
        configurations(experiment, resolutionsOf(experiment), experiment.resolutionLog2.size());
    refuseUnheeded(costs, asked);
    for (const std::string& remark : remarksOn(costs, asked))
        console.note(remark);
    for (const std::string& model : experiment.models)
        giveCalibration(*makeCostModel(model), costs);
    const std::vector<std::string> names = sceneNames(experiment.scenes);
    if (options.resume)
        refuseFinished(options.output);
    // Before anything is put away: scenes that are not there, a wrong camera, no lights.
    for (const std::string& scene : experiment.scenes)
        requireScene(scene);
    std::optional<LoadedScene> firstScene;
    const Console silent(Console::Listener{[](const std::string&) {}, {}});
    for (size_t i = 0; i < names.size(); ++i)
        if (share.frames(experiment, i).empty())
            continue;
        else if (!firstScene)
            firstScene = openScene(experiment, i, console);
        else // loaded again when its turn comes: two scenes take more memory than one
            openScene(experiment, i, silent);
    const ReportDirectory directory(options.output, options.resume, !options.part.empty());
    const std::string partial = options.output + "/partial";
    const Json experimentJson = toJson(experiment);

    Json provenance = buildProvenance(backend);
    provenance["experiment_hash"] = textHash(jsonLine(experimentJson));
    provenance["seed"] = experiment.lightSeed;
    if (!leftOut.empty())
        provenance["left_out"] = leftOut;
    Json key = provenance;
    key["scenes"] = experiment.scenes;
    std::vector<std::string> files = options.common.voxels;
    if (!options.costs.empty())
        files.push_back(options.costs);
    key["inputs"] = inputHashes(experiment.scenes, files);
    const Json ofParts = partKey(provenance, experiment, key["inputs"]);
    if (!options.part.empty())
        key["part"] = options.part;
    Journal journal(partial + "/journal.json", textHash(jsonText(key)), options.resume);
    if (journal.takenUpCount() > 0)
        console.note("resume: " + std::to_string(journal.takenUpCount()) +
                     " finished parts taken up");

    CompareFindings found(provenance, experimentJson);
    for (size_t i = 0; i < names.size(); ++i) {
        const std::vector<uint32_t> frames = share.frames(experiment, i);
        if (frames.empty())
            continue;
        checkInterrupted();
        LoadedScene loaded = firstScene ? std::move(*std::exchange(firstScene, std::nullopt))
                                        : openScene(experiment, i, console);
        const VoxelSource source{options.common.voxels, options.common.cache,
                                 options.common.allowStale};
        Workspace workspace(std::move(loaded), {backend, experiment.camera, source, &console});
        const LoadedScene& scene = workspace.scene();
        std::vector<uint32_t> resolutions;
        if (asksVoxels(experiment)) {
            refuseStaleExact(std::any_of(experiment.methods.begin(), experiment.methods.end(),
                                         [](const std::string& name) {
                                             return methodOf(name).needs().triangles;
                                         }),
                             options.common.allowStale);
            for (const uint32_t log2 : workspace.obtainVoxels(allResolutions(experiment)))
                resolutions.push_back(1u << log2);
        }
        const size_t fullCount =
            options.common.voxels.empty() ? experiment.resolutionLog2.size() : resolutions.size();
        const std::vector<RunParameters> runs = configurations(experiment, resolutions, fullCount);
        if (runs.empty())
            throw Error(ErrorKind::kUsage,
                        "nothing to compare: --methods and --thresholds leave no run");
        refuseDeepLods(runs);
        MeasureContext context;
        context.directory = partial;
        context.costs = costs.table ? &*costs.table : nullptr;
        context.given = &costs;
        context.costsPath = options.costs;
        context.journal = &journal;
        context.frames = frames;
        context.progress = console.progress("compare " + scene.name);
        found.add(experiment.isSequence ? measureSequence(workspace, experiment, runs, context)
                                        : measureScene(workspace, experiment, runs, context));
        found.results["scenes"].push_back({{"scene", scene.name},
                                           {"scene_hash", scene.geometryHash},
                                           {"triangle_count", scene.world->triangles().count()},
                                           {"light_count", scene.world->lights().size()}});
    }
    if (options.part.empty())
        publish(options, found, *package, start, console);
    else
        publishPart(options, found, share, ofParts, start, console);
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
    commandLine.flag("--resume", options->resume,
                     "Go on with what an interrupted compare in DIR has finished");
    commandLine.text("--part", options->part, "K/N",
                     "Measure only part K of N of the frames of all scenes, into DIR/part.json; "
                     "parts may run on several machines");
    commandLine.flag("--join", options->join,
                     "Make the report of parts: SCENE... are the directories of all of them");
    commandLine.flag("--no-charts", options->noCharts,
                     "Leave out the charts (they need python3-matplotlib and python3-jinja2)");
    commandLine.text(
        "--costs", options->costs, "F",
        "Replay the maps' isolated costs of a costs.json instead of measuring them; or, "
        "for --model cost, what calibrate wrote");
    commandLine.flag("--no-oracle", options->noOracle,
                     "Leave out the model oracle where --model is not given");
    options->common.declare(commandLine,
                            {SettingGroup::kSweep, SettingGroup::kRoutes, SettingGroup::kView,
                             SettingGroup::kPictures, SettingGroup::kLights, SettingGroup::kVoxels,
                             SettingGroup::kRays, SettingGroup::kMaps},
                            true);
    options->global.declare(commandLine);
    return [options, &commandLine] {
        refuseStudies(options->scenes);
        options->join ? runJoin(*options, commandLine) : runCompare(*options, commandLine);
    };
}

} // namespace shadowdag
