// SPDX-License-Identifier: Apache-2.0
// The command charts on made-up results: every chart is drawn, and lines of different commits are
// refused.
#include "tests/tools/report/report_runner.h"
#include "tools/settings/json.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <filesystem>

namespace shadowdag {

namespace {

/// Writes made-up results of a commit.
void makeResults(const std::string& path, const std::string& commit) {
    const std::string script = std::string(SDAG_SOURCE_DIR) + "/tests/tools/make_results.py";
    std::string text;
    ASSERT_EQ(runProgram({"/usr/bin/python3", script, commit}, &text), 0) << text;
    writeText(path, text);
}

void drawCharts(const std::string& results, const std::string& directory) {
    runReportPackage(kReportPackage, {"charts", results, "-o", directory});
}

} // namespace

TEST(Charts, EveryChartIsDrawnAsSvgAndPngWithACaption) {
    const TemporaryDirectory directory;
    makeResults(directory / "r.json", "c1");
    drawCharts(directory / "r.json", directory / "charts");
    const Json charts = Json::parse(readText(directory / "charts/charts.json"));
    ASSERT_EQ(charts["charts"].size(), 8u);
    EXPECT_EQ(charts["charts"][0]["file"], "speed_accuracy_builtin_made_up");
    for (const Json& chart : charts["charts"]) {
        const std::string stem = directory / ("charts/" + chart["file"].get<std::string>());
        EXPECT_THAT(readText(stem + ".svg"), testing::HasSubstr("</svg>")) << stem;
        EXPECT_EQ(readText(stem + ".svg").find("<text"), std::string::npos)
            << "text must be outlines";
        EXPECT_THAT(readText(stem + ".png"), testing::StartsWith("\x89PNG")) << stem;
        EXPECT_GT(chart["caption"].get<std::string>().size(), 40u);
    }
}

TEST(Charts, TheirProgressIsReportedAndKeptOutOfTheText) {
    const TemporaryDirectory directory;
    makeResults(directory / "r.json", "c1");
    std::vector<double> shares;
    runReportPackage(kReportPackage, {"charts", directory / "r.json", "-o", directory / "charts"},
                     [&](double share) { shares.push_back(share); });
    EXPECT_GT(shares.size(), 8u); // more steps than charts
    EXPECT_TRUE(std::is_sorted(shares.begin(), shares.end()));
    EXPECT_EQ(shares.front(), 0.0);
    EXPECT_EQ(shares.back(), 1.0);
    std::string text;
    const std::string script = "printf 'a\\n\\0360.25\\nb\\n\\0360.5\\nc'; exit 7";
    shares.clear();
    EXPECT_EQ(runProgram({"/bin/sh", "-c", script}, &text,
                         [&](double share) { shares.push_back(share); }),
              7);
    EXPECT_EQ(text, "a\nb\nc");
    EXPECT_EQ(shares, (std::vector<double>{0.25, 0.5}));
}

// Two sizes of three scenes, one of which this program builds: six panels that say so.
TEST(Charts, TheMainChartHasAPanelForEverySceneAndSize) {
    const TemporaryDirectory directory;
    makeResults(directory / "r.json", "c1");
    Json results = Json::parse(readText(directory / "r.json"));
    const Json runs = results["runs"];
    results["runs"] = Json::array();
    for (const char* scene : {"builtin:atrium", "scenes/lost_empire_torches.glb", "conference.glb"})
        for (Json run : runs) {
            run["scene"] = scene;
            results["runs"].push_back(run);
        }
    writeText(directory / "small.json", results.dump());
    results["experiment"]["size"] = "1920x1080";
    writeText(directory / "large.json", results.dump());
    const auto draw = [&](std::vector<std::string> files, std::string* said) {
        files.insert(files.begin(), "main");
        files.insert(files.end(), {"-o", directory / "main"});
        return runReport(files, said);
    };
    std::string said;
    ASSERT_EQ(draw({directory / "large.json", directory / "small.json"}, &said), 0) << said;
    const std::string svg = readText(directory / "main/main.svg");
    for (const char* title : {"atrium (built, mirrored), 640 × 360",
                              "lost empire torches, 640 × 360", "conference, 1920 × 1080"})
        EXPECT_THAT(svg, testing::HasSubstr(std::string("<!-- ") + title + " -->"));
    for (const char* name : {"voxel rays", "maps", "hybrid, voxel rays", "hybrid, oracle"})
        EXPECT_THAT(svg, testing::HasSubstr(std::string("<!-- ") + name + " -->"));
    EXPECT_THAT(svg, testing::HasSubstr("shadowdag-data: main "));
    results["provenance"]["commit"] = "c2";
    writeText(directory / "later.json", results.dump());
    EXPECT_EQ(draw({directory / "small.json", directory / "later.json"}, &said), 3);
    EXPECT_THAT(said, testing::HasSubstr("lines of different commits"));
}

TEST(Charts, RunsHaveTheNameThatTheyAreShownBy) {
    const TemporaryDirectory directory;
    makeResults(directory / "r.json", "c1");
    Json results = Json::parse(readText(directory / "r.json"));
    for (Json& run : results["runs"])
        if (run["model"] == "oracle")
            run["shown_as"] = {{"label", "hybrid measured routes 2048^3"},
                               {"model", "measured routes"},
                               {"why", "measured routes: the reason"}};
    writeText(directory / "r.json", results.dump());
    drawCharts(directory / "r.json", directory / "charts");
    std::string said;
    ASSERT_EQ(runReport({"main", directory / "r.json", "-o", directory / "main"}, &said), 0)
        << said;
    const std::string svg = readText(directory / "charts/speed_accuracy_builtin_made_up.svg");
    EXPECT_THAT(svg, testing::HasSubstr("<!-- hybrid, measured routes -->"));
    EXPECT_THAT(svg, testing::Not(testing::HasSubstr("<!-- hybrid, oracle -->")));
    // The chart of many scenes has one name for the model, whether or not it is the fastest row.
    const std::string panels = readText(directory / "main/main.svg");
    EXPECT_THAT(panels, testing::HasSubstr("<!-- hybrid, oracle -->"));
    EXPECT_THAT(panels, testing::Not(testing::HasSubstr("measured routes")));
    const Json charts = Json::parse(readText(directory / "charts/charts.json"));
    EXPECT_THAT(charts["charts"][0]["caption"].get<std::string>(),
                testing::HasSubstr("Measured routes: the reason."));
}

TEST(Charts, ASweepOfWhatRaysBelieveGetsItsOwnChart) {
    const TemporaryDirectory directory;
    makeResults(directory / "r.json", "c1");
    Json results = Json::parse(readText(directory / "r.json"));
    Json base;
    for (const Json& run : results["runs"])
        if (run["method"] == "dag" && run["parameters"]["resolution"] == 2048)
            base = run;
    results["runs"] = Json::array();
    for (const Json& believe : Json{"all", 2, 0.5, "none"}) {
        Json run = base;
        run["parameters"]["believe"] = believe;
        run["label"] = "dag believe " + believe.dump();
        run["ray_count"] = 1000;
        run["exact_ray_count"] = believe == "all" ? 0 : believe == 2 ? 250 : 1000;
        if (believe == "none") {
            run["parameters"].erase("resolution");
            run["false_shadow_count"] = run["false_light_count"] = 0;
        }
        results["runs"].push_back(run);
    }
    writeText(directory / "b.json", results.dump());
    drawCharts(directory / "b.json", directory / "charts");
    const std::string svg = readText(directory / "charts/believe_builtin_made_up.svg");
    for (const char* text : {"none", "0.5 px", "2 px", "all"}) // glyphs are preceded by their text
        EXPECT_THAT(svg, testing::HasSubstr(std::string("<!-- ") + text + " -->"));
    EXPECT_THAT(svg, testing::HasSubstr("<!-- 25 -->")) << "the share that triangles decide";
    results["runs"].erase(results["runs"].begin() + 1, results["runs"].end());
    writeText(directory / "one.json", results.dump());
    drawCharts(directory / "one.json", directory / "one");
    EXPECT_FALSE(std::filesystem::exists(directory / "one/believe_builtin_made_up.svg"));
}

TEST(Charts, ASweepOfLevelsOfDetailGetsItsOwnChart) {
    const TemporaryDirectory directory;
    makeResults(directory / "r.json", "c1");
    Json results = Json::parse(readText(directory / "r.json"));
    const auto isRays = [](const Json& run) {
        return run["method"] == "dag" && run["parameters"].value("resolution", 0) == 2048;
    };
    const Json base = *std::find_if(results["runs"].begin(), results["runs"].end(), isRays);
    const Json lods = {
        1, "footprint", "footprint:2", "coverage:0.5", "coverage:0.75", "coverage:0.75:2"};
    for (size_t i = 0; i < lods.size(); ++i) {
        Json run = base;
        run["parameters"]["lod"] = lods[i];
        run["label"] = "dag lod " + lods[i].dump();
        run["time_ms"] = base["time_ms"].get<double>() - 10.0 * double(i + 1);
        run["false_light_count"] = base["false_light_count"].get<int>() + 5000 * int(i + 1);
        results["runs"].push_back(run);
    }
    writeText(directory / "r.json", results.dump());
    drawCharts(directory / "r.json", directory / "charts");
    const Json charts = Json::parse(readText(directory / "charts/charts.json"))["charts"];
    const auto found = std::find_if(charts.begin(), charts.end(), [](const Json& chart) {
        return chart["file"] == "lod_builtin_made_up";
    });
    ASSERT_NE(found, charts.end());
    const std::string caption = (*found)["caption"];
    EXPECT_THAT(caption, testing::HasSubstr("Level 0 takes"));
    EXPECT_THAT(caption, testing::HasSubstr("the fastest, lod coverage:0.75:2"));
    EXPECT_THAT(readText(directory / "charts/lod_builtin_made_up.png"),
                testing::StartsWith("\x89PNG"));
}

TEST(Charts, TheCrossingOfTwoKnownPowersIsFound) {
    const TemporaryDirectory directory;
    makeResults(directory / "r.json", "c1");
    Json results = Json::parse(readText(directory / "r.json"));
    for (Json& cost : results["map_costs"]) { // rays = x / 50, map = 1: they meet at 50
        cost["rays_ms"] = cost["texels"].get<double>() / 50;
        cost["map_ms"] = 1.0;
    }
    writeText(directory / "r.json", results.dump());
    drawCharts(directory / "r.json", directory / "charts");
    const std::string charts = readText(directory / "charts/charts.json");
    EXPECT_THAT(charts, testing::HasSubstr("cross at 50 texels (95 % interval 50 to 50)"));
}

TEST(Charts, CaptionsNameOnlyTheThresholdsThatAreMarked) {
    const TemporaryDirectory directory;
    makeResults(directory / "r.json", "c1");
    Json results = Json::parse(readText(directory / "r.json"));
    const auto captions = [&](const std::string& size) {
        results["experiment"]["size"] = size;
        writeText(directory / "r.json", results.dump());
        drawCharts(directory / "r.json", directory / "charts");
        const Json list = Json::parse(readText(directory / "charts/charts.json"))["charts"];
        return list[0]["caption"].get<std::string>() + list[1]["caption"].get<std::string>();
    };
    const std::string both = captions("640x360"); // the sweep holds 96 and 32
    EXPECT_THAT(both, testing::HasSubstr("Crosses stand at the paper's 96 texels and 32 texels"));
    EXPECT_THAT(both, testing::HasSubstr("Lines stand at the paper's 96 texels and"));
    const std::string tiny = captions("64x36"); // 3.2: below the sweep's least, 8
    EXPECT_THAT(tiny,
                testing::HasSubstr("The cross stands at the paper's 96 texels. 3 texels have no "
                                   "run of their own."));
    EXPECT_THAT(tiny,
                testing::HasSubstr("The line marks the paper's 96 texels. Its equivalent "
                                   "for this picture size, 3, is not between 8 and 192, the least "
                                   "and the largest threshold that divides the maps."));
    const std::string paper = captions("1920x1080");
    EXPECT_THAT(paper, testing::HasSubstr("The cross stands at the paper's 96 texels."));
    EXPECT_THAT(paper, testing::Not(testing::HasSubstr("have no run")));
    for (Json& run : results["runs"]) // without 96 and 64 and 192, only the equivalent is marked
        if (run["parameters"].value("threshold_texels", Json()).is_number() &&
            run["parameters"]["threshold_texels"] >= 64)
            run["parameters"]["threshold_texels"] =
                run["parameters"]["threshold_texels"].get<double>() * 16;
    const std::string shifted = captions("640x360");
    EXPECT_THAT(shifted, testing::HasSubstr("The cross stands at 32 texels, the equivalent"));
    EXPECT_THAT(shifted, testing::HasSubstr("96 texels have no run of their own"));
}

TEST(Charts, AnUncertainCrossingIsNotReported) {
    const TemporaryDirectory directory;
    makeResults(directory / "r.json", "c1");
    Json results = Json::parse(readText(directory / "r.json"));
    uint32_t state = 1;
    for (Json& cost : results["map_costs"]) { // both constant but for noise: no crossing exists
        const auto noise = [&] {
            return 1.0 + double((state = state * 1664525u + 1013904223u) >> 16) / 16384.0;
        };
        cost["rays_ms"] = noise();
        cost["map_ms"] = noise();
    }
    writeText(directory / "r.json", results.dump());
    drawCharts(directory / "r.json", directory / "charts");
    const std::string charts = readText(directory / "charts/charts.json");
    EXPECT_THAT(charts, testing::Not(testing::HasSubstr("lines cross at")));
    EXPECT_THAT(charts, testing::HasSubstr("no crossing that the data pin down"));
}

TEST(Charts, LinesOfDifferentCommitsAreRefusedUnlessAllowed) {
    const TemporaryDirectory directory;
    makeResults(directory / "a.json", "c1");
    makeResults(directory / "b.json", "c2");
    std::string said;
    const std::vector<std::string> command{"charts", directory / "a.json", directory / "b.json",
                                           "-o", directory / "charts"};
    EXPECT_NE(runReport(command, &said), 0);
    EXPECT_THAT(said, testing::HasSubstr("different commits"));
    std::vector<std::string> told = command;
    told.push_back("--mixed-commits");
    EXPECT_EQ(runReport(told, &said), 0) << said;
}

// A view of no pair of a point and a light has no error, and a chart of 0 % would say that it is
// exact.
TEST(Charts, ScenesWithoutPairsAreNotDrawn) {
    const TemporaryDirectory directory;
    makeResults(directory / "r.json", "c1");
    Json results = Json::parse(readText(directory / "r.json"));
    Json empty = results["runs"];
    for (Json& run : empty) {
        run["scene"] = "empty";
        run["pair_count"] = run["false_shadow_count"] = run["false_light_count"] = 0;
    }
    Json both = results;
    both["runs"].insert(both["runs"].end(), empty.begin(), empty.end());
    writeText(directory / "both.json", both.dump());
    drawCharts(directory / "both.json", directory / "charts");
    const std::string charts = readText(directory / "charts/charts.json");
    EXPECT_THAT(charts, testing::HasSubstr("speed_accuracy_builtin_made_up"));
    EXPECT_THAT(charts, testing::Not(testing::HasSubstr("empty")));

    results["runs"] = empty;
    writeText(directory / "none.json", results.dump());
    std::string said;
    EXPECT_NE(runReport({"charts", directory / "none.json", "-o", directory / "none"}, &said), 0);
    EXPECT_THAT(said, testing::HasSubstr("no run has a pair of a visible point and a light"));
    EXPECT_THAT(said, testing::HasSubstr("--camera"));
}

TEST(Charts, ResultsWithoutRunsAreRefusedWithARemedy) {
    const TemporaryDirectory directory;
    makeResults(directory / "r.json", "c1");
    Json results = Json::parse(readText(directory / "r.json"));
    results["runs"] = results["map_costs"] = Json::array();
    std::string said;
    const auto refuse = [&] {
        writeText(directory / "r.json", results.dump());
        EXPECT_EQ(runReport({"charts", directory / "r.json", "-o", directory / "charts"}, &said),
                  3);
        EXPECT_THAT(said, testing::StartsWith("charts: "));
        return said;
    };
    EXPECT_THAT(refuse(), testing::HasSubstr("r.json: holds no runs to draw; measure with"));
    results["sequence_runs"] = {1};
    EXPECT_THAT(refuse(), testing::HasSubstr("its frames in sequence are drawn by shadowdag"));
}

TEST(Charts, ASweepIsACurveOfItsOwnForEveryValueOfEverySetting) {
    const TemporaryDirectory directory;
    makeResults(directory / "r.json", "c1");
    Json results = Json::parse(readText(directory / "r.json"));
    Json runs = Json::array();
    for (const Json& made : results["runs"]) // a setting of maps that the package does not know
        for (const int value : {1, 4}) {
            Json run = made;
            if (run["method"] != "dag")
                run["parameters"]["made_up_setting"] = value;
            if (run["method"] != "dag" || value == 1)
                runs.push_back(run);
        }
    results["runs"] = runs;
    writeText(directory / "r.json", results.dump());
    const std::string script =
        "import sys\n"
        "sys.path.insert(0, '" SDAG_SOURCE_DIR "/tools/report')\n"
        "from shadowdag_report.charts.runs import load\n"
        "from shadowdag_report.series import series_name, sweeps\n"
        "runs = [r for r in load([sys.argv[1]], False)[0] if r['frame'] == 0]\n"
        "series = sweeps(runs)\n"
        "for key, members in series.items():\n"
        "    thresholds = [r['parameters']['threshold_texels'] for r in members]\n"
        "    print(series_name(key, list(series)), thresholds)\n";
    std::string said;
    EXPECT_EQ(runProgram({"/usr/bin/python3", "-B", "-c", script, directory / "r.json"}, &said), 0);
    EXPECT_EQ(said, "made up setting 1 [0, 8, 16, 32, 64, 96, 192, 'inf']\n"
                    "made up setting 4 [0, 8, 16, 32, 64, 96, 192, 'inf']\n");
}

// A camera that sees nothing has no pair, and so neither histogram nor error.
TEST(Charts, VariantsByNameHaveAChartOfTheirOwn) {
    const TemporaryDirectory directory;
    makeResults(directory / "r.json", "c1");
    Json results = Json::parse(readText(directory / "r.json"));
    Json run = results["runs"][0];
    for (const char* name : {"CFM", "PMCD-EB-SO-u2", "RT"}) {
        run["label"] = name;
        run["parameters"]["variant"] = name;
        results["runs"].push_back(run);
    }
    writeText(directory / "v.json", results.dump());
    drawCharts(directory / "v.json", directory / "charts");
    const Json charts = Json::parse(readText(directory / "charts/charts.json"));
    ASSERT_EQ(charts["charts"].size(), 9u);
    EXPECT_EQ(charts["charts"][0]["file"], "variants_builtin_made_up");
}

TEST(Charts, LongNamesOfScenesMakeShortNamesOfFiles) {
    const std::string script = R"(
import sys
sys.path.insert(0, sys.argv[1])
from shadowdag_report.style import slug
names = ["a" * 245 + ".glb", "a" * 246 + ".glb", "\u00e4" * 120, "a.glb"]
print([len(slug(name).encode()) for name in names], len(set(map(slug, names))), slug("a.glb"), end="")
)";
    std::string said;
    ASSERT_EQ(runProgram({"/usr/bin/python3", "-B", "-c", script,
                          std::string(SDAG_SOURCE_DIR) + "/tools/report"},
                         &said),
              0)
        << said;
    EXPECT_EQ(said, "[100, 100, 99, 5] 4 a_glb");
}

