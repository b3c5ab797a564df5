// SPDX-License-Identifier: Apache-2.0
// Signals at seeded moments in every subcommand: it ends soon, by that signal, and leaves nothing
// half-written.
#include "cuda/error.h"
#include "tests/faults/fault_runner.h"
#include "tests/tools/program/end_by_signal.h"
#include "tests/tools/window/x_display.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <iostream>
#include <iterator>
#include <optional>
#include <thread>

namespace shadowdag {
namespace {

using test::EndBySignal;
using test::endBySignal;

/// Promised of an idle machine (docs/user_guide.md).
constexpr double kPromisedSeconds = 0.5;

constexpr const char* kResults = SDAG_SOURCE_DIR "/tests/bench/results/compare-atrium.json";

/// Every subcommand.
const std::vector<Arguments> kCommands = {
    {"scene", "necropolis", "-o", "out.glb"},
    {"voxelize", "builtin:atrium", "-o", "out.svdag", "--resolution", "4096"},
    {"voxelize", "builtin:atrium", "-o", "out.svdag", "--resolution", "4096", "--resume",
     "--checkpoint", "0.05"},
    {"merge", "1.svpart", "2.svpart", "-o", "out.svdag"},
    {"info", "builtin:necropolis", "--lights", "1000"},
    {"export", "in.svdag", "-o", "out.vdb"},
    {"import", "in.nvdb", "-o", "out.svdag"},
    {"render", "builtin:atrium", "-o", "out.png", "--size", "960x540"},
    {"validate", "builtin:atrium", "--size", "640x360"},
    {"compare", "builtin:atrium", "-o", "out", "--size", "320x180", "--no-charts"},
    {"study", "failures", "-o", "out"},
    {"calibrate", "builtin:atrium", "-o", "out.json", "--quick"},
    {"fit", "builtin:atrium", "-o", "out.json", "--max", "0.01", "--no-charts"},
    {"bench", "raster", "builtin:atrium"},
    {"rays", "builtin:atrium", "-o", "out.rays", "--size", "640x360"},
    {"figures", "in.json", "-o", "out"},
    {"diff", kResults, kResults},
    {"view", "builtin:atrium", "--resolution", "256"},
    {"merge", "1.svpart", "2.svpart", "-o", "out.svdag", "--memory-limit", "1G"},
};

/// Those that end every subcommand.
constexpr int kSignals[] = {SIGINT, SIGTERM, SIGHUP, SIGPIPE, SIGXCPU};

/// Returns whether a command keeps its folder for unfinished work.
bool isResumed(const Arguments& arguments) {
    return std::find(arguments.begin(), arguments.end(), "--resume") != arguments.end();
}

/// For signals whose default is a core dump, which takes time and space.
void forbidCoreDumps() {
    rlimit limit{};
    getrlimit(RLIMIT_CORE, &limit);
    limit.rlim_cur = 0;
    setrlimit(RLIMIT_CORE, &limit);
}

/// The files that these leave when they come to their end.
const std::vector<std::string> kOutputs = {
    "out.glb",  "out.svdag",        "out.vdb",           "out.png",        "out.json",
    "out.rays", "out/results.json", "out/failures.json", "out/charts.json"};

/// Removes what the commands write.
void removeOutputs(const TemporaryDirectory& directory) {
    for (const auto& entry : std::filesystem::directory_iterator(directory.path()))
        if (entry.path().filename().string().starts_with("out"))
            std::filesystem::remove_all(entry.path());
}

/// Gives names of files the folder.
Arguments inFolder(const TemporaryDirectory& directory, Arguments words) {
    for (std::string& word : words)
        if (word == "out" || word.find(".sv") != std::string::npos ||
            word.find(".nv") != std::string::npos || word.starts_with("out.") ||
            word.starts_with("in."))
            word = directory / word;
    return words;
}

/// Makes the files that a command reads; returns its arguments.
Arguments prepared(const TemporaryDirectory& directory, const Arguments& arguments) {
    const auto run = [&](Arguments words, const Arguments& more) {
        words.insert(words.end(), more.begin(), more.end());
        EXPECT_EQ(runShadowdag(directory, inFolder(directory, words)).status, 0);
    };
    const Arguments build = {"voxelize", "builtin:atrium", "--resolution", "1024", "-o"};
    if (arguments[0] == "merge")
        for (const char* part : {"1", "2"})
            run(build, {part + std::string(".svpart"), "--part", part + std::string("/2")});
    if (arguments[0] == "export" || arguments[0] == "import")
        run(build, {"in.svdag"});
    if (arguments[0] == "import")
        run({"export", "in.svdag", "-o", "in.nvdb"}, {});
    if (arguments[0] == "figures")
        test::makeSequence(directory / "in.json", {"RT", "PMCD"});
    return inFolder(directory, arguments);
}

/// Signals come this soon after the start at the latest.
constexpr double kLatestSeconds = 1.2;

/// Runs a command, but no longer than signals take to come. Returns how long it ran.
double runForAWhile(const TemporaryDirectory& directory, const Arguments& arguments) {
    using Clock = std::chrono::steady_clock;
    const pid_t child =
        startProgram(directory, arguments, directory / "stdout", directory / "stderr");
    const Clock::time_point begin = Clock::now();
    const auto seconds = [&] {
        return std::chrono::duration<double>(Clock::now() - begin).count();
    };
    siginfo_t ended{};
    while (seconds() < kLatestSeconds && ended.si_pid == 0) {
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
        waitid(P_PID, id_t(child), &ended, WEXITED | WNOHANG | WNOWAIT);
    }
    const double result = seconds();
    kill(child, SIGTERM);
    waitForProgram(child);
    return result;
}

/// Expects that the files that a command left are whole: the signal came between their last byte
/// and the end of the process. JSON is, if it can be read; of others a whole run tells the size.
void expectWhole(const TemporaryDirectory& directory, const Arguments& arguments) {
    for (const std::string& name : kOutputs) {
        const std::string output = directory / name;
        if (!std::filesystem::exists(output))
            continue;
        if (name.ends_with(".json")) {
            EXPECT_TRUE(Json::accept(readText(output))) << name;
            continue;
        }
        const uintmax_t size = std::filesystem::file_size(output);
        EXPECT_EQ(runShadowdag(directory, arguments).status, 0);
        EXPECT_EQ(size, std::filesystem::file_size(output)) << name;
    }
}

/// A signal is sent again, sooner, if a command was done before it came.
constexpr int kMostTries = 10;

class Signals : public testing::TestWithParam<size_t> {
protected:
    TemporaryDirectory directory_;
};

TEST_P(Signals, EndItSoonAndLeaveNothingHalf) {
    const uint64_t seed = test::faultSeed();
    test::Random random(seed);
    double worst = 0;
    for (const int signal : kSignals) // a parent may ignore them
        std::signal(signal, SIG_DFL);
    forbidCoreDumps();
    std::cout << "seed " << seed << std::endl;
    const Arguments arguments = prepared(directory_, kCommands[GetParam()]);
    std::optional<XDisplay> display;
    if (arguments[0] == "view") {
        display.emplace(640, 360);
        if (!display->isThere())
            GTEST_SKIP() << display->whyNot();
        setenv("DISPLAY", display->name().c_str(), 1);
    }
    double span = runForAWhile(directory_, arguments);
    removeOutputs(directory_);
    size_t count = 0;
    for (size_t round = 0; round < test::faultRounds(); ++round)
        for (const int signal : kSignals) {
            int status = 0;
            for (int i = 0; i < kMostTries && status == 0; ++i) {
                const double moment = span * random();
                SCOPED_TRACE(std::to_string(signal) + " after " + std::to_string(moment) + " s");
                const pid_t child = startProgram(directory_, arguments, directory_ / "stdout",
                                                 directory_ / "stderr");
                std::this_thread::sleep_for(std::chrono::duration<double>(moment));
                const EndBySignal end = endBySignal(child, signal);
                status = end.status;
                worst = std::max(worst, end.seconds);
                // What was done before ends with its own status.
                EXPECT_THAT(status, testing::AnyOf(128 + signal, 0))
                    << readText(directory_ / "stderr");
                EXPECT_LT(end.seconds, kPromisedSeconds) << end;
                EXPECT_EQ(test::unfinishedFiles(directory_.path()), "");
                if (!isResumed(arguments)) {
                    EXPECT_FALSE(std::filesystem::exists(directory_ / "out.svdag.scratch"));
                }
                if (status == 0)
                    span = std::min(span, moment);
                else
                    expectWhole(directory_, arguments);
                removeOutputs(directory_);
                ++count;
            }
            EXPECT_NE(status, 0) << "every signal came too late, the last within " << span << " s";
        }
    std::cout << "ended within " << worst << " s" << std::endl;
    test::recordFaults(count, seed);
}

INSTANTIATE_TEST_SUITE_P(Command, Signals, testing::Range(size_t(0), kCommands.size()),
                         [](const auto& info) {
                             return kCommands[info.param][0] + std::to_string(info.param);
                         });

/// Commands with --json and what they write, for runs of about a second.
const std::vector<std::pair<Arguments, std::string>> kWritersOfJson = {
    {{"compare", "builtin:fail-mover", "-o", "out", "--size", "64x36", "--methods", "dag,maps",
      "--repeats", "1", "--warmups", "0", "--no-charts", "--resolution", "64", "--believe", "all",
      "--json"},
     "out/results.json"},
    {{"study", "failures", "--only", "acne", "-o", "out", "--json"}, "out/failures.json"},
    {{"render", "builtin:fail-mover", "-o", "out.png", "--size", "320x180", "--resolution", "64",
      "--json"},
     "out.png"},
};

// The work goes on to its end: the files are whole, and the status says that the text is not.
TEST(Signals, OutputClosedAtAnyMomentIsReportedAndTheFilesAreWhole) {
    const TemporaryDirectory directory;
    const uint64_t seed = test::faultSeed();
    test::Random random(seed);
    std::cout << "seed " << seed << std::endl;
    int refusedCount = 0;
    for (const auto& [command, output] : kWritersOfJson)
        for (size_t round = 0; round < 2 * test::faultRounds(); ++round) {
            const double moment = round == 0 ? 0 : 0.8 * random();
            SCOPED_TRACE(command[0] + ", closed after " + std::to_string(moment) + " s");
            const std::string pipe = directory / "pipe";
            ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
            const int reader = open(pipe.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
            const pid_t child =
                startProgram(directory, inFolder(directory, command), pipe, directory / "stderr");
            std::this_thread::sleep_for(std::chrono::duration<double>(moment));
            close(reader);
            const int status = waitForProgram(child);
            const std::string message = readText(directory / "stderr");
            EXPECT_THAT(status, testing::AnyOf(0, int(ErrorKind::kResource))) << message;
            if (status != 0) {
                EXPECT_THAT(message, testing::HasSubstr("standard output was closed before all"));
                ++refusedCount;
            }
            EXPECT_TRUE(std::filesystem::exists(directory / output)) << output;
            EXPECT_EQ(test::unfinishedFiles(directory.path()), "");
            std::filesystem::remove(pipe);
            removeOutputs(directory);
        }
    EXPECT_GT(refusedCount, 0);
    test::recordFaults(kWritersOfJson.size() * 2 * test::faultRounds(), seed);
}

// A reader that does not read, such as a pager or a stopped process: the program waits for it, but
// not when it is told to end.
TEST(Signals, TheyEndItSoonIfNobodyReadsItsOutput) {
    for (const bool isError : {false, true}) {
        const TemporaryDirectory directory;
        const std::string pipe = directory / "pipe";
        ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
        const int reader = open(pipe.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
        const std::string page(4096, '-');
        while (write(reader, page.data(), page.size()) > 0) {
        }
        const pid_t child = startProgram(
            directory, inFolder(directory, {"render", "builtin:atrium", "-o", "out.png"}),
            isError ? directory / "stdout" : pipe, isError ? pipe : directory / "stderr");
        std::this_thread::sleep_for(std::chrono::milliseconds(300));
        const EndBySignal end = endBySignal(child, SIGTERM);
        EXPECT_EQ(end.status, 128 + SIGTERM) << (isError ? "standard error" : "standard output");
        EXPECT_LT(end.seconds, kPromisedSeconds) << end;
        EXPECT_EQ(test::unfinishedFiles(directory.path()), "");
        close(reader);
    }
}

/// Starts a command on a disk that does not answer for ten seconds once a file was written; returns
/// when it waits for it. A file that is not finished does not say so: commands also make and remove
/// one to see whether they may write.
/// @param fault the call that waits (fault_library.cpp)
pid_t startOnSlowDisk(const TemporaryDirectory& directory, const Arguments& command,
                      const std::string& fault = "fsync:1~") {
    const std::string waits = directory / "waits";
    const pid_t child = startProgram(directory, prepared(directory, command), directory / "stdout",
                                     directory / "stderr",
                                     {"/usr/bin/env", "LD_PRELOAD=" SDAG_FAULT_LIBRARY,
                                      "SDAG_FAULT=" + fault, "SDAG_FAULT_WAITS=" + waits});
    for (int i = 0; i < 1000 && !std::filesystem::exists(waits); ++i)
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
    EXPECT_TRUE(std::filesystem::remove(waits)) << command[0];
    return child;
}

const Arguments kImport = {"import", "in.nvdb", "-o", "out.svdag"},
                kScene = {"scene", "atrium", "-o", "out.glb"};

TEST(Signals, TheyEndItSoonWhileFsyncWaits) {
    const Arguments build = {"voxelize", "builtin:atrium", "-o", "out.svdag", "--resolution",
                             "256",      "--memory-limit", "1G"};
    Arguments resumed = build, merge = kCommands.back();
    resumed.push_back("--resume");
    for (const Arguments& command : {build, resumed, merge, kImport, kScene})
        for (const int signal : {SIGTERM, SIGINT}) {
            SCOPED_TRACE(command[0]);
            const TemporaryDirectory directory;
            const pid_t child = startOnSlowDisk(directory, command);
            const EndBySignal end = endBySignal(child, signal);
            EXPECT_EQ(end.status, 128 + signal) << readText(directory / "stderr");
            EXPECT_LT(end.seconds, kPromisedSeconds) << end;
            EXPECT_EQ(test::unfinishedFiles(directory.path()), "");
            EXPECT_EQ(std::filesystem::exists(directory / "out.svdag.scratch"), isResumed(command));
        }
}

// It cannot remove its files, as it does not know whether they are renamed yet.
TEST(Signals, TheyEndItSoonWhileRenameWaits) {
    for (const Arguments& command : {kImport, kScene}) {
        SCOPED_TRACE(command[0]);
        const TemporaryDirectory directory;
        const pid_t child = startOnSlowDisk(directory, command, "rename:1~");
        const EndBySignal end = endBySignal(child, SIGTERM);
        EXPECT_EQ(end.status, 128 + SIGTERM) << readText(directory / "stderr");
        EXPECT_LT(end.seconds, kPromisedSeconds) << end;
        EXPECT_EQ(runShadowdag(directory, inFolder(directory, command)).status, 0);
        EXPECT_EQ(test::unfinishedFiles(directory.path()), "");
    }
}

// As where the reader waits for a disk, which SIGKILL does not end.
TEST(Signals, ItDoesNotWaitForAReaderThatDoesNotEnd) {
    const TemporaryDirectory directory;
    const pid_t child = startProgram(
        directory, prepared(directory, kImport), directory / "stdout", directory / "stderr",
        {"/usr/bin/env", "LD_PRELOAD=" SDAG_FAULT_LIBRARY, "SDAG_FAULT=waitpid:1+"});
    pid_t reader = 0;
    for (int i = 0; i < 1000 && reader == 0; ++i)
        for (const pid_t process : test::descendants())
            if (process != child)
                reader = process;
    ASSERT_GT(reader, 0);
    kill(reader, SIGSTOP); // so that it does not end by SIGTERM
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    const EndBySignal end = endBySignal(child, SIGTERM);
    EXPECT_EQ(end.status, 128 + SIGTERM) << readText(directory / "stderr");
    EXPECT_LT(end.seconds, kPromisedSeconds) << end;
}

TEST(Signals, SigquitEndsItAtOnceAndTheNextRunRemovesItsFile) {
    const TemporaryDirectory directory;
    std::signal(SIGQUIT, SIG_DFL);
    forbidCoreDumps();
    const pid_t child = startOnSlowDisk(directory, kScene);
    const EndBySignal end = endBySignal(child, SIGQUIT);
    EXPECT_EQ(end.status, 128 + SIGQUIT);
    EXPECT_LT(end.seconds, kPromisedSeconds) << end;
    EXPECT_NE(test::unfinishedFiles(directory.path()), "");
    EXPECT_EQ(runShadowdag(directory, inFolder(directory, kScene)).status, 0);
    EXPECT_EQ(test::unfinishedFiles(directory.path()), "");
}

// As nohup, shells with background jobs and parents of daemons set it.
TEST(Signals, ThoseIgnoredAtTheStartStayIgnored) {
    for (const int signal : {SIGHUP, SIGPIPE, SIGINT, SIGTERM}) {
        SCOPED_TRACE(signal);
        const TemporaryDirectory directory;
        const pid_t child =
            startProgram(directory, inFolder(directory, kCommands[1]), directory / "stdout",
                         directory / "stderr",
                         {"/bin/bash", "-c", "trap '' HUP PIPE INT TERM; exec \"$@\"", "bash"});
        // The shell has set its traps once it has become the program.
        while (std::filesystem::read_symlink("/proc/" + std::to_string(child) + "/exe") !=
               std::filesystem::canonical(SDAG_PROGRAM))
            std::this_thread::sleep_for(std::chrono::milliseconds(5));
        std::this_thread::sleep_for(std::chrono::milliseconds(300));
        kill(child, signal);
        std::this_thread::sleep_for(std::chrono::milliseconds(600));
        siginfo_t ended{};
        waitid(P_PID, id_t(child), &ended, WEXITED | WNOHANG | WNOWAIT);
        EXPECT_EQ(ended.si_pid, 0);
        kill(child, SIGXCPU); // which is not ignored
        EXPECT_EQ(waitForProgram(child), 128 + SIGXCPU) << readText(directory / "stderr");
    }
}

TEST(Signals, AKilledImportEndsTheProcessThatReads) {
    const TemporaryDirectory directory;
    prctl(PR_SET_CHILD_SUBREAPER, 1);
    const pid_t child = startOnSlowDisk(directory, kImport);
    const auto begin = std::chrono::steady_clock::now();
    kill(child, SIGKILL);
    waitForProgram(child);
    EXPECT_GT(waitpid(-1, nullptr, 0), 0); // the one that reads
    EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(5));
    EXPECT_EQ(runShadowdag(directory, inFolder(directory, kImport)).status, 0);
    EXPECT_EQ(test::unfinishedFiles(directory.path()), "");
}

// A reader that leaves early, as `head` does.
TEST(Signals, APipeThatIsClosedIsReported) {
    const TemporaryDirectory directory;
    const ProgramResult result =
        runShadowdag(directory, {"info", "builtin:atrium"},
                     {"/bin/sh", "-c", "\"$@\" | :; exec \"$@\" >&-", "sh"});
    EXPECT_EQ(result.status, 3);
    EXPECT_THAT(result.err, testing::HasSubstr("standard output"));
}

TEST(Signals, AFullDiskUnderStandardOutputIsReported) {
    const TemporaryDirectory directory;
    for (const Arguments& command :
         {Arguments{"info", "builtin:fail-wires"}, Arguments{"diff", kResults, kResults}}) {
        const ProgramResult result =
            runShadowdag(directory, command, {"/bin/sh", "-c", "exec \"$@\" >/dev/full", "sh"});
        EXPECT_EQ(result.status, 3) << command[0];
        EXPECT_THAT(result.err, testing::HasSubstr("standard output"));
    }
}

TEST(Signals, ALimitOfTheSizeOfFilesIsReportedAndLeavesNothing) {
    const TemporaryDirectory directory;
    const Arguments build = {"voxelize", "builtin:fail-wires", "-o", directory / "in.svdag"};
    ASSERT_EQ(runShadowdag(directory, build).status, 0);
    const Arguments commands[] = {
        {"scene", "atrium", "-o", "out.glb"},
        {"voxelize", "builtin:atrium", "-o", "out.svdag", "--memory-limit", "1G"},
        {"export", "in.svdag", "-o", "out.vdb"},
        {"export", "in.svdag", "-o", "out.nvdb"},
        {"render", "builtin:atrium", "-o", "out.png"},
        {"render", "builtin:atrium", "-o", "out.exr"},
        {"rays", "builtin:atrium", "-o", "out.rays"},
        {"compare", "builtin:atrium", "-o", "out", "--no-charts"}};
    for (const Arguments& command : commands) {
        const ProgramResult result =
            runShadowdag(directory, inFolder(directory, command),
                         {"/bin/bash", "-c", "ulimit -f 1; exec \"$@\"", "bash"});
        EXPECT_EQ(result.status, 3) << command[0];
        EXPECT_THAT(result.err, testing::HasSubstr(directory / "out")) << command[0];
        EXPECT_THAT(result.err, testing::HasSubstr("(ulimit -f)")) << command[0];
        EXPECT_THAT(result.err, testing::Not(testing::HasSubstr("disk"))) << command[0];
        EXPECT_FALSE(std::filesystem::exists(directory / command[3])) << command[0];
        EXPECT_EQ(test::unfinishedFiles(directory.path()), "");
    }
}

TEST(Signals, AReaderThatHasSeenEnoughOfHelpIsNoError) {
    const TemporaryDirectory directory;
    const Arguments intoClosedPipe = {"/bin/bash", "-c",
                                      "set -o pipefail; (sleep 0.3; exec \"$@\") | :", "bash"};
    for (const char* word : {"--help", "--version"})
        EXPECT_EQ(runShadowdag(directory, {word}, intoClosedPipe).status, 0) << word;
    EXPECT_EQ(runShadowdag(directory, {"info", "builtin:fail-wires"}, intoClosedPipe).status, 3);
}

} // namespace
} // namespace shadowdag
