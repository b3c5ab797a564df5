// SPDX-License-Identifier: Apache-2.0
// The program `shadowdag`: parses, runs one subcommand, turns trouble into a message and an exit
// status.
#include "cuda/error.h"
#include "gl/slices.h"
#include "tools/commands/commands.h"
#include "tools/commands/exit_message.h"
#include "tools/settings/console.h"
#include "tools/settings/provenance.h"
#include "tools/studies/study.h"

#include <csignal>
#include <exception>
#include <iostream>

namespace {

int complain(const std::string& message, int status) {
    std::cout << std::flush;
    std::cerr << "shadowdag: error: " << message << std::endl;
    return status;
}

} // namespace

int main(int argc, char** argv) {
    using namespace shadowdag;
    catchInterrupts();
    setGlPoll(checkInterrupted);
    try {
        Program program(
            "shadowdag",
            "Rays through a sparse voxel DAG against virtual cube shadow maps, for many lights: "
            "their speed, and their error against Embree.",
            "shadowdag " + programVersion() + " (" + programCommit() + ")");
        program.command("scene", "Write a built-in scene as .glb", declareScene);
        program.command("voxelize", "Build the voxel DAG of a scene", declareVoxelize);
        program.command("merge", "Join the parts of a build to its asset", declareMerge);
        program.command("info", "Show what an asset or a scene holds", declareInfo);
        program.command("export", "Write an asset as an OpenVDB or NanoVDB grid", declareExport);
        program.command("import", "Make an asset of an OpenVDB or NanoVDB grid", declareImport);
        program.command("render", "Render frames with one method, with AOVs", declareRender);
        program.command("validate", "Hold shadows against Embree, pair by pair", declareValidate);
        program.command("compare", "Every method and parameter: time against error, as a report",
                        declareCompare);
        program.command("study", "Rows and bounds of a file, measured, as a report", declareStudy);
        program.command("figures",
                        "Redraw the paper's figures from a sequence that compare measured",
                        declareFigures);
        program.command("calibrate", "Fit the cost model `cost` to this machine", declareCalibrate);
        program.command("fit", "The least model, in time or bytes, that keeps an error",
                        declareFit);
        program.command("view", "A window: fly, compare side by side, see what a frame does",
                        declareView);
        program.command("bench", "Our rates beside Embree's and NanoVDB's", declareBench);
        program.run(argc, argv);
        if (!std::cout.flush())
            return complain("standard output cannot be written; is the disk full?",
                            int(ErrorKind::kResource));
        return 0;
    } catch (const Interrupted& interrupted) {
        complain("interrupted; files are whole or not there", 1);
        std::signal(interrupted.signal, SIG_DFL);
        std::raise(interrupted.signal); // so that shells see what ended us
    } catch (const NotHeld& notHeld) {
        return complain(notHeld.what(), NotHeld::kExitStatus);
    } catch (const std::exception& error) {
        const ExitMessage exit = exitMessageOf(error);
        return complain(exit.message, exit.status);
    }
    return 1;
}
