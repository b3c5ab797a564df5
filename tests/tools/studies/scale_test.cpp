// SPDX-License-Identifier: Apache-2.0
// Studies of scale: their files, crossovers of times computed by hand, and a small run.
#include "tools/studies/scale.h"

#include "cuda/error.h"
#include "scenes/builtin.h"
#include "scenes/gltf.h"
#include "tests/tools/temporary_directory.h"
#include "tools/settings/console.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <cmath>
#include <functional>
#include <stdexcept>

namespace shadowdag {
namespace {

using testing::AllOf;
using testing::HasSubstr;

/// A study of one small scene, grown in three ways.
Json tinyStudy() {
    return Json::parse(R"({
        "kind": "scale", "title": "T", "what": "W", "size": "96x54", "warmups": 0, "repeats": 2,
        "rows": [
          {"name": "divided", "scene": "builtin:fail-contact", "what": "D", "grow": "tessellate",
           "triangles": [1, 400, 410, 1600], "resolutions": [64, 256]},
          {"name": "leaves", "scene": "builtin:fail-contact", "what": "L", "grow": "leaves",
           "triangles": [2000], "resolutions": [64], "seed": 3, "cover": 0.5, "masked": false},
          {"name": "hidden", "scene": "builtin:fail-contact", "what": "H", "grow": "instance",
           "triangles": [500], "resolutions": [64], "only_by_name": true}]})");
}

StudyFile tinyFile(const std::function<void(Json&)>& change = {}) {
    StudyFile file{"tiny", "tiny.json", tinyStudy()};
    if (change)
        change(file.json);
    return file;
}

std::string complaintAbout(const std::function<void(Json&)>& change,
                           const StudyRequest& request = {}) {
    const Console console(true);
    try {
        makeStudy(tinyFile(change), request, console);
    } catch (const Error& error) {
        return error.what();
    }
    return "nothing was refused";
}

const Json& cellOf(const Json& results, const std::string& row, uint64_t count,
                   const std::string& method) {
    for (const Json& cell : results["cells"])
        if (cell["row"] == row && cell["triangle_count"] == count && cell["method"] == method)
            return cell;
    throw std::out_of_range(row + " " + std::to_string(count) + " " + method);
}

TEST(Scale, TheShippedStudyGrowsFromThreeHundredThousandToTenMillion) {
    const ScaleTable table = readScale(findStudy("scale"));
    uint64_t least = UINT64_MAX, most = 0;
    for (const ScaleRow& row : table.rows) {
        if (row.isOnlyByName)
            continue;
        least = std::min(least, row.triangleCounts.front());
        most = std::max(most, row.triangleCounts.back());
        EXPECT_GE(row.resolutionLog2.front(), 10u) << row.name;
    }
    EXPECT_LE(least, 325104u);
    EXPECT_GE(most, 10000000u);
}

TEST(Scale, RowsThatMustBeNamedAreMeasuredOnlyIfTheyAre) {
    const Console console(true);
    EXPECT_THAT(makeStudy(tinyFile(), {}, console)->parts(),
                testing::ElementsAre("divided at 1", "divided at 400", "divided at 410",
                                     "divided at 1600", "leaves at 2000"));
    StudyRequest named;
    named.names = {"hidden"};
    EXPECT_THAT(makeStudy(tinyFile(), named, console)->parts(),
                testing::ElementsAre("hidden at 500"));
    StudyRequest given;
    given.names = {"leaves"};
    given.scenes = {"a/x.glb", "b/y.glb"};
    const auto study = makeStudy(tinyFile(), given, console);
    EXPECT_THAT(study->parts(), testing::ElementsAre("leaves-x at 2000", "leaves-y at 2000"));
    EXPECT_EQ(study->scenes(), given.scenes);
}

TEST(Scale, FilesThatCannotBeMeasuredAreRefusedByFileAndRow) {
    const auto ofRow = [](const char* key, const Json& value) {
        return complaintAbout([&](Json& json) { json["rows"][0][key] = value; });
    };
    const auto without = [](const char* key) {
        return complaintAbout([&](Json& json) { json["rows"][0].erase(key); });
    };
    EXPECT_EQ(complaintAbout({}), "nothing was refused");
    const std::string row = "tiny.json: row 1, \"divided\": key ";
    EXPECT_THAT(ofRow("grow", "explode"),
                AllOf(HasSubstr(row), HasSubstr("must be one of tessellate, instance, leaves")));
    EXPECT_THAT(ofRow("triangles", Json::array()), HasSubstr(row + "\"triangles\" is []"));
    EXPECT_THAT(ofRow("triangles", {1000, 0}), HasSubstr(row + "\"triangles\" is 0"));
    EXPECT_THAT(ofRow("triangles", {1000, 1000}), HasSubstr("is listed twice"));
    EXPECT_THAT(without("triangles"), HasSubstr(row + "\"triangles\" is null"));
    EXPECT_THAT(ofRow("resolutions", {100}),
                AllOf(HasSubstr(row), HasSubstr("is 100; it must contain powers of two")));
    EXPECT_THAT(ofRow("resolutions", {32768}), HasSubstr("a whole number from 16 to 16384"));
    EXPECT_THAT(without("resolutions"), HasSubstr(row + "\"resolutions\" is null"));
    EXPECT_THAT(without("scene"), HasSubstr(row + "\"scene\" is missing"));
    EXPECT_THAT(ofRow("masked", true), HasSubstr("is for rows that grow by leaves"));
    EXPECT_THAT(ofRow("size", "1x1"), HasSubstr("unknown key \"size\""));
    EXPECT_THAT(complaintAbout([](Json& json) { json["rows"][1]["cover"] = 0; }),
                HasSubstr("tiny.json: row 2, \"leaves\": key \"cover\" is 0"));
    EXPECT_THAT(complaintAbout([](Json& json) { json["size"] = "big"; }), HasSubstr("tiny.json: "));
    EXPECT_THAT(complaintAbout([](Json& json) { json["repeats"] = 0; }),
                HasSubstr("tiny.json: key \"repeats\" is 0"));
    EXPECT_THAT(complaintAbout([](Json& json) { json["rows"] = Json::array(); }),
                HasSubstr("must contain at least one row"));
    StudyRequest device;
    device.backend = Backend::kCuda;
    EXPECT_THAT(complaintAbout({}, device), HasSubstr("use --backend cpu"));
}

TEST(Scale, WhatDoesNotFitIntoMemoryIsRefusedBeforeItIsMeasured) {
    const uint64_t needed = scaleBytes(100'000'000, 3);
    EXPECT_GT(needed, uint64_t(16) << 30);
    EXPECT_GT(scaleBytes(100'000'000, 4), needed);
    EXPECT_NO_THROW(requireScaleMemory("huge", 100'000'000, 3, needed));
    try {
        requireScaleMemory("huge", 100'000'000, 3, needed - 1);
        FAIL() << "nothing was refused";
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kResource);
        EXPECT_THAT(error.what(),
                    AllOf(HasSubstr("row \"huge\" at 100000000 triangles takes at least"),
                          HasSubstr("GiB; leave the number out of \"triangles\"")));
    }
}

