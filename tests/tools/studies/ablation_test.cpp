// SPDX-License-Identifier: Apache-2.0
// Judgement of mechanisms: the rule in closed form, the table and its texts, and two measured rows.
#include "tools/studies/ablation.h"

#include "cuda/backend.h"
#include "cuda/error.h"
#include "tests/tools/report/report_runner.h"
#include "tests/tools/temporary_directory.h"
#include "tools/settings/console.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

namespace shadowdag {

namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

Gain factor(double value) {
    return {std::log(value), 0};
}

// By hand: ratios 2, 4 and 8 have the median ln 4, and logarithms ln 2 apart spread by ln 2 /
// sqrt 3.
TEST(Mechanisms, GainOfRunsIsTheMedianOfPairs) {
    const Gain gain = gainOfRuns({8, 8, 80}, {4, 2, 10});
    EXPECT_DOUBLE_EQ(gain.log, std::log(4.0));
    EXPECT_NEAR(gain.spread, std::log(2.0) / std::sqrt(3.0), 1e-12);
    EXPECT_EQ(gainOfRuns({3}, {1}).spread, 0);
}

TEST(Mechanisms, GainOfCountsKeepsAFloor) {
    EXPECT_DOUBLE_EQ(gainOf(7, 0, 1).log, std::log(8.0));
    EXPECT_EQ(gainOf(0, 0, 1).log, 0);
}

// By hand: 0 and 2 have the mean 1, its standard error over scenes is 1; scenes that spread by 1
// and 1 themselves add 2 / 4 to its square.
TEST(Mechanisms, MeanGainJoinsBothSpreads) {
    const Gain gain = meanGain({{0, 1}, {2, 1}});
    EXPECT_DOUBLE_EQ(gain.log, 1);
    EXPECT_DOUBLE_EQ(gain.spread, std::sqrt(1.5));
    EXPECT_EQ(meanGain({}).log, 0);
}

/// Evidence of equal gains over three scenes.
MechanismEvidence evidenceOf(double own, double time, double error, double bytes) {
    const auto three = [](double value) { return std::vector<Gain>(3, factor(value)); };
    return {three(own), {}, three(time), three(error), three(bytes)};
}

TEST(Mechanisms, SettingsThatGainMoreThanTheyCostAreOn) {
    EXPECT_EQ(judge(evidenceOf(2, 1, 1, 1), false).verdict, MechanismVerdict::kOn);
    EXPECT_EQ(judge(evidenceOf(2, 1 / 1.9, 1, 1 / 1.9), false).verdict, MechanismVerdict::kOn);
    EXPECT_EQ(judge(evidenceOf(2, 1 / 2.1, 1, 1), false).verdict, MechanismVerdict::kOption);
    EXPECT_EQ(judge(evidenceOf(2, 1, 1, 1 / 2.1), false).verdict, MechanismVerdict::kOption);
}

// Errors are not bought off, but five percent are no loss.
TEST(Mechanisms, SettingsWithLargerErrorsAreOptions) {
    EXPECT_EQ(judge(evidenceOf(8, 1, 1 / 1.06, 1), false).verdict, MechanismVerdict::kOption);
    EXPECT_EQ(judge(evidenceOf(8, 1, 1 / 1.04, 1), false).verdict, MechanismVerdict::kOn);
    EXPECT_THAT(judge(evidenceOf(8, 1, 0.5, 1), false).reason, HasSubstr("price: error +100.0 %"));
}

TEST(Mechanisms, SettingsWithoutGainAreDeletedOrKeptIfNeeded) {
    EXPECT_EQ(judge(evidenceOf(1.005, 1, 1, 1), false).verdict, MechanismVerdict::kDelete);
    EXPECT_EQ(judge(evidenceOf(0.5, 1, 1, 1), true).verdict, MechanismVerdict::kKept);
}

// Gains of 1, 1 and 8: the mean is 2, its standard error as large.
TEST(Mechanisms, AGainInOneSceneIsWithinTheSpread) {
    MechanismEvidence evidence = evidenceOf(1, 1, 1, 1);
    evidence.own[2] = factor(8);
    EXPECT_EQ(judge(evidence, false).verdict, MechanismVerdict::kDelete);
}

TEST(Mechanisms, ARemedyIsOnWhereItCostsNothing) {
    MechanismEvidence evidence = evidenceOf(1, 1, 1, 1);
    evidence.ownOnFailures = {factor(1.19)};
    EXPECT_EQ(judge(evidence, false).verdict, MechanismVerdict::kDelete);
    evidence.ownOnFailures = {factor(1), factor(1.21)};
    EXPECT_EQ(judge(evidence, false).verdict, MechanismVerdict::kOn);
    evidence.time = std::vector<Gain>(3, factor(0.9));
    EXPECT_EQ(judge(evidence, false).verdict, MechanismVerdict::kOption);
}

AblationTable ablationTable() {
    return readAblation(findStudy("ablation"));
}

TEST(Mechanisms, RowsNameExistingSettings) {
    std::set<std::string> names;
    for (const Mechanism& row : ablationTable().rows) {
        names.insert(row.name);
        const FrameOptions on = cellSetup({row.always, row.on}).frame,
                           off = cellSetup({row.always, row.off}).frame;
        // The first of them is what the row switches on, not something else.
        if (!row.defaultIf.empty()) {
            EXPECT_EQ(cellSetup({row.always, row.on, row.defaultIf[0]}).frame, on) << row.name;
            EXPECT_NE(cellSetup({row.always, row.off, row.defaultIf[0]}).frame, off) << row.name;
        }
    }
    for (const std::string& name : costTermNames())
        EXPECT_TRUE(names.insert(name).second) << name;
}

// The committed run was made when defaults were what they are.
TEST(Mechanisms, DefaultsAreThoseOfTheCommittedRun) {
    const Json run = Json::parse(readText(SDAG_SOURCE_DIR "/tests/bench/results/mechanisms.json"));
    for (const Mechanism& row : ablationTable().rows)
        for (const Json& measured : run["mechanisms"])
            if (measured["name"] == row.name) {
                EXPECT_EQ(isDefault(row), measured["is_default"]) << row.name;
            }
}

/// Measures rows on two small scenes.
Json measureSmall(const std::vector<std::string>& names, int repeats = 0) {
    StudyFile file = findStudy("ablation");
    file.json["scenes"] = {"builtin:fail-mover", "builtin:fail-unequal-ranges"};
    file.json["size"] = "96x54";
    file.json["resolution"] = 128;
    file.json["sequence_frames"] = 1;
    file.json["repeats"] = repeats;
    static const Console console(true);
    StudyRequest request;
    request.names = names;
    return measureAll(*makeStudy(file, request, console), request);
}

const Json& rowOf(const Json& results, const std::string& name) {
    for (const Json& row : results["mechanisms"])
        if (row["name"] == name)
            return row;
    throw std::logic_error("no row " + name);
}

// Culling changes no answer; rays without movers miss what moves; what is off by default says so.
TEST(Mechanisms, MeasuresBothSidesExactly) {
    const std::vector<std::string> names = {"face-masks", "ray-movers", "half-resolution",
                                            "static-optimization"};
    const Json results = measureSmall(names);
    ASSERT_THAT(results["mechanisms"], SizeIs(names.size()));
    const Json& culling = rowOf(results, "face-masks");
    for (const Json& scene : culling["scenes"]) {
        EXPECT_EQ(scene["error_ratio"], 1.0);
        EXPECT_EQ(scene["bytes_ratio"], 1.0);
        EXPECT_LT(scene["own_ratio"].get<double>(), 1.0);
        EXPECT_EQ(scene["own_ratio"].get<double>(),
                  std::exp(-gainOf(scene["off"]["triangle_draw_count"].get<double>(),
                                   scene["on"]["triangle_draw_count"].get<double>(), 1)
                                .log));
    }
    EXPECT_TRUE(culling["is_default"].get<bool>());
    const Json& movers = rowOf(results, "ray-movers");
    EXPECT_TRUE(movers["is_default"].is_null());
    EXPECT_THAT(movers["scenes"], SizeIs(3)); // and the failure that it is a remedy for
    EXPECT_TRUE(movers["scenes"][2]["is_failure"].get<bool>());
    EXPECT_LT(movers["scenes"][0]["on"]["false_light_count"].get<int>(),
              movers["scenes"][0]["off"]["false_light_count"].get<int>());
    const Json& half = rowOf(results, "half-resolution");
    EXPECT_FALSE(half["is_default"].get<bool>());
    for (const Json& scene : half["scenes"]) // few pages, which are as large at half the texels
        EXPECT_EQ(scene["own_ratio"], scene["bytes_ratio"]);
    for (const Json& scene : rowOf(results, "static-optimization")["scenes"])
        EXPECT_LT(scene["own_ratio"].get<double>(), 1.0);
    EXPECT_THAT(mechanismsCsv(results),
                HasSubstr("face-masks,maps,static_optimization=off,culling=sphere,culling=cfm"));
    Json written = results;
    written["provenance"] = Json::object();
    written["disagreements"] = disagreements(results);
    EXPECT_THAT(pageOf("ablation", "ablation.json", written), HasSubstr("id=\"half-resolution\""));

    setThreadCount(1);
    const Json one = measureSmall(names);
    setThreadCount(0);
    EXPECT_EQ(results, one) << "counts depend on the thread count";
}

// What is left out of a frame when its pairs are asked again is not left out of the truth, which
// the rows of a scene share.
TEST(Mechanisms, ARowIsTheSameAloneAndBesideOthers) {
    const Json beside = measureSmall({"receiver-plane", "nine-taps"}),
               alone = measureSmall({"nine-taps"});
    EXPECT_EQ(rowOf(beside, "nine-taps"), rowOf(alone, "nine-taps"));
    for (const Json& scene : rowOf(alone, "nine-taps")["scenes"])
        EXPECT_GT(scene["on"]["flip"].get<double>(), 0.0);
    EXPECT_EQ(rowOf(alone, "nine-taps")["error_metric"], "flip");
    const Json& plane = rowOf(beside, "receiver-plane");
    for (size_t s = 0; s < 2; ++s)
        EXPECT_EQ(plane["scenes"][s]["off"]["occluded_count"],
                  rowOf(alone, "nine-taps")["scenes"][s]["off"]["occluded_count"]);
}

// Times of what should pay in time: every run of either side anew, in turn; others once.
TEST(Mechanisms, TimesAreOfRunsInTurn) {
    const std::vector<std::string> names = {"ray-streams", "ray-lod-level", "face-masks"};
    EXPECT_THROW(measureSmall(names), Error) << "no times were asked for";
    const Json results = measureSmall(names, 2);
    for (const char* name : {"ray-streams", "ray-lod-level"})
        for (const Json& scene : rowOf(results, name)["scenes"])
            for (const char* side : {"off", "on"}) {
                const Json& ms = scene[side]["time_ms"];
                ASSERT_THAT(ms, SizeIs(2)) << name;
                EXPECT_GT(ms[0].get<double>(), 0.0);
                EXPECT_NE(ms[0], ms[1]) << "one run cannot be two";
            }
    // What two rows share is run for each: equal to the nanosecond it would be one run.
    EXPECT_NE(rowOf(results, "ray-streams")["scenes"][0]["on"]["time_ms"],
              rowOf(results, "ray-lod-level")["scenes"][0]["off"]["time_ms"]);
    EXPECT_THAT(rowOf(results, "face-masks")["scenes"][0]["on"]["time_ms"], SizeIs(1));
}

TEST(Mechanisms, UnknownNamesAreRefusedWithTheKnownOnes) {
    try {
        measureSmall({"face-mask"});
        FAIL() << "was taken";
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kUsage);
        EXPECT_THAT(error.what(), HasSubstr("'face-mask': must be one of explicit-bounds"));
        EXPECT_THAT(error.what(), HasSubstr("term-samples"));
    }
}

