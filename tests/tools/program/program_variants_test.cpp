// SPDX-License-Identifier: Apache-2.0
// Variants, sequences and figures from end to end at smoke size, and their refusals.
#include "tests/tools/program/program_refusals.h"

#include <chrono>
#include <filesystem>
#include <thread>

namespace shadowdag {

namespace {

using testing::HasSubstr;

Arguments tiny(const std::string& output, const Arguments& more) {
    Arguments arguments{"compare", "builtin:atrium", "-o", output,  "--size", "48x27", "--repeats",
                        "1",       "--warmups",      "0",  "--json"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
}

} // namespace

TEST(ProgramVariants, RunsByNameWithEmbreeBesideThem) {
    const TemporaryDirectory directory;
    const std::string report = directory / "report";
    const ProgramResult result =
        runShadowdag(directory, tiny(report, {"--variants", "CFM,PMCD-1SM-u2,Ray Tracing",
                                              "--resolution", "64", "--no-charts"}));
    ASSERT_EQ(result.status, 0) << result.err;
    const Json results = Json::parse(readText(report + "/results.json"));
    ASSERT_EQ(results["runs"].size(), 4u);
    const char* labels[] = {"embree", "CFM", "PMCD-1SM-u2", "RT"};
    for (size_t i = 0; i < 4; ++i)
        EXPECT_EQ(results["runs"][i]["label"], labels[i]);
    EXPECT_EQ(results["runs"][2]["parameters"]["maps_per_light"], 1);
    EXPECT_EQ(results["runs"][2]["parameters"]["undersample"], 2.0);
    EXPECT_EQ(results["runs"][3]["ray_count"], results["runs"][3]["pair_count"]);
    // The experiment that was written runs again as a file.
    const ProgramResult again =
        runShadowdag(directory, {"compare", "-o", directory / "again", "--experiment",
                                 report + "/experiment.json", "--no-charts", "--json"});
    ASSERT_EQ(again.status, 0) << again.err;
    EXPECT_EQ(Json::parse(readText(directory / "again/results.json"))["experiment"],
              results["experiment"]);
}

TEST(ProgramVariants, ASequenceGivesItsTableItsFiguresAndNoOtherRuns) {
    const TemporaryDirectory directory;
    const std::string report = directory / "report";
    const ProgramResult result = runShadowdag(
        directory, tiny(report, {"--variants", "PMCD,PMCD-SO,PMCD-1SM,PMCD-T1", "--sequence",
                                 "--frames", "0:2", "--flicker-points", "300"}));
    ASSERT_EQ(result.status, 0) << result.err;
    EXPECT_EQ(result.json()["sequence_run_count"], 15);
    EXPECT_EQ(result.json()["run_count"], 0);
    const Json results = Json::parse(readText(report + "/results.json"));
    ASSERT_EQ(results["sequence_runs"].size(), 15u);
    for (const char* key : {"scene",
                            "frame",
                            "method",
                            "model",
                            "parameters",
                            "label",
                            "time_ms",
                            "stages_ms",
                            "pair_count",
                            "false_shadow_count",
                            "false_light_count",
                            "triangle_draw_count",
                            "triangle_sphere_count",
                            "texel_count",
                            "cluster_count",
                            "cluster_light_count",
                            "lighting_computation_count",
                            "pages_committed_count",
                            "pages_freed_count",
                            "flicker_count",
                            "flicker_answer_count",
                            "flicker_explained_count",
                            "flicker_held_count",
                            "flicker_resolution_switch_count",
                            "flicker_method_switch_count"})
        EXPECT_TRUE(results["sequence_runs"][1].contains(key)) << key;
    const std::string html = readText(report + "/index.html");
    EXPECT_THAT(html, HasSubstr("Frames in sequence"));
    EXPECT_THAT(html, HasSubstr("charts/figure_10_builtin_atrium.svg"));
    EXPECT_THAT(readText(report + "/sequence.csv"), HasSubstr("lighting_computation_count"));

    // The same figures by their own command, all and one.
    const ProgramResult all =
        runShadowdag(directory, {"figures", report, "-o", directory / "all", "--json"});
    expectRefused(directory, {{{"figures", report, "-o", directory / "report/../report/charts"},
                               1,
                               "contains the charts of a report"}});
    ASSERT_EQ(all.status, 0) << all.err;
    EXPECT_GE(all.json()["figures"].size(), 7u);
    EXPECT_EQ(all.json()["figures"].size() + all.json()["left_out"].size(), 9u);
    const ProgramResult one =
        runShadowdag(directory, {"figures", report + "/results.json", "-o", directory / "one",
                                 "--figure", "16", "--json"});
    ASSERT_EQ(one.status, 0) << one.err;
    ASSERT_EQ(one.json()["figures"].size(), 1u);
    for (const char* kind : {"svg", "png", "csv", "json", "txt"})
        EXPECT_TRUE(std::filesystem::exists(directory /
                                            (std::string("one/figure_16_builtin_atrium.") + kind)))
            << kind;
    expectRefused(directory, {{{"compare", "builtin:atrium", "-o", directory / "y", "--variants",
                                "PMCD", "--taps", "1,9"},
                               1,
                               "taps names 2 values"}});
    expectRefused(directory, {{{"figures", report, "-o", directory / "x", "--figure", "9"},
                               1,
                               "--figure '9': must be a whole number from 10 to 18"}});
}

// The default model is for frames whose costs were measured, which a sequence has not.
TEST(ProgramVariants, ASequenceOfAFileNeedsNoModels) {
    const TemporaryDirectory directory;
    const std::string file = directory / "e.json";
    writeText(file, R"({"scenes": ["builtin:fail-mover"], "sequence": true, "frames": "0:1",
                        "size": "32x18", "repeats": 1, "warmups": 0, "flicker_points": 100})");
    const ProgramResult result =
        runShadowdag(directory, {"compare", "--experiment", file, "-o", directory / "r",
                                 "--no-charts", "--json"});
    ASSERT_EQ(result.status, 0) << result.err;
    EXPECT_GT(result.json()["sequence_run_count"], 4);
}

TEST(ProgramVariants, SingleFramesTakeANameToo) {
    const TemporaryDirectory directory;
    const Arguments size{"--size", "48x27", "--json"};
    const auto validate = [&](Arguments arguments) {
        arguments.insert(arguments.begin(), {"validate", "builtin:atrium"});
        arguments.insert(arguments.end(), size.begin(), size.end());
        const ProgramResult result = runShadowdag(directory, arguments);
        EXPECT_EQ(result.status, 0) << result.err;
        return result.json();
    };
    const Json byName = validate({"--variant", "PMCD-TB-FP-1SM-u2-T4"}),
               byOptions = validate({"--method", "maps", "--undersample", "2"});
    EXPECT_EQ(byName["method"], "maps");
    for (const char* key : {"false_shadow_count", "false_light_count", "acne_count"})
        EXPECT_EQ(byName[key], byOptions[key]) << key;
    expectRefused(directory,
                  {{{"validate", "builtin:atrium", "--variant", "PMCE"},
                    1,
                    "--variant 'PMCE': part 1, 'PMCE' at character 1, is unknown"},
                   {{"validate", "builtin:atrium", "--variant", "PMC", "--method", "maps"},
                    1,
                    "--method and --variant contradict each other"}});
}

TEST(ProgramVariants, WrongUsesAreRefusedByName) {
    const TemporaryDirectory directory;
    const std::string out = directory / "out";
    writeText(directory / "e.json", R"({"scenes": ["builtin:atrium"], "variants": ["PMCX"]})");
    writeText(directory / "f.json",
              R"({"scenes": ["builtin:atrium"], "variants": ["PMC"], "methods": ["maps"]})");
    writeText(directory / "g.json", R"({"scenes": ["builtin:atrium"], "sequence": 1})");
    writeText(directory / "h.json",
              R"({"scenes": ["builtin:atrium"], "variants": ["PMC"], "undersample": [2]})");
    writeText(directory / "r.json",
              R"({"provenance": {"commit": "c"}, "experiment": {}, "sequence_runs": []})");
    writeText(directory / "s.json",
              R"({"provenance": {"commit": "c"}, "experiment": {}, "sequence_runs": [{"scene": "s",
                  "label": "embree", "method": "embree", "frame": 0, "time_ms": 1,
                  "stages_ms": {}, "flicker_answer_count": 0}]})");
    const auto compare = [&](const Arguments& more) {
        Arguments arguments{"compare", "builtin:atrium", "-o", out};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return arguments;
    };
    expectRefused(
        directory,
        {{compare({"--variants", "PMCD,PMCX"}), 1,
          "--variants 'PMCX': part 1, 'PMCX' at character 1"},
         {compare({"--variants", "PMCD-EB-TB"}), 1, "contradicts part 2, 'EB'"},
         {compare({"--variants", "PMCD", "--undersample", "2"}), 1,
          "--undersample and --variants contradict each other"},
         {compare({"--variants", "PMCD", "--methods", "maps"}), 1,
          "--methods and --variants contradict each other"},
         {compare({"--lead-in", "2"}), 1, "--lead-in is for --sequence"},
         {compare({"--flicker-points", "2"}), 1, "--flicker-points is for --sequence"},
         {compare({"--sequence", "--lead-in", "x"}), 1, "--lead-in 'x'"},
         {compare({"--sequence", "--part", "1/2"}), 1, "frames of a sequence depend on each other"},
         {compare({"--sequence", "--methods", "hybrid", "--model", "oracle", "--thresholds", "8",
                   "--resolution", "16", "--size", "16x16", "--no-charts"}),
          1, "model 'oracle' needs measured costs of every frame"},
         {compare({"--methods", "dag,embree", "--lod", "1"}), 1,
          "--lod is for rays through voxels, which --methods leaves out; add dag or hybrid with "
          "--believe all"},
         {compare({"--methods", "maps", "--offset", "2"}), 1, "--offset is for rays"},
         {compare({"--maps-per-light", "17"}), 1, "--maps-per-light '17'"},
         {compare({"--variants", "PMCD,PMCD-4SM"}), 1, "'PMCD-4SM': is the variant 'PMCD'"},
         {compare({"--variants", "PMCD,PMCD-T1", "--taps", "1"}), 1, "is the variant 'PMCD'"},
         {compare({"--variants", "Hybrid:expr:texels-9"}), 1, "in parentheses"},
         {{"compare", "-o", out, "--experiment", directory / "e.json"},
          2,
          "e.json: key \"variants\" 'PMCX': part 1"},
         {{"compare", "-o", out, "--experiment", directory / "f.json"},
          2,
          "contradicts \"variants\", whose names set it"},
         {{"compare", "-o", out, "--experiment", directory / "g.json"}, 2, "must be true or false"},
         {{"compare", "-o", out, "--experiment", directory / "h.json"},
          2,
          "contradicts \"variants\", whose names set it"},
         {{"compare", "-o", out, "--experiment",
           std::string(SDAG_SOURCE_DIR) + "/scenes/experiments/smoke.json", "--sequence"},
          1,
          "--sequence and --experiment contradict each other"},
         {{"compare", "-o", out, "--experiment", directory / "none.json", "--sequence"},
          2,
          "none.json: cannot be opened"}, // before what it would fix
         {{"figures", directory / "none.json", "-o", out}, 2, "none.json: cannot be opened"},
         {{"figures", directory / "r.json", "-o", out}, 2, "holds no frames in sequence"},
         {{"figures", directory / "r.json"}, 1, "--output"},
         {{"figures", "", "-o", out}, 1, "RESULTS '': must not be empty"},
         {{"figures", directory / "r.json", "-o", ""}, 1, "'': "},
         {{"figures", directory / "r.json", "-o", out, "--figure", ""}, 1, "--figure ''"},
         {{"figures", directory / "s.json", "-o", out}, 2, "contains no data for figures"},
         {{"figures", directory / "s.json", "-o", "/proc"}, 3, "cannot create '/proc/"},
         {{"render", "builtin:atrium", "-o", directory / "a.exr", "--method", "dag",
           "--maps-per-light", "4"},
          1,
          "--maps-per-light is for methods that draw maps"}});
}

