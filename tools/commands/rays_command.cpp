// SPDX-License-Identifier: Apache-2.0
// `shadowdag rays`: writes the pairs of a frame for other tracers, and scores their answers.
#include "tools/commands/commands.h"
#include "tools/report/csv.h"
#include "tools/report/report_package.h"
#include "tools/settings/common_options.h"
#include "tools/settings/json_file.h"
#include "tools/settings/parse.h"
#include "tools/settings/provenance.h"
#include "tools/settings/words.h"
#include "tools/workspace/report_directory.h"
#include "tools/workspace/scene_setup.h"
#include "tools/workspace/single_frame.h"
#include "tools/workspace/timing.h"
#include "tools/workspace/tracer_plugin.h"
#include "tools/workspace/whole_file.h"

#include "cuda/error.h"
#include "scenes/output_target.h"

#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>
#include <ostream>

namespace shadowdag {

namespace {

struct RaysOptions {
    GlobalOptions global;
    CommonOptions common;
    std::string scene, output, repeats = "10";
    std::vector<std::string> answers, tracers;

    bool scores() const { return !answers.empty() || !tracers.empty(); }
};

bool isRaySet(const std::string& path) {
    return path.ends_with(".rays") || path.ends_with(".npz");
}

RaySet raySetOfFrame(const RaysOptions& options, const CommandLine& commandLine,
                     const Console& console) {
    const Experiment experiment = options.common.experiment(commandLine, false);
    if (experiment.frames.size() > 1)
        throw Error(ErrorKind::kUsage, "--frames '" + experiment.framesText +
                                           "': a ray set holds one frame; give a single frame");
    SingleFrames frames(options.scene, options.common, experiment, MethodOptions{"truth"},
                        Backend::kCpu, console);
    const PairResults& pairs =
        frames.render(options.common.timeSeconds(experiment), experiment.frames.front());
    const auto step = console.step("gather the pairs");
    RaySet set = makeRaySet(pairs.gbuffer, pairs.frame.pairs, frames.world());
    set.about = frames.reproduction();
    for (const char* key : {"method", "model", "parameters"}) // the set is of none
        set.about.erase(key);
    set.about["scene"] = sceneNames({options.scene}).front();
    return set;
}

/// Returns the set of SCENE: read, where it is one, else of the scene's frame.
RaySet raySetOf(const RaysOptions& options, const CommandLine& commandLine,
                const Console& console) {
    if (!isRaySet(options.scene))
        return raySetOfFrame(options, commandLine, console);
    for (const char* option :
         {"--size", "--camera", "--time", "--frames", "--fps", "--lights", "--seed"})
        if (commandLine.declares(option) && commandLine.given(option))
            throw Error(ErrorKind::kUsage, std::string(option) +
                                               " chooses a frame, and SCENE is a ray set, which "
                                               "has one; drop it");
    return readRaySet(options.scene);
}

/// Writes the rows of tracers into a directory, with their page.
/// Throws Error kUsage if the rows of tracers would replace files that this command did not write.
void refuseOtherReport(const std::string& directory) {
    const bool isOurs = holdsTracerRows(directory);
    for (const char* name : {"tracers.json", "tracers.csv", "index.html"})
        if (!isOurs && std::filesystem::exists(directory + "/" + name))
            throw Error(ErrorKind::kUsage, "-o '" + directory + "': contains " + name +
                                               ", which this command did not write and would "
                                               "replace; choose an empty or a new directory");
}

void writeRows(const RaysOptions& options, const Json& results, const Console& console) {
    const ReportPackage package(false, console);
    writeWholeFile(options.output + "/tracers.json", jsonText(results));
    Json rows = results["runs"];
    for (const Json& row : results["untimed_runs"])
        rows.push_back(row);
    writeWholeFile(options.output + "/tracers.csv",
                   flatCsv(rows, {"stages_ms", "round_times_ms", "parameters"}));
    if (package.hasPage())
        package.writePage("tracers", options.output);
}

constexpr const char* kMasksRemark = "masks cut triangles of this scene, which plug-ins do not see";

void score(const RaysOptions& options, const RaySet& set, const Console& console) {
    const auto repeats = uint32_t(parseInteger("--repeats", options.repeats, 1, 1000));
    const CpuUse use;
    std::vector<RayAnswers> all;
    for (const std::string& path : options.answers)
        all.push_back(readAnswers(path, set));
    for (const std::string& path : options.tracers) {
        const TracerPlugin plugin(path);
        const auto step = console.step("answers of " + plugin.name());
        all.push_back(plugin.answer(set, repeats));
        if (!set.masks.cuts.empty())
            console.note(plugin.name() + ": " + kMasksRemark);
    }
    for (auto answers = all.begin(); answers != all.end(); ++answers)
        if (std::any_of(all.begin(), answers,
                        [&](const RayAnswers& other) { return other.tracer == answers->tracer; }))
            throw Error(ErrorKind::kUsage, "two tracers are named '" + answers->tracer +
                                               "', so that rows and charts could not tell them "
                                               "apart; rename one");
    Json results = {{"provenance", buildProvenance(Backend::kCpu)},
                    {"experiment", set.about.value("experiment", Json::object())},
                    {"set_id", set.id()},
                    {"about", set.about},
                    {"runs", Json::array()},
                    {"untimed_runs", Json::array()}};
    results["experiment"]["title"] = "";
    const std::optional<double> otherShare = use.otherShare();
    {
        const auto step = console.step("the truth and the adjudicator");
        const RaySetTruth truth = judgeRaySet(set);
        for (size_t i = 0; i < all.size(); ++i) {
            Json row = scoreRow(set, truth, all[i]);
            if (i >= options.answers.size() && !set.masks.cuts.empty())
                row["warning"] = kMasksRemark;
            results[all[i].timeMs.empty() ? "untimed_runs" : "runs"].push_back(std::move(row));
        }
    }
    results["other_cpu_share"] = otherShareJson(otherShare);
    if (const std::string busy = busyRemark(otherShare); !busy.empty() && !options.tracers.empty())
        console.note("warning: " + busy);
    writeRows(options, results, console);
    for (const char* list : {"runs", "untimed_runs"})
        for (const Json& row : results[list])
            console.people() << row["label"].get<std::string>() << ": "
                             << row["false_shadow_count"].dump() << " false shadows and "
                             << row["false_light_count"].dump() << " false lights of "
                             << row["pair_count"].dump() << " pairs, "
                             << row["proven_wrong_count"].dump() << " of "
                             << row["proven_count"].dump() << " proven wrong"
                             << (row.contains("time_ms")
                                     ? ", " + numberText(row["time_ms"].get<double>()) + " ms"
                                     : "")
                             << "\n";
    console.emit(results);
}

void runRays(const RaysOptions& options, const CommandLine& commandLine) {
    const Console console(options.global.json);
    if (!options.scores()) // every command refuses a device alike, as createDirectory does
        static_cast<void>(outputTarget(options.output));
    if (options.scores() == isRaySet(options.output))
        throw Error(ErrorKind::kUsage,
                    "-o '" + options.output +
                        (options.scores()
                             ? "': rows of tracers need a directory, not a ray set; name one"
                             : "': a ray set is a .rays or .npz file; to score tracers, give "
                               "--answer or --tracer"));
    if (options.tracers.empty() && commandLine.given("--repeats"))
        throw Error(ErrorKind::kUsage, "--repeats is for --tracer; drop it");
    options.global.apply(console, false, false);
    std::optional<DirectoryGuard> guard;
    if (options.scores()) {
        refuseOtherReport(options.output);
        guard.emplace(options.output);
        createDirectory(options.output);
    } else {
        refuseSameFile(options.output, {options.scene});
        checkWritable(options.output);
    }
    const RaySet set = raySetOf(options, commandLine, console);
    if (set.pairCount() == 0)
        throw Error(ErrorKind::kInput, options.scene + ": has no pair of a visible point and a "
                                                       "light; choose another --camera");
    if (options.scores())
        return score(options, set, console);
    {
        const auto step = console.step("write " + options.output);
        writeRaySet(set, options.output);
    }
    console.people() << options.output << ": " << set.pairCount() << " pairs of "
                     << countText(set.positionWorld.size(), "sample") << " and "
                     << countText(set.lightPoint.size(), "light") << ", "
                     << countText(set.triangle.size(), "triangle") << "\n";
    console.emit({{"output", options.output},
                  {"set_id", set.id()},
                  {"pair_count", set.pairCount()},
                  {"sample_count", set.positionWorld.size()},
                  {"light_count", set.lightPoint.size()},
                  {"triangle_count", set.triangle.size()}});
}

} // namespace

std::function<void()> declareRays(CommandLine& commandLine) {
    const auto options = std::make_shared<RaysOptions>();
    commandLine.text("SCENE", options->scene, "",
                     std::string(kSceneHelp) + "; or a ray set that this command wrote", true);
    commandLine.text("-o,--output", options->output, "F.rays|F.npz|DIR",
                     "The ray set, to be mapped into memory or read by numpy; with --answer or "
                     "--tracer the directory of their rows: tracers.json, tracers.csv, index.html",
                     true);
    commandLine.heading("Tracers");
    commandLine.texts("--answer", options->answers, "F",
                      "Score the answers that a tracer wrote to this set, as docs/rays.md "
                      "describes them; may be given several times");
    commandLine.texts("--tracer", options->tracers, "LIBRARY",
                      "Load a tracer as a plug-in, time and score it; its code runs in this "
                      "process; may be given several times");
    commandLine.text("--repeats", options->repeats, "N",
                     "Measured repetitions of each plug-in, after one to warm up [10]");
    options->common.declare(commandLine, {SettingGroup::kView, SettingGroup::kLights}, false);
    options->global.declare(commandLine);
    return [options, &commandLine] { runRays(*options, commandLine); };
}

} // namespace shadowdag