TEST(Scale, CrossoversAreWhereLinesOfLogarithmsMeet) {
    const std::vector<ScalePoint> flat = {{1e4, 10}, {1e6, 10}, {1e8, 10}};
    // Twice the time at 10^4, half of it at 10^6: equal half way, by ratio, at 10^5.
    const Crossover from = crossoverOf({{1e6, 5}, {1e4, 20}, {1e8, 1}}, flat);
    EXPECT_EQ(from.kind, CrossoverKind::kFrom);
    EXPECT_NEAR(from.triangleCount, 1e5, 1e-3);
    EXPECT_EQ(from.least, 1e4);
    EXPECT_EQ(from.largest, 1e8);
    // 2 and 1/8 of it: a quarter of the way, as log 2 is to log 16.
    EXPECT_NEAR(crossoverOf({{1e4, 20}, {1e6, 1.25}, {1e8, 1}}, flat).triangleCount,
                std::pow(10.0, 4.5), 1e-2);
    // Both lines are inclined.
    const Crossover both = crossoverOf({{1e4, 40}, {1e8, 40}}, {{1e4, 10}, {1e8, 160}});
    EXPECT_EQ(both.kind, CrossoverKind::kFrom);
    EXPECT_NEAR(both.triangleCount, 1e6, 1e-2);
}

