// SPDX-License-Identifier: Apache-2.0
// `shadowdag diff` through the built program: its exit status, its text and its JSON.
#include "tests/tools/program/program_refusals.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#if !defined(SDAG_SOURCE_DIR)
#define SDAG_SOURCE_DIR "."
#endif

namespace shadowdag {
namespace {

using testing::HasSubstr;

const std::string kAtrium = SDAG_SOURCE_DIR "/tests/bench/results/compare-atrium.json";
const std::string kTracers = SDAG_SOURCE_DIR "/tests/bench/results/tracers-atrium.json";

/// Returns the committed result with twelve pairs of acne more.
Json withMoreAcne() {
    Json results = Json::parse(readText(kAtrium));
    Json& count = results["runs"][3]["acne_count"];
    count = count.get<uint64_t>() + 12;
    return results;
}

TEST(Diff, EndsWithFiveWhereSomethingIsWorse) {
    const TemporaryDirectory directory;
    const Json worse = withMoreAcne();
    const uint64_t more = worse["runs"][3]["acne_count"];
    writeText(directory / "results.json", worse.dump());
    const ProgramResult same = runShadowdag(directory, {"diff", kAtrium, kAtrium});
    EXPECT_EQ(same.status, 0) << same.err;
    EXPECT_THAT(same.out, HasSubstr("0 worse, 0 better, 0 changed otherwise"));
    const ProgramResult text = runShadowdag(directory, {"diff", kAtrium, directory.path()});
    EXPECT_EQ(text.status, 5);
    EXPECT_THAT(text.out, HasSubstr("acne_count " + std::to_string(more - 12) + " -> " +
                                    std::to_string(more)));
    EXPECT_THAT(text.err, HasSubstr("has 1 worse value than "));
    const ProgramResult json =
        runShadowdag(directory, {"diff", kAtrium, directory / "results.json", "--json"});
    EXPECT_EQ(json.status, 5);
    EXPECT_EQ(json.json()["worse_count"], 1);
    EXPECT_EQ(json.json()["changes"][0]["verdict"], "worse");
    // The other way round it is better.
    EXPECT_EQ(runShadowdag(directory, {"diff", directory.path(), kAtrium}).status, 0);
}

// What changes a count of a method or of the judge has to change the committed file, too.
TEST(Diff, CountsOfASmallExperimentAreTheCommittedOnes) {
    const TemporaryDirectory directory;
    const std::string source = SDAG_SOURCE_DIR;
    const ProgramResult measured = runShadowdag(
        directory, {"compare", "--experiment", source + "/scenes/experiments/small.json", "-o",
                    directory / "report", "--no-charts"});
    ASSERT_EQ(measured.status, 0) << measured.err;
    const ProgramResult result =
        runShadowdag(directory, {"diff", source + "/tests/bench/results/small.json",
                                 directory / "report", "--no-times"});
    EXPECT_EQ(result.status, 0) << result.out << result.err;
    EXPECT_THAT(result.out, HasSubstr("0 worse, 0 better, 0 changed otherwise"));
}

TEST(Diff, EndsWithFiveWhereAValueIsMissingAndWithTwoWhereItIsNone) {
    const TemporaryDirectory directory;
    Json results = Json::parse(readText(kAtrium));
    results["runs"][3].erase("flip");
    writeText(directory / "results.json", results.dump());
    const ProgramResult lacking = runShadowdag(directory, {"diff", kAtrium, directory.path()});
    EXPECT_EQ(lacking.status, 5);
    EXPECT_THAT(lacking.out, HasSubstr(": flip\n"));
    EXPECT_THAT(lacking.err, HasSubstr("lacks 0 rows and 1 value of other rows"));
    EXPECT_EQ(runShadowdag(directory, {"diff", directory.path(), kAtrium}).status, 0);
    results["runs"][3]["flip"] = "5";
    writeText(directory / "results.json", results.dump());
    expectRefused(directory, {{{"diff", kAtrium, directory.path()}, 2, "\"flip\" is \"5\""}});
    results["map_costs"] = 7;
    writeText(directory / "results.json", results.dump());
    expectRefused(directory, {{{"diff", kAtrium, directory.path()}, 2, "\"map_costs\" is 7"}});
}

TEST(Diff, WritesAPageWithItsData) {
    const TemporaryDirectory directory;
    const Json worse = withMoreAcne();
    const std::string more = std::to_string(worse["runs"][3]["acne_count"].get<uint64_t>());
    writeText(directory / "results.json", worse.dump());
    const std::string page = directory / "d.html";
    const std::vector<std::string> command{"diff", kAtrium, directory / "results.json", "-o", page};
    const ProgramResult result = runShadowdag(directory, command);
    EXPECT_EQ(result.status, 5) << result.err;
    EXPECT_THAT(result.out, HasSubstr("page: " + page));
    EXPECT_THAT(readText(page),
                HasSubstr("<td data-v=\"" + more + ".000000000\">" + more + "</td>"));
    EXPECT_EQ(Json::parse(readText(directory / "d.json"))["worse_count"], 1);
    EXPECT_EQ(runShadowdag(directory, command).status, 5) << "an earlier difference is replaced";
    const std::string results = directory / "results.html", text = directory / "d.txt";
    expectRefused(directory,
                  {{{"diff", kAtrium, kAtrium, "-o", results}, 1, "is no earlier difference"},
                   {{"diff", kAtrium, kAtrium, "-o", text}, 1, "as F.html and F.json"}});
    EXPECT_EQ(readText(directory / "results.json"), worse.dump());
    const std::string foreign = directory / "foreign.html";
    writeText(foreign, "a page of another program");
    expectRefused(directory, {{{"diff", kAtrium, kAtrium, "-o", foreign},
                               1,
                               "the page would replace " + foreign + ", which is no earlier"}});
    EXPECT_EQ(readText(foreign), "a page of another program");
    EXPECT_FALSE(std::filesystem::exists(directory / "foreign.json"));
    writeText(directory / "jinja2.py", "raise ModuleNotFoundError");
    setenv("PYTHONPATH", directory.path().c_str(), 1);
    expectRefused(directory, {{command, 1, "apt-get install python3-jinja2, or leave out -o"}});
    unsetenv("PYTHONPATH");
    setenv("PYTHONHOME", directory.path().c_str(), 1);
    expectRefused(directory,
                  {{command, 1, "unset PYTHONHOME, which is '" + directory.path() + "'"}});
    unsetenv("PYTHONHOME");
}

TEST(Diff, RefusesWhatCannotBeCompared) {
    const TemporaryDirectory directory;
    writeText(directory / "other.json", "{}");
    Json other = Json::parse(readText(kAtrium));
    other["provenance"]["cpu"] = "another";
    writeText(directory / "machine.json", other.dump());
    const std::string machine = directory / "machine.json";
    expectRefused(
        directory,
        {{{"diff", kAtrium}, 1, "required"},
         {{"diff", kAtrium, directory / "none.json"}, 2, "none.json"},
         {{"diff", kAtrium, directory / "other.json"}, 2, "is no result of compare"},
         {{"diff", kAtrium, directory.path()}, 2, "holds no results"},
         {{"diff", kAtrium, kTracers}, 1, "one is a result of compare, the other of rays"},
         {{"diff", kAtrium, machine}, 1, "--allow machine"},
         {{"diff", kAtrium, machine, "--allow", "cpu"}, 1, "--allow 'cpu'"}});
    EXPECT_EQ(runShadowdag(directory, {"diff", kAtrium, machine, "--allow", "machine"}).status, 0);
    // Two processors of one name; a result that does not say which it was may be of either.
    const std::string narrow = directory / "narrow.json", unsaid = directory / "unsaid.json";
    other = Json::parse(readText(kAtrium));
    for (const auto& [path, isa] :
         {std::pair(machine, "AVX-512"), {narrow, "AVX2"}, {unsaid, ""}}) {
        other["provenance"]["vector_instructions"] = isa;
        if (path == unsaid)
            other["provenance"].erase("vector_instructions");
        writeText(path, other.dump());
    }
    expectRefused(directory, {{{"diff", machine, narrow}, 1, "vector_instructions"}});
    EXPECT_EQ(runShadowdag(directory, {"diff", unsaid, narrow}).status, 0);
    EXPECT_EQ(runShadowdag(directory, {"diff", kAtrium, machine, "--no-times"}).status, 0);
}

TEST(Diff, NamesDoNotReachTheTerminalAsControlCharacters) {
    const TemporaryDirectory directory;
    const std::string name = directory / "b\x1b[31m.json";
    writeText(name, withMoreAcne().dump());
    const ProgramResult result = runShadowdag(directory, {"diff", kAtrium, name});
    EXPECT_EQ(result.status, 5);
    EXPECT_THAT(result.err, HasSubstr("b\\x1b[31m.json has 1 worse value than "));
    EXPECT_THAT(result.err, testing::Not(HasSubstr("\x1b")));
}

} // namespace
} // namespace shadowdag
