// SPDX-License-Identifier: Apache-2.0
// The pages of studies on made-up results: their content, and that no name becomes markup.
#include "tests/tools/report/report_runner.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace shadowdag {

namespace {

using testing::HasSubstr;
using testing::Not;

const std::string kEvil = "<script>alert(1)</script>";

/// Returns results that every page takes: what does not hold, and where they come from.
Json madeResults(const Json& more) {
    Json results = {{"provenance", {{"commit", kEvil}}}, {"broken", Json::array({kEvil})}};
    results.update(more);
    return results;
}

/// Returns a cell of failures and of real scenes: 10 of 1000 pairs are false light.
Json madeCell() {
    Json cell = {{"failure", "acne"},  {"scene", "room"},
                 {"method", "maps"},   {"remedy", "off"},
                 {"pair_count", 1000}, {"mean_abs_visibility_error", 0.5},
                 {"known", "no"},      {"broken", Json::array({"contact_count"})}};
    for (const char* key :
         {"false_shadow_count", "unexplained_count", "unnamed_count", "acne_count", "contact_count",
          "magnified_count", "missing_tap_count", "flicker_count", "flicker_answer_count",
          "drawn_map_count", "traced_map_count", "triangle_count", "light_count", "occluded_count"})
        cell[key] = 0;
    cell["false_light_count"] = 10;
    cell["null_rate"] = 0.25;
    return cell;
}

void expectNoMarkup(const std::string& page) {
    EXPECT_EQ(page.find("<script>alert"), std::string::npos);
    EXPECT_THAT(page, HasSubstr("&lt;script&gt;alert(1)"));
    EXPECT_EQ(page.find("http"), std::string::npos) << "the page must not need the net";
}

} // namespace

TEST(StudyPages, AFailureIsShownWithItsPicturesItsCountsAndItsRemedy) {
    Json cell = madeCell();
    cell["images"] = {{"color", "c.png"}, {"error", "e.png"}};
    Json other = cell;
    other["failure"] = "acne-room"; // the row on a scene of the user's
    Json results = madeResults(Json::parse(R"({
        "remedies": [{"failure": "acne", "method": "maps", "measure": "acne_count", "off": 1200,
                      "on": 3, "factor": 50, "is_seen": false}],
        "pictures": [{"failure": "acne", "truth": "t.png"}],
        "left_out": [{"failure": "acne", "method": "dag", "why": "gl"}],
        "study": {"rows": [{"name": "acne", "scene": "builtin:fail-acne", "remedy": "R.",
                            "source": "S", "off": "a=1", "on": "a=2"}]}})"));
    results["cells"] = Json::array({cell, other});
    results["study"]["rows"][0]["what"] = kEvil;
    results["study"]["slack"] = {{"share", 0.125}, {"count", 1234}};
    const std::string page = pageOf("failures", "failures.json", results);
    expectNoMarkup(page);
    for (const char* shown :
         {"<h2 id=\"acne\">", "<h2 id=\"acne-room\">", "<code>builtin:fail-acne</code>",
          "src=\"images/t.png\"", "src=\"images/c.png\"", "src=\"images/e.png\"",
          "1.00 % false light", "the recorded count, 12.5 % of it and 1&#8239;234 more",
          "acne_count 1&#8239;200 without and 3 with the remedy, <b>less than the required factor",
          "<b>broken:</b> contact_count", "without the remedy <code>a=1</code>"})
        EXPECT_THAT(page, HasSubstr(shown));
}

TEST(StudyPages, OnlyCellsWithBoundsKeepThem) {
    Json results = madeResults(Json::parse(R"({"remedies": [], "pictures": [], "left_out": [],
        "study": {"rows": [{"name": "acne", "scene": "builtin:fail-acne", "remedy": "R.",
                            "what": "W.", "source": "S"}]}})"));
    results["broken"] = Json::array();
    results["cells"] = Json::array({madeCell()});
    results["cells"][0]["broken"] = Json::array();
    results["cells"][0]["bounds"] = {{"acne_count", 3}};
    EXPECT_THAT(pageOf("failures", "failures.json", results),
                HasSubstr("Every cell keeps its bounds"));
    results["cells"][0]["bounds"] = Json::object();
    EXPECT_THAT(pageOf("failures", "failures.json", results), HasSubstr("No cell has a bound"));
}

