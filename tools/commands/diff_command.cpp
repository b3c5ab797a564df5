// SPDX-License-Identifier: Apache-2.0
// `shadowdag diff`: what changed between two results, beyond their spread, as text and as a page.
#include "tools/commands/commands.h"
#include "tools/report/report_package.h"
#include "tools/report/results_diff.h"
#include "tools/settings/common_options.h"
#include "tools/settings/json_file.h"
#include "tools/settings/parse.h"
#include "tools/settings/words.h"
#include "tools/studies/study.h"
#include "tools/workspace/scene_setup.h"
#include "tools/workspace/whole_file.h"

#include "cuda/error.h"
#include "scenes/input_file.h"

#include <filesystem>
#include <memory>
#include <optional>
#include <ostream>
#include <utility>

namespace shadowdag {

namespace {

struct DiffArguments {
    GlobalOptions global;
    std::string a, b, allow, output;
    bool noTimes = false;
};

/// Returns the file of results that a path names: the file itself, or that of a report's directory.
std::string resultsFile(const std::string& path) {
    constexpr const char* kFiles[] = {
        "results.json", "failures.json",     "stability.json", "real.json",    "ablation.json",
        "mutants.json", "adjudication.json", "scale.json",     "tracers.json", "regret.json"};
    if (!std::filesystem::is_directory(path))
        return path;
    for (const char* name : kFiles)
        if (const std::string file = path + "/" + name; std::filesystem::exists(file))
            return file;
    throw Error(ErrorKind::kInput, path + ": holds no results; give the directory of a report of "
                                          "compare or study, or a JSON file of results");
}

DiffOptions optionsOf(const DiffArguments& arguments) {
    DiffOptions options;
    options.comparesTimes = !arguments.noTimes;
    if (arguments.allow.empty())
        return options;
    for (const std::string& what : parseList("--allow", arguments.allow)) {
        if (what == "experiment")
            options.allowsExperiment = true;
        else if (what == "scene")
            options.allowsScene = true;
        else if (what == "machine")
            options.allowsMachine = true;
        else
            throw Error(ErrorKind::kUsage, "--allow '" + what +
                                               "': must be experiment, scene or "
                                               "machine");
    }
    return options;
}

/// Returns the file of the data beside a page, F.json of F.html. Throws Error kUsage where the page
/// has another ending, and where the two exist and are not an earlier difference.
std::string dataBeside(const std::string& page) {
    checkExtension(page, {".html"},
                   "the page is HTML, its data go beside it, as F.html and F.json");
    const std::string data = std::filesystem::path(page).replace_extension(".json").string();
    const Json old = readOwnJsonFile(data);
    const bool isOurs = old.is_object() && old.contains("only_in_a");
    for (const auto& [what, path] : {std::pair("data", data), std::pair("page", page)})
        if (std::filesystem::exists(path) && !isOurs)
            throw Error(ErrorKind::kUsage, "-o '" + page + "': the " + what + " would replace " +
                                               path +
                                               ", which is no earlier difference with its data "
                                               "beside it; choose another name");
    return data;
}

void runDiff(const DiffArguments& arguments) {
    const Console console(arguments.global.json);
    arguments.global.apply(console, false, false);
    const DiffOptions options = optionsOf(arguments);
    std::string data;
    std::optional<ReportPackage> package;
    if (!arguments.output.empty()) {
        data = dataBeside(arguments.output);
        checkWritable(arguments.output);
        checkWritable(data);
        package = ReportPackage::forPages("leave out -o");
    }
    const std::string remedy =
        "give the JSON file that compare, study, validate, bench, rays or calibrate wrote";
    const auto read = [&](const std::string& path) {
        return readJsonFile(resultsFile(path), remedy);
    };
    const Json a = read(arguments.a), b = read(arguments.b);
    const Json diff = diffResults(arguments.a, a, arguments.b, b, options);
    console.people() << diffText(diff) << std::flush;
    if (package) {
        writeWholeFile(data, jsonText(diff));
        package->run({"diff", data});
        console.people() << "page: " << arguments.output << std::endl;
    }
    console.emit(diff);
    const uint64_t worse = diff.at("worse_count"), rows = diff.at("lost_row_count"),
                   values = diff.at("lost_value_count");
    if (worse + rows + values > 0)
        throw NotHeld(arguments.b + " has " + countText(worse, "worse value") + " than " +
                      arguments.a +
                      (rows + values > 0 ? ", and lacks " + countText(rows, "row") + " and " +
                                               countText(values, "value") + " of other rows"
                                         : ""));
}

} // namespace

std::function<void()> declareDiff(CommandLine& commandLine) {
    const auto arguments = std::make_shared<DiffArguments>();
    commandLine.text(
        "RESULTS_A", arguments->a, "",
        "Results of compare, study, validate, bench, rays or calibrate: a JSON file, or a report's "
        "directory",
        true);
    commandLine.text("RESULTS_B", arguments->b, "",
                     "The results to compare with RESULTS_A; the program ends with 5 where these "
                     "are worse or lack a row or a value",
                     true);
    commandLine.text("-o,--output", arguments->output, "F.html",
                     "A page of the difference; its data are written beside it, as F.json [none]");
    commandLine.text(
        "--allow", arguments->allow, "WHAT,...",
        "What may differ, of experiment, scene, machine; where experiments may, so may "
        "rows [nothing]");
    commandLine.flag("--no-times", arguments->noTimes,
                     "Leave out times, so that machines and numbers of rounds may differ");
    arguments->global.declare(commandLine);
    return [arguments] { runDiff(*arguments); };
}

} // namespace shadowdag