TEST(ProgramVariants, UnusedOptionsAreRefused) {
    const TemporaryDirectory directory;
    writeText(directory / "maps.json",
              R"({"scenes": ["builtin:atrium"], "methods": ["maps"], "size": "16x16"})");
    const std::string file = directory / "maps.json", costs = directory / "costs.json";
    writeText(costs, "[]");
    const auto compare = [&](const Arguments& more) {
        Arguments arguments{"compare", "builtin:atrium", "-o", directory / "out"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return arguments;
    };
    expectRefused(
        directory,
        {{compare({"--variants", "PMCD", "--offset", "2"}), 1,
          "--offset is for rays through voxels, which --variants leaves out; add RT or "
          "Hybrid"},
         {compare({"--variants", "PMCD,CFM", "--lod", "1"}), 1, "--lod is for rays"},
         {compare({"--variants", "PMCD", "--resolution", "64"}), 1,
          "--resolution is for methods dag and hybrid, which --variants leaves out"},
         {compare({"--methods", "embree,maps", "--resolution", "64"}), 1, "which --methods leaves"},
         {compare({"--variants", "RT", "--pool", "64M"}), 1,
          "--pool is for methods that draw maps, which --variants leaves out"},
         {compare({"--methods", "dag", "--bias", "1"}), 1, "--bias is for methods that draw maps"},
         {compare({"--variants", "PMCD-T1,RT", "--taps", "4"}), 1,
          "--taps is for maps whose names do not set it"},
         {compare({"--methods", "dag,maps", "--thresholds", "32"}), 1,
          "--thresholds is for method hybrid"},
         {compare({"--methods", "dag,maps", "--model", "oracle"}), 1, "--model is for method"},
         {compare({"--no-oracle", "--model", "texels:3"}), 1, "--no-oracle and --model contradict"},
         {compare({"--methods", "maps", "--dag-resolution", "64"}), 1, "--dag-resolution is for"},
         {compare({"--variants", "Hybrid,RT", "--costs", costs}), 1, "--costs is for models cost"},
         {compare({"--route-margin", "0.2"}), 1, "--route-margin is for --sequence"},
         {compare({"--variants", "PMCD,RT", "--sequence", "--route-margin", "0.2"}), 1,
          "--route-margin is for hybrids"},
         {compare({"--variants", "Hybrid-RH", "--sequence", "--route-margin", "0.2"}), 1,
          "whose names do not set it"},
         {compare({"--sequence", "--route-margin", "-1"}), 1, "--route-margin '-1'"},
         {compare({"--sequence", "--route-margin", "nan"}), 1, "--route-margin 'nan'"},
         {compare({"--seed", "3"}), 1, "--seed has no effect without --lights"},
         {compare({"--fps", "3"}), 1, "--fps has no effect without --frames"},
         {compare({"--allow-stale"}), 1, "--allow-stale has no effect without --voxels"},
         {{"compare", "-o", directory / "out", "--experiment", file, "--voxels",
           directory / "none.svdag"},
          1,
          "--voxels is for methods dag and hybrid, which " + file},
         {{"compare", "-o", directory / "out", "--experiment", file, "--route-margin", "1"},
          1,
          "--route-margin and --experiment contradict"},
         {{"render", "builtin:atrium", "-o", directory / "a.exr", "--route-margin", "0.1"},
          1,
          "--route-margin is for sequences of frames"},
         {{"render", "builtin:atrium", "-o", directory / "a.exr", "--route-margin", "0.1",
           "--frames", "0:1", "--method", "maps"},
          1,
          "--route-margin is for hybrid, not for 'maps'"},
         {{"render", "builtin:atrium", "-o", directory / "a.exr", "--route-margin", "0.1",
           "--frames", "0:1", "--variant", "Hybrid-RH0.3"},
          1,
          "the name sets it"},
         {{"render", "builtin:atrium", "-o", directory / "a.exr", "--method", "truth", "--truth"},
          1,
          "--truth is for methods that can be wrong"},
         {{"validate", "builtin:atrium", "--variant", "PMCD-T1", "--taps", "4"},
          1,
          "--taps and --variant 'PMCD-T1' contradict"},
         {{"validate", "builtin:atrium", "--variant", "PMCD", "--offset", "2"},
          1,
          "--offset is for rays through voxels"}});
    for (const char* option : {"--variants", "--costs", "--experiment", "--title", "--model"})
        expectRefused(directory,
                      {{compare({option, ""}), 1, std::string(option) + " '': is empty"}});
    EXPECT_FALSE(std::filesystem::exists(directory / "out"));
}

TEST(ProgramVariants, AMarginOfRoutesIsKeptInSequencesAndByRender) {
    const TemporaryDirectory directory;
    const std::string report = directory / "report";
    const ProgramResult result = runShadowdag(
        directory, tiny(report, {"--variants", "Hybrid:texels:24,Hybrid:texels:24-RH0.5",
                                 "--sequence", "--frames", "0:1", "--resolution", "64",
                                 "--flicker-points", "100", "--no-charts"}));
    ASSERT_EQ(result.status, 0) << result.err;
    const Json results = Json::parse(readText(report + "/results.json"));
    EXPECT_EQ(results["sequence_runs"][1]["parameters"]["route_margin"], 0.0);
    EXPECT_EQ(results["sequence_runs"][2]["parameters"]["route_margin"], 0.5);
    EXPECT_EQ(results["sequence_runs"][2]["label"], "Hybrid:texels:24-RH0.5");
    EXPECT_TRUE(results["sequence_runs"][2].contains("flicker_missing_tap_count"));
    const ProgramResult frames =
        runShadowdag(directory, {"render", "builtin:atrium", "-o", directory / "a.exr", "--size",
                                 "48x27", "--frames", "0:1", "--model", "texels:24", "--resolution",
                                 "64", "--route-margin", "0.5", "--json"});
    ASSERT_EQ(frames.status, 0) << frames.err;
    EXPECT_EQ(frames.json()["frames"].size(), 2u);
}

TEST(ProgramVariants, ASecondCompareInTheSameDirectoryIsRefused) {
    const TemporaryDirectory directory;
    const std::string report = directory / "report";
    Arguments arguments = tiny(report, {"--methods", "maps", "--no-charts"});
    for (std::string& argument : arguments)
        if (argument == "48x27")
            argument = "320x180";
    const pid_t child = startProgram(directory, arguments, directory / "out", directory / "err");
    while (!std::filesystem::exists(report + "/partial/journal.json"))
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
    expectRefused(directory, {{arguments, 3, "another shadowdag is writing there"}});
    EXPECT_EQ(waitForProgram(child), 0) << readText(directory / "err");
    EXPECT_TRUE(std::filesystem::exists(report + "/results.json"));
}

} // namespace shadowdag
