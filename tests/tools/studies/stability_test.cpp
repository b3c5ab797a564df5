// SPDX-License-Identifier: Apache-2.0
// The stability of errors: motion of a scene, the fit, the bands and their checks by hand; small
// groups from end to end.
#include "tools/studies/stability.h"
#include "tools/studies/stability_stage.h"

#include "cuda/backend.h"
#include "cuda/error.h"
#include "scenes/fail_scenes.h"
#include "scenes/warning.h"
#include "tests/tools/report/report_runner.h"
#include "tests/tools/temporary_directory.h"
#include "tools/settings/console.h"
#include "tools/studies/study.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

namespace shadowdag {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

FailScene postScene() {
    for (const FailScene& scene : failScenes())
        if (scene.name == "fail-detached-shadow")
            return scene;
    throw std::runtime_error("fail-detached-shadow is gone");
}

TEST(MovedScene, MovesGeometryLightsAndCameraAlike) {
    const Scene scene = makeFailScene(postScene());
    SceneMotion motion;
    motion.scale = 4.0;
    motion.rotation = glm::angleAxis(glm::radians(90.0), glm::dvec3(0, 1, 0)); // x to -z, z to x
    motion.shift = {1000, 0, -16};
    const Scene moved = movedScene(scene, motion);
    const World before(scene, {}), after(moved, {});
    const auto where = [&](const glm::vec3& p) {
        return glm::vec3(4 * p.z + 1000, 4 * p.y, -4 * p.x - 16);
    };
    ASSERT_EQ(after.triangles().count(), before.triangles().count());
    for (size_t i = 0; i < before.triangles().positions.count; ++i)
        ASSERT_LT(
            glm::length(after.triangles().positions[i] - where(before.triangles().positions[i])),
            2e-4f); // rounding at 1000
    ASSERT_EQ(after.lights().size(), before.lights().size());
    const Light &a = before.lights()[0], &b = after.lights()[0];
    EXPECT_LT(glm::length(b.positionWorld - where(a.positionWorld)), 2e-4f);
    EXPECT_FLOAT_EQ(b.rangeWorld, 4 * a.rangeWorld);
    EXPECT_FLOAT_EQ(b.intensity.x, 16 * a.intensity.x);
    // What a light sends to a point stays: candela over metres squared.
    const glm::vec3 p(0.3f, 0.1f, 1.0f);
    EXPECT_NEAR(lightIrradiance(b, where(p)).x, lightIrradiance(a, p).x,
                1e-3f * lightIrradiance(a, p).x);
    const Camera &c = before.cameras()[0], &d = after.cameras()[0];
    EXPECT_LT(glm::length(d.positionWorld - where(c.positionWorld)), 2e-4f);
    EXPECT_LT(glm::length(d.forward - glm::vec3(c.forward.z, c.forward.y, -c.forward.x)), 1e-5f);
    EXPECT_FLOAT_EQ(d.znear, 4 * c.znear);
    EXPECT_FLOAT_EQ(d.zfar, 4 * c.zfar);
}

TEST(MovedScene, ShiftsPartsSeparatelyAndRefusesToDivideANode) {
    const Scene scene = makeFailScene(postScene());
    const World before(scene, {});
    for (int part = 0; part < 3; ++part) {
        SceneMotion motion;
        const glm::dvec3 by(0.5, -0.25, 1.0);
        (part == 0   ? motion.geometryShift
         : part == 1 ? motion.lightShift
                     : motion.cameraShift) = by;
        const Scene moved = movedScene(scene, motion);
        const World after(moved, {});
        const auto shift = [&](bool isMoved) { return isMoved ? glm::vec3(by) : glm::vec3(0.0f); };
        EXPECT_EQ(after.triangles().positions[0],
                  before.triangles().positions[0] + shift(part == 0));
        EXPECT_EQ(after.lights()[0].positionWorld,
                  before.lights()[0].positionWorld + shift(part == 1));
        EXPECT_EQ(after.cameras()[0].positionWorld,
                  before.cameras()[0].positionWorld + shift(part == 2));
    }
    Scene one = scene;
    one.nodes[size_t(one.roots[0])].light = 0;
    SceneMotion motion;
    motion.lightShift = {1, 0, 0};
    try {
        movedScene(one, motion);
        FAIL() << "was taken";
    } catch (const Error& error) {
        EXPECT_THAT(error.what(), HasSubstr("cannot be shifted separately"));
    }
    motion.geometryShift = motion.cameraShift = motion.lightShift;
    EXPECT_NO_THROW(movedScene(one, motion));
}

// By hand: y = 3 x^1.5 exactly; then one point off.
TEST(FitRate, ComputesTheSlopeItsErrorAndLocalSlopes) {
    std::vector<std::pair<double, double>> points;
    for (const double x : {1.0, 2.0, 4.0, 8.0})
        points.push_back({x, 3 * std::pow(x, 1.5)});
    FittedRate fit = fitRate(points);
    EXPECT_NEAR(fit.slope, 1.5, 1e-12);
    EXPECT_NEAR(fit.standardError, 0, 1e-7);
    EXPECT_NEAR(fit.leastLocal, 1.5, 1e-12);
    // log2 y = 0, 1, 2 and 5: mean 2, sum (x - mean)(y - mean) = 3 + 0.5 + 0 + 4.5 = 8 over 5;
    // residuals 0.4, -0.2, -0.8, 0.6: sum of squares 1.2; sqrt(1.2 / 2 / 5).
    fit = fitRate({{1, 1}, {2, 2}, {4, 4}, {8, 32}});
    EXPECT_NEAR(fit.slope, 1.6, 1e-12);
    EXPECT_NEAR(fit.standardError, std::sqrt(0.12), 1e-12);
    EXPECT_NEAR(fit.leastLocal, 1, 1e-12);
    EXPECT_NEAR(fit.greatestLocal, 3, 1e-12);
    // Points that are not positive are left out; of fewer than three there is no rate.
    EXPECT_EQ(fitRate({{1, 1}, {2, 0}, {4, 4}, {8, 8}}).pointCount, 3u);
    EXPECT_THROW(fitRate({{1, 1}, {2, 0}, {4, 4}}), Error);
}

StabilityTable table(uint32_t width = 512) {
    StabilityTable read = readStability(findStudy("stability"));
    read.width = width;
    return read;
}

/// Measures a group or part in rows of so many pixels.
Json measure(const std::vector<std::string>& names, uint32_t width, uint32_t finestLog2 = 12) {
    StabilityTable of = table(width);
    of.finestVoxelsLog2 = finestLog2;
    Json results = Json::object();
    for (const StabilityGroup& group : stabilityGroupsNamed(of, names)) {
        const Json measured = measureStability(of, group);
        for (const auto& [key, list] : measured.items())
            for (const Json& item : list)
                results[key].push_back(item);
    }
    return results;
}

TEST(Stability, TablesAreConsistent) {
    const StabilityTable tables = table();
    std::set<std::string> names, parts, ids;
    for (const StabilityGroup& group : tables.groups) {
        EXPECT_TRUE(names.insert(group.name).second) << group.name << " is there twice";
        EXPECT_TRUE(group.name.starts_with(kStabilityPartNames[size_t(group.part)])) << group.name;
        EXPECT_FALSE(group.what.empty());
        parts.insert(kStabilityPartNames[size_t(group.part)]);
    }
    EXPECT_EQ(parts.size(), size_t(kStabilityPartCount));
    for (const StabilityBand& band : tables.bands) {
        EXPECT_TRUE(ids.insert(band.id).second) << band.id << " is there twice";
        EXPECT_FALSE(band.formula.empty() || band.reason.empty() || band.kinds.empty() ||
                     band.methods.empty())
            << band.id;
        const auto [low, high] = limitsOf(band, band.methods[0], {});
        EXPECT_LE(low, high) << band.id;
    }
    for (const KnownBreak& known : tables.known) {
        EXPECT_TRUE(names.contains(known.group)) << known.group;
        EXPECT_LE(known.low, known.high);
        EXPECT_FALSE(known.reason.empty());
    }
    // A misspelt kind, method or measure would check nothing. What groups give stands in the last
    // run that was committed: each entry of the tables made a check there, and each check there
    // would be made by the same entry today.
    const Json run = Json::parse(readText(SDAG_SOURCE_DIR "/tests/bench/results/stability.json"));
    std::set<std::vector<std::string>> made;
    std::set<std::string> groups;
    for (const Json& check : run["checks"]) {
        const std::string band = check["band"], kind = check["kind"], method = check["method"],
                          group = check["group"], measure = check["measure"];
        made.insert(band == "known" ? std::vector<std::string>{band, group, kind, method, measure}
                                    : std::vector<std::string>{band, "kind", kind});
        made.insert({band, "method", method});
        groups.insert(group);
        const auto part = std::find(kStabilityPartNames, kStabilityPartNames + kStabilityPartCount,
                                    check["part"].get<std::string>());
        Json again = Json::array();
        addChecks(tables, again, StabilityPart(part - kStabilityPartNames), check, measure, 0, {});
        EXPECT_EQ(again.empty() ? "none" : again[0]["band"], band) << check;
    }
    const char* const rerun = " checks nothing that the committed run of study stability gave; "
                              "mend it, or run it and commit tests/bench/results/stability.json";
    for (const StabilityBand& band : tables.bands) {
        for (const std::string& kind : band.kinds)
            EXPECT_TRUE(made.contains({band.id, "kind", kind})) << band.id << ", " << kind << rerun;
        for (const MatrixMethod method : band.methods)
            EXPECT_TRUE(made.contains({band.id, "method", kMatrixMethodNames[size_t(method)]}))
                << band.id << ", " << kMatrixMethodNames[size_t(method)] << rerun;
    }
    for (const KnownBreak& known : tables.known)
        EXPECT_TRUE(made.contains({"known", known.group, known.kind, known.method, known.measure}))
            << known.group << ", " << known.method << rerun;
    EXPECT_EQ(groups, names) << "groups that the committed run checked, and those there are";
}

Json rowOf(const std::string& kind, const std::string& method) {
    return {
        {"group", "perturbation-posts"}, {"case", "by hand"}, {"kind", kind}, {"method", method}};
}

// By hand: of 10000 pairs 100 are wrong; 0.4 of them may be others, three standard deviations are 3
// sqrt(0.4) = 1.897, and three: 5.297 pairs.
TEST(Stability, AThousandthMayChangeTheDerivedNumbers) {
    const StabilityTable tables = table();
    BandInputs inputs;
    inputs.base = 0.01;
    inputs.count = 10000;
    for (const auto& [wrong, holds] :
         {std::pair(105, true), {106, false}, {95, true}, {94, false}}) {
        Json checks = Json::array();
        addChecks(tables, checks, StabilityPart::kPerturbation, rowOf("tiny", "maps"),
                  "wrong_share", wrong / 10000.0, inputs);
        ASSERT_EQ(checks.size(), 1u);
        EXPECT_NEAR(checks[0]["high"].get<double>(), 105.297e-4, 1e-7);
        EXPECT_NEAR(checks[0]["low"].get<double>(), 94.703e-4, 1e-7);
        EXPECT_EQ(checks[0]["holds"], holds) << wrong;
        EXPECT_EQ(unstableLines({{"checks", checks}}).size(), holds ? 0u : 1u);
    }
    Json checks = Json::array();
    addChecks(tables, checks, StabilityPart::kPerturbation, rowOf("tiny", "dag believe all"),
              "acne_count", 1, inputs);
    EXPECT_TRUE(checks.empty()); // no band
    addChecks(tables, checks, StabilityPart::kPerturbation, rowOf("shifted", "dag believe none"),
              "wrong_share", 1e-4, inputs);
    EXPECT_EQ(checks[0]["holds"], false);
    const std::vector<std::string> lines = unstableLines({{"checks", checks}});
    ASSERT_EQ(lines.size(), 1u);
    EXPECT_THAT(lines[0],
                HasSubstr("perturbation-posts, by hand, by dag believe none: wrong_share is "
                          "0.0001, band 0.0 to 0.0"));
}

// By hand: of 4 outlines a = 0.865; three of 1000 pairs. Rounding by a quarter of a voxel adds 6 /
// 4 to rays, by an eighth of a texel 6 / 8 to maps, the larger to the hybrid.
TEST(Stability, FarAwayBandsGrowWithTheSpacingOfFloats) {
    const StabilityTable tables = table();
    BandInputs inputs;
    inputs.base = 0.1;
    inputs.count = 1000;
    inputs.outlineCount = 4;
    inputs.voxelSpacing = 0.25;
    inputs.texelSpacing = 0.125;
    const auto bandOf = [&](const std::string& kind, const char* method) {
        Json checks = Json::array();
        addChecks(tables, checks, StabilityPart::kPerturbation, rowOf(kind, method), "wrong_share",
                  0.1, inputs);
        return std::pair(checks.at(0)["low"].get<double>(), checks.at(0)["high"].get<double>());
    };
    for (const std::string kind : {"shifted", "shifted, aligned"}) {
        EXPECT_NEAR(bandOf(kind, "maps").first, 0.0135 - 0.003, 1e-9);
        EXPECT_NEAR(bandOf(kind, "dag believe all").second, 0.1 * (1 + 0.865 + 1.5) + 0.003, 1e-9)
            << kind;
        EXPECT_NEAR(bandOf(kind, "maps").second, 0.1 * (1 + 0.865 + 0.75) + 0.003, 1e-9) << kind;
        EXPECT_NEAR(bandOf(kind, "hybrid").second, 0.1 * (1 + 0.865 + 1.5) + 0.003, 1e-9) << kind;
    }
    EXPECT_NEAR(bandOf("shifted", "dag believe all").first, 0.0135 - 0.003, 1e-9);
    std::swap(inputs.voxelSpacing, inputs.texelSpacing);
    EXPECT_NEAR(bandOf("shifted", "dag believe all").second, 0.1 * (1 + 0.865 + 0.75) + 0.003,
                1e-9);
    EXPECT_NEAR(bandOf("shifted", "maps").second, 0.1 * (1 + 0.865 + 1.5) + 0.003, 1e-9);
    EXPECT_NEAR(bandOf("shifted", "hybrid").second, 0.1 * (1 + 0.865 + 1.5) + 0.003, 1e-9);
}

// By hand: three of 1000 pairs; rounding by a texel makes an outline 1 + 3 texels off, shifts reach
// 2, so a strip of 2 texels is beyond: four times what half a texel holds. A quarter texel leaves
// 1.75, within reach. Rays round in voxels and have no such strip.
TEST(Stability, FarAwayOnlyRoundingExceedsTheShifts) {
    const StabilityTable tables = table();
    BandInputs inputs;
    inputs.count = 1000;
    inputs.reachTexels = 2;
    inputs.wrongShare = 0.01;
    const auto highOf = [&](const std::string& kind, const char* method, const char* measure,
                            double spacing) {
        inputs.texelSpacing = inputs.voxelSpacing = spacing;
        Json checks = Json::array();
        addChecks(tables, checks, StabilityPart::kPerturbation, rowOf(kind, method), measure, 0,
                  inputs);
        return checks.at(0)["high"].get<double>();
    };
    EXPECT_NEAR(highOf("shifted", "maps", "unexplained_share", 1), 0.003 + 0.04, 1e-9);
    EXPECT_NEAR(highOf("shifted, aligned", "hybrid", "unexplained_share", 1), 0.043, 1e-9);
    EXPECT_NEAR(highOf("shifted", "maps", "unexplained_share", 0.25), 0.003, 1e-9);
    EXPECT_NEAR(highOf("shifted", "dag believe all", "unexplained_share", 1), 0.003, 1e-9);
    EXPECT_NEAR(highOf("turned", "maps", "unexplained_share", 1), 0.003, 1e-9);
    EXPECT_NEAR(highOf("shifted", "maps", "unnamed_share", 1), 0.003, 1e-9);
}

TEST(Stability, ASceneWithoutPairsIsRefused) {
    const Json row = rowOf("tiny", "maps");
    EXPECT_EQ(shareOf(row, "pairs", 1, 4), 0.25);
    EXPECT_NO_THROW(requireEvidence(row, 4, 1));
    const auto message = [](const std::function<void()>& ask) {
        try {
            ask();
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::kInput);
            return std::string(error.what());
        }
        return std::string();
    };
    EXPECT_THAT(message([&] { shareOf(row, "held answers", 0, 0); }),
                HasSubstr("perturbation-posts, by hand, by maps: there are no held answers"));
    for (const auto& [pairs, dark] : {std::pair(0u, 0u), {4u, 0u}, {4u, 4u}})
        EXPECT_THAT(message([&] { requireEvidence(row, pairs, dark); }),
                    HasSubstr("there is no shadow edge to judge"))
            << dark << " of " << pairs;
    // A picture of one pixel and a scene of one light.
    StabilityTable of = table(2);
    Json results = {{"time", {}},
                    {"perturbation", {}},
                    {"resolution", {}},
                    {"rates", {}},
                    {"checks", Json::array()}};
    StabilityGroup group{"by-hand", StabilityPart::kTime, "builtin:fail-self-shadow", "one pixel"};
    EXPECT_THAT(message([&] { measureTime(of, group, results); }),
                HasSubstr("there is no shadow edge to judge"));
    of.width = 1;
    for (const auto measure : {measurePerturbation, measureResolution})
        EXPECT_THAT(message([&] { measure(of, group, results); }),
                    HasSubstr("there is no shadow edge to judge"));
    EXPECT_TRUE(results["checks"].empty());
}

