// SPDX-License-Identifier: Apache-2.0
// The command regret on made results whose regret is known, and on files that it cannot draw.
#include "tests/tools/report/report_runner.h"
#include "tools/settings/json.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace shadowdag {

namespace {

using testing::HasSubstr;

Json runOf(const std::string& method, const std::string& model, uint32_t frame, double ms) {
    return {{"scene", "builtin:made"},
            {"frame", frame},
            {"method", method},
            {"model", model},
            {"time_ms", ms},
            {"time_ms_min", 0.99 * ms},
            {"time_ms_max", 1.01 * ms},
            {"traced_light_count", 3},
            {"mapped_light_count", 4},
            {"ray_count", 30},
            {"pair_count", 120},
            // Two stages whose work routes change, and one that they do not.
            {"stages_ms", {{"g-buffer", 10}, {"rasterization", 0.25 * ms}, {"shading", 0.5 * ms}}}};
}

/// Four frames: rays 100, maps 150, oracle 60, cost 64 ms; texels:96 90, texels:300 70 ms. In the
/// last frame cost takes 115.
Json madeRegret() {
    Json runs = Json::array();
    for (const uint32_t frame : {0u, 10u, 20u, 30u}) {
        runs.push_back(runOf("dag", "texels:inf", frame, 100));
        runs.push_back(runOf("maps", "texels:0", frame, 150));
        runs.push_back(runOf("hybrid", "texels:96", frame, 90));
        runs.push_back(runOf("hybrid", "texels:300", frame, 70));
        runs.push_back(runOf("hybrid", "oracle", frame, 60));
        runs.push_back(runOf("hybrid", "cost", frame, frame == 30 ? 115 : 64));
    }
    // The cheaper method of two maps adds up to 30 ms a frame; the oracle's stages to 45.
    Json costs = Json::array();
    for (const uint32_t frame : {0u, 10u, 20u, 30u})
        for (const uint32_t light : {0u, 1u})
            costs.push_back({{"scene", "builtin:made"},
                             {"frame", frame},
                             {"light", light},
                             {"rays_ms", light == 0 ? 10 : 70},
                             {"map_ms", light == 0 ? 70 : 20}});
    return {{"provenance", {{"commit", "c0ffee"}}}, {"runs", runs}, {"map_costs", costs}};
}

int drawRegret(const TemporaryDirectory& directory, const Json& results, std::string* text) {
    writeText(directory / "results.json", jsonText(results));
    return runReport({"regret", directory / "results.json", "-o", directory / "charts"}, text);
}

} // namespace

TEST(RegretChart, SumsAreThoseOfAllFrames) {
    const TemporaryDirectory directory;
    std::string text;
    ASSERT_EQ(drawRegret(directory, madeRegret(), &text), 0) << text;
    EXPECT_THAT(readText(directory / "charts/regret.svg"), HasSubstr("</svg>"));
    EXPECT_THAT(readText(directory / "charts/regret.png"), testing::StartsWith("\x89PNG"));
    const Json chart = Json::parse(readText(directory / "charts/regret.json"));
    EXPECT_EQ(chart["provenance"]["commit"], "c0ffee");
    const Json scene = chart["scenes"][0];
    EXPECT_EQ(scene["best_threshold"], "texels:300");
    EXPECT_EQ(scene["frames"][0]["best_threshold"], "texels:300");
    const Json held = scene["sums"];
    EXPECT_EQ(held["frame_count"], 4);
    EXPECT_DOUBLE_EQ(held["better_single_ms"].get<double>(), 400);
    EXPECT_DOUBLE_EQ(held["oracle_gain_ms"].get<double>(), 160);
    EXPECT_DOUBLE_EQ(held["oracle_serving_over_cost_sum"].get<double>(), 1.5);
    EXPECT_DOUBLE_EQ(held["realised"].get<double>(), (400.0 - 3 * 64 - 115) / 160);
    EXPECT_EQ(scene["slower_frames"], Json{30});
    EXPECT_EQ(scene["worst_frame"]["frame"], 30);
    EXPECT_DOUBLE_EQ(scene["worst_frame"]["ray_share"].get<double>(), 0.25);
    EXPECT_NEAR(scene["frames"][1]["regret"]["texels:96"].get<double>(), 0.5, 1e-12);
    EXPECT_THAT(text, AllOf(HasSubstr("worst frame 30"), HasSubstr("58 %")));
    // What was analysed is drawn again without the results.
    const std::string svg = readText(directory / "charts/regret.svg");
    ASSERT_EQ(
        runReport({"regret", directory / "charts/regret.json", "-o", directory / "again"}, &text),
        0)
        << text;
    EXPECT_EQ(Json::parse(readText(directory / "again/regret.json"))["scenes"], chart["scenes"]);
    const auto withoutStamp = [](const std::string& drawing) {
        const size_t at = drawing.find("shadowdag-data:");
        return drawing.substr(0, at) + drawing.substr(drawing.find('<', at));
    };
    EXPECT_EQ(withoutStamp(readText(directory / "again/regret.svg")), withoutStamp(svg));
}

TEST(RegretChart, AGainWithinTheNoiseIsReportedAndNotUsedAsADivisor) {
    const TemporaryDirectory directory;
    Json results = madeRegret();
    for (Json& run : results["runs"])
        if (run["model"] == "oracle")
            run["time_ms"] = 99.9, run["time_ms_min"] = 95, run["time_ms_max"] = 105;
    std::string text;
    ASSERT_EQ(drawRegret(directory, results, &text), 0) << text;
    const Json scene = Json::parse(readText(directory / "charts/regret.json"))["scenes"][0];
    EXPECT_TRUE(scene["sums"]["realised"].is_null());
    EXPECT_THAT(text, HasSubstr("nothing to speak of"));
}

TEST(RegretChart, RefusesDataThatCannotBeDrawn) {
    const TemporaryDirectory directory;
    std::string text;
    EXPECT_NE(drawRegret(directory, {{"runs", 3}}, &text), 0);
    EXPECT_THAT(text, HasSubstr("not results of a compare"));
    Json results = madeRegret();
    results["runs"].erase(results["runs"].size() - 1);
    EXPECT_NE(drawRegret(directory, results, &text), 0);
    EXPECT_THAT(text, HasSubstr("frame 30: no run by cost"));
}

} // namespace shadowdag
