// SPDX-License-Identifier: Apache-2.0
// The program `shadowdag`: parses the command line, runs one subcommand, and turns exceptions into
// a message and an exit status.
#include "cuda/cancel.h"
#include "cuda/error.h"
#include "gl/slices.h"
#include "scenes/output_file.h"
#include "scenes/printable.h"
#include "scenes/warning.h"
#include "tools/commands/commands.h"
#include "tools/commands/exit_message.h"
#include "tools/settings/console.h"
#include "tools/settings/provenance.h"
#include "tools/studies/study.h"

#include <fcntl.h>
#include <poll.h>
#include <pthread.h>
#include <sys/resource.h>
#include <sys/uio.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <csignal>
#include <cstdlib>
#include <exception>
#include <iostream>
#include <new>
#include <string_view>
#include <system_error>

namespace {

/// Writes an error to standard error: without memory, and without std::cerr, which writes nothing
/// more once a remark could not be written.
void writeError(std::string_view message) {
    const std::string_view texts[] = {"shadowdag: error: ", message, "\n"};
    iovec parts[3];
    for (size_t i = 0; i < 3; ++i)
        parts[i] = {const_cast<char*>(texts[i].data()), texts[i].size()}; // it does not write there
    static_cast<void>(writev(STDERR_FILENO, parts, 3) + 1);
}

int complain(const std::string& message, int status) {
    std::cout << std::flush;
    writeError(shadowdag::printableLine(message));
    return status;
}

bool asksForHelp(int argc, char** argv) {
    return std::any_of(argv + 1, argv + argc, [](const char* word) {
        return std::string_view(word) == "--help" || std::string_view(word) == "-h" ||
               std::string_view(word) == "--version";
    });
}

/// Returns whether standard output is a pipe or a socket whose reader is gone: the write that
/// failed may be long ago.
bool isOutputClosed() {
    pollfd output{STDOUT_FILENO, POLLOUT, 0};
    return poll(&output, 1, 0) > 0 && (output.revents & (POLLERR | POLLHUP)) != 0;
}

/// Returns whether a write would not wait for a reader.
bool canWrite(int file) {
    pollfd output{file, POLLOUT, 0};
    return poll(&output, 1, 0) > 0 && (output.revents & POLLOUT) != 0;
}

/// Ends the process by a signal, so that shells see it.
void raiseAgain(int signal) {
    std::signal(signal, SIG_DFL);
    std::raise(signal);
}

/// Says that memory is short, when even a message would take some.
int complainWithoutMemory() {
    writeError("not enough memory");
    return int(shadowdag::ErrorKind::kResource);
}

std::terminate_handler terminateBefore = nullptr; ///< the C++ library's

#if !defined(SDAG_SANITIZED) // whose own memory is not yet set up before libraries are
/// Ends the process when a library starts threads or takes memory in its initializers, before main
/// can catch anything, and gets none.
[[noreturn]] void onTerminateBeforeMain() {
    try {
        if (std::current_exception())
            throw;
    } catch (const std::bad_alloc&) {
        _exit(complainWithoutMemory());
    } catch (const std::system_error&) {
        writeError("the system refuses a thread or memory before the program begins; raise the "
                   "limits of the shell (ulimit -u, ulimit -v)");
        _exit(int(shadowdag::ErrorKind::kResource));
    } catch (...) {
    }
    terminateBefore();
    std::abort();
}

/// Raises a limit of the stack, of this thread and of those that are started, to the usual 8 MiB;
/// ends the process where it stays below 2 MiB, the size of a thread's stack in glibc without a
/// limit.
void takeStack() {
    constexpr rlim_t kUsualBytes = rlim_t(8) << 20, kLeastBytes = rlim_t(2) << 20;
    rlimit limit{};
    if (getrlimit(RLIMIT_STACK, &limit) != 0 || limit.rlim_cur >= kUsualBytes)
        return;
    limit.rlim_cur = std::min(limit.rlim_max, kUsualBytes);
    if (limit.rlim_cur < kLeastBytes) {
        writeError("the stack is limited to less than the 2 MiB that the program needs; raise the "
                   "limit of the shell (ulimit -s 8192)");
        _exit(int(shadowdag::ErrorKind::kResource));
    }
    setrlimit(RLIMIT_STACK, &limit);
    pthread_attr_t thread; // glibc took its default size before the limit was raised
    pthread_attr_init(&thread);
    pthread_attr_setstacksize(&thread, limit.rlim_cur);
    pthread_setattr_default_np(&thread);
    pthread_attr_destroy(&thread);
}

void beforeLibraries() {
    terminateBefore = std::set_terminate(onTerminateBeforeMain);
    takeStack();
}

/// The dynamic linker calls the functions of this section before the initializers of libraries.
__attribute__((section(".preinit_array"), used)) void (*const kBeforeLibraries)() = beforeLibraries;
#endif

/// Ends the process when memory or threads run out where no exception may leave: in the destructors
/// of JSON values, which allocate, in oneTBB's workers, and in Embree while it gives up a scene
/// that it could not build.
[[noreturn]] void onTerminate() {
    try {
        if (std::current_exception())
            throw;
        if (std::uncaught_exceptions() > 0) { // whose type is unknown here
            shadowdag::removeUnfinishedFiles();
            writeError("cannot clean up after another error, as happens where memory is short");
            _exit(int(shadowdag::ErrorKind::kResource));
        }
    } catch (const std::bad_alloc&) {
        shadowdag::removeUnfinishedFiles();
        _exit(complainWithoutMemory());
    } catch (const std::exception& error) {
        const shadowdag::ExitMessage exit = shadowdag::exitMessageOf(error);
        if (exit.status == int(shadowdag::ErrorKind::kResource)) {
            shadowdag::removeUnfinishedFiles();
            _exit(complain(exit.message, exit.status));
        }
    } catch (...) {
    }
    terminateBefore();
    std::abort();
}

/// Puts /dev/null in place of standard streams that are closed, or the next file that is opened
/// would get their text. As before, it is an error to read from or to write to them. Returns
/// whether standard output was closed.
bool holdStandardStreams() {
    bool isClosed = false;
    for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
        if (fcntl(stream, F_GETFD) < 0) { // the lowest number that is free is taken
            static_cast<void>(open("/dev/null", stream == STDIN_FILENO ? O_WRONLY : O_RDONLY));
            isClosed = isClosed || stream == STDOUT_FILENO;
        }
    return isClosed;
}

/// Runs the command. Throws only what its own messages throw.
int runProgram(int argc, char** argv, bool hasNoOutput) {
    using namespace shadowdag;
    // Takes no memory, which may be short.
    const auto sayFarewell = [] {
        writeError(hasFinishedParts() ? "interrupted; every file is complete or absent, and "
                                        "finished parts are kept; run the same command with "
                                        "--resume to continue"
                                      : "interrupted; every file is complete or absent");
    };
    static std::atomic_flag isEnding;
    const auto endBySignal = [&](int signal) {
        while (isEnding.test_and_set()) // the other thread ends the process
            pause();
        std::cout << std::flush;
        sayFarewell();
        raiseAgain(signal);
    };
    try {
        catchInterrupts([sayFarewell](int signal) {
            removeUnfinishedFiles();
            // The main thread may be blocked in a write; then no message is written.
            if (!isEnding.test_and_set() && canWrite(STDERR_FILENO))
                sayFarewell();
            raiseAgain(signal);
        });
        setGlPoll(checkInterrupted);
        setCpuPoll(pollLoops);
        setWarningListener([](const std::string& text) { Console(true).note("warning: " + text); });
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
        program.command("rays", "Write a frame's pairs for other tracers, and score their answers",
                        declareRays);
        program.command("diff", "Show what changed between two results, beyond their spread",
                        declareDiff);
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
        if (!std::cout.flush() && isOutputClosed())
            return asksForHelp(argc, argv)
                       ? 0 // the reader has seen as much as it wanted
                       : complain("standard output was closed before all was written; read it to "
                                  "its end",
                                  int(ErrorKind::kResource));
        if (!std::cout)
            return complain(
                hasNoOutput ? "standard output is closed; open it, for example as >/dev/null"
                            : "standard output cannot be written; is the disk full, or the size "
                              "of files limited (ulimit -f)?",
                int(ErrorKind::kResource));
        return 0;
    } catch (const Interrupted& interrupted) {
        endBySignal(interrupted.signal);
    } catch (const NotHeld& notHeld) {
        return complain(notHeld.what(), NotHeld::kExitStatus);
    } catch (const std::exception& error) {
        if (isInterrupted()) // a call that the signal ended has failed
            endBySignal(caughtSignal());
        ExitMessage exit = exitMessageOf(error);
        if (exit.status == int(ErrorKind::kResource) && hasFinishedParts())
            exit.message +=
                "; finished parts are kept; once this is fixed, run the same command with --resume "
                "to continue";
        return complain(exit.message, exit.status);
    }
    return 1;
}

} // namespace

int main(int argc, char** argv) {
    const std::terminate_handler before = std::set_terminate(onTerminate);
    if (!terminateBefore)
        terminateBefore = before;
    const bool hasNoOutput = holdStandardStreams();
    try {
        return runProgram(argc, argv, hasNoOutput);
    } catch (const std::bad_alloc&) {
        return complainWithoutMemory();
    }
}
