// SPDX-License-Identifier: Apache-2.0
// Variants, sequences and figures from end to end at smoke size, and all that is refused there.
#include "tests/tools/program_refusals.h"

#include <chrono>
#include <filesystem>
#include <thread>

namespace shadowdag {

namespace {

using testing::HasSubstr;
using Arguments = std::vector<std::string>;

Arguments tiny(const std::string& output, const Arguments& more) {
    Arguments arguments{"compare", "builtin:atrium", "-o", output,  "--size", "48x27", "--repeats",
                        "1",       "--warmups",      "0",  "--json"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
}

} // namespace

TEST(ProgramVariants, RunsByNameWithTheTruthBesideThem) {
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
    ASSERT_EQ(all.status, 0) << all.err;
    EXPECT_GE(all.json()["figures"].size(), 7u);
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
                               "--figure '9': must be a whole number from 10 to 17"}});
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
    const Json byName = validate({"--variant", "PMCD-TB-1SM-u2"}),
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
         {compare({"--sequence", "--part", "1/2"}), 1, "frames of a sequence follow each other"},
         {compare({"--sequence", "--methods", "hybrid", "--model", "oracle", "--thresholds", "8",
                   "--resolution", "16", "--size", "16x16", "--no-charts"}),
          1, "model 'oracle' needs the costs of every frame"},
         {compare({"--methods", "dag-exact,embree", "--lod", "1"}), 1,
          "--lod is for rays that stop at voxels, which --methods leaves out"},
         {compare({"--methods", "maps", "--offset", "2"}), 1, "--offset is for rays"},
         {compare({"--maps-per-light", "17"}), 1, "--maps-per-light '17'"},
         {{"compare", "-o", out, "--experiment", directory / "e.json"},
          2,
          "e.json: key \"variants\" 'PMCX': part 1"},
         {{"compare", "-o", out, "--experiment", directory / "f.json"},
          2,
          "contradicts \"variants\", which name their methods"},
         {{"compare", "-o", out, "--experiment", directory / "g.json"}, 2, "must be true or false"},
         {{"compare", "-o", out, "--experiment", directory / "h.json"},
          2,
          "contradicts \"variants\", whose names say it"},
         {{"compare", "-o", out, "--experiment", directory / "h.json", "--sequence"},
          1,
          "--sequence and --experiment contradict each other"},
         {{"figures", directory / "none.json", "-o", out}, 2, "none.json: cannot be opened"},
         {{"figures", directory / "r.json", "-o", out}, 2, "holds no frames in sequence"},
         {{"figures", directory / "r.json"}, 1, "--output"},
         {{"render", "builtin:atrium", "-o", directory / "a.exr", "--method", "dag",
           "--maps-per-light", "4"},
          1,
          "--maps-per-light is for methods that draw maps"}});
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
    expectRefused(directory, {{arguments, 1, "another shadowdag is writing there"}});
    EXPECT_EQ(waitForProgram(child), 0) << readText(directory / "err");
    EXPECT_TRUE(std::filesystem::exists(report + "/results.json"));
}

} // namespace shadowdag
