// SPDX-License-Identifier: Apache-2.0
// Real scenes: bounds of cells, messages about exceeded ones, and a known scene.
#include "tools/studies/real_scenes.h"

#include "cuda/backend.h"
#include "cuda/error.h"
#include "scenes/fail_scenes.h"
#include "scenes/gltf.h"
#include "tests/scenes/gltf_files.h"
#include "tests/tools/report/report_runner.h"
#include "tests/tools/temporary_directory.h"
#include "tools/settings/console.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <iterator>
#include <map>
#include <set>

namespace shadowdag {

namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

const RealTable& table() {
    static const RealTable read = readReal(findStudy("real"));
    return read;
}

TEST(RealScenes, EveryKnownSceneHasACellPerMethod) {
    for (const RealScene& scene : table().scenes) {
        EXPECT_EQ(scene.geometryHash.size(), 32u) << scene.name;
        EXPECT_EQ(scene.known.size(), size_t(kMatrixMethodCount)) << scene.name;
    }
}

// By hand: a twentieth of 100 and 3 more are 108, for dag believe none there is no slack; what any
// scene is held to goes before that.
TEST(RealScenes, BoundsAreTheRecordedOnesOrThoseOfAnyScene) {
    RealScene scene;
    for (int m = 0; m < kMatrixMethodCount; ++m) {
        KnownCell known{MatrixMethod(m)};
        known.counts[size_t(CellMeasure::kFalseShadow)] = 100;
        known.counts[size_t(CellMeasure::kAcne)] = 40;
        scene.known.push_back(known);
    }
    const Json maps = realBounds(table(), &scene, MatrixMethod::kMaps, true);
    EXPECT_EQ(maps["false_shadow_count"], 108);
    EXPECT_EQ(maps["acne_count"], 45);
    EXPECT_EQ(maps["unnamed_count"], 0);
    EXPECT_EQ(realBounds(table(), &scene, MatrixMethod::kDagAll, true)["acne_count"], 45);
    EXPECT_EQ(realBounds(table(), nullptr, MatrixMethod::kDagAll, true)["acne_share"], 0.001);
    const Json exact = realBounds(table(), &scene, MatrixMethod::kDagNone, true),
               exactAnywhere = realBounds(table(), nullptr, MatrixMethod::kDagNone, true);
    EXPECT_EQ(exact["false_shadow_count"], 100);
    EXPECT_EQ(exact["acne_count"], 0);
    EXPECT_EQ(exactAnywhere["false_shadow_count"], 0);
    EXPECT_EQ(exactAnywhere["unexplained_count"], 0);
    const Json unknown = realBounds(table(), nullptr, MatrixMethod::kHybrid, true);
    EXPECT_EQ(unknown["unnamed_count"], 0);
    const Json cell = {{"false_shadow_count", 109}, {"acne_count", 45}, {"unnamed_count", 0}},
               bounds = {{"false_shadow_count", 108}, {"acne_count", 45}, {"unnamed_count", 0}};
    EXPECT_EQ(realBroken(cell, bounds), Json::array({"false_shadow_count"}));
}

// What any scene is held to, whatever was recorded; a known cell may be named as untrusted.
TEST(RealScenes, ToleranceHoldsForEveryMethodUnlessItIsNamed) {
    for (int m = 0; m < kMatrixMethodCount; ++m) {
        const Json bounds = realBounds(table(), nullptr, MatrixMethod(m), true);
        for (const char* name : {"false_shadow_share", "false_light_share", "magnified_share"})
            EXPECT_TRUE(bounds.contains(name)) << kMatrixMethodNames[m];
    }
    RealScene scene;
    scene.untrusted.push_back({MatrixMethod::kDagAll, "lamps"});
    EXPECT_FALSE(
        realBounds(table(), &scene, MatrixMethod::kDagAll, true).contains("magnified_share"));
    EXPECT_TRUE(realBounds(table(), &scene, MatrixMethod::kMaps, true).contains("magnified_share"));
    const Json cell = {{"scene", "street"},
                       {"method", "dag believe all"},
                       {"magnified_share", 0.2},
                       {"bounds", {{"magnified_share", 0.002}}}};
    Json broken = cell;
    broken["broken"] = realBroken(cell, cell["bounds"]);
    EXPECT_EQ(broken["broken"], Json::array({"magnified_share"}));
    EXPECT_THAT(realBrokenLines({{"cells", Json::array({broken})}}),
                ElementsAre("street by dag believe all: magnified_share is 20 %, bound 0.2 %"));
}

// Power is judged where errors lie: near outlines, whatever the rate of all pairs is.
TEST(RealScenes, ExplainingHasNoPowerWhereHalfOfTheRightPairsNearOutlinesWouldBeExplained) {
    const auto powerOf = [](MatrixMethod method, double rate, int sampleCount) {
        return explainingHasPower(table(), method,
                                  {{"null_rate", 0.01},
                                   {"outline_null_rate", rate},
                                   {"outline_null_sample_count", sampleCount}});
    };
    for (int m = 0; m < kMatrixMethodCount; ++m) {
        EXPECT_EQ(powerOf(MatrixMethod(m), 0.5, 100), true) << kMatrixMethodNames[m];
        EXPECT_EQ(powerOf(MatrixMethod(m), 0.51, 100), false) << kMatrixMethodNames[m];
        EXPECT_EQ(powerOf(MatrixMethod(m), 0.0, 0), nullptr) << kMatrixMethodNames[m];
    }
}

// Without power no error is excused: both kinds together have a bound, unless the cell is named.
TEST(RealScenes, WhereExplainingHasNoPowerAllErrorsTogetherHaveABound) {
    const Json cell = {{"scene", "street"},      {"method", "maps"},
                       {"wrong_share", 0.015},   {"false_shadow_share", 0.008},
                       {"acne_share", 0.0},      {"false_light_share", 0.007},
                       {"magnified_share", 0.0}, {"unnamed_count", 0}};
    for (const Json& hasPower : {Json(true), Json(nullptr)})
        EXPECT_THAT(realBroken(cell, realBounds(table(), nullptr, MatrixMethod::kMaps, hasPower)),
                    IsEmpty())
            << hasPower;
    Json broken = cell;
    broken["bounds"] = realBounds(table(), nullptr, MatrixMethod::kMaps, false);
    broken["broken"] = realBroken(cell, broken["bounds"]);
    EXPECT_EQ(broken["broken"], Json::array({"wrong_share"}));
    EXPECT_THAT(realBrokenLines({{"cells", Json::array({broken})}}),
                ElementsAre("street by maps: wrong_share is 1.5 %, bound 1 % where explaining has "
                            "no power, so that it excuses no error"));
    RealScene named;
    named.untrusted.push_back({MatrixMethod::kMaps, "small objects"});
    EXPECT_FALSE(realBounds(table(), &named, MatrixMethod::kMaps, false).contains("wrong_share"));
}

MatrixMethod methodOf(const Json& cell) {
    const auto found = std::find(std::begin(kMatrixMethodNames), std::end(kMatrixMethodNames),
                                 cell["method"].get<std::string>());
    return MatrixMethod(found - std::begin(kMatrixMethodNames));
}

// The list in the file is of the bounds before that run; these are what was recorded from it.
TEST(RealScenes, TheCommittedCountsKeepTheBoundsOfTheStudy) {
    const Json run = Json::parse(readText(SDAG_SOURCE_DIR "/tests/bench/results/real_scenes.json"));
    ASSERT_GT(run["cells"].size(), 100u);
    size_t knownCount = 0;
    for (const Json& cell : run["cells"]) {
        const RealScene* scene = table().find(cell["scene"]);
        if (!scene) // without a shadow edge, so not recorded
            continue;
        ++knownCount;
        EXPECT_EQ(cell["geometry_hash"], scene->geometryHash);
        const Json bounds =
            realBounds(table(), scene, methodOf(cell), cell["explaining_has_power"]);
        EXPECT_EQ(realBroken(cell, bounds), Json::array())
            << cell["scene"] << " by " << cell["method"];
    }
    EXPECT_EQ(knownCount, table().scenes.size() * kMatrixMethodCount);
}

// What the documents say of the committed run is counted in it.
TEST(RealScenes, TheDocumentsCountTheCellsWithoutPower) {
    const Json run = Json::parse(readText(SDAG_SOURCE_DIR "/tests/bench/results/real_scenes.json"));
    std::map<MatrixMethod, size_t> powerless;
    for (const Json& cell : run["cells"])
        powerless[methodOf(cell)] += explainingHasPower(table(), methodOf(cell), cell) == false;
    const std::string said = std::to_string(powerless[MatrixMethod::kMaps]) + " of " +
                             std::to_string(run["cells"].size() / kMatrixMethodCount) +
                             " scenes by maps, " +
                             std::to_string(powerless[MatrixMethod::kDagAll]) + " by voxels and " +
                             std::to_string(powerless[MatrixMethod::kHybrid]) + " by the hybrid";
    EXPECT_EQ(powerless[MatrixMethod::kDagNone], 0u);
    for (const char* document : {"/docs/results.md", "/docs/limits.md"}) {
        const std::string text = readText(SDAG_SOURCE_DIR + std::string(document));
        std::string words;
        for (size_t i = 0; i < text.size(); ++i) { // however its lines are broken
            const bool isSpace = text[i] == ' ' || text[i] == '\n';
            if (!isSpace || words.empty() || words.back() != ' ')
                words += isSpace ? ' ' : text[i];
        }
        EXPECT_THAT(words, HasSubstr(said)) << document;
    }
}

// A view that is all dark or all lit has no shadow to be wrong at: a known scene must not be such.
TEST(RealScenes, AKnownSceneMustShowAShadowEdge) {
    Json cell = {{"scene", "barn"}, {"method", "maps"}, {"known", "yes"}, {"pair_count", 9}};
    for (const int dark : {0, 1, 8, 9}) {
        cell["occluded_count"] = dark;
        const bool shows = dark == 1 || dark == 8;
        EXPECT_EQ(showsShadowEdge(cell), shows) << dark;
        cell["broken"] = realBroken(cell, Json::object());
        EXPECT_EQ(cell["broken"], shows ? Json::array() : Json::array({"occluded_count"})) << dark;
    }
    EXPECT_THAT(realBrokenLines({{"cells", Json::array({cell})}}),
                ElementsAre(HasSubstr("barn by maps: shows no shadow edge, occluded_count is 9 of "
                                      "9 pairs")));
    cell["pair_count"] = cell["occluded_count"] = 0;
    EXPECT_FALSE(showsShadowEdge(cell));
}

TEST(RealScenes, ACellWithoutPairsIsBroken) {
    Json cell = {{"scene", "sky"}, {"method", "maps"}, {"known", "no"}, {"pair_count", 1}};
    cell["occluded_count"] = 0;
    EXPECT_TRUE(realBroken(cell, Json::object()).empty());
    cell["pair_count"] = 0;
    cell["broken"] = realBroken(cell, Json::object());
    EXPECT_THAT(realBrokenLines({{"cells", Json::array({cell})}}),
                ElementsAre(HasSubstr("sky by maps: no visible point faces a light")));
}

// What was measured of each known scene, as it is committed, proves something; a scene without a
// shadow edge proves nothing and is not recorded.
TEST(RealScenes, TheCommittedRunShowsAShadowEdgeInEveryKnownCell) {
    const Json run = Json::parse(readText(SDAG_SOURCE_DIR "/tests/bench/results/real_scenes.json"));
    std::set<std::string> scenes;
    for (const Json& cell : run["cells"]) {
        EXPECT_EQ(showsShadowEdge(cell), cell["known"] == "yes")
            << cell["scene"] << " by " << cell["method"];
        scenes.insert(cell["scene"].get<std::string>());
    }
    for (const RealScene& scene : table().scenes)
        EXPECT_TRUE(scenes.contains(scene.name)) << scene.name;
}

TEST(RealScenes, ExceededBoundsAreReportedWithNumbersAndTheFirstPair) {
    const Json first = {{"error", "false light"}, {"frame", 1}, {"pixel", {3, 4}}, {"light", 7}};
    const Json cell = {{"scene", "barn"},
                       {"method", "maps"},
                       {"unnamed_count", 2},
                       {"bounds", {{"unnamed_count", 0}}},
                       {"broken", Json::array({"unnamed_count", "unknown"})},
                       {"unnamed", Json::array({first})}};
    EXPECT_THAT(
        realBrokenLines({{"cells", Json::array({cell})}}),
        ElementsAre("barn by maps: unnamed_count is 2, bound 0; the first: a false light in "
                    "frame 1 at pixel 3,4 of light 7",
                    "barn by maps: it has no recorded counts; run tools/studies/update_known.py"));
}

Json measure(const std::vector<std::string>& files, const std::string& settings) {
    const TemporaryDirectory directory;
    static const Console console(true);
    StudyFile file = findStudy("real");
    if (!settings.empty())
        file.json["settings"] = settings;
    const StudyRequest request{Backend::kCpu, {}, files, directory / "cache", ""};
    return measureAll(*makeStudy(file, request, console), request);
}

// An unknown scene: errors have names, dag believe none has none, and threads change nothing.
TEST(RealScenes, AnySceneIsMeasuredTheSameOnAnyThreadCount) {
    const Json many = measure({"builtin:fail-contact"}, "resolution=128 pool=256M");
    ASSERT_EQ(many["cells"].size(), size_t(kMatrixMethodCount));
    for (const Json& cell : many["cells"]) {
        EXPECT_EQ(cell["known"], "no");
        EXPECT_EQ(cell["bounds"]["unnamed_count"], 0);
        EXPECT_GT(cell["pair_count"], 0);
        EXPECT_GT(cell["flicker_answer_count"], 0);
        EXPECT_EQ(cell["explaining_has_power"].is_null(), cell["outline_null_sample_count"] == 0);
        EXPECT_EQ(cell["unnamed"].size(), std::min(cell["unnamed_count"].get<size_t>(), size_t(8)));
    }
    EXPECT_GT(many["cells"][size_t(MatrixMethod::kDagAll)]["false_light_count"], 20);
    EXPECT_TRUE(many["cells"][size_t(MatrixMethod::kDagNone)]["broken"].empty());
    setThreadCount(1);
    const Json one = measure({"builtin:fail-contact"}, "resolution=128 pool=256M");
    setThreadCount(0);
    EXPECT_EQ(many, one);
    // Of a view that is all dark the page says what it is worth.
    const char* const nothing = "It shows no shadow edge";
    const auto page = [](Json results) {
        results["provenance"] = Json::object();
        results["broken"] = realBrokenLines(results);
        results["study"] = findStudy("real").json;
        return pageOf("real", "real.json", results);
    };
    EXPECT_THAT(page(many), Not(HasSubstr(nothing)));
    Json dark = many;
    for (Json& cell : dark["cells"])
        cell["occluded_count"] = cell["pair_count"];
    EXPECT_THAT(page(dark), HasSubstr(nothing));
}

// A light on a face by rays offset by nothing: more acne by rays than any scene may have.
TEST(RealScenes, AcneByRaysBreaksAnyScene) {
    const Json results = measure({"builtin:fail-self-shadow"}, "resolution=128 pool=256M offset=0");
    EXPECT_THAT(
        results["cells"][size_t(MatrixMethod::kDagAll)]["broken"].get<std::vector<std::string>>(),
        Contains("acne_share"));
}

TEST(RealScenes, ASmallKnownSceneKeepsItsBoundsWhichAreTight) {
    if (test::sharedScenes().empty())
        GTEST_SKIP() << "the shared scenes are absent; SDAG_SHARED_SCENES names their folder";
    const Json results = measure({test::sharedScenes() + "glb/lqdm1.glb"}, "");
    EXPECT_THAT(realBrokenLines(results), IsEmpty());
    for (const Json& cell : results["cells"]) {
        EXPECT_EQ(cell["known"], "yes");
        CellCounts counts;
        for (size_t m = 0; m < counts.size(); ++m)
            counts[m] = cell[kCellMeasureNames[m]].get<uint64_t>();
        for (const KnownCell& known : table().find("lqdm1")->known) {
            if (cell["method"] != kMatrixMethodNames[size_t(known.method)])
                continue;
            for (size_t m = 0; m < counts.size(); ++m)
                EXPECT_LE(known.counts[m], boundOf(counts, table().slack)[m])
                    << cell["method"] << ": " << kCellMeasureNames[m]
                    << " is better than the study says; run tools/studies/update_known.py";
        }
    }
}

/// Writes a failure scene without its lights.
void writeDarkScene(const std::string& path) {
    Scene scene = makeFailScene(failScenes()[1]);
    scene.lights.clear();
    for (Node& node : scene.nodes)
        node.light = kNone;
    writeGlb(scene, path);
}

TEST(RealScenes, FilesAreScenesAndThoseOfDirectories) {
    const TemporaryDirectory directory;
    const Console console(true);
    RealTable litOnly;
    RealTable placing;
    placing.placedLightCount = 4;
    const auto message = [&](const std::vector<std::string>& arguments) {
        try {
            realFiles(litOnly, arguments, console);
        } catch (const Error& error) {
            return std::string(error.what());
        }
        return std::string();
    };
    EXPECT_THAT(message({}), HasSubstr("study real needs scenes"));
    EXPECT_THAT(message({directory.path()}), HasSubstr("has no .glb or .gltf file"));
    EXPECT_THAT(realFiles(litOnly, {"a.glb", "b.glb"}, console), ElementsAre("a.glb", "b.glb"));
    EXPECT_THAT(message({"a.glb", "a.glb"}), HasSubstr("given twice"));
    // Cells and pictures go by the stem: two of one would be one.
    EXPECT_THAT(message({"a/x.glb", "y.glb", "b/x.gltf"}),
                HasSubstr("a/x.glb and b/x.gltf both have the name 'x'"));
    try {
        measure({"a/x.glb", "b/x.glb"}, "");
        FAIL() << "were taken";
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kUsage);
        EXPECT_THAT(error.what(), HasSubstr("both have the name 'x'"));
    }
    writeDarkScene(directory / "dark.glb");
    EXPECT_THAT(message({directory.path()}), HasSubstr("no .glb or .gltf file in it has lights"));
    Scene scene = makeFailScene(failScenes().front());
    writeGlb(scene, directory / "lit.glb");
    writeGlb(scene, directory / "also.glb");
    EXPECT_THAT(realFiles(litOnly, {directory.path()}, console),
                ElementsAre(directory / "also.glb", directory / "lit.glb"));
    EXPECT_THAT(realFiles(placing, {directory.path()}, console),
                ElementsAre(directory / "also.glb", directory / "dark.glb", directory / "lit.glb"));
}

TEST(RealScenes, LightsArePlacedWhereASceneHasNone) {
    const TemporaryDirectory directory;
    writeDarkScene(directory / "dark.glb");
    const Json dark = measure({directory / "dark.glb"}, "resolution=128 pool=256M");
    for (const Json& cell : dark["cells"]) {
        EXPECT_EQ(cell["lights"], "placed");
        EXPECT_EQ(cell["light_count"], table().placedLightCount);
        EXPECT_GT(cell["pair_count"], 0);
    }
    const Json lit = measure({"builtin:fail-contact"}, "resolution=128 pool=256M");
    EXPECT_EQ(lit["cells"][0]["lights"], "own");
}

} // namespace
} // namespace shadowdag
