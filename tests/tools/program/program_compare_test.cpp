// SPDX-License-Identifier: Apache-2.0
// `shadowdag compare` from end to end at smoke size: keys, charts, death, resumption, threads.
#include "scenes/builtin.h"
#include "scenes/gltf.h"
#include "tests/tools/program/program_refusals.h"
#include "tools/workspace/frame_json.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include <csignal>
#include <filesystem>
#include <set>
#include <thread>

namespace shadowdag {

namespace {

using testing::HasSubstr;
using Arguments = std::vector<std::string>;

Arguments tinyCompare(const std::string& output) {
    return {"compare",     "builtin:atrium", "-o", output,         "--size",
            "48x27",       "--resolution",   "64", "--thresholds", "0,16,inf",
            "--no-charts", "--repeats",      "1",  "--warmups",    "0",
            "--json"};
}

/// Removes what may differ between two runs: times, and what provenance says about the run itself.
Json withoutTimes(Json results) {
    results["provenance"].erase("thread_count");
    for (Json& run : results["runs"])
        for (const char* key : {"time_ms", "time_ms_min", "time_ms_max", "stages_ms"})
            run.erase(key);
    for (Json& cost : results["map_costs"])
        for (const char* key : {"rays_ms", "map_ms", "rays_scale", "maps_scale"})
            cost.erase(key);
    return results;
}

std::vector<std::string> filesBelow(const std::string& directory) {
    std::vector<std::string> names;
    if (!std::filesystem::exists(directory))
        return names;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(directory))
        if (entry.is_regular_file())
            names.push_back(std::filesystem::relative(entry.path(), directory).string());
    return names;
}

} // namespace

TEST(Compare, AWrongCameraOrLightCountIsToldBeforeUnfinishedWorkIsPutAway) {
    const TemporaryDirectory directory;
    const std::string report = directory / "report", journal = report + "/partial/journal.json";
    std::filesystem::create_directories(report + "/partial");
    const std::string dark = directory / "dark.glb";
    Scene scene = makeBuiltin("fail-contact");
    scene.lights.clear();
    for (Node& node : scene.nodes)
        node.light = kNone;
    writeGlb(scene, dark);
    const std::string unfinished = "{\"key\": \"a\", \"parts\": {\"b\": 1}}";
    writeText(journal, unfinished);
    const auto refused = [&](Arguments more) {
        Arguments arguments = tinyCompare(report);
        arguments.insert(arguments.begin() + 2, more.begin(), more.end());
        const ProgramResult result = runShadowdag(directory, arguments);
        EXPECT_NE(result.status, 0);
        EXPECT_EQ(readText(journal), unfinished);
        return result.err;
    };
    EXPECT_THAT(refused({"--camera", "nowhere"}), HasSubstr("no camera of that name"));
    EXPECT_THAT(refused({"--lights", "0"}), HasSubstr("without a light"));
    EXPECT_THAT(refused({dark}), HasSubstr("has no light that we support"));
}

TEST(Compare, SmokeExperimentGivesReportChartsAndEveryKey) {
    const TemporaryDirectory directory;
    const std::string report = directory / "report";
    const ProgramResult result =
        runShadowdag(directory, {"compare", "--experiment",
                                 std::string(SDAG_SOURCE_DIR) + "/scenes/experiments/smoke.json",
                                 "-o", report, "--json"});
    ASSERT_EQ(result.status, 0) << result.err;
    EXPECT_EQ(result.json()["chart_count"], 8);
    const Json results = Json::parse(readText(report + "/results.json"));
    for (const char* key : {"commit", "preset", "compiler", "flags", "cpu", "backend", "device",
                            "driver", "experiment_hash", "seed", "thread_count"})
        EXPECT_TRUE(results["provenance"].contains(key)) << key;
    EXPECT_EQ(results["scenes"][0]["scene_hash"].get<std::string>().size(), 32u);
    for (const Json& run : results["runs"])
        for (const char* key : {"scene",
                                "frame",
                                "method",
                                "model",
                                "parameters",
                                "time_ms",
                                "time_ms_min",
                                "time_ms_max",
                                "stages_ms",
                                "pair_count",
                                "occluded_count",
                                "false_shadow_count",
                                "false_light_count",
                                "unexplained_false_shadow_count",
                                "unexplained_false_light_count",
                                "acne_count",
                                "contact_count",
                                "null_rate",
                                "mean_abs_visibility_error",
                                "rmse",
                                "flip",
                                "traced_light_count",
                                "mapped_light_count",
                                "page_count",
                                "texel_count",
                                "triangle_draw_count",
                                "ray_count",
                                "dag_bytes",
                                "map_bytes"})
            EXPECT_TRUE(run.contains(key)) << run["label"] << " " << key;
    const std::string html = readText(report + "/index.html");
    for (const std::string& name : filesBelow(report + "/charts"))
        if (name.ends_with(".svg")) {
            EXPECT_THAT(html, HasSubstr("charts/" + name));
        }
    EXPECT_EQ(html.find("http"), std::string::npos) << "the page must not need the net";
    EXPECT_FALSE(std::filesystem::exists(report + "/partial"));
}

