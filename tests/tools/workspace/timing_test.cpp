// SPDX-License-Identifier: Apache-2.0
// Measuring times: the order of runs, the counted runs, the statistics.
#include "tools/workspace/timing.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <thread>

namespace shadowdag {

using testing::ElementsAre;

TEST(Timing, EveryRoundBeginsWithAnotherConfiguration) {
    std::vector<size_t> order;
    timeInTurn(3, 1, 2, [&](size_t i) {
        order.push_back(i);
        return StageTimes{};
    });
    EXPECT_THAT(order, ElementsAre(0, 1, 2, 1, 2, 0, 2, 0, 1));
}

TEST(Timing, WarmUpsAreNotCounted) {
    double next = 100;
    const std::vector<Timing> timings = timeInTurn(1, 1, 3, [&](size_t) {
        StageTimes stages;
        stages.add("work", next);
        next = next == 100 ? 3 : next - 1;
        return stages;
    });
    ASSERT_EQ(timings.size(), 1u);
    EXPECT_THAT(timings[0].totalMs, ElementsAre(3, 2, 1));
    const Json json = timings[0].toJson();
    EXPECT_EQ(json["time_ms"], 2.0);
    EXPECT_EQ(json["time_ms_min"], 1.0);
    EXPECT_EQ(json["time_ms_max"], 3.0);
    EXPECT_EQ(json["repeat_count"], 3);
}

TEST(CpuUse, SeesOtherProcesses) {
    if (!std::ifstream("/proc/stat"))
        GTEST_SKIP() << "the system has no /proc/stat";
    const CpuUse use;
    EXPECT_EQ(use.otherShare(), 0.0) << "half a second has not passed";
    ASSERT_EQ(std::system("timeout 1 sh -c 'while :; do :; done'"), 124 << 8);
    const double share = use.otherShare();
    EXPECT_GT(share, 0.5 / std::thread::hardware_concurrency()) << "one core was busy";
    EXPECT_LE(share, 1.0);
}

TEST(CpuUse, AMachineIsBusyAboveATenth) {
    EXPECT_EQ(busyRemark(0.1), "");
    EXPECT_THAT(busyRemark(0.25),
                testing::StartsWith("other processes used 25 % of the processor"));
}

TEST(Timing, WithoutConfigurationsNothingRuns) {
    runInTurn(0, 5, [](size_t) { FAIL(); });
    EXPECT_TRUE(timeInTurn(0, 1, 1, [](size_t) { return StageTimes{}; }).empty());
}

} // namespace shadowdag
