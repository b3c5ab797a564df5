// SPDX-License-Identifier: Apache-2.0
// `shadowdag study stability` from end to end: its numeric part, and rows on a user's scene.
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

// Bands and rates of a row hold for its own scene alone; on another one it is measured without
// them.
TEST(StudyStability, OnAUsersSceneRatesHaveNoBand) {
    const TemporaryDirectory directory;
    const std::string report = directory / "report";
    Json study =
        Json::parse(readText(std::string(SDAG_SOURCE_DIR) + "/scenes/studies/stability.json"));
    study["width"] = 64;
    study["finest_voxels"] = 256;
    writeText(directory / "small.json", study.dump());
    const ProgramResult result = runShadowdag(
        directory, {"study", directory / "small.json", "builtin:fail-lantern", "--only",
                    "resolution-wires,resolution-cubes", "-o", report, "--json"});
    ASSERT_EQ(result.status, 0) << result.err;
    const Json json = Json::parse(readText(report + "/stability.json"));
    EXPECT_TRUE(json["checks"].empty());
    ASSERT_EQ(json["resolution"].size(), 2 * (3u + 5u));
    EXPECT_EQ(json["resolution"][0]["kind"], "mixed");
    EXPECT_EQ(json["rates"].size(), 2 * 4u) << "all of three and five resolutions have errors";
    EXPECT_TRUE(std::filesystem::exists(report + "/charts/stability_resolution.svg"));
}

} // namespace
} // namespace shadowdag