TEST(Scale, CrossoversAreNamedForEachOrderOfTheTimes) {
    const std::vector<ScalePoint> flat = {{1e4, 10}, {1e6, 10}, {1e8, 10}};
    const auto kindOf = [&](const std::vector<ScalePoint>& method) {
        return crossoverOf(method, flat).kind;
    };
    EXPECT_EQ(kindOf({{1e4, 11}, {1e6, 11}, {1e8, 11}}), CrossoverKind::kNever);
    EXPECT_EQ(kindOf({{1e4, 10}, {1e6, 10}, {1e8, 10}}), CrossoverKind::kNever) << "ties";
    EXPECT_EQ(kindOf({{1e4, 9}, {1e6, 9}, {1e8, 9}}), CrossoverKind::kEverywhere);
    // A tie, then faster: from the number of the tie on.
    const Crossover tie = crossoverOf({{1e4, 12}, {1e6, 10}, {1e8, 9}}, flat);
    EXPECT_EQ(tie.kind, CrossoverKind::kFrom);
    EXPECT_NEAR(tie.triangleCount, 1e6, 1e-3);
    // Faster, slower, faster: what counts is from where on it stays so.
    const Crossover again = crossoverOf({{1e4, 5}, {1e6, 20}, {1e8, 5}}, flat);
    EXPECT_EQ(again.kind, CrossoverKind::kFrom);
    EXPECT_NEAR(again.triangleCount, 1e7, 1e-1);
    const Crossover lost = crossoverOf({{1e4, 5}, {1e6, 20}, {1e8, 40}}, flat);
    EXPECT_EQ(lost.kind, CrossoverKind::kUpTo);
    EXPECT_NEAR(lost.triangleCount, 1e5, 1e-3);
    // A single number; numbers without a partner; none at all.
    EXPECT_EQ(kindOf({{1e6, 9}}), CrossoverKind::kEverywhere);
    const Crossover part = crossoverOf({{1e4, 20}, {3e5, 1}, {1e8, 5}}, flat);
    EXPECT_EQ(part.kind, CrossoverKind::kFrom);
    EXPECT_NEAR(part.triangleCount, 1e6, 1e-2);
    EXPECT_EQ(kindOf({{3e5, 1}}), CrossoverKind::kNone);
    EXPECT_EQ(crossoverOf({}, {}).kind, CrossoverKind::kNone);
    EXPECT_EQ(kindOf({{1e4, 0}}), CrossoverKind::kNone) << "a time of 0 has no logarithm";
}

TEST(Scale, CrossoversOfResultsStateTheTimesAtTheLargestNumber) {
    Json cells = Json::array();
    const auto add = [&](const char* row, const char* method, double count, double ns) {
        cells.push_back({{"row", row},
                         {"method", method},
                         {"triangle_count", count},
                         {"ns_per_pair", ns},
                         {"ns_per_pair_low", 0.8 * ns},
                         {"ns_per_pair_high", 1.2 * ns},
                         {"ns_per_pair_confidence", ns == 39 ? 0.0 : 0.96}});
    };
    add("a", "embree", 1e5, 10);
    add("a", "voxels 64", 1e5, 20);
    add("a", "embree", 1e7, 40);
    add("a", "voxels 64", 1e7, 20);
    add("a", "maps cold", 1e7, 30);
    add("b", "voxels 64", 1e7, 30);
    add("c", "embree", 1e7, 39); // a single time
    add("c", "voxels 64", 1e7, 1);
    const Json crossovers = crossoversOf(cells);
    ASSERT_EQ(crossovers.size(), 3u) << "Embree is not compared with itself, nor without it";
    EXPECT_EQ(crossovers[0]["row"], "a");
    EXPECT_EQ(crossovers[0]["method"], "voxels 64");
    EXPECT_EQ(crossovers[0]["kind"], "from");
    EXPECT_NEAR(crossovers[0]["triangle_count"].get<double>(), 1e6, 1);
    EXPECT_EQ(crossovers[0]["largest_triangle_count"], 1e7);
    EXPECT_EQ(crossovers[0]["ns_per_pair"], 20);
    EXPECT_EQ(crossovers[0]["embree_ns_per_pair"], 40);
    EXPECT_EQ(crossovers[0]["are_apart"], true);
    EXPECT_EQ(crossovers[0]["text"], "faster than Embree from 1 M triangles on");
    EXPECT_EQ(crossovers[1]["kind"], "everywhere");
    EXPECT_EQ(crossovers[1]["triangle_count"], Json());
    EXPECT_EQ(crossovers[1]["are_apart"], false) << "36 is above 32";
    EXPECT_EQ(crossovers[2]["are_apart"], false) << "a single time has no interval";
    EXPECT_EQ(crossovers[2]["text"], "faster than Embree at 10 M triangles");
}

