// SPDX-License-Identifier: Apache-2.0
#include "cuda/timer.h"

#include "cuda/error.h"

#include <gtest/gtest.h>

#include <stdexcept>
#include <thread>

namespace shadowdag {
namespace {

TEST(StageTimes, KeepTheOrderOfFirstEndsAndAddUp) {
    StageTimes times;
    times.add("cull", 1.5);
    times.add("rasterize", 2.0);
    times.add("cull", 0.5);
    ASSERT_EQ(times.stagesMs.size(), 2u);
    EXPECT_EQ(times.stagesMs[0], std::make_pair(std::string("cull"), 2.0));
    EXPECT_EQ(times.stagesMs[1], std::make_pair(std::string("rasterize"), 2.0));
    EXPECT_EQ(times.totalMs(), 4.0);
}

TEST(StageTimer, MeasuresAtLeastWhatPassed) {
    StageTimes times;
    {
        const StageTimer timer(Backend::kCpu, times, "sleep");
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    ASSERT_EQ(times.stagesMs.size(), 1u);
    EXPECT_GE(times.stagesMs[0].second, 20.0);
    EXPECT_LT(times.stagesMs[0].second, 20'000.0); // milliseconds, not microseconds
}

int waitCount = 0;

void failSecondWait(Backend) {
    if (++waitCount == 2)
        throw Error(ErrorKind::kDevice, "a kernel failed");
}

TEST(StageTimer, FailureWithinTheStageIsThrownAndAddsNoTime) {
    StageTimes times;
    waitCount = 0;
    EXPECT_THROW({ const StageTimer timer(Backend::kCpu, times, "draw", failSecondWait); }, Error);
    EXPECT_EQ(waitCount, 2);
    EXPECT_TRUE(times.stagesMs.empty());
}

TEST(StageTimer, LetsAnotherExceptionPass) {
    StageTimes times;
    waitCount = 0;
    try {
        const StageTimer timer(Backend::kCpu, times, "draw", failSecondWait);
        throw std::logic_error("first");
    } catch (const std::logic_error&) {
    }
    EXPECT_EQ(waitCount, 1);
    EXPECT_TRUE(times.stagesMs.empty());
}

} // namespace
} // namespace shadowdag
