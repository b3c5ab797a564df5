// SPDX-License-Identifier: Apache-2.0
// `shadowdag compare` from end to end at smoke size: keys, charts, interruption, resumption,
// threads.
#include "scenes/builtin.h"
#include "scenes/gltf.h"
#include "scenes/scene_file.h"
#include "tests/tools/program/program_refusals.h"
#include "tests/tools/program/time_keys.h"
#include "tools/workspace/frame_json.h"
#include "tools/workspace/report_directory.h"

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

const std::string kAtrium = "builtin:atrium";

/// A sweep over a few boxes takes a tenth of the time of the atrium, which is for tests that
/// stop a run half way, or that need work for two threads.
Arguments tinyCompare(const std::string& output,
                      const std::string& scene = "builtin:fail-unequal-ranges") {
    return {"compare",     scene,          "-o", output,         "--size",
            "48x27",       "--resolution", "64", "--thresholds", "0,16,inf",
            "--no-charts", "--repeats",    "1",  "--warmups",    "0",
            "--json"};
}

/// Returns a compare that takes seconds.
Arguments slowCompare(const std::string& report) {
    return tinyCompare(report, kAtrium) + Arguments{"--lights", "8"};
}

/// Returns the text as it stands in a page.
std::string escapedHtml(const std::string& text) {
    std::string escaped;
    for (const char c : text)
        switch (c) {
        case '&':
            escaped += "&amp;";
            break;
        case '<':
            escaped += "&lt;";
            break;
        case '>':
            escaped += "&gt;";
            break;
        case '"':
            escaped += "&#34;";
            break;
        case '\'':
            escaped += "&#39;";
            break;
        default:
            escaped += c;
        }
    return escaped;
}

/// Removes what may differ between two runs: times, and what provenance says about the run itself.
Json withoutTimes(Json results) {
    results["provenance"].erase("thread_count");
    results.erase("verdict"); // of times
    for (Json& run : results["runs"])
        for (auto entry = run.begin(); entry != run.end();)
            entry = isOfTime(entry.key()) ? run.erase(entry) : std::next(entry);
    for (Json& cost : results["map_costs"])
        for (const char* key : {"rays_ms", "map_ms", "rays_scale", "maps_scale", "whole_frame"})
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

TEST(Compare, WhatCannotBeMeasuredIsRefusedBeforeUnfinishedWorkIsDeleted) {
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
        const auto replace = [&](const char* option, const char* by) {
            const auto at = std::find(arguments.begin(), arguments.end(), option);
            if (std::find(more.begin(), more.end(), by) != more.end())
                arguments.erase(at, at + 2);
        };
        replace("--thresholds", "--thresholds");
        replace("--resolution", "--voxels");
        arguments.insert(arguments.begin() + 2, more.begin(), more.end());
        const ProgramResult result = runShadowdag(directory, arguments);
        EXPECT_NE(result.status, 0);
        EXPECT_EQ(readText(journal), unfinished);
        return result.err;
    };
    EXPECT_THAT(refused({"--camera", "nowhere"}), HasSubstr("no camera of that name"));
    EXPECT_THAT(refused({"--lights", "0"}), HasSubstr("without a light"));
    EXPECT_THAT(refused({dark}), HasSubstr("has no supported light"));
    EXPECT_THAT(refused({"--methods", "hybrid", "--no-oracle", "--thresholds", "0"}),
                HasSubstr("nothing to compare: --methods and --thresholds select no run"));
    EXPECT_THAT(refused({"--believe", "all", "--lod", "7"}),
                HasSubstr("64^3 voxels have levels 0 to 6"));
    EXPECT_THAT(refused({"--sequence", "--model", "oracle"}),
                HasSubstr("model 'oracle' needs measured costs of every frame"));
}

