// SPDX-License-Identifier: Apache-2.0
#include "cuda/timer.h"

#include <gtest/gtest.h>

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

} // namespace
} // namespace shadowdag