TEST(Stability, AKnownCheckReplacesABand) {
    const StabilityTable tables = table();
    ASSERT_FALSE(tables.known.empty());
    const KnownBreak& known = tables.known.front();
    const auto group = std::find_if(tables.groups.begin(), tables.groups.end(),
                                    [&](const StabilityGroup& g) { return g.name == known.group; });
    const Json row = {{"group", known.group},
                      {"case", "by hand"},
                      {"kind", known.kind},
                      {"method", known.method}};
    for (const double value : {known.low, known.high, known.low - 0.01, known.high + 0.01}) {
        Json checks = Json::array();
        addChecks(tables, checks, group->part, row, known.measure, value, {});
        ASSERT_EQ(checks.size(), 1u);
        EXPECT_EQ(checks[0]["band"], "known");
        EXPECT_EQ(checks[0]["holds"], value >= known.low && value <= known.high);
    }
}

TEST(Stability, SmallGroupsKeepTheirBands) {
    Json results = measure({"numeric-rays", "perturbation-cubes"}, 128);
    EXPECT_THAT(unstableLines(results), IsEmpty());
    // Of rays 4 grids by 3 measures. Of cubes 17 motions by: wrong share and both of unexplained of
    // 4 methods; the mean error of maps where bands know it, 6 tiny ones and 2 scaled; and one
    // hybrid that is both.
    EXPECT_EQ(results["checks"].size(), 4u * 3 + 17 * 4 * 3 + 8 + 1);
    for (const Json& row : results["numeric"]) {
        EXPECT_GT(row["touching_count"], 1000);
        EXPECT_GT(row["judged_count"].get<uint64_t>(), 2 * row["touching_count"].get<uint64_t>());
        EXPECT_GT(row["grown_count"], 0) << "nothing between touching and too far";
    }
    EXPECT_EQ(results["numeric"].size(), 4u);
    EXPECT_EQ(results["perturbation"].size(), 18u * kMatrixMethodCount);
    // Something is there to be stable: rays and maps err, and ties part.
    double tie = 1;
    for (const Json& row : results["perturbation"]) {
        if (row["kind"] == "unperturbed, aligned" && row["method"] != "dag believe none") {
            EXPECT_GT(row["wrong_share"].get<double>(), 0.001) << row["method"];
        }
        if (row["method"] == "dag believe all" && row["kind"] == "tiny, aligned")
            tie = std::min(tie, row["wrong_share"].get<double>() /
                                    row["wrong_share_unperturbed"].get<double>());
    }
    EXPECT_LT(tie, 0.8);
    results["provenance"] = {{"commit", "c0ffee"}};
    results["broken"] = unstableLines(results);
    results["study"] = findStudy("stability").json;
    const std::string page = pageOf("stability", "stability.json", results);
    EXPECT_THAT(page, HasSubstr("Every check passes"));
    EXPECT_THAT(page, HasSubstr("id=\"perturbation\""));
    EXPECT_THAT(page, testing::Not(HasSubstr("id=\"time\"")));
}