TEST(Compare, SmokeExperimentGivesReportChartsAndEveryKey) {
    const TemporaryDirectory directory;
    const std::string report = directory / "report";
    const ProgramResult result =
        runShadowdag(directory, {"compare", "--experiment",
                                 std::string(SDAG_SOURCE_DIR) + "/scenes/experiments/smoke.json",
                                 "-o", report, "--json"});
    ASSERT_EQ(result.status, 0) << result.err;
    EXPECT_EQ(result.json()["chart_count"], 10);
    const Json results = Json::parse(readText(report + "/results.json"));
    EXPECT_EQ(results.begin().key(), "verdict");
    const std::string verdict = results["verdict"]["text"], page = readText(report + "/index.html");
    EXPECT_THAT(result.err, HasSubstr(verdict));
    EXPECT_LT(result.err.find(verdict), result.err.find("false shadow "));
    EXPECT_THAT(page, HasSubstr(escapedHtml(verdict)));
    EXPECT_LT(page.find(escapedHtml(verdict)), page.find("class=\"lead\""));
    for (const char* key : {"commit", "preset", "compiler", "flags", "embree", "cpu", "backend",
                            "device", "driver", "experiment_hash", "seed", "thread_count"})
        EXPECT_TRUE(results["provenance"].contains(key)) << key;
    EXPECT_EQ(results["scenes"][0]["scene_hash"].get<std::string>().size(), 32u);
    const Json& lights = results["truth_images"][0]["lights"]; // of 65, those in the picture
    EXPECT_GT(lights.size(), 10u);
    EXPECT_LT(lights.size(), 65u);
    for (const Json& light : lights) {
        EXPECT_LT(light["light"], 65);
        EXPECT_TRUE(light["x"] >= 0 && light["x"] < 96 && light["y"] >= 0 && light["y"] < 54)
            << light;
    }
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

// A stage without its timer would make every published time smaller. The rest of a frame are waits
// and allocations between stages; a run that another process interrupts there is not the median.
TEST(Compare, StagesHoldTheTimeOfAFrame) {
    const TemporaryDirectory directory;
    const ProgramResult result =
        runShadowdag(directory, {"compare", "builtin:atrium", "--size", "320x180", "--methods",
                                 "embree,dag,maps,hybrid", "--thresholds", "96", "--resolution",
                                 "256", "--believe", "none,all", "--no-oracle", "--repeats", "5",
                                 "-o", directory / "report", "--no-charts"});
    ASSERT_EQ(result.status, 0) << result.err;
    const Json runs = Json::parse(readText(directory / "report/results.json"))["runs"];
    ASSERT_GE(runs.size(), 5u);
    for (const Json& run : runs) {
        SCOPED_TRACE(run["label"]);
        const double sumMs = run["time_ms"], wallMs = run["wall_ms"];
        EXPECT_GE(wallMs, sumMs);
        EXPECT_LE(wallMs, 1.15 * sumMs + 0.5);
    }
}

TEST(Compare, WithoutThresholdsEachRunRoutesInItsOwnWay) {
    const TemporaryDirectory directory;
    const std::string report = directory / "report";
    const ProgramResult result = runShadowdag(
        directory, {"compare", kAtrium, "-o", report, "--size", "64x36", "--resolution", "64",
                    "--methods", "dag,maps,hybrid", "--no-oracle", "--repeats", "1", "--warmups",
                    "0", "--views", "2", "--no-charts", "--json"});
    ASSERT_EQ(result.status, 0) << result.err;
    const Json results = Json::parse(readText(report + "/results.json"));
    EXPECT_EQ(results["experiment"]["thresholds"], Json({"auto"}));
    ASSERT_EQ(results["scenes"].size(), 2u);
    EXPECT_NE(results["scenes"][0]["thresholds"], results["scenes"][1]["thresholds"]);
    for (const Json& scene : results["scenes"]) {
        std::set<Json> rayCounts;
        size_t runCount = 0;
        for (const Json& run : results["runs"])
            if (run["scene"] == scene["scene"]) {
                rayCounts.insert(run["ray_count"]);
                ++runCount;
            }
        EXPECT_EQ(runCount, scene["thresholds"].size()) << scene;
        EXPECT_GE(runCount, 6u) << scene;
        EXPECT_EQ(rayCounts.size(), runCount) << scene;
    }
}

TEST(Compare, OneAndTwoThreadsAgreeInAllButTimes) {
    const TemporaryDirectory directory;
    Json results[2];
    std::string pictures[2];
    for (int i = 0; i < 2; ++i) {
        const std::string report = directory / ("report" + std::to_string(i));
        Arguments arguments = slowCompare(report);
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

TEST(Compare, CostsOfAnotherSceneSizeCameraOrLightsAreRefusedUnlessAllowed) {
    const TemporaryDirectory directory;
    const std::string scene = directory / "a.glb", costs = directory / "a/costs.json",
                      png = directory / "a.png";
    writeGlb(makeBuiltin("fail-unequal-ranges"), scene);
    Arguments compare = tinyCompare(directory / "a", scene);
    ASSERT_EQ(runShadowdag(directory, compare).status, 0);
    const auto render = [&](const Arguments& more) {
        Arguments all{"render", scene,     "-o",     png,       "--resolution",
                      "64",     "--model", "oracle", "--costs", costs};
        all.insert(all.end(), more.begin(), more.end());
        return all;
    };
    const Arguments size = {"--size", "48x27"};
    const ProgramResult same = runShadowdag(directory, render(size));
    EXPECT_EQ(same.status, 0) << same.err;
    EXPECT_THAT(same.err, testing::Not(HasSubstr("warning: " + costs)));
    compare[3] = directory / "b";
    compare.insert(compare.end(), {"--costs", costs, "--camera", "0,2,6,0,1,0"});
    expectRefused(directory,
                  {{render({"--size", "64x36"}), 2, "size \"48x27\" instead of \"64x36\""},
                   {render({"--size", "48x27", "--camera", "0,2,6,0,1,0"}), 2, "camera_numbers"},
                   {render({"--size", "48x27", "--lights", "5"}), 2, "lights -1 instead of 5"},
                   {compare, 2, "camera_numbers"}});
    const ProgramResult allowed =
        runShadowdag(directory, render({"--size", "64x36", "--allow-stale"}));
    EXPECT_EQ(allowed.status, 0) << allowed.err;
    EXPECT_THAT(allowed.err, HasSubstr("used nevertheless"));
    Scene brighter = makeBuiltin("fail-unequal-ranges");
    brighter.lights.front().intensity *= 2.0f;
    writeGlb(brighter, scene);
    expectRefused(directory, {{render(size), 2, "light_hash"}});
    writeGlb(makeBuiltin("fail-contact"), scene);
    expectRefused(directory, {{render(size), 2, "scene_hash"}});
    // A file that cannot match is refused before the scene is read.
    writeText(directory / "b.glb", "no scene");
    Arguments other = render(size);
    other[1] = directory / "b.glb";
    expectRefused(directory, {{other, 2, "has no costs of b.glb frame 0"}});
    compare[1] = other[1];
    expectRefused(directory, {{compare, 2, "has no costs of b.glb frame 0"}});
}

TEST(Compare, AKilledRunLeavesNoPartialResultsAndIsResumed) {
    const TemporaryDirectory directory;
    const std::string report = directory / "report";
    Arguments arguments = slowCompare(report);
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

    const std::string unfinished = readText(journal);
    Arguments other = arguments;
    std::replace(other.begin(), other.end(), std::string("48x27"), std::string("64x36"));
    other.push_back("--resume");
    expectRefused(directory, {{arguments, 1,
                               "of an interrupted run, which this run would delete; add --resume"},
                              {other, 1, "experiment.size was \"48x27\" and is \"64x36\""}});
    EXPECT_EQ(readText(journal), unfinished);

    arguments.push_back("--resume");
    const ProgramResult resumed = runShadowdag(directory, arguments);
    ASSERT_EQ(resumed.status, 0) << resumed.err;
    EXPECT_THAT(resumed.err, testing::ContainsRegex("finished parts? (is|are) reused"));
    EXPECT_NE(readText(report + "/results.json"), old);
    EXPECT_EQ(Json::parse(readText(report + "/results.json"))["runs"].size(), 8u);
}

TEST(Compare, AResumedRunMeasuresAgainWhatLostItsPictures) {
    const TemporaryDirectory directory;
    const std::string report = directory / "report", journal = report + "/partial/journal.json";
    Arguments arguments = slowCompare(report);
    arguments.insert(arguments.end(), {"--frames", "0:2"});
    const pid_t child = startProgram(directory, arguments, directory / "out", directory / "err");
    for (int i = 0; i < 3000 && readText(journal).find("/times") == std::string::npos; ++i)
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
    kill(child, SIGKILL);
    EXPECT_EQ(waitForProgram(child), 128 + SIGKILL);
    std::filesystem::remove_all(report + "/partial/images");
    arguments.emplace_back("--resume");
    const ProgramResult resumed = runShadowdag(directory, arguments);
    ASSERT_EQ(resumed.status, 0) << resumed.err;
    EXPECT_THAT(resumed.err,
                testing::ContainsRegex("lost (its|their) pictures and (is|are) measured again"));
    const Json results = Json::parse(readText(report + "/results.json"));
    size_t count = 0;
    const auto expectFile = [&](const Json& file) {
        EXPECT_TRUE(std::filesystem::exists(report + "/" + file.get<std::string>())) << file;
        ++count;
    };
    for (const Json& image : results["truth_images"])
        expectFile(image["file"]);
    for (const Json& run : results["runs"])
        for (const Json& image : run.value("images", Json::object()))
            expectFile(image);
    EXPECT_GT(count, 3u);
}

TEST(Compare, AFinishedReportIsNotResumedAndADamagedJournalIsRefused) {
    const TemporaryDirectory directory;
    const std::string report = directory / "report";
    std::filesystem::create_directories(report);
    writeText(report + "/results.json", R"({"provenance": {}, "experiment": {}, "runs": []})");
    Arguments arguments = tinyCompare(report);
    arguments.push_back("--resume");
    const std::string old = readText(report + "/results.json");
    expectRefused(directory,
                  {{arguments, 1, "results.json is finished, so there is nothing to resume"}});
    EXPECT_EQ(readText(report + "/results.json"), old);
    EXPECT_EQ(filesBelow(report).size(), 1u);

    std::filesystem::remove(report + "/results.json");
    std::filesystem::create_directories(report + "/partial");
    writeText(report + "/partial/journal.json", "{\"key\": \"a\", \"par");
    expectRefused(directory, {{tinyCompare(report), 2, "journal.json: is damaged or truncated"}});
}

TEST(Compare, AFullPoolIsReportedForTheCostsOfRouting) {
    EXPECT_EQ(poolNote(Json{{"degrade_divisor", 1.0}}), "");
    EXPECT_THAT(
        poolNote(Json{{"degrade_divisor", 1.0}, {"costs_degrade_divisor", 1.4142}}),
        HasSubstr("pool full while costs were measured: single maps undivided, all together "
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

TEST(Compare, ATitleThatIsNotUtf8IsEscaped) {
    const TemporaryDirectory directory;
    const std::string report = directory / "report";
    Arguments arguments = tinyCompare(report);
    arguments.insert(arguments.end(), {"--title", "a\xff", "--no-oracle"});
    const ProgramResult result = runShadowdag(directory, arguments);
    ASSERT_EQ(result.status, 0) << result.err;
    EXPECT_EQ(Json::parse(readText(report + "/results.json"))["experiment"]["title"], "a\uFFFD");
}

TEST(Compare, AnInterruptEndsWithTheSignalAndNoPartialFiles) {
    const TemporaryDirectory directory;
    const std::string report = directory / "report";
    Arguments arguments = slowCompare(report);
    for (std::string& argument : arguments)
        if (argument == "48x27")
            argument = "320x180";
    const pid_t child = startProgram(directory, arguments, directory / "out", directory / "err");
    const std::string journal = report + "/partial/journal.json";
    for (int i = 0; i < 3000 && !std::filesystem::exists(journal); ++i)
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
    kill(child, SIGINT);
    EXPECT_EQ(waitForProgram(child), 128 + SIGINT);
    EXPECT_THAT(readText(directory / "err"),
                HasSubstr("interrupted; every file is complete or absent"));
    EXPECT_FALSE(std::filesystem::exists(report + "/results.json"));
    EXPECT_EQ(readText(directory / "out"), "");
    for (const std::string& name : filesBelow(report))
        EXPECT_TRUE(name == "partial/journal.json" || name.ends_with(".png"))
            << name << " is left over";
}

// In its first part and after it, where an older report is complete, of which --resume is refused.
TEST(Compare, AnInterruptAdvisesToResumeOnlyWhereThatGoesOn) {
    const TemporaryDirectory directory;
    const std::string report = directory / "report", journal = report + "/partial/journal.json";
    Arguments compare = slowCompare(report);
    std::replace(compare.begin(), compare.end(), std::string("48x27"), std::string("320x180"));
    const std::pair<Arguments, Arguments> commands[] = {
        {tinyCompare(report), compare},
        {{"study", "failures", "-o", report, "--only", "acne", "--no-charts"},
         {"study", "failures", "-o", report}}};
    const auto partCount = [&] {
        const Json found =
            std::filesystem::exists(journal) ? Json::parse(readText(journal)) : Json();
        return found.is_object() ? int(found["parts"].size()) : -1;
    };
    for (const auto& [before, interrupted] : commands) {
        ASSERT_EQ(runShadowdag(directory, before).status, 0);
        for (const int count : {0, 1}) {
            const pid_t child =
                startProgram(directory, interrupted, directory / "out", directory / "err");
            for (int i = 0; i < 30'000 && partCount() < count; ++i)
                std::this_thread::sleep_for(std::chrono::milliseconds(1));
            kill(child, SIGINT);
            EXPECT_EQ(waitForProgram(child), 128 + SIGINT) << interrupted[0];
            const std::string said = readText(directory / "err");
            EXPECT_EQ(said.find("with --resume") != std::string::npos, partCount() > 0)
                << interrupted[0] << ", " << count << ": " << said;
            std::filesystem::remove_all(report + "/partial");
        }
        std::filesystem::remove_all(report);
    }
}

// Its journal of finished parts grows beyond the limit.
TEST(Compare, AFailureAfterFinishedPartsAdvisesToResume) {
    const TemporaryDirectory directory;
    const std::string report = directory / "report";
    for (const int blocks : {1, 48}) {
        const ProgramResult result = runShadowdag(
            directory, slowCompare(report),
            {"/bin/bash", "-c", "ulimit -f " + std::to_string(blocks) + "; exec \"$@\"", "bash"});
        EXPECT_EQ(result.status, 3);
        EXPECT_EQ(result.err.find("run the same command with --resume") != std::string::npos,
                  std::filesystem::exists(report + "/partial"))
            << result.err;
        EXPECT_EQ(std::filesystem::exists(report + "/partial"), blocks == 48);
    }
    Arguments again = slowCompare(report);
    again.emplace_back("--resume");
    EXPECT_EQ(runShadowdag(directory, again).status, 0);
}

TEST(Compare, AnExperimentThatReplacesLightsSaysSoFirst) {
    const TemporaryDirectory directory;
    const std::string file = directory / "e.json";
    Json experiment = {{"scenes", {"builtin:atrium"}},
                       {"size", "48x27"},
                       {"methods", {"maps"}},
                       {"lights", 12},
                       {"repeats", 1},
                       {"warmups", 0}};
    writeText(file, experiment.dump());
    const Arguments arguments{"compare",     "--experiment", file,
                              "--no-charts", "-o",           directory / "r"};
    const ProgramResult result = runShadowdag(directory, arguments);
    EXPECT_EQ(result.status, 0) << result.err;
    EXPECT_THAT(result.err, testing::StartsWith(
                                file + " replaces the lights of every scene by 12 placed ones"));
    experiment["offset"] = {2};
    writeText(file, experiment.dump());
    expectRefused(directory,
                  {{arguments, 2, file + ": key \"offset\" is for rays through voxels"}});
}

TEST(Compare, FilesThatNoCompareWroteAreNotReplaced) {
    const TemporaryDirectory directory;
    for (const char* name : {"images/a.png", "charts/a.svg", "partial/a", "index.html"}) {
        const std::string report = directory / std::string("r-").append(name, 2);
        std::filesystem::create_directories(
            std::filesystem::path(report + "/" + name).parent_path());
        writeText(report + "/" + name, "mine");
        const ProgramResult result = runShadowdag(directory, tinyCompare(report));
        EXPECT_EQ(result.status, 1) << name;
        EXPECT_THAT(result.err, HasSubstr("which shadowdag did not write")) << name;
        EXPECT_EQ(readText(report + "/" + name), "mine");
        EXPECT_EQ(filesBelow(report).size(), 1u);
    }
}

TEST(Compare, AFileInPlaceOfItsFolderAndLinksThatLeadNowhereAreNotReplaced) {
    const TemporaryDirectory directory;
    writeText(directory / "partial", "mine");
    std::filesystem::create_symlink("nowhere", directory / "index.html");
    for (const char* name : {"partial", "index.html"}) {
        const ProgramResult result = runShadowdag(directory, tinyCompare(directory.path()));
        EXPECT_EQ(result.status, 1) << name;
        EXPECT_THAT(result.err, HasSubstr(name + std::string(", which shadowdag did not write")));
        EXPECT_TRUE(std::filesystem::remove(directory / name));
    }
}

TEST(Compare, ANewReportReplacesTheOldOneCompletely) {
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
    EXPECT_THAT(result.err, testing::Not(HasSubstr("of another experiment")));
    Arguments other = arguments;
    std::replace(other.begin(), other.end(), std::string("48x27"), std::string("64x36"));
    EXPECT_THAT(runShadowdag(directory, other).err,
                HasSubstr("the report in " + report +
                          " is of another experiment (size was "
                          "\"48x27\" and is \"64x36\"); this run replaces it"));
}

// The range of the light of the second scene ends before any surface.
TEST(Compare, FramesWithoutPairsAreLeftOutBesideOthers) {
    const TemporaryDirectory directory;
    const std::string dark = directory / "dark.glb", report = directory / "report",
                      lit = "builtin:fail-contact";
    Scene scene = makeBuiltin("fail-contact");
    for (LightSource& light : scene.lights)
        light.rangeWorld = 1e-3f;
    writeGlb(scene, dark);
    const auto compare = [&](const std::vector<std::string>& scenes, const std::string& output,
                             const Arguments& more) {
        Arguments arguments = {"compare",   "-o", output,         "--size", "32x18",
                               "--repeats", "1",  "--resolution", "64",     "--no-charts"};
        arguments.insert(arguments.end(), scenes.begin(), scenes.end());
        arguments.insert(arguments.end(), more.begin(), more.end());
        return runShadowdag(directory, arguments);
    };
    const auto expectLitAlone = [&](const std::string& which) {
        const Json results = Json::parse(readText(report + "/results.json"));
        ASSERT_EQ(results["scenes"].size(), 1u);
        EXPECT_EQ(results["scenes"][0]["scene"], lit);
        EXPECT_EQ(results["warnings"][0], "left out: " + which +
                                              "dark.glb, frame 0: no light reaches what the camera "
                                              "sees, so there is nothing to compare; give another "
                                              "--camera, as in --camera auto, or place more lights "
                                              "with --lights");
    };
    const Arguments methods = {"--methods", "dag,maps,hybrid", "--thresholds", "16"};
    const ProgramResult both = compare({lit, dark}, report, methods);
    ASSERT_EQ(both.status, 0) << both.err;
    EXPECT_THAT(both.err, HasSubstr("warning: left out: dark.glb, frame 0"));
    expectLitAlone("");
    // Its own costs can be replayed.
    std::filesystem::copy(report + "/costs.json", directory / "costs.json");
    const ProgramResult replayed =
        compare({lit, dark}, report, methods + Arguments{"--costs", directory / "costs.json"});
    EXPECT_EQ(replayed.status, 0) << replayed.err;

    for (const char* part : {"1", "2"}) {
        const ProgramResult done = compare({lit, dark}, directory / part,
                                           methods + Arguments{"--part", std::string(part) + "/2"});
        EXPECT_EQ(done.status, 0) << done.err;
        EXPECT_EQ(done.err.find("left out: dark.glb") != std::string::npos, *part == '2');
    }
    const ProgramResult joined =
        runShadowdag(directory, {"compare", "--join", directory / "1", directory / "2", "-o",
                                 report, "--no-charts"});
    EXPECT_EQ(joined.status, 0) << joined.err;
    expectLitAlone("");
    EXPECT_EQ(compare({dark}, directory / "all", methods + Arguments{"--part", "1/1"}).status, 0);
    expectRefused(directory, {{{"compare", "--join", directory / "all", "-o", report},
                               2,
                               "dark.glb, frame 0: no light reaches"}});

    const ProgramResult sequence =
        compare({lit, dark}, report,
                {"--sequence", "--frames", "0:1", "--methods", "dag,maps", "--warmups", "0"});
    ASSERT_EQ(sequence.status, 0) << sequence.err;
    expectLitAlone("a sequence, whose frames belong together: ");
}

// Its lights are out of reach at first.
TEST(Compare, ThresholdsAreThoseOfTheFirstFrameThatHasMaps) {
    const TemporaryDirectory directory;
    const std::string late = directory / "late.glb", report = directory / "report";
    Scene scene = makeBuiltin("fail-unequal-ranges");
    AnimationChannel comes;
    comes.interpolation = AnimationChannel::Interpolation::kStep;
    comes.times = {0.0f, 0.05f};
    scene.animations.push_back({"lights", {}});
    for (size_t node = 0; node < scene.nodes.size(); ++node)
        if (scene.nodes[node].light != kNone) {
            comes.node = int(node);
            const glm::vec4 place(scene.nodes[node].local.translation, 0);
            comes.values = {place + glm::vec4(0, 1e5f, 0, 0), place};
            scene.animations.back().channels.push_back(comes);
        }
    writeGlb(scene, late);
    const ProgramResult result =
        runShadowdag(directory, {"compare", late, "-o", report, "--size", "48x27", "--frames",
                                 "0,3", "--methods", "hybrid", "--no-oracle", "--repeats", "1",
                                 "--no-charts", "--json"});
    ASSERT_EQ(result.status, 0) << result.err;
    const Json results = Json::parse(readText(report + "/results.json"));
    EXPECT_THAT(results["warnings"][0].get<std::string>(),
                HasSubstr("left out: late.glb, frame 0: no light"));
    EXPECT_EQ(result.json()["warnings"], results["warnings"]);
    EXPECT_GT(results["scenes"][0]["thresholds"].size(), 2u) << "more than maps and rays alone";
    ASSERT_FALSE(results["runs"].empty());
    EXPECT_EQ(results["runs"][0]["frame"], 3);
}

TEST(Compare, WhereNoThresholdDividesTheMapsHybridIsSaidToBeMissing) {
    const TemporaryDirectory directory;
    const ProgramResult result =
        runShadowdag(directory, {"compare", "builtin:fail-contact", "-o", directory / "report",
                                 "--size", "48x27", "--methods", "hybrid,dag", "--no-oracle",
                                 "--repeats", "1", "--no-charts", "--json"});
    ASSERT_EQ(result.status, 0) << result.err;
    EXPECT_EQ(result.json()["run_count"], 1);
    EXPECT_THAT(result.json()["warnings"][0].get<std::string>(),
                HasSubstr("no threshold routes a part of them; hybrid has no row"));
}

TEST(Compare, AStudyThatReplacesItSaysSoAtTheStart) {
    const TemporaryDirectory directory;
    const std::string report = directory / "report";
    const Arguments study = {"study", "failures", "--only", "contact", "-o", report, "--no-charts"};
    ASSERT_EQ(runShadowdag(directory, tinyCompare(report)).status, 0);
    EXPECT_THAT(runShadowdag(directory, study).err,
                HasSubstr("the report in " + report + " is of compare; this run replaces it"));
    EXPECT_THAT(runShadowdag(directory, study).err, testing::Not(HasSubstr("replaces it")));
    EXPECT_THAT(runShadowdag(directory, tinyCompare(report)).err,
                HasSubstr("is of study failures; this run replaces it"));
}

TEST(Compare, AnInterruptedSwapKeepsTheOldReport) {
    const TemporaryDirectory directory;
    const std::string report = directory / "report";
    ASSERT_EQ(runShadowdag(directory, tinyCompare(report)).status, 0);
    const size_t count = filesBelow(report + "/images").size();
    std::filesystem::create_directories(report + "/partial/old");
    std::filesystem::rename(report + "/images", report + "/partial/old/images");
    writeText(report + "/partial/results.json", "{}");    // the new one
    { const ReportDirectory held(report, false, false); } // as the next run begins
    EXPECT_EQ(filesBelow(report + "/images").size(), count);
}

// A floor and a cube on it: the same numbers as of the glTF file of the same triangles.
TEST(Compare, AnObjFileIsMeasuredAsTheSameSceneInGltfIs) {
    if (!readsOtherScenes())
        GTEST_SKIP() << "built without Assimp";
    const TemporaryDirectory directory;
    const std::string obj = directory / "cube.obj", glb = directory / "cube.glb";
    std::string text = "v -3 0 -3\nv 4 0 -3\nv 4 0 4\nv -3 0 4\nf 4 3 2 1\n";
    for (int c = 0; c < 8; ++c)
        text += "v " + std::to_string(c & 1) + " " + std::to_string(c >> 1 & 1) + " " +
                std::to_string(c >> 2) + "\n";
    writeText(obj, text + "f 5 7 8 6\nf 9 10 12 11\nf 5 6 10 9\nf 7 11 12 8\nf 5 9 11 7\n"
                          "f 6 8 12 10\n");
    writeGlb(readSceneFile(obj), glb);
    std::vector<Json> runs;
    for (const std::string& scene : {obj, glb}) {
        const ProgramResult result = runShadowdag( // an oracle routes by times
            directory,
            tinyCompare(directory / "report", scene) + Arguments{"--lights", "4", "--no-oracle"});
        ASSERT_EQ(result.status, 0) << result.err;
        Json results = withoutTimes(Json::parse(readText(directory / "report/results.json")));
        for (Json& run : results["runs"])
            for (const char* named : {"scene", "images"})
                run.erase(named);
        EXPECT_GT(results["runs"][0]["pair_count"].get<uint64_t>(), 0u);
        runs.push_back(results["runs"]);
    }
    EXPECT_EQ(runs[0], runs[1]);
}

TEST(Compare, ScenesOfOneFileNameAreDistinguished) {
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
