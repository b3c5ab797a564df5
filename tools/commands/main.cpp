// SPDX-License-Identifier: Apache-2.0
// The program `shadowdag`: parses the command line, runs one subcommand, and turns exceptions into
// a message and an exit status.
#include "cuda/cancel.h"
#include "cuda/error.h"
#include "gl/slices.h"
#include "scenes/output_file.h"
#include "tools/commands/commands.h"
#include "tools/commands/exit_message.h"
#include "tools/settings/console.h"
#include "tools/settings/provenance.h"
#include "tools/studies/study.h"

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <exception>
#include <iostream>
#include <string_view>

namespace {

int complain(const std::string& message, int status) {
    std::cout << std::flush;
    std::cerr << "shadowdag: error: " << message << std::endl;
    return status;
}

bool asksForHelp(int argc, char** argv) {
    return std::any_of(argv + 1, argv + argc, [](const char* word) {
        return std::string_view(word) == "--help" || std::string_view(word) == "-h" ||
               std::string_view(word) == "--version";
    });
}

} // namespace

int main(int argc, char** argv) {
    using namespace shadowdag;
    static const std::string command = argc > 1 ? argv[1] : "";
    static std::atomic_flag isEnding;
    const auto endBySignal = [](int signal) {
        while (isEnding.test_and_set()) // the other thread ends the process
            pause();
        complain(std::string("interrupted; every file is complete or absent") +
                     (command == "compare" || command == "study"
                          ? "; the same command with --resume goes on after the finished parts"
                          : ""),
                 1);
        std::signal(signal, SIG_DFL);
        std::raise(signal); // so that shells see the signal
    };
    std::signal(SIGPIPE, SIG_IGN); // a write into a closed pipe then fails, like one to a full disk
    try {
        catchInterrupts([endBySignal](int signal) {
            removeUnfinishedFiles();
            endBySignal(signal);
        });
        setGlPoll(checkInterrupted);
        setCpuPoll(pollLoops);
        Program program("shadowdag",
                        "Compares rays through a sparse voxel DAG with virtual cube shadow maps, "
                        "for many lights: "
                        "their speed, and their error against Embree.",
                        "shadowdag " + programVersion() + " (" + programCommit() + ")");
        program.command("scene", "Write a built-in scene as .glb", declareScene);
        program.command("voxelize", "Build the voxel DAG of a scene", declareVoxelize);
        program.command("merge", "Join the parts of a build into an asset", declareMerge);
        program.command("info", "Show the contents of an asset or a scene", declareInfo);
        program.command("export", "Write an asset as an OpenVDB or NanoVDB grid", declareExport);
        program.command("import", "Make an asset from an OpenVDB or NanoVDB grid", declareImport);
        program.command("render", "Render frames with one method, with AOVs", declareRender);
        program.command("validate", "Compare shadows with Embree, pair by pair", declareValidate);
        program.command("compare", "Measure time and error of methods and parameters, as a report",
                        declareCompare);
        program.command("study", "Measure a study's rows and check their bounds, as a report",
                        declareStudy);
        program.command("figures", "Draw the paper's figures from a sequence measured by compare",
                        declareFigures);
        program.command("calibrate", "Fit the cost model `cost` to this machine", declareCalibrate);
        program.command("fit",
                        "Find the cheapest model, in time or bytes, that keeps an error bound",
                        declareFit);
        program.command("view", "Open a window: fly, compare side by side, inspect frames",
                        declareView);
        program.command("bench", "Compare our rates with Embree's and NanoVDB's", declareBench);
        program.run(argc, argv);
        errno = 0;
        if (!std::cout.flush() && errno == EPIPE)
            return asksForHelp(argc, argv)
                       ? 0 // the reader has seen as much as it wanted
                       : complain("standard output was closed before all was written; read it to "
                                  "its end",
                                  int(ErrorKind::kResource));
        if (!std::cout)
            return complain("standard output cannot be written; is the disk full?",
                            int(ErrorKind::kResource));
        return 0;
    } catch (const Interrupted& interrupted) {
        endBySignal(interrupted.signal);
    } catch (const NotHeld& notHeld) {
        return complain(notHeld.what(), NotHeld::kExitStatus);
    } catch (const std::exception& error) {
        if (isInterrupted()) // a call that the signal ended has failed
            endBySignal(caughtSignal());
        const ExitMessage exit = exitMessageOf(error);
        return complain(exit.message, exit.status);
    }
    return 1;
}