// Frames of 64 x 36; the threshold goes with them.
TEST(Stability, SmallFramesInTimeKeepTheirBands) {
    const Json results = measure({"time-plates"}, 128);
    EXPECT_THAT(unstableLines(results), IsEmpty());
    ASSERT_EQ(results["time"].size(), 7u);
    // 7 rows' held answers; 3 rows that hold more than the one before; that there is something to
    // be held: resolutions of maps, resolutions and routes of the hybrid.
    EXPECT_EQ(results["checks"].size(), 7u + 3 + 3);
    for (const Json& row : results["time"]) {
        EXPECT_EQ(row["frame_count"], 16);
        EXPECT_GT(row["answer_count"], 1000);
        EXPECT_EQ(row["held_answer_count"].get<uint64_t>() +
                      row["resolution_switch_answer_count"].get<uint64_t>() +
                      row["method_switch_answer_count"].get<uint64_t>(),
                  row["answer_count"].get<uint64_t>());
        EXPECT_EQ(row["wrong_share"].get<double>() > 0, row["method"] != "dag believe none");
    }
}

TEST(Stability, AFewSizesOfVoxelsGiveARateOfOne) {
    const Json results = measure({"resolution-posts"}, 256, 9);
    EXPECT_THAT(unstableLines(results), IsEmpty());
    EXPECT_EQ(results["checks"].size(), 2u); // the mean error's rate of rays and of maps
    ASSERT_EQ(results["resolution"].size(), 4u + 5);
    ASSERT_EQ(results["rates"].size(), 4u);
    double before = 1;
    for (int i = 0; i < 4; ++i) {
        const Json& row = results["resolution"][size_t(i)];
        EXPECT_EQ(row["method"], "dag believe all");
        EXPECT_EQ(row["resolution"], 64 << i);
        EXPECT_LT(row["wrong_share"].get<double>(), 0.7 * before);
        before = row["wrong_share"].get<double>();
    }
    EXPECT_EQ(results["rates"][0]["point_count"], 4);
}

