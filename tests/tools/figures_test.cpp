// SPDX-License-Identifier: Apache-2.0
// figures.py on made-up sequences: every figure with its data and claims, and what it refuses.
#include "tools/charts_run.h"

#include "cuda/error.h"
#include "tests/tools/temporary_directory.h"
#include "tools/json.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace shadowdag {

namespace {

using testing::HasSubstr;

/// Writes made-up results of a commit and some variants; of none: of all.
void makeSequence(const std::string& path, const std::string& commit,
                  const std::vector<std::string>& variants = {}) {
    std::vector<std::string> arguments{
        "/usr/bin/python3", std::string(SDAG_SOURCE_DIR) + "/tests/tools/make_sequence.py", commit};
    arguments.insert(arguments.end(), variants.begin(), variants.end());
    std::string text;
    ASSERT_EQ(runProgram(arguments, &text), 0) << text;
    writeText(path, text);
}

std::string refusal(const std::string& results, const std::string& directory,
                    const std::vector<std::string>& more) {
    try {
        drawCharts(SDAG_FIGURES, results, directory, more);
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kInput);
        return error.what();
    }
    ADD_FAILURE() << "no error";
    return "";
}

} // namespace

TEST(Figures, EachIsDrawnWithItsDataItsCaptionAndWhatThePaperStates) {
    const TemporaryDirectory directory;
    makeSequence(directory / "r.json", "c1");
    drawCharts(SDAG_FIGURES, directory / "r.json", directory / "figures");
    const Json charts = Json::parse(readText(directory / "figures/charts.json"));
    ASSERT_EQ(charts["charts"].size(), 8u);
    for (int figure = 10; figure <= 17; ++figure) {
        const std::string stem =
            directory / ("figures/figure_" + std::to_string(figure) + "_builtin_made_up");
        EXPECT_EQ(charts["charts"][size_t(figure - 10)]["file"],
                  "figure_" + std::to_string(figure) + "_builtin_made_up");
        EXPECT_THAT(readText(stem + ".svg"), HasSubstr("</svg>"));
        EXPECT_THAT(readText(stem + ".png"), testing::StartsWith("\x89PNG"));
        EXPECT_THAT(readText(stem + ".csv"), testing::StartsWith("frame,"));
        EXPECT_THAT(readText(stem + ".txt"), HasSubstr("the paper"));
        const Json data = Json::parse(readText(stem + ".json"));
        EXPECT_EQ(data["provenance"]["commit"], "c1");
        EXPECT_EQ(data["frames"].size(), 16u);
        EXPECT_FALSE(data["claims"].empty()) << figure;
        for (const auto& [name, values] : data["series"].items())
            EXPECT_EQ(values.size(), 16u) << figure << " " << name;
    }
}

TEST(Figures, ClaimsAreHeldAgainstTheData) {
    const TemporaryDirectory directory;
    makeSequence(directory / "r.json", "c1");
    drawCharts(SDAG_FIGURES, directory / "r.json", directory / "figures", {"--figure", "15"});
    const Json data = Json::parse(readText(directory / "figures/figure_15_builtin_made_up.json"));
    const auto claim = [&](const std::string& start) {
        for (const Json& one : data["claims"])
            if (one["claim"].get<std::string>().starts_with(start))
                return one;
        return Json();
    };
    // Made up: PMC draws 0.14, PMCD 0.13, PMCD-EB 0.1 of what the sphere does, SO half of that.
    EXPECT_EQ(claim("PMC:")["measured"], "7.1 to 7.1 times");
    EXPECT_EQ(claim("PMC:")["holds"], true);
    EXPECT_EQ(claim("EB:")["measured"], "-23.1 % to -23.1 %, mean -23.1 %");
    EXPECT_EQ(claim("EB:")["holds"], true);
    EXPECT_EQ(claim("SO:")["measured"], "-50.0 %");
    EXPECT_EQ(claim("SO:")["holds"], true);
}

TEST(Figures, StepsOfCullingAreSharesOfTheirSumAndStagesAreDrawnInGroups) {
    const TemporaryDirectory directory;
    makeSequence(directory / "r.json", "c1", {"PMCD-EB", "RT"});
    drawCharts(SDAG_FIGURES, directory / "r.json", directory / "figures", {"--figure", "13"});
    const Json steps = Json::parse(readText(directory / "figures/figure_13_builtin_made_up.json"));
    // Made up at frame 0: resolution 0.4, boxes 0.6, hierarchy 0.2, masks 1.5, blocks 0.5, query
    // 0.8, tests 4 ms, of 8.0; the last frame's tests take 5.
    ASSERT_EQ(steps["series"].size(), 7u);
    EXPECT_EQ(steps["series"]["update of batch boxes (ms)"][0], 0.6);
    EXPECT_EQ(steps["series"]["tests of masks and depths (ms)"][15], 5.0);
    EXPECT_EQ(steps["claims"][0]["measured"], "tests of masks and depths");
    EXPECT_EQ(steps["claims"][0]["holds"], false);
    EXPECT_EQ(steps["claims"][1]["measured"], "10.0 %"); // 0.8 of 8.0
    drawCharts(SDAG_FIGURES, directory / "r.json", directory / "figures", {"--figure", "12"});
    const Json stages = Json::parse(readText(directory / "figures/figure_12_builtin_made_up.json"));
    EXPECT_NEAR(stages["series"]["PMCD-EB: culling (ms)"][0].get<double>(), 6.1, 1e-9);
    EXPECT_NEAR(stages["series"]["PMCD-EB: page allocation (ms)"][0].get<double>(), 0.8, 1e-9);
    EXPECT_NEAR(stages["series"]["RT: culling (ms)"][0].get<double>(), 0.8, 1e-9);
}

TEST(Figures, WhatIsNotMeasuredIsLeftOutUnlessAskedFor) {
    const TemporaryDirectory directory;
    makeSequence(directory / "r.json", "c1", {"CFM", "PMCD-EB"});
    drawCharts(SDAG_FIGURES, directory / "r.json", directory / "figures");
    const Json charts = Json::parse(readText(directory / "figures/charts.json"));
    EXPECT_EQ(charts["charts"].size(), 5u); // 10, 12, 13, 15, 17
    EXPECT_THAT(refusal(directory / "r.json", directory / "x", {"--figure", "11"}),
                HasSubstr("figure 11 of builtin:made-up needs a variant with SO or SOR"));
    EXPECT_THAT(refusal(directory / "r.json", directory / "x", {"--figure", "16"}),
                HasSubstr("needs variants PMCD-EB and some of PMCD-EB-1SM"));
}

TEST(Figures, OtherFilesAndLinesOfDifferentCommitsAreRefused) {
    const TemporaryDirectory directory;
    makeSequence(directory / "a.json", "c1");
    makeSequence(directory / "b.json", "c2");
    writeText(directory / "c.json", "{}");
    std::string said;
    EXPECT_EQ(runProgram({"/usr/bin/python3", SDAG_FIGURES, directory / "a.json",
                          directory / "b.json", "-o", directory / "x"},
                         &said),
              3);
    EXPECT_THAT(said, HasSubstr("lines of different commits"));
    EXPECT_THAT(refusal(directory / "c.json", directory / "x", {}),
                HasSubstr("c.json: not a results file of compare"));
}

} // namespace shadowdag
