// SPDX-License-Identifier: Apache-2.0
// The page of compare on made-up results, and rows as comma-separated values.
#include "hybrid/frame.h"
#include "tests/tools/report/report_runner.h"
#include "tools/report/csv.h"
#include "tools/report/results_table.h"
#include "tools/workspace/frame_json.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <regex>

namespace shadowdag {

namespace {

using testing::HasSubstr;
using testing::Not;

/// Returns a run of 1000 pairs: 20 false shadows, 5 false lights, 7 + 2 of them unexplained.
Json madeUpRun(const std::string& method, const std::string& label, double timeMs) {
    return {{"scene", "builtin:made-up"},
            {"frame", 3},
            {"method", method},
            {"model", method == "hybrid" ? "texels:64" : "texels:0"},
            {"label", label},
            {"time_ms", timeMs},
            {"time_ms_min", timeMs - 1},
            {"time_ms_max", timeMs + 2},
            {"repeat_count", 5},
            {"time_over_embree", 1.25},
            {"time_over_embree_low", 1.2},
            {"time_over_embree_high", 1.3},
            {"time_over_embree_confidence", 0.96},
            {"null_rate", 0.125},
            {"outline_null_rate", 0.75},
            {"outline_null_sample_count", 500},
            {"pair_count", 1000},
            {"false_shadow_count", 20},
            {"false_light_count", 5},
            {"unexplained_false_shadow_count", 7},
            {"unexplained_false_light_count", 2},
            {"settled_false_shadow_count", 4},
            {"acne_count", 1},
            {"contact_count", 3},
            {"magnified_count", 5},
            {"mean_abs_visibility_error", 0.03125},
            {"rmse", 0.25},
            {"flip", 0.125},
            {"traced_light_count", 11},
            {"mapped_light_count", 22},
            {"ray_count", 1234567},
            {"page_count", 15156},
            {"pages_wanted_count", 15156},
            {"degrade_divisor", 1.0},
            {"dag_bytes", 3 * 1048576},
            {"map_bytes", 1572864},
            {"images",
             {{"color", "images/" + method + "_c.png"},
              {"error", "images/" + method + "_e.png"},
              {"method", "images/" + method + "_m.png"}}}};
}

Json fullPool(Json run) {
    run["pages_wanted_count"] = 27641;
    run["degrade_divisor"] = 1.41421;
    return run;
}

Json madeUpResults(const Json& runs) {
    return {
        {"provenance", {{"commit", "<b>"}, {"cpu", "c"}, {"thread_count", 1}, {"backend", "cpu"}}},
        {"experiment", {{"title", "A title"}, {"size", "1x1"}}},
        {"scenes",
         {{{"scene", "builtin:made-up"},
           {"scene_hash", "h"},
           {"triangle_count", 318944},
           {"light_count", 65}}}},
        {"runs", runs},
        {"truth_images",
         {{{"scene", "builtin:made-up"}, {"frame", 3}, {"file", "images/truth.png"}}}}};
}

std::string pageOfCompare(const Json& results) {
    return pageOf("compare", "results.json", results);
}

/// Returns what stands between two texts, the first of each; fails where one is missing.
std::string between(const std::string& text, const std::string& from, const std::string& to) {
    const size_t begin = text.find(from);
    EXPECT_NE(begin, std::string::npos) << from;
    const size_t end = begin == std::string::npos ? begin : text.find(to, begin);
    EXPECT_NE(end, std::string::npos) << to;
    return end == std::string::npos ? "" : text.substr(begin, end - begin);
}

/// Returns the cells of the first row of the first table's body, without tags.
std::vector<std::string> firstRow(const std::string& html) {
    std::string row = between(html, "<tbody>\n<tr", "</tr>");
    std::vector<std::string> cells;
    for (size_t at = row.find("<td"); at != std::string::npos; at = row.find("<td", at + 1)) {
        const size_t begin = row.find('>', at) + 1;
        cells.push_back(std::regex_replace(row.substr(begin, row.find("</td>", begin) - begin),
                                           std::regex("<[^>]*>"), ""));
    }
    return cells;
}

} // namespace

TEST(Report, TheTableContainsEveryNumberOfARunUnderItsHeading) {
    const std::string html =
        pageOfCompare(madeUpResults(Json::array({madeUpRun("maps", "maps", 100.25)})));
    const std::vector<std::string> expected = {"maps",
                                               "builtin:made-up",
                                               "3",
                                               "100.25",
                                               "99.25 to 102.25 (93 %)",
                                               "5",
                                               "1.25: 1.20 to 1.30",
                                               "fits",
                                               "0.03125",
                                               "2.500",
                                               "2.000",
                                               "0.500",
                                               "9",
                                               "4",
                                               "28.0",
                                               "75.0",
                                               "12.5",
                                               "5",
                                               "1",
                                               "3",
                                               "0.2500",
                                               "0.1250",
                                               "11",
                                               "22",
                                               "1&#8239;234&#8239;567",
                                               "15&#8239;156",
                                               "4.50",
                                               "3.00",
                                               "0.00",
                                               "1.50"};
    EXPECT_EQ(firstRow(html), expected);
    const std::string head = between(html, "<thead>", "</thead>");
    size_t headingCount = 0;
    for (size_t at = head.find("<th "); at != std::string::npos; at = head.find("<th ", at + 1))
        ++headingCount;
    EXPECT_EQ(headingCount, expected.size());
}

TEST(Report, FindingsNameThePureMethodsAndTheFastestHybrid) {
    const std::string findings =
        between(pageOfCompare(madeUpResults({madeUpRun("embree", "embree", 50),
                                             madeUpRun("maps", "maps", 100),
                                             madeUpRun("hybrid", "hybrid slow 512^3", 90),
                                             madeUpRun("hybrid", "hybrid fast 512^3", 80)})),
                "<ul>", "</ul>");
    EXPECT_THAT(findings, HasSubstr("builtin:made-up, frame 3"));
    EXPECT_THAT(
        findings,
        HasSubstr("embree 50.0 ms at 2.50 % wrong pairs; maps 100.0 ms at 2.50 % wrong pairs"));
    EXPECT_THAT(findings,
                HasSubstr("the fastest hybrid (hybrid fast 512\u00b3) 80.0 ms at 2.50 %"));
    EXPECT_THAT(findings, Not(HasSubstr("slow")));
    EXPECT_THAT(findings, Not(HasSubstr("pool")));
    EXPECT_THAT(findings, HasSubstr("36 wrong pairs are unexplained; of the unexplained, 16 are "
                                    "settled: a shift aimed at the blocker finds them"));
}

TEST(Report, AFullPoolIsReportedInFindingsTableAndPictures) {
    const std::string html = pageOfCompare(
        madeUpResults({fullPool(madeUpRun("maps", "maps", 100)), madeUpRun("dag", "dag", 90)}));
    const std::string note =
        "pool full: resolutions divided by 1.41; wanted 27641 pages, 15156 fit";
    const std::string findings = between(html, "<ul>", "</ul>");
    EXPECT_THAT(findings, HasSubstr("The page pool was full</b> in 1 of 2 runs (maps: " + note));
    EXPECT_EQ(firstRow(html)[7], "full, \u00f7\u20091.41");
    EXPECT_THAT(between(html, "<h3>maps", "<div"), HasSubstr(note));
    EXPECT_THAT(between(html, "<h3>dag", "<div"), Not(HasSubstr("pool")));
}

TEST(Report, PictureRowsShowMethodTruthErrorAndRouteAndFoldSomeHybrids) {
    const std::string html = pageOfCompare(
        madeUpResults({madeUpRun("maps", "maps", 100), madeUpRun("hybrid", "hybrid x", 80)}));
    const std::string row = between(html, "<h3>maps: 100.0 ms, 2.00 % false shadow", "</div>");
    size_t at = 0;
    for (const char* file :
         {"images/maps_c.png", "images/truth.png", "images/maps_e.png", "images/maps_m.png"}) {
        const size_t found = row.find("src=\"" + std::string(file), at);
        ASSERT_NE(found, std::string::npos) << file << " is missing or out of order in " << row;
        at = found;
    }
    EXPECT_THAT(between(html, "<details>", "</details>"), HasSubstr("<h3>hybrid x"));
}

TEST(PoolNote, IsEmptyIfPagesFitOrWereNotCounted) {
    EXPECT_EQ(poolNote(madeUpRun("maps", "maps", 1)), "");
    EXPECT_EQ(poolNote(Json::object()), "");
    EXPECT_EQ(poolNote(FrameCounts()), "");
    FrameCounts full;
    full.maps.degradeDivisor = 2.0f;
    full.maps.pagesWantedCount = 40;
    full.maps.pageCount = 10;
    EXPECT_EQ(poolNote(full), "pool full: resolutions divided by 2.00; wanted 40 pages, 10 fit");
    EXPECT_EQ(poolNote(toJson(full)), poolNote(full)) << "a frame and its JSON say the same";
}

TEST(Report, ARowThatIsShownByAnotherNameHasItInTheTableWithALegend) {
    std::ostringstream plain, table;
    Json run = madeUpRun("hybrid", "hybrid oracle", 3);
    printRuns(plain, Json::array({run}));
    EXPECT_THAT(plain.str(), HasSubstr("hybrid oracle "));
    EXPECT_THAT(plain.str(), Not(HasSubstr("measured routes")));
    run["shown_as"] = {{"label", "hybrid measured routes"}, {"why", "measured routes: the reason"}};
    printRuns(table, Json::array({run}));
    EXPECT_THAT(table.str(), HasSubstr("  hybrid measured routes "));
    EXPECT_THAT(table.str(), Not(HasSubstr("hybrid oracle")));
    EXPECT_THAT(table.str(), HasSubstr("\nmeasured routes: the reason\n"));
}

TEST(Report, CsvGivesNestedKeysTheirOwnColumns) {
    const Json runs = {{{"scene", "a,b"},
                        {"parameters", {{"taps", 9}}},
                        {"images", {{"color", "x"}}},
                        {"shown_as", {{"label", "b"}}}},
                       {{"scene", "say \"c\""},
                        {"parameters", Json::object()},
                        {"stages_ms", {{"shading", 1.5}}}}};
    EXPECT_EQ(runsCsv(runs),
              "scene,parameters.taps,stages_ms.shading\n\"a,b\",9,\n\"say \"\"c\"\"\",,1.5\n");
    EXPECT_EQ(runsCsv(Json::array()), "");
}

TEST(Report, ARunWithoutAColumnOfTheTableIsAnErrorOfTheFile) {
    std::ostringstream table;
    Json run = madeUpRun("dag", "dag", 3);
    printRuns(table, Json::array({run}));
    for (const char* key : {"scene", "frame", "label", "time_ms", "pair_count", "flip"}) {
        Json less = run;
        less.erase(key);
        EXPECT_THROW(printRuns(table, Json::array({less})), Json::exception) << key;
    }
    EXPECT_THROW(printRuns(table, Json::array({7})), Json::exception);
}

TEST(Report, ResultsWithoutARunStillHaveAPage) {
    const TemporaryDirectory directory;
    writeText(directory / "results.json", madeUpResults(Json::array()).dump());
    std::string said;
    ASSERT_EQ(runReport({"compare", directory.path()}, &said), 0) << said;
    EXPECT_THAT(readText(directory / "index.html"), HasSubstr("0 runs on builtin:made-up"));
    writeText(directory / "results.json", R"({"provenance": {}, "runs": [{}]})");
    EXPECT_EQ(runReport({"compare", directory.path(), "--no-charts"}, &said), 3);
    EXPECT_THAT(said, HasSubstr("results.json: not a results file of compare: lacks '"));
}

TEST(Report, NamesCannotBecomeMarkup) {
    Json results = madeUpResults(Json::array({madeUpRun("maps", "<script>alert(2)</script>", 1)}));
    results["experiment"]["title"] = "<script>alert(1)</script>";
    const std::string html = pageOfCompare(results);
    EXPECT_EQ(html.find("<script>alert"), std::string::npos);
    EXPECT_THAT(html, testing::HasSubstr("&lt;script&gt;alert(1)"));
    EXPECT_THAT(html, testing::HasSubstr("&lt;script&gt;alert(2)"));
    EXPECT_EQ(html.find("http"), std::string::npos) << "the page must not need the net";
}

} // namespace shadowdag
