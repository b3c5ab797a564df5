// SPDX-License-Identifier: Apache-2.0
// charts.py on made-up results: every chart is drawn, and lines of different commits are refused.
#include "tools/charts_run.h"

#include "tests/tools/temporary_directory.h"
#include "tools/json.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace shadowdag {

namespace {

/// Writes made-up results of a commit.
void makeResults(const std::string& path, const std::string& commit) {
    const std::string script = std::string(SDAG_SOURCE_DIR) + "/tests/tools/make_results.py";
    std::string text;
    ASSERT_EQ(runProgram({"/usr/bin/python3", script, commit}, &text), 0) << text;
    writeText(path, text);
}

} // namespace

TEST(Charts, EveryChartIsDrawnAsSvgAndPngWithACaption) {
    const TemporaryDirectory directory;
    makeResults(directory / "r.json", "c1");
    drawCharts(SDAG_CHARTS, directory / "r.json", directory / "charts");
    const Json charts = Json::parse(readText(directory / "charts/charts.json"));
    ASSERT_EQ(charts["charts"].size(), 8u);
    EXPECT_EQ(charts["charts"][0]["file"], "speed_accuracy_builtin_made_up");
    for (const Json& chart : charts["charts"]) {
        const std::string stem = directory / ("charts/" + chart["file"].get<std::string>());
        EXPECT_THAT(readText(stem + ".svg"), testing::HasSubstr("</svg>")) << stem;
        EXPECT_EQ(readText(stem + ".svg").find("<text"), std::string::npos)
            << "text must be outlines";
        EXPECT_THAT(readText(stem + ".png"), testing::StartsWith("\x89PNG")) << stem;
        EXPECT_GT(chart["caption"].get<std::string>().size(), 40u);
    }
}

TEST(Charts, TheCrossingOfTwoKnownPowersIsFound) {
    const TemporaryDirectory directory;
    makeResults(directory / "r.json", "c1");
    Json results = Json::parse(readText(directory / "r.json"));
    for (Json& cost : results["map_costs"]) { // rays = x / 50, map = 1: they meet at 50
        cost["rays_ms"] = cost["texels"].get<double>() / 50;
        cost["map_ms"] = 1.0;
    }
    writeText(directory / "r.json", results.dump());
    drawCharts(SDAG_CHARTS, directory / "r.json", directory / "charts");
    const std::string charts = readText(directory / "charts/charts.json");
    EXPECT_THAT(charts, testing::HasSubstr("cross at 50 texels (95 % interval 50 to 50)"));
}

TEST(Charts, LinesOfDifferentCommitsAreRefusedUnlessTold) {
    const TemporaryDirectory directory;
    makeResults(directory / "a.json", "c1");
    makeResults(directory / "b.json", "c2");
    std::string said;
    const std::vector<std::string> command{"/usr/bin/python3",   SDAG_CHARTS, directory / "a.json",
                                           directory / "b.json", "-o",        directory / "charts"};
    EXPECT_NE(runProgram(command, &said), 0);
    EXPECT_THAT(said, testing::HasSubstr("different commits"));
    std::vector<std::string> told = command;
    told.push_back("--mixed-commits");
    EXPECT_EQ(runProgram(told, &said), 0) << said;
}

} // namespace shadowdag
