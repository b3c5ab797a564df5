// SPDX-License-Identifier: Apache-2.0
// Progress where standard error is no terminal, and its estimate.
#include "tools/settings/console.h"

#include "cuda/cancel.h"
#include "cuda/parallel_for.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <thread>

namespace shadowdag {

namespace {

using testing::ContainsRegex;
using testing::HasSubstr;
using testing::Not;

constexpr double kEveryHalfSecond = 0.5;

void sleepMs(int ms) {
    std::this_thread::sleep_for(std::chrono::milliseconds(ms));
}

} // namespace

TEST(Console, ProgressIsPlainLinesWithAnEstimateWhereThereIsNoTerminal) {
    testing::internal::CaptureStderr();
    {
        const Progress progress = Console(false, kEveryHalfSecond).progress("work");
        progress(0.0);
        sleepMs(700);
        progress(0.25);
        sleepMs(900);
        progress(1.0);
    }
    const std::string said = testing::internal::GetCapturedStderr();
    EXPECT_THAT(said, ContainsRegex("work: 25 %, 1 s, about [34] s left\n"));
    EXPECT_THAT(said, Not(HasSubstr("\033")));
}

TEST(Console, ShortWorkShowsNoProgress) {
    testing::internal::CaptureStderr();
    {
        const Progress progress = Console(false, kEveryHalfSecond).progress("work");
        progress(0.5);
        sleepMs(600);
        progress(1.0);
        sleepMs(700);
    }
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

// Steps of a second and more, each shorter than the interval, are not silent for longer than it.
TEST(Console, ManyShortStepsShowAsOneLongOneDoes) {
    testing::internal::CaptureStderr();
    const Console console(false, 2.0);
    for (const char* name : {"one", "two", "three"}) {
        const Progress progress = console.progress(name);
        progress(0.5);
        sleepMs(1300);
    }
    EXPECT_THAT(testing::internal::GetCapturedStderr(), ContainsRegex("(two|three): 50 %, 1 s\n"));
}

TEST(Console, AStepShowsTheProgressOfTheLoopThatRuns) {
    testing::internal::CaptureStderr();
    setCpuPoll(pollLoops);
    {
        const std::shared_ptr<void> step = Console(false, kEveryHalfSecond).step("judging");
        cpuParallelRanges(8, 1, [](size_t, size_t) { sleepMs(200 * threadCount()); });
    }
    setCpuPoll(nullptr);
    EXPECT_THAT(testing::internal::GetCapturedStderr(),
                ContainsRegex("judging: [5-9][0-9] %, 1 s"));
}

} // namespace shadowdag
