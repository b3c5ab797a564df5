// SPDX-License-Identifier: Apache-2.0
#include "tools/settings/experiment.h"
#include "tools/settings/variants.h"

#include "cuda/error.h"
#include "tests/tools/temporary_directory.h"

#include "tools/settings/json_file.h"
#include "tools/settings/unused_options.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <random>
#include <set>

namespace shadowdag {

namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

std::string inputMessage(const Json& json) {
    try {
        experimentFromJson(json, "x.json");
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kInput);
        return error.what();
    }
    ADD_FAILURE() << "no error for " << json;
    return "";
}

std::vector<std::string> labels(const std::vector<RunParameters>& runs) {
    std::vector<std::string> texts;
    for (const RunParameters& run : runs)
        texts.push_back(run.label());
    return texts;
}

} // namespace

TEST(Experiment, ComesBackFromItsOwnJson) {
    const Experiment e = experimentFromJson({{"size", "320x200"},
                                             {"frames", "0:4:2"},
                                             {"exposure", 0.1f},
                                             {"thresholds", {0, 48.5, "inf"}},
                                             {"undersample", {1, 2.5}}},
                                            "x");
    const Json json = toJson(e);
    EXPECT_EQ(toJson(experimentFromJson(json, "x")), json);
    EXPECT_EQ(json["size"], "320x200");
    EXPECT_THAT(e.frames, ElementsAre(0, 2, 4));
    EXPECT_EQ(json["thresholds"].dump(), "[0.0,48.5,\"inf\"]");
}

TEST(Experiment, FramesStartColdOrWarm) {
    Experiment e =
        experimentFromJson({{"methods", {"dag", "maps"}}, {"start", {"cold", "warm"}}}, "x");
    EXPECT_EQ(toJson(e)["start"], Json({"cold", "warm"}));
    const std::vector<RunParameters> runs = configurations(e, {}, 0);
    EXPECT_THAT(labels(runs), ElementsAre("maps", "dag believe none", "maps warm"));
    EXPECT_EQ(runs[0].toJson()["start"], "cold");
    EXPECT_EQ(runs[2].toJson()["start"], "warm");
    EXPECT_FALSE(runs[1].toJson().contains("start")) << "rays keep nothing";
    EXPECT_THAT(inputMessage({{"sequence", true}, {"start", {"warm"}}}),
                HasSubstr("\"start\" is for single frames"));
}

TEST(Experiment, AnUnknownKeyIsRefusedByName) {
    EXPECT_THAT(inputMessage({{"treshold", 1}}), HasSubstr("x.json: unknown key \"treshold\""));
}

TEST(Experiment, EveryWrongValueIsRefusedWithItsKey) {
    const std::vector<std::pair<std::string, Json>> wrong = {
        {"size", "0x0"},
        {"size", 640},
        {"frames", "5:1"},
        {"fps", 0},
        {"exposure", -1},
        {"views", 0},
        {"views", kMaxViewCount + 1},
        {"lights", -2},
        {"lights", 1.5},
        {"start", {"hot"}},
        {"start", {"cold", "cold"}},
        {"resolutions", {1000}},
        {"resolutions", Json::array()},
        {"resolutions", {8, 8}},
        {"methods", {"magic"}},
        {"thresholds", {"x"}},
        {"thresholds", {-1}},
        {"thresholds", {"auto", 32}},
        {"thresholds", 96},
        {"undersample", {0.5}},
        {"page_size", {48}},
        {"pool_mib", 0},
        {"taps", {5}},
        {"maps_per_light", {17}},
        {"maps_per_light", {0}},
        {"variants", {"PMCX"}},
        {"sequence", 1},
        {"lead_in", -1},
        {"flicker_points", "many"},
        {"repeats", 0},
        {"lod", {18}},
        {"lod", Json::array()},
        {"lod", {1, "1"}},
        {"lod", {1.5}},
        {"lod", {"footprint:0"}},
        {"lod", {"coverage:2"}},
        {"lod", {"pixels"}},
        {"title", 3},
        {"scenes", "atrium"},
        {"offset", {-1}},
        {"models", {"magic"}},
        {"models", {"texels:96", "expr:texels+"}},
        {"max_face_texels", 8193},
        {"max_face_texels", 15},
        {"route_margin", 0.1}, // not in sequence
        {"route_margin", -1},
        {"route_margin", "much"},
        {"error_seed", -1}};
    for (const auto& [key, value] : wrong)
        EXPECT_THAT(inputMessage({{key, value}}), HasSubstr("\"" + key + "\"")) << value;
    EXPECT_THAT(inputMessage(Json::array()), HasSubstr("one JSON object"));
}

