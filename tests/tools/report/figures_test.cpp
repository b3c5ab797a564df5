// SPDX-License-Identifier: Apache-2.0
// The command figures on made-up sequences: every figure with its data and claims, and what it
// refuses.
#include "cuda/error.h"
#include "tests/tools/report/report_runner.h"
#include "tools/settings/json.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <filesystem>
#include <sstream>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

namespace shadowdag {

namespace {

using testing::HasSubstr;

/// Writes made-up results of a commit and some variants; of none: of all.
void makeSequence(const std::string& path, const std::string& commit,
                  const std::vector<std::string>& variants = {}) {
    std::vector<std::string> arguments{
        "/usr/bin/python3", std::string(SDAG_SOURCE_DIR) + "/tests/tools/make_sequence.py", commit};
    arguments.insert(arguments.end(), variants.begin(), variants.end());
    std::string text;
    ASSERT_EQ(runProgram(arguments, &text), 0) << text;
    writeText(path, text);
}

void drawFigures(const std::string& results, const std::string& directory,
                 const std::vector<std::string>& more = {}) {
    std::vector<std::string> arguments{"figures", results, "-o", directory};
    arguments.insert(arguments.end(), more.begin(), more.end());
    runReportPackage(kReportPackage, arguments);
}

/// Returns what the command says of results that it must refuse: one line, no traceback.
std::string refusal(const std::string& results, const std::string& directory,
                    const std::vector<std::string>& more = {}, ErrorKind kind = ErrorKind::kInput) {
    try {
        drawFigures(results, directory, more);
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), kind);
        EXPECT_THAT(error.what(), testing::StartsWith("figures: "));
        EXPECT_THAT(error.what(), testing::Not(HasSubstr("\n")));
        return error.what();
    }
    ADD_FAILURE() << "no error";
    return "";
}

/// Returns made-up results as JSON.
Json madeUp(const TemporaryDirectory& directory, const std::vector<std::string>& variants) {
    makeSequence(directory / "made_up.json", "c1", variants);
    return Json::parse(readText(directory / "made_up.json"));
}

} // namespace

TEST(Figures, EachIsDrawnWithItsDataItsCaptionAndWhatThePaperStates) {
    const TemporaryDirectory directory;
    makeSequence(directory / "r.json", "c1");
    drawFigures(directory / "r.json", directory / "figures");
    const Json charts = Json::parse(readText(directory / "figures/charts.json"));
    ASSERT_EQ(charts["charts"].size(), 9u);
    for (int figure = 10; figure <= 18; ++figure) {
        const std::string stem =
            directory / ("figures/figure_" + std::to_string(figure) + "_builtin_made_up");
        EXPECT_EQ(charts["charts"][size_t(figure - 10)]["file"],
                  "figure_" + std::to_string(figure) + "_builtin_made_up");
        EXPECT_THAT(readText(stem + ".svg"), HasSubstr("</svg>"));
        EXPECT_THAT(readText(stem + ".png"), testing::StartsWith("\x89PNG"));
        EXPECT_THAT(readText(stem + ".csv"), testing::StartsWith("frame,"));
        EXPECT_THAT(readText(stem + ".txt"), HasSubstr("the paper"));
        const Json data = Json::parse(readText(stem + ".json"));
        EXPECT_EQ(data["provenance"]["commit"], "c1");
        EXPECT_EQ(data["frames"].size(), 16u);
        EXPECT_FALSE(data["claims"].empty()) << figure;
        for (const auto& [name, values] : data["series"].items())
            EXPECT_EQ(values.size(), 16u) << figure << " " << name;
    }
}

TEST(Figures, ClaimsAreComparedWithTheData) {
    const TemporaryDirectory directory;
    makeSequence(directory / "r.json", "c1");
    drawFigures(directory / "r.json", directory / "figures", {"--figure", "15"});
    const Json data = Json::parse(readText(directory / "figures/figure_15_builtin_made_up.json"));
    const auto claim = [&](const std::string& start) {
        for (const Json& one : data["claims"])
            if (one["claim"].get<std::string>().starts_with(start))
                return one;
        return Json();
    };
    // Made up: PMC draws 0.14, PMCD 0.13, PMCD-EB 0.1 of what the sphere does, SO half of that.
    EXPECT_EQ(claim("PMC:")["measured"], "7.1 to 7.1 times");
    EXPECT_EQ(claim("PMC:")["holds"], true);
    EXPECT_EQ(claim("EB:")["measured"], "-23.1 % to -23.1 %, mean -23.1 %");
    EXPECT_EQ(claim("EB:")["holds"], true);
    EXPECT_EQ(claim("SO:")["measured"], "-50.0 %");
    EXPECT_EQ(claim("SO:")["holds"], true);
}

