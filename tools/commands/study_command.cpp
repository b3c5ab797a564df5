// SPDX-License-Identifier: Apache-2.0
// `shadowdag study`: measures the rows of a study and checks their bounds, as a report.
#include "tools/commands/commands.h"
#include "tools/settings/common_options.h"
#include "tools/settings/parse.h"
#include "tools/studies/study.h"

#include "cuda/error.h"

#include <memory>
#include <ostream>

namespace shadowdag {

namespace {

struct StudyOptions {
    GlobalOptions global;
    std::vector<std::string> arguments; ///< the study, then scenes
    std::string only, cache;
    StudyCommand command;
    bool list = false;
};

void listStudies(const Console& console) {
    Json list = Json::array();
    for (const StudyFile& study : shippedStudies()) {
        const std::string what = study.json["what"];
        console.people() << study.name << ": " << what << "\n";
        list.push_back({{"name", study.name}, {"kind", study.json["kind"]}, {"what", what}});
    }
    console.emit({{"studies", list}});
}

void measureStudy(const StudyOptions& options, const CommandLine& commandLine) {
    const Console console(options.global.json);
    if (options.list)
        return listStudies(console);
    if (options.arguments.empty() || options.command.output.empty())
        throw Error(ErrorKind::kUsage, "study needs a STUDY and -o DIR; study --list lists those "
                                       "that come with the program");
    const StudyFile file = findStudy(options.arguments.front());
    StudyRequest request;
    request.scenes.assign(options.arguments.begin() + 1, options.arguments.end());
    request.cacheDirectory = options.cache;
    if (!options.only.empty())
        request.names = parseList("--only", options.only);
    request.backend = options.global.apply(console, true);
    // Refused before anything is moved.
    const std::unique_ptr<Study> study = makeStudy(file, request, console);
    if (commandLine.given("--cache") && !study->usesCache())
        throw Error(ErrorKind::kUsage,
                    "--cache is for studies of kind real and adjudication, and study " + file.name +
                        " is of kind " + file.json["kind"].get<std::string>() + "; drop it");
    runStudy(file, *study, request, options.command, console);
}

} // namespace

std::function<void()> declareStudy(CommandLine& commandLine) {
    const auto options = std::make_shared<StudyOptions>();
    commandLine.texts("STUDY", options->arguments, "",
                      "A study that comes with the program (--list), or your own FILE.json; "
                      "then SCENE...: scenes to measure instead of the study's; for study real the "
                      "scenes or directories of scenes that it needs");
    commandLine.text("-o,--output", options->command.output, "DIR", "The report's directory");
    commandLine.flag("--list", options->list, "List the studies that come with the program");
    commandLine.text("--only", options->only, "NAME,...", "Only these rows of the study");
    commandLine.flag("--resume", options->command.resume, "Resume an interrupted study in DIR");
    commandLine.flag("--no-charts", options->command.noCharts,
                     "Omit the charts (they need python3-matplotlib)");
    commandLine.text(
        "--cache", options->cache, "DIR",
        "Directory for the voxels of scenes, for studies of kind real and adjudication");
    options->global.declare(commandLine);
    return [options, &commandLine] { measureStudy(*options, commandLine); };
}

} // namespace shadowdag