TEST(Scale, ASmallStudyMeasuresEveryMethodAndTheSameSurfacesGiveTheSameAnswers) {
    const Console console(true);
    const auto study = makeStudy(tinyFile(), {}, console);
    const Json results = measureAll(*study, {});
    const char* const methods[] = {"embree",     "exact rays", "voxels 64",
                                   "voxels 256", "maps cold",  "maps warm"};
    for (const uint64_t count : {96u, 384u, 1536u})
        for (const char* method : methods) {
            SCOPED_TRACE(std::string(method) + " " + std::to_string(count));
            const Json& cell = cellOf(results, "divided", count, method);
            const Json& first = cellOf(results, "divided", 96, method);
            EXPECT_GT(cell["pair_count"], 1000);
            EXPECT_EQ(cell["repeat_count"], 2);
            EXPECT_GT(cell["bytes"], 0);
            EXPECT_LE(cell["ns_per_pair_low"], cell["ns_per_pair"]);
            EXPECT_LE(cell["ns_per_pair"], cell["ns_per_pair_high"]);
            EXPECT_NEAR(cell["ns_per_pair"].get<double>(),
                        1e6 * cell["shadow_ms"].get<double>() / cell["pair_count"].get<double>(),
                        1e-6);
            EXPECT_LT(cell["shadow_ms"], cell["time_ms"]);
            // The surface is the same. Embree's packets err by chance.
            if (std::string(method) != "embree") {
                EXPECT_EQ(cell["false_shadow_count"], first["false_shadow_count"]);
                EXPECT_EQ(cell["false_light_count"], first["false_light_count"]);
            }
            if (std::string(method).starts_with("voxels")) {
                EXPECT_EQ(cell["bytes"], first["bytes"]) << "triangles grow, voxels do not";
            }
        }
    EXPECT_GT(cellOf(results, "divided", 1536, "embree")["bytes"],
              cellOf(results, "divided", 96, "embree")["bytes"]);
    EXPECT_EQ(cellOf(results, "divided", 96, "maps cold")["build_s"], 0.0);
    EXPECT_GT(cellOf(results, "divided", 96, "voxels 64")["build_s"], 0.0);
    EXPECT_GT(cellOf(results, "divided", 96, "embree")["build_s"], 0.0);
    EXPECT_GT(cellOf(results, "divided", 96, "exact rays")["build_s"], 0.0);
    EXPECT_EQ(cellOf(results, "divided", 96, "voxels 256")["resolution"], 256);
    EXPECT_EQ(cellOf(results, "leaves", 2000, "exact rays")["false_light_count"], 0);
    ASSERT_EQ(results["skipped"].size(), 1u) << results["skipped"];
    EXPECT_EQ(results["skipped"][0]["asked_triangle_count"], 410);
    EXPECT_EQ(results["steps"].size(), 4u);
    EXPECT_EQ(results["cells"].size(), 3 * 6 + 5u);
    EXPECT_EQ(results["crossovers"].size(), 5 + 4u);
    EXPECT_THAT(study->brokenLines(results), testing::IsEmpty());
    EXPECT_THAT(study->csv(results), HasSubstr("voxels 256"));
}

TEST(Scale, WrongPairsOfExactRaysBreakTheStudy) {
    const Console console(true);
    const auto study = makeStudy(tinyFile(), {}, console);
    const auto broken = [&](const char* method, int wrong) {
        return study->brokenLines({{"cells",
                                    {{{"row", "r"},
                                      {"triangle_count", 7},
                                      {"method", method},
                                      {"pair_count", 1000000},
                                      {"false_shadow_count", wrong},
                                      {"false_light_count", 5}}}}});
    };
    EXPECT_THAT(broken("exact rays", 5), testing::IsEmpty()) << "10 of a million are allowed";
    EXPECT_THAT(broken("exact rays", 6),
                testing::ElementsAre("r at 7 triangles by exact rays: 11 of 1000000 pairs are "
                                     "wrong, more than the study allows"));
    EXPECT_THAT(broken("voxels 64", 100000), testing::IsEmpty());
}

TEST(Scale, ASceneWithoutLightsGetsTheSamePlacedOnesAtEachNumber) {
    const TemporaryDirectory directory;
    Scene scene = makeBuiltin("fail-contact");
    for (LightSource& light : scene.lights)
        light.intensity = 0; // as good as none
    writeGlb(scene, directory / "dark.glb");
    StudyRequest request;
    request.names = {"divided"};
    request.scenes = {directory / "dark.glb"};
    const Console console(true);
    const StudyFile file = tinyFile([&](Json& json) {
        json["placed_lights"] = 5;
        json["rows"][0]["resolutions"] = {64};
        json["rows"][0]["triangles"] = {1, 1600};
    });
    const auto study = makeStudy(file, request, console);
    EXPECT_FALSE(study->needsLights());
    const Json results = measureAll(*study, request);
    ASSERT_EQ(results["steps"].size(), 2u);
    for (const Json& step : results["steps"]) {
        EXPECT_EQ(step["light_count"], 5);
        EXPECT_EQ(step["pair_count"], results["steps"][0]["pair_count"]);
    }
    EXPECT_EQ(cellOf(results, "divided-dark", 1536, "maps cold")["false_light_count"],
              cellOf(results, "divided-dark", 96, "maps cold")["false_light_count"]);
}

} // namespace
} // namespace shadowdag
