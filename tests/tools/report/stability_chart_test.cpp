// SPDX-License-Identifier: Apache-2.0
// The charts of stability, drawn from made-up numbers: parts, methods, and captions.
#include "tests/tools/report/report_runner.h"
#include "tests/tools/temporary_directory.h"
#include "tools/studies/stability.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace shadowdag {
namespace {

using testing::HasSubstr;

/// Results as measureStability gives them, two groups of made numbers.
Json madeResults() {
    Json results = {{"provenance", {{"commit", "c0ffee"}}}};
    for (const char* key : {"time", "perturbation", "numeric", "resolution", "rates", "checks"})
        results[key] = Json::array();
    for (const char* method : {"maps", "dag believe all"})
        results["time"].push_back({{"group", "time-made"},
                                   {"kind", "camera path"},
                                   {"case", "every frame for itself"},
                                   {"method", method},
                                   {"answer_count", 1000},
                                   {"held_flicker_count", 0},
                                   {"resolution_switch_flicker_count", 3},
                                   {"method_switch_flicker_count", 1}});
    for (const char* method : {"maps", "dag believe all"}) {
        for (int i = 0; i < 3; ++i)
            results["resolution"].push_back({{"group", "resolution-made"},
                                             {"method", method},
                                             {"resolution", 64 << i},
                                             {"undersample", 4 >> i},
                                             {"wrong_share", 0.1 / (1 << i)}});
        results["rates"].push_back({{"group", "resolution-made"},
                                    {"case", "wrong_share"},
                                    {"method", method},
                                    {"slope", 1.0},
                                    {"standard_error", 0.25}});
    }
    return results;
}

TEST(StabilityChart, DrawsTheExistingPartsAndRefusesOtherFiles) {
    const TemporaryDirectory directory;
    const auto draw = [&](const Json& results, std::string* text) {
        writeText(directory / "stability.json", jsonText(results));
        return runReport(
            {"stability-charts", directory / "stability.json", "-o", directory / "charts"}, text);
    };
    std::string text;
    Json results = madeResults();
    results["checks"].push_back({{"part", "time"}, {"group", "time-made"}, {"holds", true}});
    ASSERT_EQ(draw(results, &text), 0) << text;
    const Json charts = Json::parse(readText(directory / "charts/charts.json"))["charts"];
    ASSERT_EQ(charts.size(), 2u);
    EXPECT_EQ(charts[0]["part"], "time");
    EXPECT_EQ(charts[1]["part"], "resolution");
    for (const Json& chart : charts) {
        const std::string stem = "charts/" + chart["file"].get<std::string>();
        EXPECT_THAT(readText(directory / (stem + ".svg")), HasSubstr("</svg>"));
        EXPECT_THAT(readText(directory / (stem + ".png")), testing::StartsWith("\x89PNG"));
    }
    const auto captionOfTime = [&] {
        return Json::parse(readText(directory / "charts/charts.json"))["charts"][0]["caption"]
            .get<std::string>();
    };
    // The text about outcomes follows from the checks.
    EXPECT_THAT(captionOfTime(), HasSubstr("All 1 checks hold."));
    results["checks"].push_back({{"part", "time"}, {"group", "time-made"}, {"holds", false}});
    ASSERT_EQ(draw(results, &text), 0) << text;
    EXPECT_THAT(captionOfTime(), HasSubstr("1 of 2 checks do not hold."));
    EXPECT_NE(draw({{"time", 3}}, &text), 0);
    EXPECT_THAT(text, HasSubstr("not a result of study stability"));
}

// A study on several scenes has more groups than there are colours; one hardly errs and has no
// rate.
TEST(StabilityChart, DrawsAnyNumberOfGroups) {
    const TemporaryDirectory directory;
    const Json one = madeResults();
    Json results = one;
    for (const char* part : {"time", "resolution", "rates"})
        results[part] = Json::array();
    constexpr int kGroups = 9;
    for (int g = 0; g < kGroups; ++g)
        for (const char* part : {"time", "resolution", "rates"})
            for (Json row : one[part]) {
                const bool isRate = std::string(part) == "rates";
                row["group"] = (isRate ? "resolution" : part) + ("-scene" + std::to_string(g));
                if (!isRate || g != 4)
                    results[part].push_back(row);
            }
    writeText(directory / "stability.json", jsonText(results));
    std::string text;
    ASSERT_EQ(
        runReport({"stability-charts", directory / "stability.json", "-o", directory / "charts"},
                  &text),
        0)
        << text;
    const std::string curves = readText(directory / "charts/stability_resolution.svg");
    const std::string bars = readText(directory / "charts/stability_time.svg");
    for (int g = 0; g < kGroups; ++g) {
        const std::string name = "<!-- scene" + std::to_string(g) + ": ";
        EXPECT_THAT(curves, HasSubstr(name + (g == 4 ? "none" : "1.00 ± 0.25")));
        EXPECT_THAT(bars, HasSubstr(name + "camera path"));
    }
}

// Methods without a wrong pair are named in place of being drawn; all others are drawn.
TEST(StabilityChart, DrawsEveryMethodThatErrsUnderPerturbation) {
    const TemporaryDirectory directory;
    Json results = {{"provenance", {{"commit", "c0ffee"}}}};
    for (const char* key : {"time", "perturbation", "numeric", "resolution", "rates", "checks"})
        results[key] = Json::array();
    std::vector<std::string> methods(std::begin(kMatrixMethodNames), std::end(kMatrixMethodNames));
    methods.push_back("a new method");
    for (const std::string& method : methods)
        for (const char* name : {"unperturbed", "moved"})
            results["perturbation"].push_back(
                {{"group", "perturbation-made"},
                 {"case", name},
                 {"kind", name},
                 {"method", method},
                 {"wrong_share", method == "dag believe none" ? 0.0 : 0.1},
                 {"wrong_share_unperturbed", method == "dag believe none" ? 0.0 : 0.1}});
    for (const bool exactErrs : {false, true}) {
        if (exactErrs)
            for (Json& row : results["perturbation"])
                row["wrong_share"] = row["wrong_share_unperturbed"] = 0.1;
        writeText(directory / "stability.json", jsonText(results));
        std::string text;
        ASSERT_EQ(runReport({"stability-charts", directory / "stability.json", "-o",
                             directory / "charts"},
                            &text),
                  0)
            << text;
        const std::string svg = readText(directory / "charts/stability_perturbation.svg");
        for (const char* method : {"maps", "dag believe all", "hybrid", "a new method"})
            EXPECT_THAT(svg, HasSubstr("<!-- " + std::string(method) + " -->"));
        EXPECT_EQ(svg.find("<!-- dag believe none -->") != std::string::npos, exactErrs);
        const std::string caption =
            Json::parse(readText(directory / "charts/charts.json"))["charts"][0]["caption"];
        EXPECT_THAT(caption, HasSubstr("No check was made."));
        EXPECT_EQ(caption.find("dag believe none: no wrong pair anywhere") == std::string::npos,
                  exactErrs);
    }
}

} // namespace
} // namespace shadowdag