TEST(Stability, NumbersDoNotDependOnTheThreadCount) {
    const Json many = measure({"perturbation-tiles"}, 64);
    setThreadCount(1);
    const Json one = measure({"perturbation-tiles"}, 64);
    setThreadCount(0);
    EXPECT_EQ(many, one);
}

std::vector<std::string> stabilityWarnings;

// Lights of files cannot be moved; all other rows are measured without --only.
TEST(Stability, TheRowOfMovingLightsIsLeftOutOnOtherScenes) {
    const Console console(true);
    const auto partsOf = [&](const std::vector<std::string>& names,
                             const std::vector<std::string>& scenes) {
        stabilityWarnings.clear();
        return makeStudy(findStudy("stability"), {Backend::kCpu, names, scenes, "", ""}, console)
            ->parts();
    };
    setWarningListener([](const std::string& text) { stabilityWarnings.push_back(text); });
    const std::string own = rowNameOn("time-lights", "builtin:fail-popping"),
                      other = rowNameOn("time-lights", "builtin:atrium");
    for (const std::vector<std::string>& names :
         {std::vector<std::string>{}, std::vector<std::string>{"time"}}) {
        const std::vector<std::string> parts = partsOf(names, {"builtin:atrium"});
        EXPECT_THAT(parts, testing::Contains(rowNameOn("time-posts", "builtin:atrium")));
        EXPECT_THAT(parts, testing::Not(testing::Contains(other)));
        ASSERT_EQ(stabilityWarnings.size(), 1u);
        EXPECT_THAT(stabilityWarnings[0], testing::HasSubstr("the row time-lights is left out on "
                                                             "builtin:atrium, whose lights"));
    }
    EXPECT_THAT(partsOf({}, {"builtin:fail-popping", "builtin:atrium"}),
                testing::AllOf(testing::Contains(own), testing::Not(testing::Contains(other))));
    EXPECT_THAT(partsOf({}, {}), testing::Contains("time-lights"));
    EXPECT_TRUE(stabilityWarnings.empty());
    EXPECT_THROW(partsOf({"time-lights"}, {"builtin:atrium"}), Error) << "asked for by name";
    setWarningListener(nullptr);
}

TEST(Stability, UnknownNamesAreRefusedWithTheKnownOnes) {
    for (const std::string name : {"tiem", "numeric,numeric"}) {
        try {
            stabilityGroupsNamed(table(), {name});
            FAIL() << name << " was taken";
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::kUsage);
            EXPECT_THAT(error.what(), HasSubstr("must be one of time, perturbation"));
        }
    }
}

} // namespace
} // namespace shadowdag
