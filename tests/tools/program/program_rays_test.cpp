// SPDX-License-Identifier: Apache-2.0
// `shadowdag rays` from end to end: a set is written, ten lines of numpy answer it as docs/rays.md
// has them, a plug-in answers it too, and both are rows and points of a chart.
#include "tests/tools/program/program_runner.h"
#include "tests/tools/report/report_runner.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sys/stat.h>

#include <filesystem>

namespace shadowdag {
namespace {

using testing::HasSubstr;

/// Returns the lines of a document between two marks.
std::string between(const std::string& text, const std::string& from, const std::string& to) {
    const size_t begin = text.find(from) + from.size();
    return text.substr(begin, text.find(to, begin) - begin);
}

TEST(ProgramRays, AStrangersAnswersAreScoredAndDrawn) {
    const TemporaryDirectory directory;
    const std::string set = directory / "set.npz", answers = directory / "numpy.npz",
                      rows = directory / "rows";
    ProgramResult result = runShadowdag(
        directory, {"rays", "builtin:fail-contact", "--size", "64x36", "-o", set, "--json"});
    ASSERT_EQ(result.status, 0) << result.err;
    const uint64_t pairs = result.json()["pair_count"];
    EXPECT_GT(pairs, 500u);

    const std::string document = readText(SDAG_SOURCE_DIR "/docs/rays.md");
    writeText(directory / "answer.py", between(document, "```python\n", "```"));
    std::string said;
    ASSERT_EQ(runProgram({"/usr/bin/python3", directory / "answer.py", set, answers}, &said), 0)
        << said;

    result = runShadowdag(directory, {"rays", set, "--answer", answers, "--tracer",
                                      SDAG_EMBREE_TRACER, "--repeats", "2", "-o", rows, "--json"});
    ASSERT_EQ(result.status, 0) << result.err;
    const Json results = result.json();
    ASSERT_EQ(results["runs"].size(), 2u);
    for (const Json& run : results["runs"]) {
        EXPECT_EQ(run["pair_count"], pairs);
        EXPECT_LT(run["false_shadow_count"].get<uint64_t>() +
                      run["false_light_count"].get<uint64_t>(),
                  pairs / 50)
            << run["label"];
        EXPECT_GT(run["occluded_count"], 20) << "the scene has a shadow";
    }
    EXPECT_EQ(results["runs"][1]["repeat_count"], 2);
    EXPECT_THAT(readText(rows + "/index.html"), HasSubstr("Embree, robust"));
    EXPECT_THAT(readText(rows + "/tracers.csv"), HasSubstr("proven_wrong_count"));
    ASSERT_EQ(runReport({"charts", rows + "/tracers.json", "-o", directory / "charts"}, &said), 0)
        << said;
    EXPECT_THAT(readText(directory / "charts/charts.json"), HasSubstr("speed_accuracy"));
    EXPECT_THAT(readText(directory / "charts/speed_accuracy_builtin_fail_contact.svg"),
                HasSubstr("Embree, robust"));
}

TEST(ProgramRays, ASetOfASceneIsTheOneThatWasWritten) {
    const TemporaryDirectory directory;
    const std::string set = directory / "set.rays";
    const std::vector<std::string> view = {"--size", "32x18"};
    ProgramResult result = runShadowdag(
        directory, {"rays", "builtin:fail-wires", view[0], view[1], "-o", set, "--json"});
    ASSERT_EQ(result.status, 0) << result.err;
    const std::string id = result.json()["set_id"];
    for (const std::vector<std::string>& scene :
         {std::vector<std::string>{set}, {"builtin:fail-wires", view[0], view[1]}}) {
        std::vector<std::string> arguments = {"rays"};
        arguments.insert(arguments.end(), scene.begin(), scene.end());
        arguments.insert(arguments.end(), {"--tracer", SDAG_EMBREE_TRACER, "--repeats", "1", "-o",
                                           directory / "rows", "--json"});
        result = runShadowdag(directory, arguments);
        ASSERT_EQ(result.status, 0) << result.err;
        EXPECT_EQ(result.json()["set_id"], id);
    }
}

TEST(ProgramRays, RowsReplaceNoFilesOfOthers) {
    const TemporaryDirectory directory;
    const std::string set = directory / "set.npz", mine = directory / "mine",
                      rows = directory / "rows";
    ASSERT_EQ(
        runShadowdag(directory, {"rays", "builtin:fail-contact", "--size", "32x18", "-o", set})
            .status,
        0);
    const auto score = [&](const std::string& output) {
        return runShadowdag(directory, {"rays", set, "--tracer", SDAG_EMBREE_TRACER, "--repeats",
                                        "1", "-o", output});
    };
    std::filesystem::create_directory(mine);
    writeText(mine + "/index.html", "my own page");
    const ProgramResult refused = score(mine);
    EXPECT_EQ(refused.status, 1);
    EXPECT_THAT(refused.err, HasSubstr("contains index.html, which this command did not write"));
    EXPECT_EQ(readText(mine + "/index.html"), "my own page");
    ASSERT_EQ(score(rows).status, 0);
    EXPECT_EQ(score(rows).status, 0) << "its own rows";
    const ProgramResult compared =
        runShadowdag(directory, {"compare", "builtin:fail-contact", "-o", rows, "--no-charts"});
    EXPECT_EQ(compared.status, 1);
    EXPECT_THAT(compared.err, HasSubstr("holds the rows of tracers that rays wrote"));
}

TEST(ProgramRays, ContradictionsAreRefused) {
    const TemporaryDirectory directory;
    const auto refusal = [&](const std::vector<std::string>& arguments) {
        std::vector<std::string> all = {"rays"};
        all.insert(all.end(), arguments.begin(), arguments.end());
        const ProgramResult result = runShadowdag(directory, all);
        EXPECT_EQ(result.status, 1) << result.err;
        return result.err;
    };
    EXPECT_THAT(refusal({"builtin:fail-wires", "-o", directory / "rows"}),
                HasSubstr("a ray set is a .rays or .npz file"));
    EXPECT_THAT(refusal({"builtin:fail-wires", "--answer", "a.npz", "-o", "set.npz"}),
                HasSubstr("rows of tracers need a directory"));
    EXPECT_THAT(refusal({"set.npz", "--size", "8x8", "--answer", "a.npz", "-o", "rows"}),
                HasSubstr("--size chooses a frame, and SCENE is a ray set"));
    EXPECT_THAT(refusal({"builtin:fail-wires", "--repeats", "3", "-o", "set.npz"}),
                HasSubstr("--repeats is for --tracer"));
    const ProgramResult missing = runShadowdag(directory, {"rays", "builtin:fail-wires", "--tracer",
                                                           "nowhere.so", "-o", directory / "rows"});
    EXPECT_EQ(missing.status, 2);
    EXPECT_THAT(missing.err, HasSubstr("--tracer nowhere.so: cannot be opened: No such file"));
    ASSERT_EQ(mkfifo((directory / "pipe.so").c_str(), 0600), 0);
    const ProgramResult pipe = runShadowdag(
        directory,
        {"rays", "builtin:fail-wires", "--tracer", directory / "pipe.so", "-o", directory / "rows"},
        {"/usr/bin/timeout", "20"});
    EXPECT_EQ(pipe.status, 2);
    EXPECT_THAT(pipe.err, HasSubstr("pipe.so: is a pipe, where a regular file is read"));
    EXPECT_FALSE(std::filesystem::exists(directory / "rows"));
}

} // namespace
} // namespace shadowdag
