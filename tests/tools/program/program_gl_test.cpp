// SPDX-License-Identifier: Apache-2.0
// `--backend gl` from end to end: commands without OpenGL run without it; unsupported options are
// refused by name, or omitted with a message if they come from a list.
#include "cuda/error.h"
#include "gl/context.h"
#include "tests/tools/program/end_by_signal.h"
#include "tests/tools/program/program_refusals.h"

#include <chrono>
#include <csignal>
#include <filesystem>
#include <thread>

namespace shadowdag {

namespace {

using testing::AllOf;
using testing::HasSubstr;

/// The program where EGL finds no driver.
const Arguments kNoEgl{"/usr/bin/env", "__EGL_VENDOR_LIBRARY_FILENAMES=/nowhere.json"};

class ProgramGl : public testing::Test {
protected:
    void SetUp() override {
        try {
            glDeviceInfo();
        } catch (const Error& error) {
            GTEST_SKIP() << error.what();
        }
    }
    const TemporaryDirectory directory;
};

Arguments tinyCompare(const std::string& output, const Arguments& more) {
    Arguments arguments{"compare", "-o", output, "--backend", "gl", "--json", "--no-charts"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
}

} // namespace

TEST_F(ProgramGl, CommandsWithoutFramesDoNotOpenOpenGl) {
    const std::string asset = directory / "a.svdag";
    const ProgramResult built = runShadowdag(
        directory,
        {"voxelize", "builtin:atrium", "-o", asset, "--resolution", "32", "--backend", "gl"},
        kNoEgl);
    EXPECT_EQ(built.status, 0) << built.err;
    const ProgramResult shown = runShadowdag(directory, {"info", asset, "--backend", "gl"}, kNoEgl);
    EXPECT_EQ(shown.status, 0) << shown.err;
    const ProgramResult figures = runShadowdag(
        directory, {"figures", directory / "none.json", "-o", directory / "f", "--backend", "gl"},
        kNoEgl);
    EXPECT_THAT(figures.err, HasSubstr("none.json: cannot be opened")); // that, and not OpenGL
    const ProgramResult fitted = runShadowdag(directory,
                                              {"calibrate", "--from", directory / "none.json", "-o",
                                               directory / "c.json", "--backend", "gl"},
                                              kNoEgl);
    EXPECT_THAT(fitted.err, HasSubstr("none.json: cannot be opened"));
    const ProgramResult drawn = runShadowdag(
        directory, {"render", "builtin:atrium", "-o", directory / "a.exr", "--backend", "gl"},
        kNoEgl);
    EXPECT_EQ(drawn.status, int(ErrorKind::kDevice));
    EXPECT_THAT(drawn.err, HasSubstr("no OpenGL 4.5"));
}

TEST_F(ProgramGl, UnsupportedOptionsAreRefusedByName) {
    const std::string output = directory / "out", exr = directory / "a.exr",
                      json = directory / "f.json";
    const auto render = [&](const Arguments& more) {
        Arguments arguments{"render", "builtin:atrium", "-o", exr, "--backend", "gl"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return arguments;
    };
    const auto compare = [&](const Arguments& more) {
        Arguments arguments = tinyCompare(output, {"builtin:atrium"});
        arguments.insert(arguments.end(), more.begin(), more.end());
        return arguments;
    };
    expectRefused(
        directory,
        {{render({"--method", "dag", "--believe", "none"}), 1,
          "--believe 'none': --backend gl believes all voxels"},
         {render({"--method", "dag", "--lod", "2"}), 1, "--lod '2': --backend gl traces voxels of"},
         {render({"--method", "maps", "--polygon-lod", "1"}), 1, "--polygon-lod '1': --backend gl"},
         {render({"--variant", "PMCD-SOR"}), 1, "--variant 'PMCD-SOR': --backend gl frees pages"},
         {compare({"--believe", "all,2"}), 1, "--believe '2': --backend gl"},
         {compare({"--lod", "0,footprint"}), 1, "--lod 'footprint': --backend gl"},
         {compare({"--variants", "CFM,PMCD-EB-PLOD1"}), 1,
          "--variants 'PMCD-EB-PLOD1': --backend gl draws full detail"},
         {{"view", "--lod", "footprint", "--backend", "gl"}, 1, "--lod 'footprint': --backend gl"},
         {{"view", "--polygon-lod", "1", "--backend", "gl"},
          1,
          "--polygon-lod '1': --backend gl draws full detail"},
         {{"study", "stability", "-o", output, "--backend", "gl"},
          1,
          "--backend gl: study stability needs rays against triangles"},
         {{"study", "ablation", "-o", output, "--backend", "gl"},
          1,
          "--backend gl: study ablation needs rays against triangles, and retained pages"},
         {{"study", "real", "builtin:atrium", "-o", output, "--backend", "gl"},
          1,
          "--backend gl: study real needs rays against triangles"},
         {{"fit", "builtin:atrium", "-o", json, "--believe", "none", "--backend", "gl"},
          1,
          "--believe 'none': --backend gl"}});
    EXPECT_FALSE(std::filesystem::exists(output)) << "nothing was put there";
    EXPECT_FALSE(std::filesystem::exists(exr));
    EXPECT_FALSE(std::filesystem::exists(json));
}

TEST_F(ProgramGl, AListOmitsUnsupportedMethodsAndReportsIt) {
    const std::string file = directory / "e.json", report = directory / "report";
    const auto leavesOut = [&](const std::string& key, const std::string& list,
                               const std::string& left) {
        SCOPED_TRACE(list);
        writeText(file, R"({"scenes": ["builtin:fail-acne"], ")" + key + "\": " + list +
                            (key == "believe" ? R"(, "methods": ["dag", "maps", "hybrid"])" : "") +
                            R"(, "size": "48x27", "resolutions": [32], "repeats": 1,
                                "warmups": 0})");
        const std::string to = report + "-" + key;
        const ProgramResult result =
            runShadowdag(directory, tinyCompare(to, {"--experiment", file}));
        ASSERT_EQ(result.status, 0) << result.err;
        EXPECT_THAT(result.err, HasSubstr("omitted: " + left));
        const Json results = Json::parse(readText(to + "/results.json"));
        // Variants have Embree beside them.
        EXPECT_EQ(results["provenance"]["left_out"].size(), key == "variants" ? 2u : 1u);
        EXPECT_THAT(readText(to + "/index.html"), HasSubstr("Omitted: " + left));
    };
    leavesOut("believe", R"(["none", "all"])", "believe none: --backend gl believes all voxels");
    leavesOut("methods", R"(["dag", "embree"])",
              "method embree: --backend gl has no rays of Embree");
    leavesOut("variants", R"(["CFM", "CFM-PLOD1"])",
              "variant CFM-PLOD1: --backend gl draws full detail");
    // No level of detail but the default's.
    writeText(file, R"({"scenes": ["builtin:fail-acne"], "methods": ["dag"], "lod": ["footprint"],
                        "size": "48x27", "resolutions": [32], "repeats": 1, "warmups": 0})");
    const ProgramResult rest =
        runShadowdag(directory, tinyCompare(directory / "plain", {"--experiment", file}));
    ASSERT_EQ(rest.status, 0) << rest.err;
    EXPECT_THAT(rest.err, HasSubstr("without a level of detail (--lod); 0 instead"));
    // Nothing but that: refused, and nothing is put away.
    const std::string other = directory / "other";
    writeText(file, R"({"scenes": ["builtin:fail-acne"], "methods": [], "variants": ["CFM-PLOD1"],
                        "size": "48x27"})");
    expectRefused(directory, {{tinyCompare(other, {"--experiment", file}), 1,
                               "variant CFM-PLOD1: --backend gl draws full detail"}});
    EXPECT_FALSE(std::filesystem::exists(other));
}