TEST(Mechanisms, ChartIsDrawnAndInvalidInputRefused) {
    const TemporaryDirectory directory;
    const auto draw = [&](const std::string& text, std::string& said) {
        writeText(directory / "ablation.json", text);
        return runReport(
            {"mechanisms-chart", directory / "ablation.json", "-o", directory / "charts"}, &said);
    };
    Json scene = {
        {"scene", "builtin:made"}, {"is_failure", false}, {"own_ratio", 0.01}, {"time_ratio", 1.5}};
    Json row = {{"name", "made"},    {"metric", "bytes"}, {"own_ratio", 0.01},
                {"time_ratio", 1.5}, {"agrees", false},   {"verdict", "to be deleted"},
                {"scenes", {scene}}};
    std::string said;
    ASSERT_EQ(draw(jsonText({{"scenes", {"builtin:made"}}, {"mechanisms", {row}}}), said), 0)
        << said;
    EXPECT_THAT(readText(directory / "charts/mechanisms.svg"), HasSubstr("</svg>"));
    EXPECT_THAT(readText(directory / "charts/charts.json"),
                HasSubstr("The gain of each mechanism"));
    EXPECT_NE(draw("{\"mechanisms\": []}", said), 0);
    EXPECT_THAT(said, HasSubstr("holds no mechanism"));
}

