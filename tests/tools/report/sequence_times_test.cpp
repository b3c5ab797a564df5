// SPDX-License-Identifier: Apache-2.0
// The times of a sequence: their quantiles, and their ratios to Embree's frame by frame.
#include "tools/report/sequence_times.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <vector>

namespace shadowdag {
namespace {

Json row(const char* label, int frame, const std::vector<double>& rounds) {
    return {{"scene", "s"},    {"frame", frame},       {"label", label},
            {"method", label}, {"time_ms", rounds[0]}, {"round_times_ms", rounds}};
}

// Frame 1 takes ten times as long as frame 0, and each second round twice as long: ratios of one
// frame and round see neither.
TEST(SequenceTimes, RatiosToEmbreeAreOfTheSameFrameAndRound) {
    const Json rows = {row("embree", 0, {1, 2}), row("maps", 0, {2, 4}), row("embree", 1, {10, 20}),
                       row("maps", 1, {20, 60})};
    const Json times = sequenceTimes(rows);
    ASSERT_EQ(times.size(), 2u);
    EXPECT_EQ(times[0]["time_over_embree"], 1.0);
    EXPECT_EQ(times[1]["label"], "maps");
    EXPECT_EQ(times[1]["value_count"], 4);
    EXPECT_EQ(times[1]["time_over_embree"], 2.0);
    EXPECT_EQ(times[1]["time_over_embree_low"], 2.0);
    EXPECT_EQ(times[1]["time_over_embree_high"], 3.0);
    EXPECT_NEAR(times[1]["time_over_embree_confidence"].get<double>(), 0.875, 1e-12);
}

TEST(SequenceTimes, OfTwoConfigurationsOfEmbreeTheFirstIsTheBase) {
    Json second = row("embree", 0, {10, 20});
    second["label"] = "embree again";
    const Json times = sequenceTimes({row("embree", 0, {1, 2}), row("maps", 0, {2, 4}), second});
    EXPECT_EQ(times[1]["label"], "maps");
    EXPECT_EQ(times[1]["time_over_embree"], 2.0);
}

TEST(SequenceTimes, WithoutEmbreeInEveryFrameThereIsNoRatio) {
    const Json none = sequenceTimes(Json::array({row("maps", 0, {2, 4})}));
    EXPECT_FALSE(none[0].contains("time_over_embree"));
    const Json some = sequenceTimes(
        Json::array({row("embree", 0, {1, 2}), row("maps", 0, {2, 4}), row("maps", 1, {2, 4})}));
    EXPECT_TRUE(some[0].contains("time_over_embree"));
    EXPECT_FALSE(some[1].contains("time_over_embree"));
    // Older results have no rounds: one value of their median.
    Json old = Json::array({row("embree", 0, {4}), row("maps", 0, {2})});
    for (Json& r : old)
        r.erase("round_times_ms");
    EXPECT_EQ(sequenceTimes(old)[1]["time_over_embree"], 0.5);
}

} // namespace
} // namespace shadowdag
