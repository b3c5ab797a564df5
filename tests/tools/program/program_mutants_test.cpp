// SPDX-License-Identifier: Apache-2.0
// `shadowdag study mutants` from end to end: a few faults, each in a process of its own, are
// noticed, and without one nothing complains.
#include "tests/tools/program/program_runner.h"

#include "cuda/mutant.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace shadowdag {
namespace {

using testing::HasSubstr;

std::vector<std::string> checksOf(const Json& results, const std::string& name) {
    std::vector<std::string> checks;
    for (const Json& mutant : results["mutants"])
        if (mutant["name"] == name)
            for (const Json& notice : mutant["notices"])
                checks.push_back(notice["check"]);
    return checks;
}

TEST(StudyMutants, FaultsAreNoticedByTheChecksThatTheyViolate) {
    if (!kHasMutants)
        GTEST_SKIP() << "built without assertions";
    const TemporaryDirectory directory;
    const std::string report = directory / "report";
    const ProgramResult result =
        runShadowdag(directory, {"study", "mutants", "--only",
                                 "none,light-short,order-without-maps,exact-lane-lost,ray-lane-"
                                 "lost,map-seam-clamped,sample-moved",
                                 "-o", report, "--json"});
    ASSERT_EQ(result.status, 0) << result.err;
    EXPECT_EQ(result.json()["fault_count"], 6);
    EXPECT_EQ(result.json()["noticed_count"], 6);
    const Json results = Json::parse(readText(report + "/mutants.json"));
    EXPECT_THAT(checksOf(results, "none"), testing::IsEmpty());
    EXPECT_THAT(checksOf(results, "light-short"), testing::Contains("pairs"));
    EXPECT_THAT(checksOf(results, "order-without-maps"), testing::Contains("picture"));
    EXPECT_THAT(checksOf(results, "exact-lane-lost"), testing::Contains("exact"));
    EXPECT_THAT(checksOf(results, "ray-lane-lost"), testing::Contains("other way"));
    EXPECT_THAT(checksOf(results, "map-seam-clamped"), testing::Contains("lookup"));
    EXPECT_THAT(checksOf(results, "sample-moved"), testing::Contains("samples"));
    for (const Json& mutant : results["mutants"]) {
        EXPECT_FALSE(mutant.contains("cells")) << mutant["name"];
        const bool addsWrongPairs = mutant["name"] == "ray-lane-lost";
        if (addsWrongPairs) {
            EXPECT_GT(mutant["excess"].at(0)["wrong_count"], 100);
        }
    }
    EXPECT_THAT(readText(report + "/index.html"), HasSubstr("light-short"));
    EXPECT_THAT(readText(report + "/mutants.csv"), HasSubstr("order-without-maps"));
}

// Faults that no comparison with the truth shows, because the truth is asked about the frame's own
// pairs.
TEST(StudyMutants, ValidateSeesWhatIsWrongWithTheFrameItself) {
    if (!kHasMutants)
        GTEST_SKIP() << "built without assertions";
    const TemporaryDirectory directory;
    const auto checks = [&](const char* fault, const char* scene,
                            const std::vector<std::string>& options) {
        std::vector<std::string> before; // without a fault the variable is not set
        if (*fault != '\0')
            before = {"/usr/bin/env", std::string("SHADOWDAG_MUTANT=") + fault};
        std::vector<std::string> line = {"validate", scene, "--size", "256x144", "--json"};
        line.insert(line.end(), options.begin(), options.end());
        const ProgramResult result = runShadowdag(directory, line, before);
        EXPECT_EQ(result.status, 0) << result.err;
        Json found = result.json()["self_checks"];
        found.erase("adjudicated_count"); // wrong, but not yet a fault
        found.erase("ambiguous_count");
        uint64_t all = 0;
        for (const auto& [name, count] : found.items())
            all += count.get<uint64_t>();
        EXPECT_EQ(all > 0,
                  result.err.find("the frame is not what its method promises") != std::string::npos)
            << result.err;
        return found;
    };
    for (const char* method : {"dag", "maps"}) {
        const Json healthy = checks("", "builtin:fail-sun", {"--method", method});
        EXPECT_EQ(healthy.size(), 9u);
        for (const auto& [name, count] : healthy.items())
            EXPECT_EQ(count, 0) << name << " by " << method;
    }
    EXPECT_GT(
        checks("light-short", "builtin:fail-sun", {"--method", "dag"})["wrong_list_pair_count"],
        50);
    EXPECT_GT(
        checks("sample-moved", "builtin:fail-sun", {"--method", "dag"})["misplaced_sample_count"],
        1000);
    EXPECT_GT(checks("order-without-maps", "builtin:fail-alpha",
                     {"--variant", "PMCD-EB-RL"})["wrong_color_count"],
              10);
    EXPECT_GT(
        checks("routes-swapped", "builtin:fail-alpha", {"--method", "maps"})["wrong_lookup_count"],
        1000);
    EXPECT_GT(
        checks("seen-batch-lost", "builtin:fail-wires", {"--method", "dag"})["hidden_sample_count"],
        20);
    EXPECT_GT(
        checks("exact-lane-lost", "builtin:fail-wires", {"--method", "dag"})["proven_wrong_count"],
        100);
    EXPECT_GT(
        checks("proof-blind", "builtin:fail-wires", {"--variant", "RT-LP"})["proven_wrong_count"],
        10);
    EXPECT_GT(checks("belief-too-wide", "builtin:fail-lantern",
                     {"--believe", "4"})["beyond_belief_count"],
              100);
    EXPECT_GT(checks("level-too-coarse", "builtin:fail-contact",
                     {"--believe", "all", "--lod", "footprint:8"})["coarser_cell_count"],
              50);
    EXPECT_GT(
        checks("map-face-halved", "builtin:fail-alpha", {"--method", "maps"})["coarser_map_count"],
        0);
}

TEST(StudyMutants, AVariableThatNamesNoFaultEndsTheProgram) {
    if (!kHasMutants)
        GTEST_SKIP() << "built without assertions";
    const TemporaryDirectory directory;
    const ProgramResult result =
        runShadowdag(directory, {"--version"}, {"/usr/bin/env", "SHADOWDAG_MUTANT=dag-eaten"});
    EXPECT_EQ(result.status, 1);
    EXPECT_THAT(result.err, HasSubstr("environment: SHADOWDAG_MUTANT 'dag-eaten': names no fault"));
}

} // namespace
} // namespace shadowdag
