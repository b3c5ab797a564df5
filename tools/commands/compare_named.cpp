// SPDX-License-Identifier: Apache-2.0
#include "tools/commands/commands.h"
#include "tools/commands/compare_options.h"
#include "tools/studies/failures.h"
#include "tools/studies/mechanisms.h"
#include "tools/studies/real_scenes.h"
#include "tools/studies/stability.h"

#include "cuda/error.h"

#include <filesystem>

namespace shadowdag {

namespace {

/// Whether a compare of this name is meant instead of scenes; a file of that name is ./NAME.
bool isMeant(const CompareOptions& options, const char* name) {
    return !options.scenes.empty() && options.scenes.front() == name;
}

/// Throws Error kUsage for what such a compare fixes itself.
/// @param rows what it has, for people @param takesCharts whether --no-charts is heeded
void refuseBeside(const CompareOptions& options, const CommandLine& commandLine,
                  const std::string& name, const std::string& rows, bool takesCharts) {
    std::vector<std::string> fixed = optionsOfExperiments();
    fixed.insert(fixed.end(), {"--experiment", "--resume", "--part", "--join", "--voxels",
                               "--costs", "--cache", "--allow-stale"});
    if (!takesCharts)
        fixed.push_back("--no-charts");
    for (const std::string& option : fixed)
        if (commandLine.given(option))
            throw Error(ErrorKind::kUsage, option + " and compare " + name +
                                               " contradict each other: its " + rows +
                                               " say what is run; drop one");
    if (options.scenes.size() > 1)
        throw Error(ErrorKind::kUsage, "SCENE '" + options.scenes[1] + "': " + name +
                                           " stands alone; drop the other scenes, or write ./" +
                                           name + " for a file of that name");
}

/// Throws Error kUsage on --backend gl for a compare whose rows ask for what it does not follow:
/// without them its bounds would say nothing. @param needs those, for people
void refuseGl(const CompareOptions& options, const std::string& name, const std::string& needs) {
    if (options.global.backend == "gl")
        throw Error(ErrorKind::kUsage, "--backend gl: compare " + name + " needs " + needs +
                                           ", which it does not follow; use --backend cpu or cuda");
}

void runRealScenes(const CompareOptions& options, const CommandLine& commandLine) {
    std::vector<std::string> fixed = optionsOfExperiments();
    fixed.insert(fixed.end(), {"--experiment", "--resume", "--part", "--join", "--no-charts",
                               "--voxels", "--costs", "--allow-stale", "--only"});
    for (const std::string& option : fixed)
        if (commandLine.given(option))
            throw Error(ErrorKind::kUsage, option + " and compare real contradict each other: its "
                                                    "bounds hold for one view and one choice of "
                                                    "settings; drop one");
    refuseGl(options, "real", "dag-exact");
    const Console console(options.global.json);
    runReal({options.output,
             {options.scenes.begin() + 1, options.scenes.end()},
             options.common.cache,
             options.global.apply(console, true)},
            console);
}

} // namespace

std::vector<std::string> optionsOfExperiments() {
    std::vector<std::string> options{"--no-oracle"};
    for (const Setting& setting : settings())
        if (!setting.option.empty())
            options.push_back(setting.option);
    return options;
}

bool runNamedCompare(const CompareOptions& options, const CommandLine& commandLine) {
    if (isMeant(options, "real")) {
        runRealScenes(options, commandLine);
        return true;
    }
    const auto meant = [&](const char* name, const char* rows, bool takesCharts) {
        if (!isMeant(options, name))
            return false;
        refuseBeside(options, commandLine, name, rows, takesCharts);
        return true;
    };
    const bool isFailures = meant("failures", "rows", false),
               isStability = !isFailures && meant("stability", "groups", true),
               isMechanisms = !isFailures && !isStability && meant("mechanisms", "rows", true);
    if (!isFailures && !isStability && !isMechanisms) {
        for (const std::string& scene : options.scenes)
            for (const char* name : {"failures", "stability", "mechanisms", "real"})
                if (scene == name && !std::filesystem::exists(scene))
                    throw Error(ErrorKind::kUsage,
                                "SCENE '" + scene + "': compare " + name +
                                    " stands first; there is no file of that name, either");
        return false;
    }
    if (isStability)
        refuseGl(options, "stability", "dag-exact");
    if (isMechanisms)
        refuseGl(options, "mechanisms",
                 "dag-exact, and retained pages and polygon levels of detail (SOR and PLOD of "
                 "--variants)");
    const Console console(options.global.json);
    const Backend backend = options.global.apply(console, true);
    if (isFailures)
        runFailures({options.output, options.only, backend}, console);
    else if (isStability)
        runStability({options.output, options.only, options.noCharts, backend}, console);
    else
        runMechanisms({options.output, options.only, options.noCharts, backend}, console);
    return true;
}

} // namespace shadowdag
