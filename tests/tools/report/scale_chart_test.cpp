// SPDX-License-Identifier: Apache-2.0
// The charts and the page of scale, made of few made-up numbers.
#include "tests/tools/report/report_runner.h"
#include "tests/tools/temporary_directory.h"
#include "tools/studies/scale.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace shadowdag {
namespace {

using testing::HasSubstr;
using testing::Not;

const std::string kEvil = "<script>alert(1)</script>";

Json madeCell(const std::string& row, const std::string& method, double count, double ns) {
    return {{"row", row},
            {"scene", "builtin:made"},
            {"growth", "leaves"},
            {"asked_triangle_count", count},
            {"triangle_count", count},
            {"method", method},
            {"resolution", method == "voxels 64" ? 64 : 0},
            {"build_s", method == "maps warm" ? 0.0 : 1e-6 * count},
            {"bytes", 100 * count},
            {"pair_count", 1000},
            {"false_shadow_count", method == "voxels 64" ? 25 : 0},
            {"false_light_count", 0},
            {"time_ms", 12.0},
            {"time_ms_low", 11.0},
            {"time_ms_high", 13.0},
            {"time_ms_confidence", 0.96},
            {"repeat_count", 7},
            {"ns_per_pair", ns},
            {"ns_per_pair_low", 0.9 * ns},
            {"ns_per_pair_high", 1.2 * ns},
            {"ns_per_pair_confidence", 0.96}};
}

Json madeScale() {
    Json results = {{"provenance", {{"commit", kEvil}}},
                    {"study", {{"what", kEvil}, {"rows", Json::array()}}},
                    {"broken", Json::array()},
                    {"skipped", Json::array()},
                    {"steps", Json::array()},
                    {"cells", Json::array()}};
    for (const char* row : {"one", "two"}) {
        results["study"]["rows"].push_back({{"name", row}, {"what", "Leaves fall."}});
        for (const double count : {1e5, 1e7}) {
            results["steps"].push_back({{"row", row},
                                        {"triangle_count", count},
                                        {"light_count", 3},
                                        {"pair_count", 4321}});
            const bool isLarge = count > 1e6;
            results["cells"].push_back(madeCell(row, "embree", count, isLarge ? 40 : 10));
            results["cells"].push_back(madeCell(row, "voxels 64", count, 20));
            results["cells"].push_back(madeCell(row, "maps warm", count, isLarge ? 50 : 30));
        }
    }
    results["skipped"].push_back(
        {{"row", "two"}, {"asked_triangle_count", 17}, {"reason", "none nearer"}});
    results["crossovers"] = crossoversOf(results["cells"]);
    return results;
}

int draw(const TemporaryDirectory& directory, const Json& results, std::string* text) {
    writeText(directory / "scale.json", results.dump());
    return runReport({"scale-chart", directory / "scale.json", "-o", directory / "charts"}, text);
}

TEST(ScaleChart, EachRowIsDrawnAsSvgAndPngWithItsCrossoversInTheCaption) {
    const TemporaryDirectory directory;
    std::string text;
    ASSERT_EQ(draw(directory, madeScale(), &text), 0) << text;
    for (const std::string row : {"one", "two"}) {
        EXPECT_THAT(readText(directory / ("charts/scale_" + row + ".svg")), HasSubstr("</svg>"));
        EXPECT_THAT(readText(directory / ("charts/scale_" + row + ".png")),
                    testing::StartsWith("\x89PNG"));
    }
    const Json charts = Json::parse(readText(directory / "charts/charts.json"))["charts"];
    ASSERT_EQ(charts.size(), 2u);
    const std::string caption = charts[0]["caption"];
    EXPECT_THAT(caption, HasSubstr("voxels 64: faster than Embree from 1 M triangles on."));
    EXPECT_THAT(caption, HasSubstr("maps warm: slower than Embree up to 10 M triangles."));
    EXPECT_THAT(caption, HasSubstr("95 % intervals of medians of 7"));
}

TEST(ScaleChart, ASingleNumberWithoutEmbreeIsDrawnAndOtherFilesAreRefused) {
    const TemporaryDirectory directory;
    std::string text;
    Json results = madeScale();
    results["cells"] = {madeCell("one", "voxels 64", 5, 20)};
    results["crossovers"] = crossoversOf(results["cells"]);
    EXPECT_EQ(draw(directory, results, &text), 0) << text;
    results["cells"] = Json::array();
    EXPECT_NE(draw(directory, results, &text), 0);
    EXPECT_THAT(text, HasSubstr("no row was measured"));
    results.erase("cells");
    EXPECT_NE(draw(directory, results, &text), 0);
    EXPECT_THAT(text, HasSubstr("not a result of study scale"));
}

TEST(ScaleChart, ThePageStatesCrossoversCellsAndWhatWasNotMeasured) {
    const std::string page = pageOf("scale", "scale.json", madeScale());
    EXPECT_THAT(page, Not(HasSubstr("<script>alert")));
    for (const char* shown : {"faster than Embree from 1 M triangles on", "voxels 64³",
                              "Leaves fall.", "two at 17 triangles: none nearer", "4&#8239;321",
                              "2.5000", "20.0 (18.0 to 24.0)", "10&#8239;000&#8239;000"})
        EXPECT_THAT(page, HasSubstr(shown));
}

} // namespace
} // namespace shadowdag
