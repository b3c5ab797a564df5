// SPDX-License-Identifier: Apache-2.0
// `shadowdag export` and `shadowdag import` as scripts use them.
#include "tests/tools/program/program_runner.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

namespace shadowdag {

namespace {

using testing::HasSubstr;

std::string builtAsset(const TemporaryDirectory& directory) {
    const std::string path = directory / "a.svdag";
    const ProgramResult result =
        runShadowdag(directory, {"voxelize", "builtin:atrium", "-o", path, "--resolution", "64"});
    EXPECT_EQ(result.status, 0) << result.err;
    return path;
}

} // namespace

TEST(Export, ImportGivesTheSameFileBack) {
    const TemporaryDirectory directory;
    const std::string asset = builtAsset(directory);
    for (const char* ending : {".vdb", ".nvdb"}) {
        const std::string grid = directory / (std::string("g") + ending),
                          back = directory / (std::string("b") + ending + ".svdag");
        const ProgramResult out = runShadowdag(directory, {"export", asset, "-o", grid, "--json"});
        ASSERT_EQ(out.status, 0) << out.err;
        EXPECT_EQ(out.json()["grid"], "builtin:atrium");
        EXPECT_EQ(out.json()["resolution"], 64);
        EXPECT_EQ(out.json()["file_bytes"], std::filesystem::file_size(grid));
        const ProgramResult in = runShadowdag(directory, {"import", grid, "-o", back, "--json"});
        ASSERT_EQ(in.status, 0) << in.err;
        EXPECT_EQ(in.json()["voxel_count"], out.json()["voxel_count"]);
        EXPECT_EQ(in.json()["is_foreign"], false);
        EXPECT_EQ(in.err.find("was not exported"), std::string::npos) << in.err;
        EXPECT_EQ(readText(back), readText(asset)) << ending;
    }
}

TEST(Export, ErrorsAreReportedAndLeaveNoFile) {
    const TemporaryDirectory directory;
    const std::string asset = builtAsset(directory), grid = directory / "g.vdb";
    ASSERT_EQ(runShadowdag(directory, {"export", asset, "-o", grid}).status, 0);
    writeText(directory / "broken.vdb", readText(grid).substr(0, 2000));
    writeText(directory / "broken.nvdb", "this is no grid");
    writeText(directory / "broken.svdag", "this is no asset");
    struct Wrong {
        std::vector<std::string> arguments;
        int status;
        std::string message;
    };
    const std::string out = directory / "out.svdag";
    const std::vector<Wrong> cases = {
        {{"export", asset}, 1, "--output"},
        {{"export", asset, "-o", directory / "g.obj"}, 1, ".vdb (OpenVDB) or .nvdb (NanoVDB)"},
        {{"export", "builtin:atrium", "-o", directory / "h.vdb"}, 1, "shadowdag voxelize"},
        {{"export", directory / "none.svdag", "-o", directory / "h.vdb"}, 2, "cannot be opened"},
        {{"export", directory / "broken.svdag", "-o", directory / "h.vdb"}, 2, "broken.svdag"},
        {{"export", asset, "-o", directory / "none/h.vdb"}, 3, "there is no directory"},
        {{"import", grid, "-o", directory / "a.vox"}, 1, "use that extension"},
        {{"import", asset, "-o", out}, 1, ".vdb (OpenVDB) or .nvdb (NanoVDB)"},
        {{"import", directory / "none.vdb", "-o", out}, 2, "cannot be opened"},
        {{"import", directory / "broken.vdb", "-o", out}, 2, "broken.vdb"},
        {{"import", directory / "broken.nvdb", "-o", out}, 2, "broken.nvdb"},
        {{"import", grid, "-o", out, "--grid", "smoke"}, 1, "no grid 'smoke'"},
        {{"import", grid, "-o", directory / "none/a.svdag"}, 3, "there is no directory"},
        {{"import", grid, "-o", out, "--gl-pages", "nonsense"}, 1, "use auto, sparse or atlas"},
    };
    for (const Wrong& wrong : cases) {
        const ProgramResult result = runShadowdag(directory, wrong.arguments);
        EXPECT_EQ(result.status, wrong.status) << wrong.arguments[1] << ": " << result.err;
        EXPECT_THAT(result.err, HasSubstr(wrong.message));
    }
    EXPECT_FALSE(std::filesystem::exists(out));
    for (const auto& entry : std::filesystem::directory_iterator(directory.path()))
        EXPECT_EQ(entry.path().string().find(".tmp-"), std::string::npos) << entry.path();
}

} // namespace shadowdag
