// SPDX-License-Identifier: Apache-2.0
// `shadowdag fit` from end to end at smoke size: choice, neighbours, replay, refusals.
#include "scenes/scene_file.h"
#include "tests/tools/program/program_refusals.h"

#include <filesystem>

namespace shadowdag {

namespace {

using testing::HasSubstr;

/// A space of some tens of models on a failure scene, for bytes: nothing depends on time.
Arguments tinyFit(const std::string& output, const Arguments& more = {}) {
    Arguments arguments{"fit",
                        "builtin:fail-contact",
                        "-o",
                        output,
                        "--size",
                        "48x27",
                        "--frames",
                        "0",
                        "--resolution",
                        "16,32,64,128",
                        "--lod",
                        "0",
                        "--believe",
                        "all",
                        "--taps",
                        "1,9",
                        "--thresholds",
                        "16",
                        "--page-size",
                        "16",
                        "--json",
                        "--minimise",
                        "bytes",
                        "--methods",
                        "dag,maps,hybrid"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
}

uint64_t wrongOf(const Json& run) {
    return run.at("false_shadow_count").get<uint64_t>() +
           run.at("false_light_count").get<uint64_t>();
}

} // namespace

TEST(Fit, ChoiceKeepsTheBoundAndCompareReplaysItsErrors) {
    const TemporaryDirectory directory;
    const std::string result = directory / "f.json", report = directory / "report";
    const ProgramResult fit = runShadowdag(directory, tinyFit(result, {"--max", "0.05"}));
    ASSERT_EQ(fit.status, 0) << fit.err;
    const Json found = Json::parse(readText(result));
    const Json chosen = found.at("chosen");
    EXPECT_EQ(fit.json().at("chosen"), chosen);
    EXPECT_EQ(chosen.at("status"), "chosen");
    EXPECT_LE(chosen.at("error").get<double>(), 0.05);
    EXPECT_GT(chosen.at("time_ms").get<double>(), 0.0) << "named beside the bytes";
    EXPECT_THAT(fit.err, testing::ContainsRegex("chosen .* (B|KiB|MiB), [0-9.]+ ms  error"));
    EXPECT_TRUE(chosen.at("is_complete").get<bool>());
    EXPECT_LT(found.at("measured_count"), found.at("model_count"));
    EXPECT_THAT(readText(directory / "f.svg"), HasSubstr("</svg>"));
    EXPECT_THAT(readText(directory / "f.png"), testing::StartsWith("\x89PNG"));
    EXPECT_THAT(readText(directory / "f.html"), HasSubstr("<p class=\"verdict\">Chosen: "));

    const ProgramResult compare =
        runShadowdag(directory, {"compare", "--experiment", directory / "f.experiment.json", "-o",
                                 report, "--no-charts", "--json"});
    ASSERT_EQ(compare.status, 0) << compare.err;
    const Json runs = Json::parse(readText(report + "/results.json")).at("runs");
    ASSERT_EQ(runs.size(), 1u);
    EXPECT_EQ(runs[0].at("label"), chosen.at("label"));
    EXPECT_GT(runs[0].at("pair_count"), 0);
    for (const char* key : {"pair_count", "false_shadow_count", "false_light_count", "map_bytes"})
        EXPECT_EQ(runs[0].at(key), chosen.at(key)) << key;
    EXPECT_EQ(double(wrongOf(runs[0])) / runs[0].at("pair_count").get<double>(),
              chosen.at("error").get<double>());
}

TEST(Fit, ChoosesWhatMeasuringEveryModelChooses) {
    const TemporaryDirectory directory;
    const std::string report = directory / "report";
    const ProgramResult compare = runShadowdag(directory, {"compare",
                                                           "builtin:fail-contact",
                                                           "-o",
                                                           report,
                                                           "--size",
                                                           "48x27",
                                                           "--resolution",
                                                           "16,32,64,128",
                                                           "--taps",
                                                           "1,9",
                                                           "--thresholds",
                                                           "16",
                                                           "--undersample",
                                                           "1,2,4",
                                                           "--maps-per-light",
                                                           "1,4",
                                                           "--page-size",
                                                           "16",
                                                           "--methods",
                                                           "dag,maps,hybrid",
                                                           "--believe",
                                                           "all",
                                                           "--no-oracle",
                                                           "--repeats",
                                                           "1",
                                                           "--warmups",
                                                           "0",
                                                           "--no-charts",
                                                           "--json"});
    ASSERT_EQ(compare.status, 0) << compare.err;
    const Json runs = Json::parse(readText(report + "/results.json")).at("runs");
    for (const char* bound : {"0.2", "0.05", "0.02", "0.01"}) {
        SCOPED_TRACE(bound);
        uint64_t least = UINT64_MAX;
        for (const Json& run : runs)
            if (double(wrongOf(run)) <= std::stod(bound) * run.at("pair_count").get<double>())
                least = std::min(least, run.at("dag_bytes").get<uint64_t>() +
                                            run.at("map_bytes").get<uint64_t>());
        const std::string result = directory / "f.json";
        const ProgramResult fit =
            runShadowdag(directory, tinyFit(result, {"--no-charts", "--max", bound}));
        const Json found = Json::parse(readText(result));
        EXPECT_EQ(found.at("model_count"), runs.size());
        if (least == UINT64_MAX) {
            EXPECT_EQ(fit.status, 1);
            EXPECT_TRUE(found.at("chosen").is_null());
            continue;
        }
        ASSERT_EQ(fit.status, 0) << fit.err;
        EXPECT_EQ(found.at("chosen").at("bytes"), least);
        // Its cheaper neighbours were measured and break the bound.
        for (const Json& neighbour : found.at("neighbours"))
            if (neighbour.contains("bytes") && neighbour.at("bytes") < least) {
                EXPECT_EQ(neighbour.at("status"), "refuted") << neighbour.at("label");
                EXPECT_GT(neighbour.at("error_over_bound"), 1.0);
                EXPECT_TRUE(neighbour.at("is_complete").get<bool>());
            }
    }
}

TEST(Fit, ByBytesEveryByteIsTheSameOnOneAndTwoThreads) {
    const TemporaryDirectory directory;
    Json results[2];
    for (int i = 0; i < 2; ++i) {
        const std::string result = directory / ("f" + std::to_string(i) + ".json");
        const ProgramResult fit =
            runShadowdag(directory, tinyFit(result, {"--no-charts", "--max", "0.03", "--metric",
                                                     "flip", "--threads", std::to_string(i + 1)}));
        ASSERT_EQ(fit.status, 0) << fit.err;
        results[i] = Json::parse(readText(result));
        results[i]["provenance"].erase("thread_count");
        const auto eraseTimes = [](Json& model) { // of the choice, whose time is reported
            for (const char* key : {"time_ms", "time_ms_standard_error"})
                model.erase(key);
        };
        results[i].erase("other_cpu_share");
        eraseTimes(results[i]["chosen"]);
        eraseTimes(results[i]["least_error"]);
        for (Json& model : results[i]["models"])
            eraseTimes(model);
    }
    EXPECT_EQ(results[0].dump(1), results[1].dump(1));
}

TEST(Fit, ByTimeTheChoiceIsTimedOnAllFramesOfAllScenes) {
    const TemporaryDirectory directory;
    const std::string result = directory / "f.json";
    const ProgramResult fit = runShadowdag(directory, {"fit",
                                                       "builtin:fail-contact",
                                                       "builtin:fail-mover",
                                                       "-o",
                                                       result,
                                                       "--size",
                                                       "48x27",
                                                       "--frames",
                                                       "0,30",
                                                       "--resolution",
                                                       "32,64",
                                                       "--methods",
                                                       "dag,maps",
                                                       "--undersample",
                                                       "1",
                                                       "--max",
                                                       "0.3",
                                                       "--repeats",
                                                       "3",
                                                       "--no-charts",
                                                       "--json"});
    ASSERT_EQ(fit.status, 0) << fit.err;
    const Json found = Json::parse(readText(result));
    EXPECT_EQ(found.at("frame_count"), 3) << "fail-contact stands still: one frame";
    const Json chosen = found.at("chosen");
    EXPECT_GT(chosen.at("time_ms"), 0.0);
    EXPECT_TRUE(chosen.contains("time_ms_standard_error"));
    ASSERT_EQ(chosen.at("frames").size(), 3u);
    double worst = 0;
    for (const Json& frame : chosen.at("frames"))
        worst = std::max(worst, frame.at("error").get<double>());
    EXPECT_EQ(chosen.at("error"), worst);
    for (const Json& model : found.at("models"))
        EXPECT_TRUE(model.contains("status")) << model.at("label");
}

TEST(Fit, ABoundThatNoModelKeepsIsReportedWithTheLeastError) {
    const TemporaryDirectory directory;
    const std::string result = directory / "f.json";
    writeText(directory / "f.experiment.json",
              R"({"title": "The least model in bytes with false error at most 0.5"})"); // a fit's
    const ProgramResult fit = runShadowdag(
        directory, tinyFit(result, {"--no-charts", "--max", "0", "--metric", "visibility"}));
    EXPECT_EQ(fit.status, 1);
    EXPECT_EQ(fit.out, "");
    EXPECT_THAT(fit.err, HasSubstr("--max '0': no model keeps it; the least visibility error"));
    const Json found = Json::parse(readText(result));
    EXPECT_TRUE(found.at("chosen").is_null());
    EXPECT_GT(found.at("least_error").at("error"), 0.0);
    EXPECT_THAT(fit.err, HasSubstr(found.at("least_error").at("label").get<std::string>()));
    EXPECT_FALSE(std::filesystem::exists(directory / "f.experiment.json"));
    EXPECT_THAT(fit.err,
                HasSubstr("f.experiment.json: removed, because it belongs to an earlier fit"));
}

TEST(Fit, FoldersAreTheScenesInThem) {
    const TemporaryDirectory directory;
    const std::string folder = directory / "scenes";
    std::filesystem::create_directories(folder);
    for (const char* name : {"contact", "acne"})
        ASSERT_EQ(runShadowdag(directory, {"scene", "fail-" + std::string(name), "-o",
                                           folder + "/" + name + ".glb"})
                      .status,
                  0);
    const std::string result = directory / "f.json";
    const ProgramResult fit =
        runShadowdag(directory, {"fit", folder, "-o", result, "--size", "32x18", "--resolution",
                                 "32", "--methods", "dag", "--lod", "0", "--max", "1", "--minimise",
                                 "bytes", "--no-charts", "--json"});
    ASSERT_EQ(fit.status, 0) << fit.err;
    const Json scenes = Json::parse(readText(result)).at("scenes");
    ASSERT_EQ(scenes.size(), 2u);
    EXPECT_EQ(scenes[0].at("scene"), "acne.glb");
    EXPECT_EQ(scenes[1].at("scene"), "contact.glb");
}

TEST(Fit, FoldersHoldScenesOfEveryKindThatIsRead) {
    if (!readsOtherScenes())
        GTEST_SKIP() << "built without Assimp";
    const TemporaryDirectory directory;
    const std::string folder = directory / "scenes";
    std::filesystem::create_directories(folder);
    // Two floors and a board between them, so that lights and shadows are there.
    const std::string stage = "v 0 0 0\nv 4 0 0\nv 4 0 4\nv 0 0 4\nv 1 1 1\nv 3 1 1\n"
                              "v 3 1 3\nv 1 1 3\nf 4 3 2 1\nf 8 7 6 5\n";
    writeText(folder + "/b.obj", stage);
    writeText(folder + "/a.OBJ", stage);
    writeText(folder + "/b.mtl", "newmtl a\n");
    const std::string result = directory / "f.json";
    const ProgramResult fit = runShadowdag(
        directory, {"fit", folder, "-o", result, "--lights", "4", "--size", "32x18", "--methods",
                    "dag", "--max", "1", "--minimise", "bytes", "--no-charts", "--json"});
    ASSERT_EQ(fit.status, 0) << fit.err;
    const Json scenes = Json::parse(readText(result)).at("scenes");
    ASSERT_EQ(scenes.size(), 2u);
    EXPECT_EQ(scenes[0].at("scene"), "a.OBJ");
    EXPECT_EQ(scenes[1].at("scene"), "b.obj");
}

// A hybrid that draws no map is the method of rays that believes the same, not any.
TEST(Fit, RaysInPlaceOfAHybridBelieveTheSame) {
    const TemporaryDirectory directory;
    const std::string result = directory / "f.json";
    const ProgramResult fit = runShadowdag(directory, {"fit",          "builtin:fail-contact",
                                                       "-o",           result,
                                                       "--size",       "48x27",
                                                       "--frames",     "0",
                                                       "--methods",    "dag,hybrid",
                                                       "--resolution", "16",
                                                       "--believe",    "all,none",
                                                       "--thresholds", "100000",
                                                       "--taps",       "1",
                                                       "--repeats",    "2",
                                                       "--max",        "0",
                                                       "--no-charts",  "--json"});
    ASSERT_EQ(fit.status, 0) << fit.err;
    const Json chosen = fit.json().at("chosen");
    EXPECT_EQ(chosen.at("error").get<double>(), 0.0) << chosen.at("label");
    EXPECT_EQ(chosen.at("method"), "dag") << "which needs no map";
}

TEST(Fit, ErrorsAreReportedWithTheirStatus) {
    const TemporaryDirectory directory;
    const std::string f = directory / "f.json", scene = "builtin:fail-contact",
                      calibration = directory / "c.json", results = directory / "r.json";
    writeText(calibration, R"({"calibration": {"rays": [{"term": "samples", "ms": 1}],
                               "map": [{"term": "maps", "ms": 1}]}})");
    writeText(results, R"({"runs": [], "map_costs": []})");
    std::filesystem::create_directories(directory / "empty");
    writeText(directory / "mine.json", "{\"title\": \"Mine\"}");
    writeText(directory / "page.html", "<p>mine</p>");
    writeText(directory / "chart.png", "mine");
    std::filesystem::create_directories(directory / "folder.html");
    expectRefused(
        directory,
        {{{"fit", scene}, 1, "--output"},
         {{"fit", scene, "-o", f, "--metric", "psnr"}, 1, "must be one of false, visibility, flip"},
         {{"fit", scene, "-o", f, "--max", "2"}, 1, "--max '2'"},
         {{"fit", scene, "-o", f, "--minimise", "watts"}, 1, "must be one of time, bytes"},
         {{"fit", scene, "-o", f, "--methods", "embree"}, 1, "must be one of dag, maps, hybrid"},
         {{"fit", scene, "-o", f, "--bias", "1,2"}, 1, "--bias: fit does not vary it"},
         {{"fit", scene, "-o", f, "--beams", "0,256M"}, 1, "--beams: fit does not vary it"},
         {{"fit", scene, "-o", f, "--start", "cold,warm"}, 1, "--start: fit does not vary it"},
         {{"fit", scene, "--costs", calibration, "-o", calibration}, 1, "c.json"},
         {{"fit", scene, "-o", results}, 1, "r.json': would replace results of compare"},
         {{"fit", scene, "-o", f, "--repeats", "1"}, 1, "--repeats '1'"},
         {{"fit", scene, "-o", f, "--minimise", "bytes", "--repeats", "3"}, 1, "is for times"},
         {{"fit", scene, "-o", f, "--model", "oracle"}, 1, "--model 'oracle': routes by"},
         {{"fit", scene, "-o", f, "--model", "cost"}, 1, "--costs"},
         {{"fit", scene, "-o", f, "--methods", "hybrid", "--thresholds", "0,inf"},
          1,
          "select no model"},
         {{"fit", directory / "empty", "-o", f}, 2, "contains no file of a scene, such as .glb"},
         {{"fit", "no.glb", "-o", f}, 2, "no.glb"},
         {{"fit", scene, "-o", directory / "no/f.json"}, 3, "create it first"},
         {{"fit", scene, "-o", f, "--experiment-out", directory / "./f.json"}, 1, "are one file"},
         {{"fit", scene, "-o", directory / "f.svg"}, 1, "f.svg are one file"},
         {{"fit", scene, "-o", f, "--experiment-out", directory / "mine.json"},
          1,
          "mine.json': is a file that no fit wrote"},
         {{"fit", scene, "-o", directory / "page.json", "--no-charts"},
          1,
          "page.html: is a file that no fit wrote"},
         {{"fit", scene, "-o", directory / "chart.json"},
          1,
          "chart.png: is a file that no fit wrote"},
         {{"fit", scene, "-o", directory / "folder.json"}, 3, "folder.html: is a directory"},
         {{"fit", scene, "-o", f, "--experiment-out", directory / "f.png"},
          1,
          "f.png are one file"},
         {{"fit", scene, "-o", f, "--methods", "dag", "--taps", "1"},
          1,
          "--taps is for methods that draw maps"},
         {{"fit", scene, "-o", f, "--resolution", "64", "--lod", "0,7"},
          1,
          "--lod '7': 64^3 voxels have levels 0 to 6"},
         {{"fit", scene, "-o", f, "--methods", "maps", "--lod", "1"}, 1, "--lod is for rays"},
         {{"fit", scene, "-o", f, "--methods", "dag", "--thresholds", "9"},
          1,
          "--thresholds is for method hybrid"},
         {{"fit", scene, scene, "-o", f}, 1, "given twice"}});
    EXPECT_EQ(readText(directory / "mine.json"), "{\"title\": \"Mine\"}");
    EXPECT_EQ(readText(directory / "page.html"), "<p>mine</p>");
}

} // namespace shadowdag