TEST(Experiment, SeveralViewsAreAutomatic) {
    const Experiment one = experimentFromJson({{"camera", "door"}}, "x");
    EXPECT_EQ(one.viewCamera(0), "door");
    const Experiment three = experimentFromJson({{"camera", "auto"}, {"views", 3}}, "x");
    EXPECT_EQ(three.viewCamera(0), "auto");
    EXPECT_EQ(three.viewCamera(2), "auto-3");
    EXPECT_EQ(toJson(experimentFromJson(toJson(three), "x")), toJson(three));
    EXPECT_THAT(inputMessage({{"camera", "door"}, {"views", 2}}),
                HasSubstr("key \"views\" and \"camera\" 'door' contradict each other"));
}

TEST(Experiment, AMarginOfRoutesIsForSequencesAndVariantsWithoutTheirOwn) {
    const Experiment e = experimentFromJson(
        {{"sequence", true},
         {"route_margin", 0.2},
         {"taps", {4}},
         {"variants", {"Hybrid", "Hybrid-RH0", "Hybrid-RH0.20-PMCC", "PMCD-T4", "PMCD-T9"}}},
        "x");
    EXPECT_EQ(toJson(e)["route_margin"], 0.2);
    EXPECT_THAT(e.variants, ElementsAre("Hybrid", "Hybrid-RH0", "Hybrid-PMCC", "PMCD", "PMCD-T9"));
    EXPECT_EQ(toJson(experimentFromJson(toJson(e), "x")), toJson(e));
    const std::vector<RunParameters> runs = configurations(e, {64}, 1);
    ASSERT_EQ(runs.size(), 6u);
    EXPECT_EQ(runs[1].frame.routeMargin, 0.2f);
    EXPECT_EQ(runs[1].toJson()["route_margin"], 0.2);
    EXPECT_EQ(runs[2].frame.routeMargin, 0.0f);
    EXPECT_EQ(runs[5].frame.bias.taps, 9u);
    EXPECT_THAT(
        inputMessage(
            {{"sequence", true}, {"route_margin", 0.2}, {"variants", {"Hybrid", "Hybrid-RH0.2"}}}),
        HasSubstr("key \"variants\" 'Hybrid-RH0.2': is the variant 'Hybrid'"));
    Experiment swept;
    swept.isSequence = true;
    swept.routeMargin = {0.5f};
    swept.methods = {"hybrid"};
    swept.thresholds = {32};
    swept.models.clear();
    EXPECT_THAT(labels(configurations(swept, {64}, 1)),
                ElementsAre("hybrid texels:32 believe none margin 0.5"));
}

TEST(Experiment, MoreCombinationsThanASweepRunsAreRefused) {
    Experiment e;
    for (int i = 0; i < 200; ++i) {
        e.bias.push_back(1 + 0.01f * float(i));
        e.offset.push_back(2 + 0.01f * float(i));
    }
    try {
        configurations(e, {64}, 1);
        FAIL() << "not refused";
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kUsage);
        EXPECT_THAT(error.what(),
                    HasSubstr("have 121203 combinations; a sweep runs 16384 at most"));
    }
}

TEST(Experiment, AMissingOrInvalidFileIsReportedByName) {
    const TemporaryDirectory directory;
    EXPECT_THROW(readExperiment(directory / "none.json"), Error);
    writeText(directory / "bad.json", "{\"size\": ");
    try {
        readExperiment(directory / "bad.json");
        FAIL();
    } catch (const Error& error) {
        EXPECT_THAT(error.what(),
                    HasSubstr("bad.json: ends at line 1, column 10, before its JSON does"));
    }
}