TEST_F(ProgramGl, TheMatrixAndTheFitOmitExactRays) {
    const std::string report = directory / "report", fit = directory / "f.json";
    const ProgramResult matrix =
        runShadowdag(directory, {"study", "failures", "--only", "acne", "-o", report, "--json",
                                 "--backend", "gl"});
    ASSERT_EQ(matrix.status, 0) << matrix.err;
    EXPECT_THAT(matrix.err,
                HasSubstr("omitted: acne by dag believe none: --backend gl believes all voxels"));
    const Json json = Json::parse(readText(report + "/failures.json"));
    ASSERT_EQ(json["left_out"].size(), 1u);
    EXPECT_EQ(json["left_out"][0]["method"], "dag believe none");
    EXPECT_EQ(json["cells"].size(), 4u); // maps twice, dag, hybrid
    EXPECT_THAT(readText(report + "/index.html"),
                HasSubstr("acne by dag believe none: --backend gl"));
    const ProgramResult fitted =
        runShadowdag(directory, {"fit", "builtin:fail-acne", "-o", fit, "--size", "32x18",
                                 "--resolution", "32", "--thresholds", "96", "--max", "1",
                                 "--minimise", "bytes", "--no-charts", "--backend", "gl"});
    ASSERT_EQ(fitted.status, 0) << fitted.err;
    EXPECT_THAT(fitted.err, HasSubstr("omitted: believe none: --backend gl believes all voxels"));
    EXPECT_EQ(Json::parse(readText(fit))["provenance"]["left_out"].size(), 1u);
}