TEST(Figures, StepsOfCullingAreSharesOfTheirSumAndStagesAreDrawnInGroups) {
    const TemporaryDirectory directory;
    makeSequence(directory / "r.json", "c1", {"PMCD-EB", "RT"});
    drawFigures(directory / "r.json", directory / "figures", {"--figure", "13"});
    const Json steps = Json::parse(readText(directory / "figures/figure_13_builtin_made_up.json"));
    // Made up at frame 0: resolution 0.4, boxes 0.6, hierarchy 0.2, masks 1.5, blocks 0.5, query
    // 0.8, tests 4 ms, of 8.0; the last frame's tests take 5.
    ASSERT_EQ(steps["series"].size(), 7u);
    EXPECT_EQ(steps["series"]["update of batch boxes (ms)"][0], 0.6);
    EXPECT_EQ(steps["series"]["tests of masks and depths (ms)"][15], 5.0);
    EXPECT_EQ(steps["claims"][0]["measured"], "tests of masks and depths");
    EXPECT_EQ(steps["claims"][0]["holds"], false);
    EXPECT_EQ(steps["claims"][1]["measured"], "10.0 %"); // 0.8 of 8.0
    drawFigures(directory / "r.json", directory / "figures", {"--figure", "12"});
    const Json stages = Json::parse(readText(directory / "figures/figure_12_builtin_made_up.json"));
    EXPECT_NEAR(stages["series"]["PMCD-EB: culling (ms)"][0].get<double>(), 6.1, 1e-9);
    EXPECT_NEAR(stages["series"]["PMCD-EB: page allocation (ms)"][0].get<double>(), 0.8, 1e-9);
    EXPECT_NEAR(stages["series"]["RT: culling (ms)"][0].get<double>(), 0.8, 1e-9);
}

// Commits of sparse textures are the driver's: figure 11 then shows their own time and says so.
TEST(Figures, CommitsByTheDriverAreMarked) {
    const TemporaryDirectory directory;
    Json results = madeUp(directory, {"PMCD-EB", "PMCD-EB-SO"});
    const auto draw = [&](const char* output) {
        writeText(directory / "r.json", results.dump());
        drawFigures(directory / "r.json", directory / output, {"--figure", "11"});
        return Json::parse(readText(directory / output + "/figure_11_builtin_made_up.json"));
    };
    const Json ours = draw("ours");
    EXPECT_EQ(ours["series"]["PMCD-EB-SO page allocation (ms)"][0], 0.8); // commit and clear
    results["provenance"]["gl_pages"] = "sparse";
    const Json drivers = draw("drivers");
    EXPECT_EQ(drivers["series"]["PMCD-EB-SO page commit (ms)"][0], 0.5);
    EXPECT_THAT(drivers["claims"][0]["measured"].get<std::string>(),
                HasSubstr("the driver's commits"));
    EXPECT_THAT(drivers["caption"].get<std::string>(), HasSubstr("by the driver"));
}

TEST(Figures, UnmeasuredFiguresAreOmittedByNameUnlessRequested) {
    const TemporaryDirectory directory;
    Json results = madeUp(directory, {"CFM", "PMCD-EB"});
    for (Json& row : results["sequence_runs"])
        row.erase("triangle_sphere_count");
    writeText(directory / "r.json", results.dump());
    drawFigures(directory / "r.json", directory / "figures");
    const Json charts = Json::parse(readText(directory / "figures/charts.json"));
    EXPECT_EQ(charts["charts"].size(), 5u); // 10, 12, 13, 17, 18
    EXPECT_THAT(
        leftOutLines(charts),
        testing::ElementsAre(
            "figure 11 of builtin:made-up is omitted: it needs a variant with SO or SOR",
            "figure 14 of builtin:made-up is omitted: it needs variants PMCD-EB and some of "
            "PMCD-EB-T1, PMCD-EB-Nk3, PMCD-EB-RL",
            "figure 15 of builtin:made-up is omitted: it needs \"triangle_sphere_count\" of CFM",
            "figure 16 of builtin:made-up is omitted: it needs variants PMCD-EB and some of "
            "PMCD-EB-1SM, PMCD-EB-16SM, PMCD-EB-u2, PMCD-EB-u4"));
    EXPECT_THAT(refusal(directory / "r.json", directory / "x", {"--figure", "11"}),
                HasSubstr("figure 11 of builtin:made-up needs a variant with SO or SOR"));
    EXPECT_THAT(refusal(directory / "r.json", directory / "x", {"--figure", "15"}),
                HasSubstr("needs \"triangle_sphere_count\" of CFM"));
    EXPECT_THAT(refusal(directory / "r.json", directory / "x", {"--figure", "16"}),
                HasSubstr("needs variants PMCD-EB and some of PMCD-EB-1SM"));
}

