// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/program/end_by_signal.h"

#include <gtest/gtest.h>

#include <cstdio>

namespace shadowdag {
namespace {

/// Processes that always want a core, three for each. They are no descendants of this one.
class BusyMachine {
public:
    BusyMachine() {
        FILE* const pipe =
            popen("for i in $(seq $((3 * $(nproc)))); do "
                  "timeout 60 sh -c 'while :; do :; done' >/dev/null 2>&1 & echo $!; done",
                  "r");
        for (int process = 0; std::fscanf(pipe, "%d", &process) == 1;)
            processes_.push_back(process);
        pclose(pipe);
    }
    ~BusyMachine() {
        for (const pid_t process : processes_)
            kill(process, SIGTERM);
    }
    BusyMachine(const BusyMachine&) = delete;
    BusyMachine& operator=(const BusyMachine&) = delete;

private:
    std::vector<pid_t> processes_;
};

/// Returns the end of a shell that runs `before`, then sleeps, and `after` upon a signal.
test::EndBySignal endOfShell(const std::string& before, const std::string& after) {
    const std::string script =
        before + "\ntrap '" + after + "; exit 5' TERM; while :; do sleep 0.02; done";
    const char* const words[] = {"/bin/bash", "-c", script.c_str(), nullptr};
    pid_t child = -1;
    posix_spawn(&child, words[0], nullptr, nullptr, const_cast<char**>(words), environ);
    std::this_thread::sleep_for(std::chrono::milliseconds(500));
    return test::endBySignal(child, SIGTERM);
}

TEST(EndBySignal, OnBusyMachinesASleepCountsInFull) {
    const BusyMachine busy;
    const test::EndBySignal end = endOfShell("", "sleep 0.8");
    EXPECT_EQ(end.status, 5);
    EXPECT_GT(end.seconds, 0.7) << end;
    EXPECT_LE(end.seconds, end.wallSeconds);
}

TEST(EndBySignal, OnBusyMachinesTimeWithoutACoreDoesNotCount) {
    const BusyMachine busy;
    const test::EndBySignal end = endOfShell("", "for ((i = 0; i < 100000; ++i)); do :; done");
    EXPECT_EQ(end.status, 5);
    EXPECT_GT(end.seconds, 0.02) << end;
    EXPECT_LT(end.seconds, 0.7 * end.wallSeconds) << end;
}

// A machine that is not idle only because of what is measured excuses nothing.
TEST(EndBySignal, TimeThatItTakesFromItselfCounts) {
    const test::EndBySignal end =
        endOfShell("for i in $(seq $((3 * $(nproc)))); do while :; do :; done & done",
                   "sleep 0.8; kill $(jobs -p)");
    EXPECT_EQ(end.status, 5);
    EXPECT_GT(end.wallSeconds, 0.75);
    EXPECT_GE(end.seconds, end.wallSeconds - end.otherSeconds) << end;
}

} // namespace
} // namespace shadowdag