// What is refused needs neither a window nor OpenGL to say so.
TEST_F(ProgramGl, TheWindowRefusesMethodsByTheirOption) {
    const ProgramResult result =
        runShadowdag(directory, {"view", "builtin:atrium", "--believe", "2", "--backend", "gl"});
    EXPECT_EQ(result.status, 1);
    EXPECT_THAT(result.err, HasSubstr("--believe '2'"));
    const ProgramResult camera =
        runShadowdag(directory, {"view", "builtin:atrium", "--camera", "1,2,3"}, kNoEgl);
    EXPECT_EQ(camera.status, 1);
    EXPECT_THAT(camera.err, HasSubstr("--camera '1,2,3': must be six numbers"));
}

// The truth's picture draws no maps, which would be thrown away.
TEST_F(ProgramGl, TheTruthsPictureDrawsNoMaps) {
    const ProgramResult result =
        runShadowdag(directory, {"render", "builtin:fail-silhouette", "--size", "64x36", "--method",
                                 "truth", "--backend", "gl", "--json", "-o", directory / "a.png"});
    ASSERT_EQ(result.status, 0) << result.err;
    EXPECT_FALSE(result.json()["frames"][0].contains("stages_ms"));
    EXPECT_GT(result.json()["frames"][0]["pair_count"], 0);
}

// A picture by a slow driver, whose one shading pass takes longer than anybody waits: it is heard
// between the pieces of the pass.
TEST_F(ProgramGl, AnInterruptEndsAFrameAndLeavesNoFile) {
    const std::string picture = directory / "a.png";
    const pid_t child = startProgram(directory,
                                     {"render", "builtin:atrium", "--method", "maps", "--backend",
                                      "gl", "--size", "3840x2160", "-o", picture},
                                     directory / "out", directory / "err");
    std::this_thread::sleep_for(std::chrono::seconds(4));
    const test::EndBySignal end = test::endBySignal(child, SIGINT);
    if (end.status == 0)
        GTEST_SKIP() << "the picture was there before the signal";
    std::printf("ended after %.1f s\n", end.seconds);
    EXPECT_EQ(end.status, 128 + SIGINT);
    EXPECT_LT(end.seconds, 10.0) << end; // the whole picture takes half a minute and more
    EXPECT_THAT(readText(directory / "err"), HasSubstr("interrupted"));
    for (const auto& entry : std::filesystem::directory_iterator(directory.path()))
        EXPECT_THAT(entry.path().filename().string(), testing::Not(HasSubstr("a.png")));
}

} // namespace shadowdag
