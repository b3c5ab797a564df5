// SPDX-License-Identifier: Apache-2.0
// `shadowdag import`: makes an asset from the active voxels of an OpenVDB or NanoVDB grid.
#include "cuda/error.h"
#include "scenes/input_file.h"
#include "scenes/limited_process.h"
#include "scenes/output_file.h"
#include "scenes/output_target.h"
#include "tools/commands/commands.h"
#include "tools/settings/common_options.h"
#include "tools/settings/console.h"
#include "tools/settings/parse.h"
#include "tools/settings/provenance.h"
#include "tools/workspace/asset_json.h"
#include "tools/workspace/scene_setup.h"
#include "voxel/vdb_file.h"

#include <nlohmann/json.hpp>

#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <iostream>
#include <memory>
#include <thread>

namespace shadowdag {

namespace {

struct ImportOptions {
    GlobalOptions global;
    std::string input, output, grid, packing = "compact";
    bool acceptEdited = false;
};

/// Returns the limits of the process that reads the grid.
VdbLimits limitsOf(const ImportOptions& options) {
    std::error_code ignored;
    const uintmax_t bytes = std::filesystem::file_size(options.input, ignored);
    return vdbLimits(ignored ? 0 : bytes,
                     std::filesystem::path(options.input).extension() == ".nvdb");
}

/// Limits this process, whose memory and time a damaged file may waste. Not with sanitizers, which
/// reserve terabytes for themselves.
void keepLimits([[maybe_unused]] const VdbLimits& limits) {
#if !defined(SDAG_SANITIZED)
    lowerLimit(RLIMIT_DATA, limits.memoryBytes);
    lowerLimit(RLIMIT_CPU, limits.cpuSeconds);
    std::signal(SIGXCPU, SIG_DFL); // the parent says what it means
#endif
}

VdbAsset readLimited(const ImportOptions& options) {
    const VdbLimits limits = limitsOf(options);
    loadVdbReader(options.input);
    keepLimits(limits);
    try {
        return readVdb(options.input, {options.grid, options.acceptEdited, programVersion()});
    } catch (const TooManyFiles&) { // which is not of the file
        throw;
    } catch (const Error& error) {
        if (error.kind() != ErrorKind::kResource)
            throw;
        throw Error(ErrorKind::kInput, std::string(error.what()) +
                                           " within the limit for a file of its size, " +
                                           std::to_string(limits.memoryBytes >> 20) +
                                           " MiB; it is damaged, or memory is short");
    }
}

void runImport(const ImportOptions& options) {
    const Console console(options.global.json);
    options.global.apply(console, false, false);
    checkExtension(options.output, {".svdag"}, "assets are .svdag files; use that extension");
    const std::string ending = std::filesystem::path(options.input).extension();
    if (ending != ".vdb" && ending != ".nvdb")
        throw Error(ErrorKind::kUsage,
                    "'" + options.input + "': grids are .vdb (OpenVDB) or .nvdb (NanoVDB) files");
    refuseSameFile(options.output, {options.input});
    checkWritable(options.output);
    const AssetPacking packing = parsePacking(options.packing);
    const auto start = std::chrono::steady_clock::now();
    const VdbAsset found = readLimited(options);
    const double wall =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    const uint64_t bytes = writeAsset(found.asset, options.output, packing);
    if (found.isForeign)
        console.note("'" + found.gridName +
                     "' was not exported by this program: " + found.asset.provenance.options);
    Json json = {{"output", options.output}};
    json.update(assetJson(found.asset, bytes));
    json["grid"] = found.gridName;
    json["grid_type"] = found.gridType;
    json["is_foreign"] = found.isForeign;
    json["corner_index"] = {found.cornerIndex.x, found.cornerIndex.y, found.cornerIndex.z};
    json["wall_s"] = wall;
    console.people() << options.output << "\n";
    printAsset(console.people(), json);
    console.emit(json);
}

/// Set in the process that reads; its value has no meaning.
constexpr const char* kApart = "SHADOWDAG_IMPORT_APART";

/// Waits for the process that reads and returns its status. After a signal, kills the reader if it
/// does not end by itself, and removes its unfinished file.
int waitForReader(pid_t child, const std::string& output) {
    const EndRemoval atEnd([&] {
        kill(child, SIGKILL);
        // Not for longer: it may wait for a disk that does not answer, and keeps its file then.
        for (int i = 0; i < 100 && waitpid(child, nullptr, WNOHANG) == 0; ++i)
            std::this_thread::sleep_for(std::chrono::milliseconds(1));
        removeAbandonedFilesOf(output);
    });
    int status = 0;
    while (waitpid(child, &status, 0) < 0)
        if (errno == EINTR)
            kill(child, SIGTERM);
        else
            pause(); // the thread that ends this process has waited for it
    return status;
}

/// Runs the import in a separate process, because a damaged file may make OpenVDB's reader write
/// past its buffers, or take memory or time without end; then only that process ends, and this one
/// reports it. A fork alone would not do: OpenVDB's logging has threads that it waits for at exit.
void runImportApart(const ImportOptions& options) {
    std::vector<std::string> texts = {"shadowdag",
                                      "import",
                                      "--output=" + options.output,
                                      "--packing=" + options.packing,
                                      "--threads=" + options.global.threads,
                                      "--backend=" + options.global.backend,
                                      "--gl-pages=" + options.global.glPages};
    if (!options.grid.empty())
        texts.push_back("--grid=" + options.grid);
    if (options.acceptEdited)
        texts.push_back("--edited");
    if (options.global.json)
        texts.push_back("--json");
    texts.insert(texts.end(), {"--", options.input});
    std::vector<char*> arguments;
    for (std::string& text : texts)
        arguments.push_back(text.data());
    arguments.push_back(nullptr);
    const std::string output = outputTarget(options.output); // where the reader's file is
    setenv(kApart, "1", 1);
    const pid_t parent = getpid(), child = fork();
    if (child < 0)
        throw Error(ErrorKind::kResource, std::string("cannot start a process to read '") +
                                              options.input + "': " + std::strerror(errno) +
                                              "; raise the limits of the shell (ulimit -u)");
    if (child == 0) {
        prctl(PR_SET_PDEATHSIG, SIGKILL);
        if (getppid() == parent) {
            execv("/proc/self/exe", arguments.data());
            // Must not allocate: another thread may have held the heap's lock at the fork.
            const char* const texts[] = {
                "shadowdag: error: cannot start itself to read a grid from /proc/self/exe: ",
                strerrordesc_np(errno), "; is /proc mounted?\n"};
            for (const char* text : texts)
                if (write(STDERR_FILENO, text, std::strlen(text)) < 0)
                    break;
        }
        _exit(int(ErrorKind::kResource));
    }
    const int status = waitForReader(child, output);
    if (WIFEXITED(status)) {
        if (WEXITSTATUS(status) != 0)
            std::exit(WEXITSTATUS(status)); // which it has reported
        return;
    }
    removeAbandonedFilesOf(output);
    // The child gets SIGTERM, whatever this process got.
    const int signal = isInterrupted() ? caughtSignal() : WTERMSIG(status);
    if (isInterrupted() || signal == SIGINT || signal == SIGTERM || signal == SIGHUP) {
        std::signal(signal, SIG_DFL);
        std::raise(signal);
    }
    if (signal == SIGKILL)
        throw Error(ErrorKind::kResource,
                    options.input + ": reading it was killed; is memory short?");
    struct rlimit own {};
    getrlimit(RLIMIT_CPU, &own);
    if (signal == SIGXCPU && own.rlim_cur < limitsOf(options).cpuSeconds)
        throw Error(ErrorKind::kResource,
                    options.input + ": reading it took longer than the limit of the shell, " +
                        std::to_string(own.rlim_cur) +
                        " s of processor time; raise it (ulimit -S -t)");
    if (signal == SIGXCPU)
        throw Error(ErrorKind::kInput,
                    options.input +
                        ": reading it took longer than the limit for a file of its size, " +
                        std::to_string(limitsOf(options).cpuSeconds) +
                        " s of processor time; it is damaged");
    throw Error(ErrorKind::kInput, options.input + ": reading it crashed (" + strsignal(signal) +
                                       "); the file is damaged");
}

} // namespace

std::function<void()> declareImport(CommandLine& commandLine) {
    auto options = std::make_shared<ImportOptions>();
    commandLine.text("FILE", options->input, "",
                     "A .vdb (OpenVDB) or .nvdb (NanoVDB) file. A file that export wrote gives the "
                     "same asset again; from any other grid the active voxels are used, in the "
                     "smallest cube whose side is a power of two",
                     true);
    commandLine.text("-o,--output", options->output, "F.svdag", "The asset to write", true);
    commandLine.text("--packing", options->packing, "fast|compact", kPackingHelp);
    commandLine.text("--grid", options->grid, "NAME", "The grid to read, if the file has several");
    commandLine.flag(
        "--edited", options->acceptEdited,
        "Accept an exported grid that was edited since, as if another program wrote it");
    options->global.declare(commandLine);
    return [options] {
        std::getenv(kApart) != nullptr ? runImport(*options) : runImportApart(*options);
    };
}

} // namespace shadowdag
