// SPDX-License-Identifier: Apache-2.0
// `shadowdag study adjudication` from end to end: it holds, and faults of exact rays break it.
#include "tests/tools/program/program_runner.h"

#include "cuda/mutant.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace shadowdag {
namespace {

using testing::HasSubstr;

TEST(StudyAdjudication, HoldsAndLeavesAReport) {
    const TemporaryDirectory directory;
    const std::string report = directory / "report";
    const ProgramResult result = runShadowdag(
        directory, {"study", "adjudication", "--only", "fail-contact", "-o", report, "--json"});
    ASSERT_EQ(result.status, 0) << result.err;
    EXPECT_EQ(result.json()["faultless_wrong_count"], 0);
    EXPECT_GT(result.json()["pair_count"], 10000);
    EXPECT_EQ(result.json()["disputed_count"], result.json()["disputed_ambiguous_count"]);
    EXPECT_EQ(result.json()["skipped_count"], 0);
    EXPECT_THAT(readText(report + "/index.html"), HasSubstr("fail-contact"));
    EXPECT_THAT(readText(report + "/adjudication.csv"), HasSubstr("rtcOccluded16 robust"));
}

// Each moves or loses answers of the set-up that truth and exact rays share, or of one of them.
TEST(StudyAdjudication, FaultsOfExactRaysAndOfTheTruthAreNoticed) {
    if (!kHasMutants)
        GTEST_SKIP() << "built without assertions";
    const std::pair<const char*, const char*> faults[] = {
        {"exact-normal-flipped", "exact packets"}, {"exact-light-moved", "exact packets"},
        {"exact-lane-lost", "exact packets"},      {"exact-doubt-lit", "exact packets"},
        {"exact-leaf-skipped", "exact single"},    {"embree-filter-off", "truth"}};
    Json study = Json::parse(readText(SDAG_SOURCE_DIR "/scenes/studies/adjudication.json"));
    study["disputed_size"] = "128x72"; // a fault may put every pair in dispute
    for (const auto& [fault, tracer] : faults) {
        const TemporaryDirectory directory;
        writeText(directory / "small.json", study.dump());
        const ProgramResult result =
            runShadowdag(directory,
                         {"study", directory / "small.json", "--only",
                          "fail-contact,fail-filter-acne,fail-alpha", "-o", directory / "report"},
                         {"/usr/bin/env", std::string("SHADOWDAG_MUTANT=") + fault});
        EXPECT_EQ(result.status, 5) << fault << ": " << result.err;
        EXPECT_THAT(result.out, HasSubstr(std::string(" by ") + tracer + ": ")) << fault;
        EXPECT_THAT(result.out, HasSubstr("pairs are proven wrong")) << fault;
        // What single rays answer is in no dispute.
        if (std::string(tracer) != "exact single") {
            EXPECT_THAT(result.out, HasSubstr("disputed pairs are proven wrong")) << fault;
        }
    }
}

} // namespace
} // namespace shadowdag
