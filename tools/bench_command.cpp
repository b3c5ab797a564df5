// SPDX-License-Identifier: Apache-2.0
// `shadowdag bench`: runs one of the benchmark programs (tests/bench) that check their answers and print our rates
// beside Embree's and NanoVDB's. They are programs of their own because the baselines are no part of ours.
#include "tools/charts_run.h"
#include "tools/commands.h"
#include "tools/common_options.h"
#include "tools/parse.h"

#include <sched.h>

#include <filesystem>
#include <iostream>
#include <memory>
#include <sstream>

namespace shadowdag {

namespace {

namespace fs = std::filesystem;

struct BenchOptions {
    GlobalOptions global;
    std::string name;
    std::vector<std::string> arguments;
};

struct Bench {
    const char* name;
    const char* program;
    const char* arguments; ///< what it takes, for --help
};

constexpr Bench kBenches[] = {
    {"voxel", "voxel_bench", "voxelizing and shadow rays beside Embree and NanoVDB"},
    {"raster", "raster_bench", "shadow maps stage by stage: [SCENE] [mapCount] [faceTexels] [pageTexels] [repeats]"},
};

/// Returns where a benchmark program is: beside ours, in the build tree, or installed; "" when it is not.
std::string findBench(const std::string& program) {
    const fs::path directory = programDirectory();
    for (const fs::path& candidate :
         {directory / program, directory.parent_path() / "tests" / "bench" / program,
          directory.parent_path() / "tests" / program, directory.parent_path() / "libexec" / "shadowdag" / program})
        if (fs::exists(candidate))
            return candidate.string();
    return "";
}

/// Confines this process, and what it starts, to `count` of the processors that it may use. The benchmark then
/// has as many threads; a second process cannot be told through setThreadCount.
void confineToProcessors(int count) {
    cpu_set_t allowed, chosen;
    CPU_ZERO(&chosen);
    if (count == 0 || sched_getaffinity(0, sizeof allowed, &allowed) != 0)
        return;
    for (int cpu = 0, taken = 0; cpu < CPU_SETSIZE && taken < count; ++cpu)
        if (CPU_ISSET(cpu, &allowed)) {
            CPU_SET(cpu, &chosen);
            ++taken;
        }
    sched_setaffinity(0, sizeof chosen, &chosen);
}

void runBench(const BenchOptions& options) {
    const Console console(options.global.json);
    const Bench* bench = nullptr;
    std::string known;
    for (const Bench& candidate : kBenches) {
        known += (known.empty() ? "" : ", ") + std::string(candidate.name);
        if (options.name == candidate.name)
            bench = &candidate;
    }
    if (bench == nullptr)
        throw Error(ErrorKind::kUsage, "bench '" + options.name + "': no such benchmark; there are " + known);
    if (options.global.backend == "cuda")
        throw Error(ErrorKind::kUsage, "bench '" + options.name + "' runs on the processor: drop --backend cuda");
    confineToProcessors(int(parseInteger("--threads", options.global.threads, 0, 4096)));
    const std::string program = findBench(bench->program);
    if (program.empty())
        throw Error(ErrorKind::kUsage, std::string("bench '") + bench->name + "': the program " + bench->program +
                                           " was not built; configure with -DSDAG_BENCHES=ON -DSDAG_TESTS=ON and build");
    std::vector<std::string> command{program};
    command.insert(command.end(), options.arguments.begin(), options.arguments.end());
    std::string said;
    const int status = runProgram(command, &said);
    console.people() << said << std::flush;
    if (status != 0)
        throw Error(ErrorKind::kInput, program + ": ended with status " + std::to_string(status) +
                                           "; a benchmark fails when an answer is wrong, see the lines above");
    Json lines = Json::array();
    std::istringstream stream(said);
    for (std::string line; std::getline(stream, line);)
        lines.push_back(line);
    console.emit({{"bench", bench->name}, {"arguments", options.arguments}, {"lines", std::move(lines)}});
}

} // namespace

std::function<void()> declareBench(CommandLine& commandLine) {
    auto options = std::make_shared<BenchOptions>();
    std::string help;
    for (const Bench& bench : kBenches)
        help += (help.empty() ? "" : "; ") + std::string(bench.name) + ": " + bench.arguments;
    commandLine.text("NAME", options->name, "", help, true);
    commandLine.texts("ARGUMENT", options->arguments, "", "Handed on to the benchmark");
    options->global.declare(commandLine);
    return [options] { runBench(*options); };
}

} // namespace shadowdag
