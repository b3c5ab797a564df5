// SPDX-License-Identifier: Apache-2.0
// The command bias on made results whose lines are known, and on files that it cannot draw.
#include "tests/tools/report/report_runner.h"
#include "tools/settings/json.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace shadowdag {

namespace {

using testing::HasSubstr;

Json acneOf(const char* shape, double bias, double angle, int darkCount) {
    return {{"shape", shape},
            {"bias_texels", bias},
            {"angle_degrees", angle},
            {"dark_count", darkCount},
            {"point_count", 200}};
}

Json filterOf(const char* scene, int taps, double bias, int falseLight, int falseShadow) {
    return {{"scene", scene},
            {"taps", taps},
            {"bias_texels", bias},
            {"false_light_count", falseLight},
            {"false_shadow_count", falseShadow},
            {"point_count", 1000}};
}

/// Two biases; a plane and a fold, whose worst angle (85 degrees) is beyond what is drawn of it.
Json madeResults() {
    Json acne = Json::array(), detached = Json::array(), filters = Json::array();
    for (const double bias : {1.0, 0.0}) {
        acne.push_back(acneOf("plane", bias, 5, 2));
        acne.push_back(acneOf("plane", bias, 85, bias > 0 ? 4 : 20));
        acne.push_back(acneOf("fold", bias, 75, bias > 0 ? 6 : 30));
        acne.push_back(acneOf("fold", bias, 85, 100));
        for (const double angle : {5.0, 45.0})
            detached.push_back({{"bias_texels", bias},
                                {"angle_degrees", angle},
                                {"lit_texels_mean", bias + angle / 100}});
        filters.push_back(filterOf("room", 9, bias, 10, bias > 0 ? 0 : 50));
        filters.push_back(filterOf("room", 1, bias, 999, 999));
    }
    return {{"acne", acne}, {"detached", detached}, {"filters", filters}};
}

int draw(const TemporaryDirectory& directory, const Json& results, std::string* text) {
    writeText(directory / "filters.json", jsonText(results));
    return runReport({"bias", directory / "filters.json", "-o", directory / "charts"}, text);
}

} // namespace

TEST(BiasChart, LinesAreThoseOfTheResultsInOrderOfBias) {
    const TemporaryDirectory directory;
    std::string text;
    ASSERT_EQ(draw(directory, madeResults(), &text), 0) << text;
    EXPECT_THAT(readText(directory / "charts/bias.svg"), HasSubstr("</svg>"));
    EXPECT_THAT(readText(directory / "charts/bias.png"), testing::StartsWith("\x89PNG"));
    const Json lines = Json::parse(readText(directory / "charts/bias.json"));
    EXPECT_EQ(lines["acne_percent"]["plane"].dump(), "[[0.0,10.0],[1.0,2.0]]");
    EXPECT_EQ(lines["acne_percent"]["fold"].dump(), "[[0.0,15.0],[1.0,3.0]]");
    EXPECT_EQ(lines["detached_texels"].size(), 2u);
    EXPECT_EQ(lines["detached_texels"]["light at 45 degrees"].dump(), "[[0.0,0.45],[1.0,1.45]]");
    EXPECT_EQ(lines["wrong_percent"]["room, false light"].dump(), "[[0.0,1.0],[1.0,1.0]]");
    EXPECT_EQ(lines["wrong_percent"]["room, false shadow"].dump(), "[[0.0,5.0],[1.0,0.0]]");
}

TEST(BiasChart, RefusesDataThatCannotBeDrawn) {
    const TemporaryDirectory directory;
    std::string text;
    for (const char* key : {"acne", "detached", "filters"}) {
        Json without = madeResults(), empty = madeResults(), half = madeResults();
        without.erase(key);
        empty[key] = Json::array();
        half[key][1].erase("bias_texels");
        for (const Json& wrong : {without, empty, half}) {
            EXPECT_NE(draw(directory, wrong, &text), 0) << key;
            EXPECT_THAT(text, HasSubstr("filters.json: not what filter_bench prints")) << key;
        }
    }
    EXPECT_NE(runReport({"bias", directory / "none.json"}, &text), 0);
    EXPECT_THAT(text, HasSubstr("none.json"));
}

} // namespace shadowdag