TEST(Figures, ScenesWhoseNamesDifferHaveFilesThatDiffer) {
    const TemporaryDirectory directory;
    Json results = madeUp(directory, {"RT"});
    Json rows = Json::array();
    for (const char* scene : {"a.glb", "a_glb", "$a"})
        for (Json row : results["sequence_runs"]) {
            row["scene"] = scene;
            row["label"] = "RT $\\frac";
            rows.push_back(row);
        }
    results["sequence_runs"] = rows;
    writeText(directory / "r.json", results.dump());
    drawFigures(directory / "r.json", directory / "figures", {"--figure", "10"});
    const Json charts = Json::parse(readText(directory / "figures/charts.json"));
    ASSERT_EQ(charts["charts"].size(), 3u);
    EXPECT_EQ(charts["charts"][0]["file"], "figure_10_a_glb");
    EXPECT_EQ(charts["charts"][1]["file"], "figure_10_a_glb_2");
    EXPECT_EQ(charts["charts"][2]["file"], "figure_10__a");
}

TEST(Figures, FiguresOfAnEarlierRunAreRemovedAndNothingElse) {
    const TemporaryDirectory directory;
    const auto has = [&](const std::string& name) {
        return std::filesystem::exists(directory / ("figures/" + name));
    };
    makeSequence(directory / "r.json", "c1", {"PMCD-EB", "RT"});
    drawFigures(directory / "r.json", directory / "figures");
    ASSERT_TRUE(has("figure_12_builtin_made_up.csv"));
    for (const char* name : {"figure_12_mine.svg", "notes.txt"})
        writeText(directory / ("figures/" + std::string(name)), "mine");
    Json results = Json::parse(readText(directory / "r.json"));
    Json none = results;
    none["sequence_runs"] = Json::array({results["sequence_runs"][0]});
    none["sequence_runs"][0]["label"] = none["sequence_runs"][0]["method"] = "embree";
    none["sequence_runs"][0]["stages_ms"] = Json::object();
    writeText(directory / "none.json", none.dump());
    drawFigures(directory / "none.json", directory / "figures");
    EXPECT_TRUE(has("figure_12_builtin_made_up.csv")) << "nothing was drawn: nothing is replaced";
    for (Json& row : results["sequence_runs"])
        row["scene"] = "other";
    writeText(directory / "r.json", results.dump());
    drawFigures(directory / "r.json", directory / "figures", {"--figure", "15"});
    for (const char* kind : {"svg", "png", "csv", "json", "txt"}) {
        EXPECT_FALSE(has("figure_12_builtin_made_up." + std::string(kind)));
        EXPECT_TRUE(has("figure_15_other." + std::string(kind)));
    }
    EXPECT_TRUE(has("figure_12_mine.svg"));
    EXPECT_TRUE(has("notes.txt"));
}

TEST(Figures, OtherFilesAndLinesOfDifferentCommitsAreRefused) {
    const TemporaryDirectory directory;
    makeSequence(directory / "a.json", "c1");
    makeSequence(directory / "b.json", "c2");
    writeText(directory / "c.json", "{}");
    std::string said;
    EXPECT_EQ(
        runReport({"figures", directory / "a.json", directory / "b.json", "-o", directory / "x"},
                  &said),
        3);
    EXPECT_THAT(said, HasSubstr("lines of different commits"));
    EXPECT_THAT(refusal(directory / "c.json", directory / "x"),
                HasSubstr("c.json: not a results file of compare"));
}

