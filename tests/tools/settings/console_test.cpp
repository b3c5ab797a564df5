// SPDX-License-Identifier: Apache-2.0
// Progress where standard error is no terminal, and its estimate.
#include "tools/settings/console.h"

#include "cuda/cancel.h"
#include "cuda/parallel_for.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cstdio>
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
    const size_t line = said.find("work: 25 %");
    ASSERT_NE(line, std::string::npos) << said;
    int elapsedS = 0, leftS = 0;
    ASSERT_EQ(
        std::sscanf(said.c_str() + line, "work: 25 %%, %d s, about %d s left\n", &elapsedS, &leftS),
        2)
        << said;
    EXPECT_GE(elapsedS, 1);
    EXPECT_NEAR(leftS, 3 * elapsedS, 2) << "both are rounded";
    EXPECT_THAT(said, Not(HasSubstr("\033")));
}

TEST(Console, ShortWorkShowsNoProgress) {
    testing::internal::CaptureStderr();
    {
        const Progress progress = Console(false, kEveryHalfSecond).progress("work");
        progress(0.5);
        sleepMs(200);
        progress(1.0);
        sleepMs(1100);
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
        sleepMs(1600);
    }
    EXPECT_THAT(testing::internal::GetCapturedStderr(),
                ContainsRegex("(one|two|three): 50 %, [1-9] s\n"));
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
                ContainsRegex("judging: [5-9][0-9] %, [1-9] s"));
}

} // namespace shadowdag