TEST(Compare, OneAndTwoThreadsAgreeInAllButTimes) {
    const TemporaryDirectory directory;
    Json results[2];
    std::string pictures[2];
    for (int i = 0; i < 2; ++i) {
        const std::string report = directory / ("report" + std::to_string(i));
        Arguments arguments = tinyCompare(report);
        arguments.insert(arguments.end(), {"--threads", std::to_string(i + 1),
                                           "--no-oracle"}); // an oracle routes by times
        const ProgramResult result = runShadowdag(directory, arguments);
        ASSERT_EQ(result.status, 0) << result.err;
        results[i] = withoutTimes(Json::parse(readText(report + "/results.json")));
        for (const std::string& name : filesBelow(report + "/images"))
            pictures[i] += name + readText(report + "/images/" + name);
    }
    EXPECT_EQ(results[0].dump(1), results[1].dump(1));
    EXPECT_EQ(pictures[0], pictures[1]);
}

TEST(Compare, CostsReplayedGiveTheSameRoutes) {
    const TemporaryDirectory directory;
    ASSERT_EQ(runShadowdag(directory, tinyCompare(directory / "a")).status, 0);
    Arguments arguments = tinyCompare(directory / "b");
    arguments.insert(arguments.end(), {"--costs", directory / "a/costs.json"});
    const ProgramResult result = runShadowdag(directory, arguments);
    ASSERT_EQ(result.status, 0) << result.err;
    EXPECT_EQ(readText(directory / "a/costs.json"), readText(directory / "b/costs.json"));
    EXPECT_EQ(withoutTimes(Json::parse(readText(directory / "a/results.json"))).dump(),
              withoutTimes(Json::parse(readText(directory / "b/results.json"))).dump());
    EXPECT_EQ(readText(directory / "a/lights.csv"), readText(directory / "b/lights.csv"));
}

TEST(Compare, AKilledRunLeavesNoHalfResultsAndIsResumed) {
    const TemporaryDirectory directory;
    const std::string report = directory / "report";
    Arguments arguments = tinyCompare(report);
    ASSERT_EQ(runShadowdag(directory, arguments).status, 0);
    const std::string old = readText(report + "/results.json");

    // A long one into the same directory, killed as soon as its journal holds something.
    for (std::string& argument : arguments)
        if (argument == "0,16,inf")
            argument = "0,4,8,16,32,64,inf";
    arguments.push_back("--no-oracle");
    const pid_t child = startProgram(directory, arguments, directory / "out", directory / "err");
    const std::string journal = report + "/partial/journal.json";
    for (int i = 0; i < 3000 && readText(journal).find("answer/") == std::string::npos; ++i)
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
    kill(child, SIGKILL);
    EXPECT_EQ(waitForProgram(child), 128 + SIGKILL);
    EXPECT_EQ(readText(report + "/results.json"), old) << "an old report must not be harmed";
    EXPECT_NO_THROW(Json::parse(readText(journal)));

    arguments.push_back("--resume");
    const ProgramResult resumed = runShadowdag(directory, arguments);
    ASSERT_EQ(resumed.status, 0) << resumed.err;
    EXPECT_THAT(resumed.err, HasSubstr("finished parts taken up"));
    EXPECT_NE(readText(report + "/results.json"), old);
    EXPECT_EQ(Json::parse(readText(report + "/results.json"))["runs"].size(), 8u);
}