TEST(Figures, AByteOrderMarkIsTaken) {
    const TemporaryDirectory directory;
    writeText(directory / "r.json", "\xef\xbb\xbf" + madeUp(directory, {"PMCD-EB", "RT"}).dump());
    drawFigures(directory / "r.json", directory / "x", {"--figure", "15"});
}

TEST(Figures, WhatCannotBeDrawnIsRefused) {
    const TemporaryDirectory directory;
    Json results = madeUp(directory, {"PMCD-EB", "Hybrid"});
    results["sequence_times"] =
        Json::array({Json{{"scene", "builtin:made-up"}, {"label", "Hybrid"}}});
    writeText(directory / "r.json", results.dump());
    EXPECT_THAT(
        refusal(directory / "r.json", directory / "x", {"--figure", "10"}),
        HasSubstr("r.json: not results of compare --sequence: lacks 'time_ms_p99'; make it again"));
}

TEST(Figures, WrongShapesAreRefusedByPlace) {
    const TemporaryDirectory directory;
    const Json right = madeUp(directory, {"PMCD-EB", "RT"});
    // One Python process for all, called file by file as a program would.
    std::vector<std::string> messages, asked{"/usr/bin/python3", "-c", R"(
import os, sys
sys.path.insert(0, os.path.dirname(sys.argv[1]))
from shadowdag_report.__main__ import main
for path in sys.argv[2:]:
    status = main(["figures", path, "-o", os.path.join(os.path.dirname(path), "x"), "--figure", "15"])
    print(f"status {status}", file=sys.stderr)
)",
                                             kReportPackage};
    const auto refused = [&](const std::string& text, const std::string& message) {
        asked.push_back(directory / ("r" + std::to_string(messages.size()) + ".json"));
        writeText(asked.back(), text);
        messages.push_back(message);
    };
    const auto row = [&](const char* key, const Json& value) {
        Json results = right;
        results["sequence_runs"][1][key] = value;
        return results.dump();
    };
    const std::string no = ".json: not a results file of compare: ", again = "; make it again";
    refused(std::string(100000, '['), no + "nests too deep" + again);
    refused("[1]", no + "no object; measure again");
    refused("{}", no + "lacks 'provenance'" + again);
    refused("{\"provenance\": \"\xff\"}", no + "byte 16 is not UTF-8" + again);
    refused("{\n  7}", no + "no JSON at line 2, column 3: ");
    for (const char* rows : {"{}", "\"abc\""}) {
        Json results = right;
        results["sequence_runs"] = Json::parse(rows);
        refused(results.dump(), ".json: \"sequence_runs\" is no list");
    }
    for (const char* key : {"provenance", "experiment"}) {
        Json results = right;
        results[key] = -1;
        refused(results.dump(), ".json: \"" + std::string(key) + "\" is no object; measure again");
    }
    Json results = right;
    results["sequence_times"] = -1;
    refused(results.dump(), ".json: \"sequence_times\" is no list; measure again");
    for (const char* key : {"time_ms_low", "time_ms_confidence"})
        refused(row(key, "x"), "sequence_runs[1]: \"" + std::string(key) + "\" is \"x\"");
    results = right;
    results["sequence_runs"][1] = 7;
    refused(results.dump(), ".json: sequence_runs[1] is no object");
    refused(row("label", nullptr), "sequence_runs[1]: \"label\" is null");
    refused(row("label", "PMCD-"), "sequence_runs[1]: \"label\" is \"PMCD-\"");
    refused(row("frame", 0.5), "sequence_runs[1]: \"frame\" is 0.5");
    refused(row("time_ms", "3"), "sequence_runs[1]: \"time_ms\" is \"3\"");
    refused(row("stages_ms", Json{{"shading", Json::array()}}),
            "sequence_runs[1]: \"stages_ms\" is {\"shading\": []}");
    // make_sequence.py writes frame by frame: rows 0 and 1 are PMCD-EB and RT at frame 0.
    refused(row("label", "PMCD-EB"),
            "sequence_runs[1]: frame 0 of PMCD-EB in builtin:made-up is listed twice");
    results = right;
    results["sequence_runs"].erase(1);
    refused(results.dump(), "builtin:made-up: RT lacks frame 0, which other variants have");
    results = right;
    results["sequence_runs"][2]["triangle_draw_count"] = -1;
    refused(results.dump(), "\"triangle_draw_count\" of PMCD-EB at frame 20 is -1, not a count");

    std::string text;
    EXPECT_EQ(runProgram(asked, &text), 0) << text;
    std::istringstream lines(text);
    for (const std::string& message : messages) {
        std::string said, status;
        std::getline(lines, said);
        std::getline(lines, status);
        EXPECT_THAT(said, testing::AllOf(testing::StartsWith("figures: "), HasSubstr(message)));
        EXPECT_EQ(status, "status 3") << said;
    }
    std::string rest;
    EXPECT_FALSE(std::getline(lines, rest)) << rest;
}

