// SPDX-License-Identifier: Apache-2.0
// `shadowdag study ablation`, `study real` and `study scale` from end to end, small.
#include "tests/tools/program/program_runner.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

namespace shadowdag {
namespace {

using testing::HasSubstr;

TEST(CompareMechanisms, WritesPageTableJsonAndChart) {
    const TemporaryDirectory directory;
    const std::string report = directory / "report";
    const ProgramResult result = runShadowdag(
        directory, {"study", "ablation", "--only", "small-pages", "-o", report, "--json"});
    ASSERT_EQ(result.status, 0) << result.err;
    EXPECT_EQ(result.json()["mechanism_count"], 1);
    const Json json = Json::parse(readText(report + "/ablation.json"));
    ASSERT_EQ(json["mechanisms"].size(), 1u);
    const Json& row = json["mechanisms"][0];
    EXPECT_EQ(row["verdict"], "default on");
    EXPECT_EQ(row["agrees"], true);
    EXPECT_LT(row["bytes_ratio"].get<double>(), 0.9);
    EXPECT_EQ(row["error_ratio"], 1.0) << "pages hold texels; they do not change them";
    EXPECT_EQ(row["scenes"].size(), 3u);
    EXPECT_THAT(readText(report + "/index.html"), HasSubstr("charts/mechanisms.svg"));
    EXPECT_TRUE(std::filesystem::exists(report + "/charts/mechanisms.svg"));
    EXPECT_THAT(readText(report + "/ablation.csv"), HasSubstr("small-pages"));
    EXPECT_FALSE(std::filesystem::exists(report + "/partial"));
}

TEST(StudyScale, WritesPageTableJsonAndChartOfAUsersSceneAndFile) {
    const TemporaryDirectory directory;
    const std::string scene = directory / "box.glb", report = directory / "report";
    ASSERT_EQ(runShadowdag(directory, {"scene", "builtin:fail-contact", "-o", scene}).status, 0);
    const Json study = {{"kind", "scale"},
                        {"title", "Small"},
                        {"what", "A small scene."},
                        {"size", "96x54"},
                        {"repeats", 2},
                        {"rows",
                         {{{"name", "leaves"},
                           {"scene", "builtin:atrium"},
                           {"what", "Leaves."},
                           {"grow", "leaves"},
                           {"triangles", {200, 2000}},
                           {"resolutions", {64}}}}}};
    writeText(directory / "small.json", study.dump());
    const ProgramResult result =
        runShadowdag(directory, {"study", directory / "small.json", scene, "-o", report});
    ASSERT_EQ(result.status, 0) << result.err;
    EXPECT_THAT(result.out, HasSubstr("leaves-box by voxels 64: "));
    EXPECT_THAT(result.out, HasSubstr(" ns a pair"));
    const Json json = Json::parse(readText(report + "/scale.json"));
    EXPECT_EQ(json["crossovers"].size(), 4u);
    EXPECT_EQ(json["cells"].size(), 10u);
    EXPECT_TRUE(json.contains("other_cpu_share"));
    EXPECT_THAT(readText(report + "/index.html"), HasSubstr("charts/scale_leaves_box.svg"));
    EXPECT_TRUE(std::filesystem::exists(report + "/charts/scale_leaves_box.png"));
    EXPECT_THAT(readText(report + "/scale.csv"), HasSubstr("voxels 64"));
}

TEST(CompareReal, WritesPageTableJsonAndPictures) {
    const TemporaryDirectory directory;
    const std::string scene = directory / "box.glb", report = directory / "report";
    ASSERT_EQ(runShadowdag(directory, {"scene", "builtin:fail-contact", "-o", scene}).status, 0);
    const ProgramResult result =
        runShadowdag(directory, {"study", "real", scene, "-o", report, "--json"});
    ASSERT_EQ(result.status, 0) << result.err;
    const Json json = Json::parse(readText(report + "/real.json"));
    ASSERT_EQ(json["cells"].size(), 4u) << "a method each";
    for (const Json& cell : json["cells"]) {
        EXPECT_EQ(cell["scene"], "box");
        EXPECT_GT(cell["pair_count"].get<uint64_t>(), 0u);
        EXPECT_TRUE(cell["broken"].empty()) << cell;
    }
    EXPECT_THAT(readText(report + "/index.html"), HasSubstr("images/"));
    EXPECT_THAT(readText(report + "/real.csv"), HasSubstr("dag believe none"));
    EXPECT_FALSE(std::filesystem::exists(report + "/partial"));
}

// A module of another place in Python's path ends the package without a page.
TEST(CompareReports, APageThatWasNotWrittenIsAnError) {
    const TemporaryDirectory directory;
    const std::string report = directory / "report";
    std::filesystem::create_directory(directory / "modules");
    writeText(directory / "modules/jinja2.py", "raise SystemExit(0)\n");
    const ProgramResult result =
        runShadowdag(directory,
                     {"compare", "builtin:fail-acne", "-o", report, "--size", "16x9", "--methods",
                      "embree", "--repeats", "1", "--warmups", "0", "--no-charts"},
                     {"/usr/bin/env", "PYTHONPATH=" + (directory / "modules")});
    EXPECT_EQ(result.status, 3) << result.err;
    EXPECT_THAT(result.err, HasSubstr("reported success but did not write"));
    EXPECT_FALSE(std::filesystem::exists(report + "/results.json"));
}

// Without the Python packages nothing is measured for charts that cannot be drawn; without charts
// the data are written, and the missing packages are reported.
TEST(CompareReports, MissingPackagesAreNamedAndTheDataAreWritten) {
    const TemporaryDirectory directory;
    const std::string report = directory / "report";
    for (const char* module : {"jinja2", "matplotlib"})
        writeText(directory / (std::string(module) + ".py"), "raise ModuleNotFoundError");
    setenv("PYTHONPATH", directory.path().c_str(), 1);
    std::vector<std::string> arguments{
        "compare", "builtin:fail-acne", "--size", "32x18", "--methods", "maps",  "--repeats",
        "1",       "--warmups",         "0",      "-o",    report,      "--json"};
    const ProgramResult refused = runShadowdag(directory, arguments);
    const bool isThere = std::filesystem::exists(report);
    arguments.push_back("--no-charts");
    const ProgramResult result = runShadowdag(directory, arguments);
    unsetenv("PYTHONPATH");
    EXPECT_EQ(refused.status, 1);
    EXPECT_THAT(refused.err, HasSubstr("apt-get install python3-jinja2 python3-matplotlib, or pass "
                                       "--no-charts"));
    EXPECT_FALSE(isThere);
    ASSERT_EQ(result.status, 0) << result.err;
    EXPECT_THAT(result.err, HasSubstr("the page is omitted: the page needs /usr/bin/python3 with "
                                      "Jinja2: apt-get install python3-jinja2\n"));
    EXPECT_EQ(result.json()["report"], report + "/results.json");
    EXPECT_TRUE(std::filesystem::exists(report + "/results.csv"));
    EXPECT_FALSE(std::filesystem::exists(report + "/index.html"));
}

// What is refused leaves nothing behind, and what was there as it was.
TEST(CompareReports, ARefusalLeavesNoDirectory) {
    const TemporaryDirectory directory;
    const std::string report = directory / "report";
    for (const char* name : {"failures", "stability", "ablation"}) {
        EXPECT_EQ(
            runShadowdag(directory, {"study", name, "--only", "no-such-row", "-o", report}).status,
            1)
            << name;
        EXPECT_FALSE(std::filesystem::exists(report)) << name;
    }
    EXPECT_NE(runShadowdag(directory, {"study", "real", "no-such.glb", "-o", report}).status, 0);
    EXPECT_FALSE(std::filesystem::exists(report));
    std::filesystem::create_directory(report);
    EXPECT_EQ(runShadowdag(directory, {"study", "stability", "--only", "no-such-row", "-o", report})
                  .status,
              1);
    EXPECT_TRUE(std::filesystem::is_empty(report));
}

// Directories above the one that is named are no exception, nor are figures and plain compares,
// whatever is wrong; what an interrupted compare has finished survives a name that is wrong, and a
// link that leads nowhere stays.
TEST(CompareReports, ARefusalChangesNoExistingFile) {
    const TemporaryDirectory directory;
    const std::string deep = directory / "a/b/c";
    const std::string badGlb = directory / "bad.glb";
    writeText(badGlb, "no glTF");
    for (const std::vector<std::string>& arguments :
         std::vector<std::vector<std::string>>{{"compare", "no-such.glb"},
                                               {"compare", "builtin:hoses"},
                                               {"compare", badGlb},
                                               {"compare", "builtin:fail-acne", "--camera", "nope"},
                                               {"compare", "builtin:fail-acne", "--lights", "0"},
                                               {"study", "stability", "--only", "nope"},
                                               {"study", "real", badGlb},
                                               {"figures", badGlb}}) {
        std::vector<std::string> all = arguments;
        all.insert(all.end(), {"-o", deep});
        EXPECT_NE(runShadowdag(directory, all).status, 0) << arguments[1];
        EXPECT_FALSE(std::filesystem::exists(directory / "a")) << arguments[1];
    }
    // A journal with a finished part, as an interrupted compare leaves it.
    std::filesystem::create_directories(deep + "/partial");
    const std::string journal = R"({"key":"k","parts":{"p":1}})";
    writeText(deep + "/partial/journal.json", journal);
    EXPECT_NE(
        runShadowdag(directory, {"compare", "builtin:fail-acne", "no-such.glb", "-o", deep}).status,
        0);
    EXPECT_NE(runShadowdag(directory, {"study", "failures", "--only", "nope", "-o", deep}).status,
              0);
    EXPECT_EQ(readText(deep + "/partial/journal.json"), journal);
    const std::string link = directory / "link";
    std::filesystem::create_directory_symlink(directory / "not-mounted", link);
    for (const char* scene : {"builtin:fail-acne", "no-such.glb"})
        EXPECT_NE(runShadowdag(directory, {"compare", scene, "--size", "32x18", "-o", link}).status,
                  0);
    EXPECT_NE(runShadowdag(directory, {"figures", badGlb, "-o", link}).status, 0);
    EXPECT_TRUE(std::filesystem::is_symlink(link));
}

} // namespace
} // namespace shadowdag