TEST(Compare, AFinishedReportIsNotResumedAndADamagedJournalIsNoStrangers) {
    const TemporaryDirectory directory;
    const std::string report = directory / "report";
    std::filesystem::create_directories(report);
    writeText(report + "/results.json", R"({"provenance": {}, "experiment": {}, "runs": []})");
    Arguments arguments = tinyCompare(report);
    arguments.push_back("--resume");
    const std::string old = readText(report + "/results.json");
    expectRefused(directory, {{arguments, 1, "results.json is finished and nothing is left"}});
    EXPECT_EQ(readText(report + "/results.json"), old);
    EXPECT_EQ(filesBelow(report).size(), 1u);

    std::filesystem::remove(report + "/results.json");
    std::filesystem::create_directories(report + "/partial");
    writeText(report + "/partial/journal.json", "{\"key\": \"a\", \"par");
    expectRefused(directory, {{tinyCompare(report), 2, "journal.json: is damaged or cut short"}});
}

TEST(Compare, AFullPoolIsSaidOfTheCostsThatRoutedByIt) {
    EXPECT_EQ(poolNote(Json{{"degrade_divisor", 1.0}}), "");
    EXPECT_THAT(poolNote(Json{{"degrade_divisor", 1.0}, {"costs_degrade_divisor", 1.4142}}),
                HasSubstr("pool full where costs were measured: maps alone undivided, all together "
                          "divided by 1.41"));
    const TemporaryDirectory directory;
    const ProgramResult result =
        runShadowdag(directory, {"compare",      "builtin:fail-unequal-ranges",
                                 "-o",           directory / "r",
                                 "--size",       "320x180",
                                 "--resolution", "64",
                                 "--methods",    "hybrid",
                                 "--thresholds", "inf",
                                 "--pool",       "1M",
                                 "--page-size",  "16",
                                 "--repeats",    "1",
                                 "--warmups",    "0",
                                 "--model",      "oracle",
                                 "--no-charts",  "--json"});
    ASSERT_EQ(result.status, 0) << result.err;
    const Json runs = Json::parse(readText(directory / "r/results.json"))["runs"];
    size_t count = 0;
    for (const Json& run : runs) {
        EXPECT_EQ(run.contains("costs_degrade_divisor"), run["model"] == "oracle");
        count += run.contains("costs_degrade_divisor") ? 1 : 0;
    }
    EXPECT_EQ(count, 1u);
}

TEST(Compare, ATitleOfBytesThatAreNoTextIsWrittenAsSuch) {
    const TemporaryDirectory directory;
    const std::string report = directory / "report";
    Arguments arguments = tinyCompare(report);
    arguments.insert(arguments.end(), {"--title", "a\xff", "--no-oracle"});
    const ProgramResult result = runShadowdag(directory, arguments);
    ASSERT_EQ(result.status, 0) << result.err;
    EXPECT_EQ(Json::parse(readText(report + "/results.json"))["experiment"]["title"], "a\uFFFD");
}

TEST(Compare, AnInterruptEndsWithTheSignalAndNothingHalf) {
    const TemporaryDirectory directory;
    const std::string report = directory / "report";
    Arguments arguments = tinyCompare(report);
    for (std::string& argument : arguments)
        if (argument == "48x27")
            argument = "320x180";
    const pid_t child = startProgram(directory, arguments, directory / "out", directory / "err");
    const std::string journal = report + "/partial/journal.json";
    for (int i = 0; i < 3000 && !std::filesystem::exists(journal); ++i)
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
    kill(child, SIGINT);
    EXPECT_EQ(waitForProgram(child), 128 + SIGINT);
    EXPECT_THAT(readText(directory / "err"), HasSubstr("interrupted"));
    EXPECT_FALSE(std::filesystem::exists(report + "/results.json"));
    EXPECT_EQ(readText(directory / "out"), "");
    for (const std::string& name : filesBelow(report))
        EXPECT_TRUE(name == "partial/journal.json" || name.ends_with(".png"))
            << name << " is left over";
}