// scenes/output_file.cpp has the same rule.
TEST(Figures, UnfinishedFilesOfKilledRunsAreRemoved) {
    const TemporaryDirectory directory;
    makeSequence(directory / "r.json", "c1", {"RT", "PMCD"});
    std::filesystem::create_directory(directory / "figures");
    const pid_t ended = fork();
    if (ended == 0)
        _exit(0);
    waitpid(ended, nullptr, 0);
    const std::string begin = directory / "figures/charts.json.tmp-";
    const std::string gone = begin + std::to_string(ended) + "-0", running = begin + "1-0";
    for (const std::string& path : {gone, running})
        writeText(path, "half");
    drawFigures(directory / "r.json", directory / "figures", {"--figure", "15"});
    EXPECT_FALSE(std::filesystem::exists(gone));
    EXPECT_TRUE(std::filesystem::exists(running));
}

TEST(Figures, FilesThatAreReplacedKeepTheirPermissions) {
    namespace fs = std::filesystem;
    const TemporaryDirectory directory;
    const std::string figures = directory / "figures", charts = figures + "/charts.json";
    makeSequence(directory / "r.json", "c1", {"RT", "PMCD"});
    fs::create_directory(figures);
    writeText(charts, "old");
    fs::permissions(charts, fs::perms(0600));
    drawFigures(directory / "r.json", figures, {"--figure", "15"});
    EXPECT_NE(readText(charts), "old");
    EXPECT_EQ(fs::status(charts).permissions(), fs::perms(0600));
    if (geteuid() == 0) { // who may give files away
        ASSERT_EQ(chown(charts.c_str(), 65534, 65533), 0);
        drawFigures(directory / "r.json", figures, {"--figure", "15"});
        struct stat status {};
        ASSERT_EQ(stat(charts.c_str(), &status), 0);
        EXPECT_EQ(status.st_uid, 65534u);
        EXPECT_EQ(status.st_gid, 65533u);
        EXPECT_EQ(status.st_mode & 0777u, 0600u);
    }
    fs::permissions(charts, fs::perms(0444));
    EXPECT_THAT(refusal(directory / "r.json", figures, {"--figure", "15"}, ErrorKind::kResource),
                HasSubstr("charts.json: cannot be written: it is read-only"));
}

TEST(Figures, WriteErrorsAreReportedAndLeaveNoPartialFile) {
    const TemporaryDirectory directory;
    makeSequence(directory / "r.json", "c1", {"PMCD-EB"});
    const auto unwritten = [&](const std::string& where) {
        return refusal(directory / "r.json", where, {"--figure", "15"}, ErrorKind::kResource);
    };
    // Neither can be written to, by any user.
    EXPECT_THAT(unwritten("/proc"), HasSubstr("/proc/figure_15_builtin_made_up.svg: cannot be "
                                              "written: "));
    EXPECT_THAT(unwritten(directory / "r.json/x"),
                testing::AllOf(HasSubstr("r.json/x: cannot be written"),
                               HasSubstr("choose another directory")));
    // A file may grow to 4 KiB, as on a full disk; what Python leaves then is nothing.
    rlimit before{};
    getrlimit(RLIMIT_FSIZE, &before);
    rlimit small = before;
    small.rlim_cur = 4096;
    setrlimit(RLIMIT_FSIZE, &small);
    const std::string said = unwritten(directory / "full");
    setrlimit(RLIMIT_FSIZE, &before);
    EXPECT_THAT(said, HasSubstr("cannot be written: File too large"));
    EXPECT_TRUE(std::filesystem::is_empty(directory / "full"));
}

} // namespace shadowdag
