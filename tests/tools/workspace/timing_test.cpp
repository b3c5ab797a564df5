// SPDX-License-Identifier: Apache-2.0
// Measuring times: the order of runs, the counted runs, the statistics.
#include "tools/workspace/timing.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

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
    EXPECT_EQ(json["round_times_ms"], Json({3, 2, 1}));
}

Timing timingOf(const std::vector<double>& totals) {
    Timing timing;
    for (const double total : totals) {
        StageTimes stages;
        stages.add("work", total);
        timing.add(stages);
    }
    return timing;
}

TEST(Timing, StatesTheIntervalOfTheMedianAndWhatItHolds) {
    const Json ten = timingOf({10, 1, 2, 3, 4, 5, 6, 7, 8, 9}).toJson();
    EXPECT_EQ(ten["time_ms"], 5.5);
    EXPECT_EQ(ten["time_ms_low"], 2.0);
    EXPECT_EQ(ten["time_ms_high"], 9.0);
    EXPECT_NEAR(ten["time_ms_confidence"].get<double>(), 1.0 - 22.0 / 1024.0, 1e-12);
    const Json three = timingOf({3, 1, 2}).toJson();
    EXPECT_EQ(three["time_ms_low"], 1.0);
    EXPECT_EQ(three["time_ms_high"], 3.0);
    EXPECT_NEAR(three["time_ms_confidence"].get<double>(), 0.75, 1e-12);
}

TEST(Timing, TheWallClockIsTheMedianOfTheRunsThatTookIt) {
    Timing timing;
    for (const double wallMs : {7.0, 4.0, 5.0}) {
        StageTimes stages;
        stages.add("work", 3);
        timing.add({stages, wallMs});
    }
    EXPECT_EQ(timing.toJson()["wall_ms"], 5.0);
    EXPECT_EQ(timing.toJson()["time_ms"], 3.0);
    EXPECT_FALSE(timingOf({1, 2}).toJson().contains("wall_ms"));
}

// The second round was slow for both: the ratio does not see it.
TEST(Timing, RatiosArePairedByRound) {
    const Json ratio = ratioJson("over", timingOf({2, 20, 2.2}), timingOf({1, 10, 1}));
    EXPECT_EQ(ratio["over"], 2.0);
    EXPECT_EQ(ratio["over_low"], 2.0);
    EXPECT_EQ(ratio["over_high"], 2.2);
    EXPECT_NEAR(ratio["over_confidence"].get<double>(), 0.75, 1e-12);
}

TEST(CpuUse, SeesOtherProcesses) {
    if (!std::ifstream("/proc/stat"))
        GTEST_SKIP() << "the system has no /proc/stat";
    const CpuUse use;
    EXPECT_EQ(use.otherShare(), std::nullopt) << "half a second has not passed";
    ASSERT_EQ(std::system("timeout 1 sh -c 'while :; do :; done'"), 124 << 8);
    const std::optional<double> share = use.otherShare();
    ASSERT_TRUE(share.has_value());
    EXPECT_GT(*share, 0.5 / std::thread::hardware_concurrency()) << "one core was busy";
    EXPECT_LE(*share, 1.0);
}

TEST(CpuUse, WhatOthersDoOnIdleCoresTakesNothing) {
    // Two seconds on two cores: one other process uses one of them all the time.
    EXPECT_EQ(shareOfOthers(2, 2, 2, 1), 0.0) << "on the core that this run leaves idle";
    EXPECT_EQ(shareOfOthers(2, 2, 2, 2), 0.5);
    EXPECT_EQ(shareOfOthers(3, 2, 2, 1), 0.5) << "half a core beyond the idle one";
    EXPECT_EQ(shareOfOthers(1, 2, 2, 1), 0.0) << "not negative";
    EXPECT_EQ(shareOfOthers(2, 2, 2, 64), 0.5) << "no more than the cores";
    EXPECT_EQ(shareOfOthers(9, 2, 4, 2), 1.0) << "ticks are rounded";
    EXPECT_EQ(shareOfOthers(126, 2, 64, 2), 0.5) << "this run's cores count, not the machine's";
}

TEST(CpuUse, AnUnknownShareIsNullAndAnyKnownOneIsLarger) {
    EXPECT_EQ(otherShareJson(std::nullopt), Json());
    EXPECT_EQ(otherShareJson(0.25), Json(0.25));
    const Json unknown = {{"other_cpu_share", nullptr}}, some = {{"other_cpu_share", 0.25}};
    EXPECT_EQ(largerOtherShare(std::nullopt, unknown), std::nullopt);
    EXPECT_EQ(largerOtherShare(std::nullopt, Json::object()), std::nullopt);
    EXPECT_EQ(largerOtherShare(0.5, unknown), 0.5);
    EXPECT_EQ(largerOtherShare(std::nullopt, some), 0.25);
    EXPECT_EQ(largerOtherShare(0.5, some), 0.5);
}

TEST(CpuUse, AMachineIsBusyAboveATenth) {
    EXPECT_EQ(busyRemark(0.1), "");
    EXPECT_EQ(busyRemark(std::nullopt), "");
    EXPECT_THAT(busyRemark(0.25),
                testing::StartsWith("other processes took 25 % of the cores that this run uses"));
}

TEST(Timing, WithoutConfigurationsNothingRuns) {
    runInTurn(0, 5, [](size_t) { FAIL(); });
    EXPECT_TRUE(timeInTurn(0, 1, 1, [](size_t) { return StageTimes{}; }).empty());
}

} // namespace shadowdag