TEST(Charts, OnlyDifferencesBeyondTheSpreadMakeAFront) {
    const std::string script = R"(
import sys
sys.path.insert(0, sys.argv[1])
from shadowdag_report.series import pareto
def run(name, time, error, spread=2):
    return {"label": name, "time_ms": time, "time_ms_min": time - spread / 2, "time_ms_max": time + spread / 2,
            "error": error}
runs = [run("embree", 30, 0), run("maps", 10, 0.02), run("noise", 9.5, 0.03), run("fast", 5, 0.03), run("slow", 40, 0),
        run("middle", 20, 0.01)]
print(" ".join(r["label"] for r in pareto(runs)), end="")
)";
    std::string said;
    ASSERT_EQ(runProgram({"/usr/bin/python3", "-c", script,
                          std::string(SDAG_SOURCE_DIR) + "/tools/report"},
                         &said),
              0)
        << said;
    EXPECT_EQ(said, "fast maps middle embree");
}

TEST(Charts, AnErrorOfZeroIsDrawn) {
    const TemporaryDirectory directory;
    makeResults(directory / "r.json", "c1");
    Json results = Json::parse(readText(directory / "r.json"));
    for (Json& run : results["runs"])
        if (run["method"] == "dag")
            run["false_light_count"] = 0;
    writeText(directory / "z.json", results.dump());
    drawCharts(directory / "r.json", directory / "some");
    drawCharts(directory / "z.json", directory / "none");
    const auto legendAndMarks = [&](const std::string& charts) {
        const std::string svg = readText(directory / (charts + "/resolution_builtin_made_up.svg"));
        size_t count = 0; // the sky-blue of false light: its line, its legend, every mark
        for (size_t at = svg.find("#56b4e9"); at != std::string::npos;
             at = svg.find("#56b4e9", at + 1))
            ++count;
        return count;
    };
    EXPECT_EQ(legendAndMarks("none"), legendAndMarks("some"));
}

} // namespace shadowdag