TEST(Experiment, ADirectoryOrAFileWithADuplicateKeyIsReportedByName) {
    const TemporaryDirectory directory;
    const auto message = [&](const std::string& path) -> std::string {
        try {
            readExperiment(path);
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::kInput);
            return error.what();
        }
        return "";
    };
    const std::string path = directory / "e.json";
    EXPECT_THAT(message(directory.path()), HasSubstr(": is a directory; give an experiment file"));
    EXPECT_THAT(message(directory / "none.json"), HasSubstr("cannot be opened"));
    writeText(path, "{\"repeats\": 1,\n \"repeats\": 2}");
    EXPECT_THAT(message(path), HasSubstr("key \"repeats\" occurs twice"));
    writeText(path, "{\"repeats\": 1,\n  maps}");
    EXPECT_THAT(message(path), HasSubstr("is not JSON at line 2, column"));
    for (const char* number : {"NaN", "-Infinity", "nan", "inf", "+inf"}) {
        writeText(path, std::string("{\"fps\": ") + number + "}");
        EXPECT_THAT(message(path), AllOf(HasSubstr("is not JSON at line 1, column"),
                                         HasSubstr("JSON has no NaN and no Infinity")))
            << number;
    }
    for (const std::string& start : {std::string("\xff\xfe{\0}\0", 6), std::string("\0{\0}", 4)}) {
        writeText(path, start);
        EXPECT_THAT(message(path), HasSubstr("e.json: is UTF-16; save it as UTF-8"));
    }
    writeText(path, " \n");
    EXPECT_THAT(message(path), HasSubstr("is empty"));
    writeText(path, R"({"fps": 1e999})");
    EXPECT_THAT(message(path), AllOf(HasSubstr(path), HasSubstr("a number beyond 1.8e308"),
                                     Not(HasSubstr("json.exception"))));
    // The same key in two objects is no key twice.
    EXPECT_EQ(parseJson("[{\"a\": 1}, {\"a\": {\"a\": 2}}]", "x", "y").size(), 2u);
    for (const size_t depth : {size_t(kMaxJsonDepth + 1), size_t(100'000), size_t(10'000'000)}) {
        writeText(directory / "deep.json", std::string(depth, '[') + std::string(depth, ']'));
        EXPECT_THAT(message(directory / "deep.json"),
                    HasSubstr("nests deeper than 100 levels at line 1, column 101; "));
        EXPECT_TRUE(readOwnJsonFile(directory / "deep.json").is_discarded());
    }
    const std::string deepest = std::string(kMaxJsonDepth, '[') + std::string(kMaxJsonDepth, ']');
    EXPECT_EQ(jsonLine(parseJson(deepest, "x", "y")), deepest);
    const std::string inText = "[\"" + std::string(1000, '[') + "\\\"[\"]";
    EXPECT_EQ(parseJson(inText, "x", "y").size(), 1u);
    EXPECT_THAT(message("/dev/zero"), HasSubstr("/dev/zero: is a device; "));
}

TEST(Experiment, InvalidUtf8IsRefusedByNameOrReplaced) {
    EXPECT_THAT(inputMessage({{"size", "\xff"}}), HasSubstr("\"size\""));
    EXPECT_THAT(inputMessage({{"models", {"\xff"}}}), HasSubstr("\"models\""));
    EXPECT_EQ(jsonLine("a\xff"), "\"a\uFFFD\"");
}

TEST(Experiment, ALevelThatVoxelsDoNotHaveIsRefusedWithThoseTheyHave) {
    Experiment e;
    e.methods = {"dag", "maps"};
    e.believe = {kPaperBelieve, 0};
    e.lod = {LodChoice(6), LodChoice(7)};
    EXPECT_NO_THROW(refuseLods(configurations(e, {128}, 1)));
    try {
        refuseLods(configurations(e, {64}, 1));
        FAIL() << "was taken";
    } catch (const Error& error) {
        EXPECT_THAT(error.what(), HasSubstr("--lod '7': 64^3 voxels have levels 0 to 6"));
    }
}

TEST(Experiment, ABoundedBeliefOfLevelsOfDetailIsRefused) {
    Experiment e;
    e.methods = {"dag"};
    e.believe = {4};
    e.lod = {LodChoice(0)};
    EXPECT_NO_THROW(refuseLods(configurations(e, {64}, 1)));
    e.lod = {LodChoice(3)};
    try {
        refuseLods(configurations(e, {64}, 1));
        FAIL() << "was taken";
    } catch (const Error& error) {
        EXPECT_THAT(error.what(), HasSubstr("--believe bounds how far voxels displace a shadow"));
    }
}

TEST(Experiment, PolygonLevelsOfDetailAreTexelsOfMaps) {
    const Experiment e =
        experimentFromJson({{"polygon_lod", {0, 1.5}}, {"methods", {"maps", "dag"}}}, "x");
    EXPECT_EQ(e.polygonLod, (std::vector<float>{0, 1.5f}));
    EXPECT_EQ(toJson(e)["polygon_lod"].dump(), "[0.0,1.5]");
    EXPECT_EQ(baseOptions(e).maps.lodTexels, 0.0f);
    std::vector<float> drawn;
    size_t rayCount = 0;
    for (const RunParameters& run : configurations(e, {64}, 1)) {
        rayCount += run.method == "dag" ? 1 : 0;
        if (run.usesMaps()) {
            drawn.push_back(run.frame.maps.lodTexels);
            EXPECT_EQ(run.toJson()["polygon_lod"], run.frame.maps.lodTexels);
        }
    }
    EXPECT_THAT(drawn, ElementsAre(0.0f, 1.5f));
    EXPECT_EQ(rayCount, 1u) << "rays do not read it";
    EXPECT_THAT(inputMessage({{"polygon_lod", {-1}}}), HasSubstr("\"polygon_lod\""));
    EXPECT_THAT(inputMessage({{"polygon_lod", 2}}), HasSubstr("must be a list"));
}

TEST(Experiment, LevelsOfDetailAreNumbersAndTexts) {
    const Json lods = {0, 2, "footprint", "footprint:2", "coverage:0.75", "coverage:0.5:4"};
    const Experiment e = experimentFromJson({{"lod", lods}}, "x");
    EXPECT_EQ(toJson(e)["lod"], lods);
    ASSERT_EQ(e.lod.size(), 6u);
    EXPECT_EQ(e.lod[1].level, 2u);
    EXPECT_EQ(e.lod[3].rule, LodRule::kFootprint);
    EXPECT_EQ(e.lod[3].footprintScale, 2.0f);
    EXPECT_EQ(e.lod[5].rule, LodRule::kCoverage);
    EXPECT_EQ(e.lod[5].coverage, 0.5f);
    EXPECT_EQ(e.lod[5].footprintScale, 4.0f);
    EXPECT_EQ(parseLod("--lod", "coverage").text(), "coverage:0.75");
    Experiment swept = e;
    swept.methods = {"dag"};
    swept.believe = {kPaperBelieve};
    EXPECT_THAT(labels(configurations(swept, {1024}, 1)),
                ElementsAre("dag 1024^3 believe all", "dag 1024^3 believe all lod 2",
                            "dag 1024^3 believe all lod footprint",
                            "dag 1024^3 believe all lod footprint:2",
                            "dag 1024^3 believe all lod coverage:0.75",
                            "dag 1024^3 believe all lod coverage:0.5:4"));
    EXPECT_EQ(configurations(swept, {1024}, 1)[3].toJson()["lod"], "footprint:2");
    EXPECT_EQ(configurations(swept, {1024}, 1)[1].toJson()["lod"], 2);
}

TEST(Configurations, PureMethodsReplaceTheEndsOfTheSweep) {
    Experiment e;
    e.thresholds = {0, 96, std::numeric_limits<float>::infinity()};
    e.believe = {kPaperBelieve};
    EXPECT_THAT(labels(configurations(e, {1024, 512}, 1)),
                ElementsAre("embree", "maps", "hybrid texels:96 1024^3 believe all",
                            "dag 1024^3 believe all", "dag 512^3 believe all",
                            "hybrid oracle 1024^3 believe all"));
}

TEST(Configurations, AutomaticThresholdsAreThePapersUntilAFrameIsKnown) {
    const Experiment e = experimentFromJson({{"models", Json::array()}}, "x");
    EXPECT_EQ(toJson(e)["thresholds"], Json({"auto"}));
    EXPECT_EQ(toJson(experimentFromJson({{"thresholds", {"auto"}}}, "x"))["thresholds"],
              Json({"auto"}));
    EXPECT_THAT(labels(configurations(e, {64}, 1)),
                ElementsAre("embree", "maps", "hybrid texels:96 believe none", "dag believe none"));
}

TEST(AutomaticThresholds, LieAtQuantilesAsRoundNumbers) {
    std::vector<float> requests;
    for (int i = 0; i < 70; ++i)
        requests.push_back(1000.0f + 10.0f * float(i));
    EXPECT_THAT(automaticThresholds(requests), ElementsAre(1100, 1200, 1300, 1400, 1500, 1600));
    EXPECT_THAT(automaticThresholds({7, 90, 94, 97.25f, 300}), ElementsAre(10, 91, 96, 100));
    EXPECT_THAT(automaticThresholds({1.25f, 1.5f}), ElementsAre(1.3f));
    EXPECT_THAT(automaticThresholds({200, 200, 200}), testing::IsEmpty());
    EXPECT_THAT(automaticThresholds({}), testing::IsEmpty());
}

// Over lists with ties, tiny gaps and one dominant value.
TEST(AutomaticThresholds, EachRoutesInItsOwnWay) {
    std::mt19937 random(5);
    for (int round = 0; round < 200; ++round) {
        std::vector<float> requests(1 + random() % 40);
        for (float& request : requests)
            request = round % 3 == 0   ? float(1 + random() % 4)
                      : round % 3 == 1 ? 100.0f + 1e-5f * float(random() % 100)
                                       : std::exp2(float(random() % 1000) / 90.0f);
        std::set<int64_t> tracedCounts = {0, int64_t(requests.size())}; // maps and rays alone
        for (const float threshold : automaticThresholds(requests)) {
            const int64_t tracedCount = std::count_if(requests.begin(), requests.end(),
                                                      [&](float r) { return r < threshold; });
            EXPECT_TRUE(tracedCounts.insert(tracedCount).second) << round << ": " << threshold;
        }
    }
}

TEST(Configurations, RaysDoNotVaryWithMapsNorMapsWithRays) {
    Experiment e;
    e.thresholds = {96};
    e.models.clear();
    e.undersample = {1, 2};
    e.offset = {1, 2};
    e.methods = {"dag", "maps"};
    e.believe = {kPaperBelieve};
    EXPECT_THAT(labels(configurations(e, {1024}, 1)),
                ElementsAre("maps", "dag 1024^3 believe all", "dag 1024^3 believe all offset 2",
                            "maps u2"));
}

TEST(Configurations, RaysThatBelieveNoVoxelAreOneRun) {
    Experiment e;
    e.thresholds = {96};
    e.models.clear();
    e.offset = {1, 2};
    e.lod[0].level = 1;
    e.taps = {1, 9};
    e.methods = {"embree", "dag"};
    const std::vector<RunParameters> runs = configurations(e, {1024, 512}, 1);
    EXPECT_THAT(labels(runs), ElementsAre("embree", "dag believe none"));
    EXPECT_EQ(runs[1].frame.rays.believe, 0.0f);
    EXPECT_EQ(runs[1].toJson(),
              (Json{{"believe", "none"}, {"beam_bytes", 0}, {"threshold_texels", "inf"}}));
    EXPECT_TRUE(runs[1].usesRays() && runs[1].usesTriangles());
    EXPECT_FALSE(runs[1].usesMaps() || runs[1].usesVoxels());
}

TEST(Configurations, ResolutionsVaryForTheVoxelsThatAreBelieved) {
    Experiment e;
    e.methods = {"dag"};
    e.thresholds.clear();
    e.models.clear();
    e.believe = {0, 2, kPaperBelieve};
    EXPECT_THAT(labels(configurations(e, {1024, 512}, 1)),
                ElementsAre("dag believe none", "dag 1024^3 believe 2", "dag 1024^3 believe all",
                            "dag 512^3 believe 2", "dag 512^3 believe all"));
}

TEST(Configurations, LabelsAndFileNamesAreUnique) {
    Experiment e;
    e.undersample = {1, 2};
    e.taps = {1, 9};
    e.bias = {0, 1};
    e.lod = {0, 1};
    e.pageTexels = {32, 64};
    e.models = {"oracle", "expr:texels-96", "expr:texels-48"};
    std::set<std::string> seen, files;
    const std::vector<RunParameters> runs = configurations(e, {1024, 2048}, 2);
    for (const RunParameters& run : runs) {
        seen.insert(run.label());
        files.insert(run.slug());
    }
    EXPECT_EQ(seen.size(), runs.size());
    EXPECT_EQ(files.size(), runs.size());
}

TEST(Configurations, ExpressionsThatDifferInSignsAloneHaveTheirOwnShortFiles) {
    Experiment e;
    e.models = {"expr:texels<50", "expr:texels>50", "expr:" + std::string(400, '1')};
    e.models.push_back(e.models.back() + "1");
    std::set<std::string> files;
    const std::vector<RunParameters> runs = configurations(e, {1024}, 1);
    for (const RunParameters& run : runs) {
        files.insert(run.slug());
        EXPECT_LE(run.slug().size(), 60u);
    }
    EXPECT_EQ(files.size(), runs.size());
    EXPECT_EQ(runs[0].slug(), "embree");
    EXPECT_EQ(fileSlug("scene.gltf"), "scene.gltf");
    EXPECT_NE(fileSlug("a/scene.gltf"), fileSlug("a_scene.gltf"));
    EXPECT_NE(fileSlug("\u00e4.gltf"), fileSlug("\u00f6.gltf"));
    EXPECT_NE(fileSlug("\u00e4.gltf"), fileSlug("__.gltf"));
}

TEST(Configurations, TheLargestFaceIsTheExperiments) {
    const Experiment e = experimentFromJson({{"max_face_texels", 8192}}, "x");
    for (const RunParameters& run : configurations(e, {1024}, 1))
        EXPECT_EQ(run.frame.maxFaceTexels, 8192u) << run.label();
    EXPECT_EQ(toJson(e)["max_face_texels"], 8192);
}

TEST(Configurations, BeamsAreKeptByExactRaysThatStartColdOrWarm) {
    const Experiment e = experimentFromJson({{"methods", {"dag"}},
                                             {"thresholds", {"inf"}},
                                             {"believe", {"none", "all"}},
                                             {"beams_mib", {0, 256}},
                                             {"start", {"cold", "warm"}}},
                                            "x");
    std::vector<std::string> labels;
    for (const RunParameters& run : configurations(e, {1024}, 1)) {
        labels.push_back(run.label());
        EXPECT_EQ(run.toJson().value("beam_bytes", uint64_t(0)),
                  run.frame.rays.keepsBeams() ? uint64_t(256) << 20 : 0u)
            << run.label();
    }
    EXPECT_THAT(labels, testing::UnorderedElementsAre(
                            "dag believe none", "dag believe none beams 256M",
                            "dag believe none beams 256M warm", "dag 1024^3 believe all"));
    EXPECT_EQ(toJson(e)["beams_mib"], (Json{0, 256}));
    for (const Json& bad : {Json(-1), Json(16385), Json("much")})
        EXPECT_THROW(experimentFromJson({{"beams_mib", bad}}, "x"), Error);
}

TEST(Experiment, TheCommittedFilesAreValid) {
    for (const char* name : {"atrium", "houses", "necropolis", "smoke", "real"}) {
        const Experiment e =
            readExperiment(std::string(SDAG_SOURCE_DIR) + "/scenes/experiments/" + name + ".json");
        EXPECT_FALSE(e.title.empty()) << name;
        EXPECT_EQ(e.areThresholdsAutomatic(), std::string(name) != "smoke") << name;
    }
    EXPECT_GE(
        readExperiment(std::string(SDAG_SOURCE_DIR) + "/scenes/experiments/lod.json").lod.size(),
        8u);
    for (const char* name :
         {"figures_necropolis", "figures_houses", "figures_atrium", "slow_camera"}) {
        const Experiment e =
            readExperiment(std::string(SDAG_SOURCE_DIR) + "/scenes/experiments/" + name + ".json");
        EXPECT_TRUE(e.isSequence) << name;
        EXPECT_GE(e.variants.size(), 5u) << name;
    }
    for (const char* name : {"beams", "beams_1080p", "beams_placed", "beams_placed_1080p",
                             "beams_sequence", "beams_still"})
        EXPECT_EQ(
            readExperiment(std::string(SDAG_SOURCE_DIR) + "/scenes/experiments/" + name + ".json")
                .beamsMib,
            (std::vector<uint32_t>{0, 512}))
            << name;
    EXPECT_EQ(readExperiment(std::string(SDAG_SOURCE_DIR) + "/scenes/experiments/held_routes.json")
                  .variants,
              (std::vector<std::string>{"Hybrid:texels:32", "Hybrid:texels:32-RH0.2",
                                        "Hybrid:texels:32-RH1"}));
}

// What times are published of: ten repeats after a warm-up, or a sequence of 60 frames, twice.
TEST(Experiment, TheCommittedFilesMeasureTimesOftenEnough) {
    const auto read = [](const std::string& name) {
        return readExperiment(std::string(SDAG_SOURCE_DIR) + "/scenes/experiments/" + name +
                              ".json");
    };
    for (const char* name :
         {"atrium", "believe", "houses", "lod", "main", "main_1080p", "main_gpu", "main_placed",
          "main_placed_1080p", "main_placed_gpu", "necropolis", "real", "regret"}) {
        EXPECT_GE(read(name).repeats, 10) << name;
        EXPECT_GE(read(name).warmups, 1) << name;
    }
    for (const char* name : {"animations", "figure_10", "held_routes", "slow_camera"}) {
        EXPECT_GE(read(name).frames.size(), 60u) << name;
        EXPECT_GE(read(name).repeats, 2) << name;
        EXPECT_GE(read(name).leadIn, 1u) << name; // a frame that warms up the next
    }
}

TEST(Experiment, VariantsReplaceTheSweep) {
    const Experiment e = experimentFromJson({{"variants", {"PMC", "PMCD-u2", "RT"}}}, "x");
    EXPECT_THAT(labels(configurations(e, {256}, 1)), ElementsAre("embree", "PMC", "PMCD-u2", "RT"));
    EXPECT_EQ(configurations(e, {256}, 1)[3].resolution, 256u);
    EXPECT_EQ(toJson(experimentFromJson(toJson(e), "x")), toJson(e));
    const Experiment alone =
        experimentFromJson({{"variants", {"PMC"}}, {"methods", Json::array()}}, "x");
    EXPECT_THAT(labels(configurations(alone, {}, 0)), ElementsAre("PMC"));
}

TEST(Configurations, MapsALightAreSweptAndNamed) {
    const Experiment e = experimentFromJson(
        {{"methods", {"maps"}}, {"maps_per_light", {1, 4}}, {"thresholds", {0}}}, "x");
    const std::vector<RunParameters> runs = configurations(e, {}, 0);
    ASSERT_EQ(runs.size(), 2u);
    EXPECT_EQ(runs[1].frame.mapsPerLight, 4u);
    EXPECT_EQ(runs[1].toJson()["maps_per_light"], 4);
    EXPECT_NE(runs[0].label(), runs[1].label());
}

TEST(Experiment, ModelsThatRunAtOneValueOfAListAreNamed) {
    Experiment e;
    e.models = {"cost", "oracle"};
    const auto remark = [&] {
        return oneValueRemark(e, configurations(e, {1024, 2048}, e.resolutionLog2.size()));
    };
    EXPECT_EQ(remark(), "");
    e.taps = {4, 9};
    e.resolutionLog2 = {10, 11};
    EXPECT_EQ(remark(),
              "--model cost, oracle: run at the first value of every list only (--taps 4, "
              "--resolution 1024); lists are combined with thresholds");
    e.models.clear();
    EXPECT_EQ(remark(), "");
}

} // namespace shadowdag