// By hand: rays cost 1 ms a sample, maps 10; with samples in the form every map is routed to the
// cheaper method, with constants all go one way: by rays, whose mean is below 10 by the weights of
// a fit, 1 / (rays + map). Every frame has 20 maps of 1 to 20 samples.
TEST(Mechanisms, ATermUsedForRoutingPays) {
    std::vector<ObservedFrame> observed;
    for (const char* scene : {"a", "b"})
        for (uint32_t f = 0; f < 2; ++f) {
            ObservedFrame frame;
            frame.scene = scene;
            frame.view = "made";
            frame.frame = f;
            for (uint32_t m = 0; m < 20; ++m) {
                MapQuantities map;
                map.light = m;
                map.samples = m + 1;
                frame.maps.push_back(map);
                frame.costs.push_back({m, 0, double(m + 1), 10});
            }
            observed.push_back(frame);
        }
    const Json rows = judgeCostTerms(observed, {"term-samples", "term-pages"});
    ASSERT_THAT(rows, SizeIs(2));
    EXPECT_TRUE(rows[0]["is_default"].get<bool>());
    // 55 for the cheap half and 100 for the dear one, against 210 by rays alone.
    EXPECT_DOUBLE_EQ(rows[0]["own_ratio"].get<double>(), 155.0 / 210.0);
    EXPECT_EQ(rows[0]["verdict"], kMechanismVerdictNames[size_t(MechanismVerdict::kOn)]);
    EXPECT_DOUBLE_EQ(rows[1]["own_ratio"].get<double>(), 1.0);
    EXPECT_FALSE(rows[1]["is_default"].get<bool>());
}

TEST(Mechanisms, ADefaultThatContradictsItsVerdictIsReported) {
    Json row = {{"name", "made"},
                {"agrees", true},
                {"is_default", true},
                {"verdict", "to be deleted"},
                {"reason", "does not pay"}};
    EXPECT_THAT(disagreements({{"mechanisms", {row}}}), IsEmpty());
    row["agrees"] = false;
    EXPECT_THAT(disagreements({{"mechanisms", {row}}}),
                ElementsAre("made: to be deleted, and is on by default; does not pay"));
}

} // namespace
} // namespace shadowdag