TEST(StudyPages, ARealSceneStatesItsContentAndItsLimits) {
    const auto page = [](int occludedCount, const char* lights = "own") {
        Json results = madeResults(Json::parse(R"({
            "pictures": [], "settings": "a=1", "frame_count": 4,
            "study": {"rows": [{"name": "room", "what": "A room.",
                                "unexplained": [{"method": "dag", "failure": "tie"}]}]}})"));
        results["study"]["rows"][0]["unexplained"][0]["reason"] = kEvil;
        results["cells"] = Json::array({madeCell()});
        results["cells"][0]["occluded_count"] = occludedCount;
        results["cells"][0]["lights"] = lights;
        return pageOf("real", "real.json", results);
    };
    expectNoMarkup(page(0));
    EXPECT_THAT(page(0), HasSubstr("It shows no shadow edge"));
    EXPECT_THAT(page(500), Not(HasSubstr("It shows no shadow edge")));
    EXPECT_THAT(page(500), HasSubstr("A room. 0 triangles, 0 lights, 1&#8239;000 pairs"));
    EXPECT_EQ(page(500).find("is not to be trusted here"), std::string::npos);
    EXPECT_THAT(page(500, "placed"), HasSubstr("0 lights that were placed, 1&#8239;000 pairs"));
    EXPECT_THAT(page(500), HasSubstr("(no): it is held to what any scene"));
    Json results = madeResults(Json::parse(R"({"pictures": [], "settings": "a=1", "frame_count": 4,
                                               "study": {"rows": []}})"));
    results["cells"] = Json::array({madeCell()});
    results["cells"][0].update({{"lights", "own"}, {"untrusted", kEvil}});
    EXPECT_THAT(pageOf("real", "real.json", results),
                HasSubstr("<b>maps</b> is not to be trusted here"));
    // The share of explained errors, all of them here, stands only where it says something.
    results["cells"] = Json::array();
    for (const Json& power : {Json(true), Json(), Json(false)}) {
        results["cells"].push_back(madeCell());
        results["cells"].back().update(
            {{"lights", "own"}, {"untrusted", kEvil}, {"explaining_has_power", power}});
    }
    results["study"]["tolerances"] = {{{"null_rate", 0.25}}, {{"null_rate", 0.25}}};
    const std::string powers = pageOf("real", "real.json", results);
    const auto countOf = [&](const std::string& text) {
        size_t count = 0;
        for (size_t at = powers.find(text); at != std::string::npos; at = powers.find(text, at + 1))
            ++count;
        return count;
    };
    EXPECT_EQ(countOf(">no power</td>"), 1u);
    EXPECT_EQ(countOf(">100.0</td>"), 2u);
    EXPECT_EQ(countOf("explaining has no power in 1 of 3 cells: there more than 25.0 % of the right"),
              1u);
    EXPECT_EQ(countOf("the recorded one, 5.0 % of it and 3 more"), 1u);
    expectNoMarkup(powers);
}

TEST(StudyPages, StabilityNamesTheCheckNearestToItsBound) {
    const auto check = [](const char* name, double value, bool holds) {
        return Json{{"part", "time"},    {"band", "b"},    {"method", "maps"},
                    {"group", "time-a"}, {"case", name},   {"low", 0.0},
                    {"high", 1.0},       {"value", value}, {"holds", holds}};
    };
    Json results = madeResults(Json::parse(R"({
        "time": [{"group": "time-a", "value": 0.25}], "perturbation": [], "numeric": [],
        "resolution": [], "rates": [],
        "study": {"rows": [{"name": "time-a"}], "bands": [], "known": []}})"));
    results["study"]["rows"][0]["what"] = kEvil;
    results["checks"] = Json::array({check("far", 0.1, true), check("near", 1.5, false)});
    const std::string page = pageOf("stability", "stability.json", results);
    expectNoMarkup(page);
    EXPECT_THAT(page, HasSubstr("<td>2</td><td><b>1</b></td><td>time-a, near</td><td>1.5</td>"
                                "<td>0 to 1</td>"));
    EXPECT_THAT(page, Not(HasSubstr("id=\"numeric\"")));
}

TEST(StudyPages, AMechanismWhoseDefaultDisagreesIsMarked) {
    const Json side = {{"pair_count", 1},
                       {"false_shadow_count", 1000},
                       {"false_light_count", 0},
                       {"unexplained_false_shadow_count", 2},
                       {"unexplained_false_light_count", 3},
                       {"acne_count", 0},
                       {"triangle_draw_count", 0},
                       {"texel_count", 0},
                       {"ray_count", 0}};
    const Json scene = {{"scene", "room"}, {"own_ratio", 0.5}, {"off", side}, {"on", side}};
    const Json row = {{"name", "made"},      {"metric", "bytes"},
                      {"own_ratio", 0.5},    {"agrees", false},
                      {"verdict", "on"},     {"reason", kEvil},
                      {"is_default", false}, {"what", "W."},
                      {"method", "maps"},    {"always", ""},
                      {"off_settings", "a"}, {"on_settings", "b"},
                      {"kept_for", ""},      {"is_sequence", true},
                      {"source", "S"},       {"scenes", Json::array({scene})}};
    Json results = madeResults({{"mechanisms", Json::array({row})},
                                {"scenes", Json::array({"room"})},
                                {"size", "1x1"},
                                {"disagreements", Json::array({kEvil})}});
    const std::string page = pageOf("mechanisms", "mechanisms.json", results);
    expectNoMarkup(page);
    for (const char* shown :
         {"<a href=\"#made\">made</a>", "<td>0.500</td>", "<td><b>on</b></td><td>off</td>",
          "1&#8239;000 \u2192 1&#8239;000", "<td>5 \u2192 5</td>", "; frames in sequence. Source"})
        EXPECT_THAT(page, HasSubstr(shown));
    EXPECT_EQ(pageOf("ablation", "ablation.json", results).find("mechanisms.json"),
              std::string::npos);
}

} // namespace shadowdag
