// SPDX-License-Identifier: Apache-2.0
// `shadowdag figures`: the paper's figures of a sequence that compare measured, as data, SVG and
// PNG.
#include "tools/commands/commands.h"
#include "tools/report/report_package.h"
#include "tools/settings/common_options.h"
#include "tools/settings/json_file.h"
#include "tools/settings/parse.h"
#include "tools/workspace/report_directory.h"

#include "cuda/error.h"
#include "scenes/input_file.h"
#include "scenes/output_file.h"

#include <nlohmann/json.hpp>

#include <filesystem>
#include <iostream>
#include <memory>

namespace shadowdag {

namespace {

namespace fs = std::filesystem;

constexpr int kFirstFigure = 10, kLastFigure = 18;

struct FiguresOptions {
    GlobalOptions global;
    std::string results, output, figures;
};

void runFigures(const FiguresOptions& options, const CommandLine& commandLine) {
    const Console console(options.global.json);
    options.global.apply(console, false, false);
    if (options.results.empty())
        throw Error(ErrorKind::kUsage, "RESULTS '': must not be empty; give the results.json of "
                                       "compare --sequence, or its directory");
    std::vector<std::string> more;
    if (commandLine.given("--figure"))
        for (const std::string& part : parseList("--figure", options.figures)) {
            more.push_back("--figure");
            more.push_back(
                std::to_string(parseInteger("--figure", part, kFirstFigure, kLastFigure)));
        }
    const ReportPackage package(true, console, "");
    const std::string path =
        fs::is_directory(options.results) ? options.results + "/results.json" : options.results;
    if (const std::string why = whyNoInput(path, kMaxJsonBytes); !why.empty())
        throw Error(ErrorKind::kInput, path + ": " + why +
                                           "; give the results.json of compare --sequence, or "
                                           "its directory");
    const fs::path folder = fs::weakly_canonical(options.output);
    if (folder.filename() == "charts" && holdsReport(folder.parent_path().string()))
        throw Error(ErrorKind::kUsage,
                    "-o '" + options.output +
                        "': contains the charts of a report, which figures would "
                        "remove; choose another directory");
    const DirectoryGuard guard(options.output);
    createDirectory(options.output);
    const DirectoryLock lock("-o", options.output);
    more.insert(more.begin(), {"figures", path, "-o", options.output});
    try {
        package.run(more);
    } catch (...) {
        removeAbandonedFiles(options.output); // of Python, which may have been killed
        throw;
    }
    const Json charts = readJsonFile(options.output + "/charts.json", "draw the figures again");
    for (const std::string& line : leftOutLines(charts))
        console.note(line);
    if (charts["charts"].empty())
        throw Error(ErrorKind::kInput, path + ": contains no data for figures; measure "
                                              "with compare --sequence --variants paper");
    Json list = Json::array();
    for (const Json& chart : charts["charts"]) {
        console.people() << options.output << "/" << chart["file"].get<std::string>()
                         << ".{svg,png,csv,json}: " << chart["title"].get<std::string>() << "\n";
        list.push_back(chart);
    }
    console.emit({{"directory", options.output},
                  {"figures", std::move(list)},
                  {"left_out", charts["left_out"]}});
}

} // namespace

std::function<void()> declareFigures(CommandLine& commandLine) {
    auto options = std::make_shared<FiguresOptions>();
    commandLine.text("RESULTS", options->results, "",
                     "results.json of compare --sequence, or its directory", true);
    commandLine.text(
        "-o,--output", options->output, "DIR",
        "Directory of the figures: each as .svg, .png, .csv and .json; charts.json lists them, "
        "and the omitted ones with the data that they need. Figures of an earlier run are removed",
        true);
    commandLine.text("--figure", options->figures, "N,...",
                     "Only these, by the paper's numbers: 10 frame times, 11 page commits, 12 "
                     "stages, 13 culling, 14 shading, 15 triangles, 16 texels and lighting "
                     "computations; 17 and 18, which the paper lacks, are flicker and how "
                     "differently pictures change [all]");
    options->global.declare(commandLine);
    return [options, &commandLine] { runFigures(*options, commandLine); };
}

} // namespace shadowdag