TEST(Compare, WhatNoCompareMadeIsNotReplaced) {
    const TemporaryDirectory directory;
    for (const char* name : {"images/a.png", "charts/a.svg", "partial/a", "index.html"}) {
        const std::string report = directory / std::string("r-").append(name, 2);
        std::filesystem::create_directories(
            std::filesystem::path(report + "/" + name).parent_path());
        writeText(report + "/" + name, "mine");
        const ProgramResult result = runShadowdag(directory, tinyCompare(report));
        EXPECT_EQ(result.status, 1) << name;
        EXPECT_THAT(result.err, HasSubstr("no compare made")) << name;
        EXPECT_EQ(readText(report + "/" + name), "mine");
        EXPECT_EQ(filesBelow(report).size(), 1u);
    }
}

TEST(Compare, ANewReportTakesThePlaceOfTheOldOneWhole) {
    const TemporaryDirectory directory;
    const std::string report = directory / "report";
    const Arguments arguments = tinyCompare(report);
    ASSERT_EQ(runShadowdag(directory, arguments).status, 0);
    const size_t count = filesBelow(report).size();
    // What an unfinished compare left, and a swap that died between two renames.
    std::filesystem::create_directories(report + "/partial/old");
    std::filesystem::create_directories(report + "/partial/images");
    writeText(report + "/partial/images/stray.png", "stray");
    std::filesystem::rename(report + "/images", report + "/partial/old/images");
    const ProgramResult result = runShadowdag(directory, arguments);
    ASSERT_EQ(result.status, 0) << result.err;
    EXPECT_EQ(filesBelow(report).size(), count);
    EXPECT_FALSE(std::filesystem::exists(report + "/images/stray.png"));
    EXPECT_FALSE(std::filesystem::exists(report + "/partial"));
}

TEST(Compare, ASwapThatDiedLeavesTheOldReportToTheNextCompare) {
    const TemporaryDirectory directory;
    const std::string report = directory / "report";
    ASSERT_EQ(runShadowdag(directory, tinyCompare(report)).status, 0);
    const size_t count = filesBelow(report + "/images").size();
    std::filesystem::create_directories(report + "/partial/old");
    std::filesystem::rename(report + "/images", report + "/partial/old/images");
    // Fails, but only after the directory was put in order: assets are read once scenes are open.
    Arguments arguments = tinyCompare(report);
    const auto resolution = std::find(arguments.begin(), arguments.end(), "--resolution");
    ASSERT_NE(resolution, arguments.end());
    resolution[0] = "--voxels";
    resolution[1] = directory / "bad.svdag";
    writeText(directory / "bad.svdag", "no asset");
    EXPECT_EQ(runShadowdag(directory, arguments).status, 2);
    EXPECT_EQ(filesBelow(report + "/images").size(), count);
}

TEST(Compare, ScenesOfOneFileNameStayApart) {
    const TemporaryDirectory directory;
    Arguments arguments = tinyCompare(directory / "report");
    arguments[1] = directory / "a/scene.glb";
    arguments.insert(arguments.begin() + 2, directory / "b/scene.glb");
    int which = 0;
    for (const char* builtin : {"builtin:fail-mover", "builtin:fail-far-origin"}) {
        const std::string file = arguments[size_t(++which)];
        std::filesystem::create_directories(std::filesystem::path(file).parent_path());
        const ProgramResult made = runShadowdag(directory, {"scene", builtin, "-o", file});
        ASSERT_EQ(made.status, 0) << made.err;
    }
    const ProgramResult result = runShadowdag(directory, arguments);
    ASSERT_EQ(result.status, 0) << result.err;
    const Json results = Json::parse(readText(directory / "report/results.json"));
    EXPECT_NE(results["scenes"][0]["scene"], results["scenes"][1]["scene"]);
    std::set<std::string> pictures;
    size_t pictureCount = 0;
    for (const Json& run : results["runs"])
        if (run.contains("images"))
            for (const Json& file : run["images"]) {
                pictures.insert(file.get<std::string>());
                ++pictureCount;
                EXPECT_TRUE(
                    std::filesystem::exists(directory / "report/" + file.get<std::string>()));
            }
    EXPECT_GT(pictureCount, 0u);
    EXPECT_EQ(pictures.size(), pictureCount);
    EXPECT_EQ(Json::parse(readText(directory / "report/costs.json"))["costs"].size(), 2u);
}

} // namespace shadowdag
