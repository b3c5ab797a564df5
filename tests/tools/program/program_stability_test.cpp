// SPDX-License-Identifier: Apache-2.0
// `shadowdag study stability` from end to end, its numeric part.
#include "tests/tools/program/program_runner.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

namespace shadowdag {
namespace {

using testing::HasSubstr;

TEST(StudyStability, WritesPageTableJsonAndCharts) {
    const TemporaryDirectory directory;
    const std::string report = directory / "report";
    const ProgramResult result = runShadowdag(
        directory, {"study", "stability", "--only", "numeric", "-o", report, "--json"});
    ASSERT_EQ(result.status, 0) << result.err;
    EXPECT_EQ(result.json()["check_count"], 20); // 4 grids x 3, 8 faces
    EXPECT_TRUE(result.json()["broken"].empty());
    const Json json = Json::parse(readText(report + "/stability.json"));
    EXPECT_EQ(json["numeric"].size(), 12u);
    EXPECT_TRUE(json["provenance"].contains("commit"));
    const std::string page = readText(report + "/index.html");
    EXPECT_THAT(page, HasSubstr("charts/stability_numeric.svg"));
    EXPECT_TRUE(std::filesystem::exists(report + "/charts/stability_numeric.svg"));
    EXPECT_THAT(readText(report + "/stability.csv"), HasSubstr("part,group,case"));
    EXPECT_FALSE(std::filesystem::exists(report + "/partial"));
    // A later one takes its place.
    EXPECT_EQ(runShadowdag(directory, {"study", "stability", "--only", "numeric-faces", "-o",
                                       report, "--no-charts"})
                  .status,
              0);
}

} // namespace
} // namespace shadowdag
