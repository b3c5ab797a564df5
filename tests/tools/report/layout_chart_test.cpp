// SPDX-License-Identifier: Apache-2.0
// The command layouts on the committed measurements of layouts, and on another file.
#include "tests/tools/report/report_runner.h"
#include "tools/settings/json.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace shadowdag {

namespace {

constexpr const char* kData = SDAG_SOURCE_DIR "/tests/bench/results/layouts.json";

int draw(const std::string& data, const std::string& directory, std::string* text) {
    return runReport({"layouts", data, "-o", directory}, text);
}

} // namespace

TEST(LayoutChart, CommittedLayoutsAreDrawnAsSvgAndPng) {
    const TemporaryDirectory directory;
    std::string text;
    ASSERT_EQ(draw(kData, directory / "charts", &text), 0) << text;
    const std::string svg = readText(directory / "charts/layouts.svg");
    EXPECT_THAT(svg, testing::HasSubstr("</svg>"));
    EXPECT_EQ(svg.find("<text"), std::string::npos) << "text must be outlines";
    EXPECT_THAT(readText(directory / "charts/layouts.png"), testing::StartsWith("\x89PNG"));
}

TEST(LayoutChart, CommittedLayoutsContainTheirCriteria) {
    const Json data = Json::parse(readText(kData));
    EXPECT_FALSE(data["provenance"]["commit"].get<std::string>().empty());
    EXPECT_FALSE(data["provenance"]["compiler"].get<std::string>().empty());
    int kept = 0;
    for (const Json& row : data["traced"]) {
        EXPECT_GE(row["repeat_count"], 5);
        EXPECT_LE(row["rate_ratio_min"], row["rate_ratio"]);
        EXPECT_LE(row["rate_ratio"], row["rate_ratio_max"]);
        EXPECT_GT(row["traced_bytes"], row["file_bytes"]);
        kept += row["kept"].get<bool>();
    }
    EXPECT_EQ(kept, 8); // two layouts, two scenes, two resolutions
    EXPECT_EQ(data["files"].size(), 20u);
}

TEST(LayoutChart, OtherFilesAreRefused) {
    const TemporaryDirectory directory;
    writeText(directory / "other.json", "{\"runs\": []}");
    std::string text;
    EXPECT_NE(draw(directory / "other.json", directory / "charts", &text), 0);
    EXPECT_THAT(text, testing::HasSubstr("not a file of layouts"));
    writeText(directory / "unknown.json",
              R"({"traced": [{"resolution": 4096, "scene": "s", "shape": "ternary"}]})");
    EXPECT_NE(draw(directory / "unknown.json", directory / "charts", &text), 0);
    EXPECT_THAT(text, testing::HasSubstr("unknown shape 'ternary'"));
}

} // namespace shadowdag
