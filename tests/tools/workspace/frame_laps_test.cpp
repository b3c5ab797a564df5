// SPDX-License-Identifier: Apache-2.0
// Times of laps: which frames are reported, and the medians of their stages.
#include "tools/workspace/frame_laps.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace shadowdag {

namespace {

Json row(double wallMs, const Json& stages) {
    double sum = 0;
    for (const auto& [name, timeMs] : stages.items())
        sum += timeMs.get<double>();
    return {{"wall_ms", wallMs}, {"time_ms", sum}, {"stages_ms", stages}};
}

} // namespace

TEST(FrameLaps, SummaryHasMediansAndTheSlowestFrame) {
    const Json summary = summarizeLap(Json::array({row(5, {{"gbuffer", 1.0}, {"shading", 3.0}}),
                                                   row(9, {{"gbuffer", 2.0}, {"page masks", 4.0}}),
                                                   row(7, {{"gbuffer", 6.0}, {"shading", 0.5}})}));
    EXPECT_EQ(summary["wall_ms"], 7.0);
    EXPECT_EQ(summary["wall_ms_max"], 9.0);
    EXPECT_EQ(summary["time_ms"], 6.0);
    EXPECT_EQ(summary["stages_ms"]["gbuffer"], 2.0);
    EXPECT_EQ(summary["stages_ms"]["shading"], 0.5);    // 0 in the frame that has no such stage
    EXPECT_EQ(summary["stages_ms"]["page masks"], 0.0); // 0 in two of three
    const Json two =
        summarizeLap(Json::array({row(5, {{"shading", 1.0}}), row(9, {{"shading", 4.0}})}));
    EXPECT_EQ(two["wall_ms"], 7.0);
    EXPECT_EQ(two["stages_ms"]["shading"], 2.5);
}

} // namespace shadowdag
