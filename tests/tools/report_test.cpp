// SPDX-License-Identifier: Apache-2.0
#include "tools/report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace shadowdag {

TEST(Report, CsvGivesNestedKeysTheirOwnColumns) {
    const Json runs = {
        {{"scene", "a,b"}, {"parameters", {{"taps", 9}}}, {"images", {{"color", "x"}}}},
        {{"scene", "say \"c\""},
         {"parameters", Json::object()},
         {"stages_ms", {{"shading", 1.5}}}}};
    EXPECT_EQ(runsCsv(runs),
              "scene,parameters.taps,stages_ms.shading\n\"a,b\",9,\n\"say \"\"c\"\"\",,1.5\n");
    EXPECT_EQ(runsCsv(Json::array()), "");
}

TEST(Report, NamesCannotBecomeMarkup) {
    const Json results = {
        {"provenance", {{"commit", "<b>"}, {"cpu", "c"}, {"thread_count", 1}, {"backend", "cpu"}}},
        {"experiment", {{"title", "<script>alert(1)</script>"}, {"size", "1x1"}}},
        {"scenes", Json::array()},
        {"runs", Json::array()},
        {"truth_images", Json::array()}};
    const std::string html = reportHtml(results, Json());
    EXPECT_EQ(html.find("<script>alert"), std::string::npos);
    EXPECT_THAT(html, testing::HasSubstr("&lt;script&gt;alert(1)"));
    EXPECT_EQ(html.find("http"), std::string::npos) << "the page must not need the net";
}

} // namespace shadowdag
