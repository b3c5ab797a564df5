// SPDX-License-Identifier: Apache-2.0
// The model space of fit, the times it compares, and its chart.
#include "tools/workspace/fit_space.h"

#include "tests/tools/report/report_runner.h"
#include "tests/tools/temporary_directory.h"
#include "tools/workspace/fit_measure.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>
#include <set>

namespace shadowdag {

namespace {

using testing::HasSubstr;

Experiment sweep() {
    Experiment e;
    e.scenes = {"builtin:fail-acne"};
    e.methods = {"dag", "maps", "hybrid"};
    e.believe = {std::numeric_limits<float>::infinity(), 0};
    e.resolutionLog2 = {6, 7, 8};
    e.lod = {LodChoice(0), parseLod("--lod", "coverage")};
    e.undersample = {1, 4, 2};
    e.taps = {4, 1};
    e.mapsPerLight = {1, 4};
    e.pageTexels = {16};
    e.thresholds = {0, 32, 8, std::numeric_limits<float>::infinity()};
    e.models = {};
    return e;
}

size_t indexOf(const FitModels& models, const std::string& label) {
    for (size_t m = 0; m < models.runs.size(); ++m)
        if (models.runs[m].label() == label)
            return m;
    ADD_FAILURE() << label;
    return 0;
}

bool isSimpler(const FitModels& models, const std::string& a, const std::string& b) {
    return models.space.models[indexOf(models, a)].simplicity <
           models.space.models[indexOf(models, b)].simplicity;
}

} // namespace

TEST(FitSpace, VariesOnlyTheParametersThatAMethodReads) {
    const FitModels models = makeFitModels(sweep(), FitObjective::kTime);
    std::map<std::string, int> counts;
    std::set<std::string> labels;
    for (const RunParameters& run : models.runs) {
        ++counts[run.method];
        EXPECT_TRUE(labels.insert(run.label()).second) << run.label() << " is there twice";
    }
    EXPECT_EQ(counts["dag"], 3 * 2 + 1) << "without voxels there is no resolution";
    EXPECT_EQ(counts["maps"], 3 * 2 * 2);
    EXPECT_EQ(counts["hybrid"], (3 * 2 + 1) * (3 * 2 * 2) * 2)
        << "thresholds 0 and inf are no routers";
    EXPECT_EQ(models.space.models.size(), models.runs.size());
    EXPECT_EQ(models.experiments.size(), models.runs.size());
}

// Also where routers are groups of their own, each at its first and only rank.
TEST(FitSpace, NoTwoModelsAreEquallySimple) {
    Experiment e = sweep();
    e.models = {"cost", "expr:texels-96", "expr:pages"};
    const FitModels models = makeFitModels(e, FitObjective::kBytes);
    std::set<std::vector<int>> seen;
    for (size_t m = 0; m < models.runs.size(); ++m) {
        EXPECT_TRUE(seen.insert(models.space.models[m].simplicity).second)
            << models.runs[m].label();
        EXPECT_EQ(models.space.models[m].simplicity.size(), simplicityOrder().size());
    }
}

TEST(FitSpace, RanksRunFromCoarseToFine) {
    const FitModels models = makeFitModels(sweep(), FitObjective::kTime);
    const auto at = [&](const std::string& label) {
        return models.space.models[indexOf(models, label)].at;
    };
    EXPECT_EQ(at("dag 64^3 believe all"), (std::vector<int>{0, 0, -1, -1, -1, -1, -1}));
    EXPECT_EQ(at("dag 256^3 believe all lod coverage:0.75"),
              (std::vector<int>{2, 1, -1, -1, -1, -1, -1}));
    EXPECT_EQ(at("maps"), (std::vector<int>{-1, -1, 2, 1, 0, 0, -1}));
    EXPECT_EQ(at("maps u4 4SM taps 1"), (std::vector<int>{-1, -1, 0, 0, 1, 0, -1}));
    EXPECT_EQ(at("hybrid texels:32 128^3 believe all u2")[6], 0)
        << "the larger threshold draws less";
    EXPECT_EQ(models.runs[indexOf(models, "hybrid texels:32 128^3 believe all u2")].dag, 1u);
}

TEST(FitSpace, TheSimplerHasFewerMechanismsThenCoarserVoxelsThenFewerTaps) {
    const FitModels models = makeFitModels(sweep(), FitObjective::kTime);
    EXPECT_TRUE(isSimpler(models, "dag 256^3 believe all", "maps taps 1"));
    EXPECT_TRUE(isSimpler(models, "maps taps 1", "maps"));
    EXPECT_TRUE(isSimpler(models, "dag believe none", "dag 64^3 believe all"));
    EXPECT_TRUE(isSimpler(models, "dag 64^3 believe all", "dag 128^3 believe all"));
    EXPECT_TRUE(
        isSimpler(models, "dag 256^3 believe all", "dag 64^3 believe all lod coverage:0.75"));
    EXPECT_TRUE(isSimpler(models, "hybrid texels:8 64^3 believe all taps 1",
                          "hybrid texels:32 128^3 believe all taps 1"));
    EXPECT_TRUE(isSimpler(models, "hybrid texels:32 64^3 believe all u4",
                          "hybrid texels:32 64^3 believe all"));
    std::set<std::vector<int>> ranks;
    for (const FitModel& model : models.space.models)
        EXPECT_TRUE(ranks.insert(model.simplicity).second) << "two models are equally simple";
}

TEST(FitSpace, SparserTexelsMayHelpWhereARouterSeesThem) {
    // What is required after undersampling is routed: u4 traces maps that u1 draws.
    const size_t kUndersample = 2;
    for (const FitObjective objective : {FitObjective::kTime, FitObjective::kBytes}) {
        const FitModels models = makeFitModels(sweep(), objective);
        for (size_t group = 0; group < models.groups.size(); ++group) {
            const FitLaw law = models.space.laws[group][kUndersample];
            const bool isHybrid = models.groups[group].starts_with("hybrid");
            EXPECT_EQ(law.errorFalls, !isHybrid) << models.groups[group];
            EXPECT_EQ(law.costGrows, !isHybrid || objective == FitObjective::kBytes);
        }
    }
}

TEST(FitSpace, EveryModelsExperimentIsThatModelAlone) {
    const FitModels models = makeFitModels(sweep(), FitObjective::kBytes);
    for (size_t m = 0; m < models.runs.size(); ++m) {
        const Experiment read = experimentFromJson(toJson(models.experiments[m]), "replay");
        const std::vector<RunParameters> runs =
            configurations(read, {1u << read.resolutionLog2[0]}, 1);
        ASSERT_EQ(runs.size(), 1u) << models.runs[m].label();
        EXPECT_EQ(runs[0].label(), models.runs[m].label());
        EXPECT_EQ(runs[0].toJson(), models.runs[m].toJson());
    }
}

TEST(FitSpace, VoxelsAreKnownBytesOfModelsThatTrace) {
    FitModels models = makeFitModels(sweep(), FitObjective::kBytes);
    setKnownBytes(models, {10, 20, 40});
    EXPECT_EQ(models.space.models[indexOf(models, "dag 256^3 believe all")].knownCost, 40);
    EXPECT_EQ(models.space.models[indexOf(models, "hybrid texels:8 128^3 believe all")].knownCost,
              20);
    EXPECT_EQ(models.space.models[indexOf(models, "maps")].knownCost, 0);
}

TEST(FitTime, StandardErrorIsThatOfTheMedian) {
    // Mean 12, squares 4 + 1 + 0 + 1 + 4 = 10: variance 2.5, of the mean 0.5, of the median
    // pi / 2 times that.
    const FitTime time = fitTime({10, 11, 12, 13, 14});
    EXPECT_DOUBLE_EQ(time.medianMs, 12);
    EXPECT_DOUBLE_EQ(time.minMs, 10);
    EXPECT_NEAR(time.standardErrorMs, std::sqrt(0.5 * 3.14159265358979 / 2), 1e-12);
}

TEST(FrontierChart, DrawsAResultAndRefusesOtherFiles) {
    const TemporaryDirectory directory;
    const auto model = [](const std::string& label, const std::string& method, double error,
                          uint64_t bytes) {
        return Json{{"label", label},
                    {"method", method},
                    {"error", error},
                    {"bytes", bytes},
                    {"status", "dominated"}};
    };
    Json result = {
        {"metric", "false"},
        {"minimise", "bytes"},
        {"bound", 0.02},
        {"chosen", model("dag 512^3 believe all", "dag", 0.015, 700'000)},
        {"models",
         {model("dag 256^3 believe all", "dag", 0.04, 200'000),
          model("dag 512^3 believe all", "dag", 0.015, 700'000),
          model("dag believe none", "dag", 0, 3'000'000), model("maps", "maps", 0.01, 90'000'000),
          model("new 7", "a new method", 0.02, 1'000'000),
          Json{{"label", "never measured"}, {"method", "maps"}, {"status", "ruled out"}}}},
        {"least_error", model("dag believe none", "dag", 0, 3'000'000)},
        {"model_count", 6},
        {"measured_count", 5},
        {"measured_in_all_frames_count", 5},
        {"frame_count", 1},
        {"status_counts", {{"dominated", 5}, {"ruled out", 1}}},
        {"neighbours", Json::array()},
        {"laws", Json::array()},
        {"sweep", Json::object()},
        {"provenance", Json::object()}};
    const auto draw = [&](std::string* text) {
        writeText(directory / "f.json", jsonText(result));
        return runReport({"fit", directory / "f.json", "-o", directory / "charts"}, text);
    };
    std::string text;
    ASSERT_EQ(draw(&text), 0) << text;
    EXPECT_THAT(readText(directory / "charts/f.svg"), HasSubstr("</svg>"));
    EXPECT_THAT(readText(directory / "charts/f.svg"), HasSubstr("<!-- a new method -->"));
    EXPECT_THAT(readText(directory / "charts/f.png"), testing::StartsWith("\x89PNG"));
    result["chosen"] = Json();
    ASSERT_EQ(draw(&text), 0) << text;
    result["models"] = Json::array();
    EXPECT_NE(draw(&text), 0);
    EXPECT_THAT(text, HasSubstr("holds no measured model"));
    result.erase("models");
    EXPECT_NE(draw(&text), 0);
    EXPECT_THAT(text, HasSubstr("f.json: not a result of fit"));
}

} // namespace shadowdag
