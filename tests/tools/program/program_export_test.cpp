// SPDX-License-Identifier: Apache-2.0
// `shadowdag export` and `shadowdag import` as scripts use them.
#include "tests/tools/program/program_runner.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sys/resource.h>

#include <filesystem>

namespace shadowdag {

namespace {

using testing::HasSubstr;
using testing::Not;

std::string builtAsset(const TemporaryDirectory& directory) {
    const std::string path = directory / "a.svdag";
    const ProgramResult result =
        runShadowdag(directory, {"voxelize", "builtin:atrium", "-o", path, "--resolution", "64"});
    EXPECT_EQ(result.status, 0) << result.err;
    return path;
}

/// Appends the bytes of numbers, and texts after their lengths, as OpenVDB writes them.
class VdbBytes {
public:
    template <class T> VdbBytes& number(T value) {
        bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
        return *this;
    }
    VdbBytes& text(const std::string& value) {
        number(uint32_t(value.size()));
        bytes += value;
        return *this;
    }

    std::string bytes;
};

/// Returns a file of 2 MB that takes OpenVDB minutes to read and little memory: 10 000 grids of one
/// name share one place in the file, with 100 000 metadata of one name, and each takes its tree
/// from all grids of that name.
std::string endlessVdb() {
    constexpr int kGridCount = 10000, kMetadataCount = 100000;
    VdbBytes place; // compression, metadata, transform
    place.number(uint32_t(0)).number(uint32_t(kMetadataCount));
    for (int i = 0; i < kMetadataCount; ++i)
        place.text("a").text("bool").number(uint32_t(1)).number(uint8_t(1));
    place.text("UniformScaleMap");
    for (int i = 0; i < 5 * 3; ++i)
        place.number(1.0);
    VdbBytes file;
    file.number(int64_t(0x56444220)).number(uint32_t(224)); // magic, version of the format
    file.number(uint32_t(10)).number(uint32_t(0)).number(uint8_t(1)); // library, has offsets
    file.bytes += "00000000-0000-0000-0000-000000000000";             // identifier
    file.number(uint32_t(0)).number(int32_t(kGridCount));             // metadata, grids
    const auto entry = [](int64_t placeAt, int64_t end) {
        // The tree's values are not read; entries end a byte after what is read of them.
        VdbBytes grid;
        grid.text("x").text("Tree_bool_5_4_3").text("x").number(placeAt).number(placeAt);
        return grid.number(end).number(uint8_t(0)).bytes;
    };
    const int64_t begin = int64_t(file.bytes.size()), size = int64_t(entry(0, 0).size());
    for (int i = 1; i <= kGridCount; ++i)
        file.bytes += entry(begin + kGridCount * size, begin + i * size);
    return file.bytes + place.bytes;
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

TEST(Export, OpenVdbIsLoadedWhenAGridIsFirstNeeded) {
    const TemporaryDirectory directory;
    const std::string asset = builtAsset(directory);
    const std::vector<std::string> traced = {"/usr/bin/env", "LD_DEBUG=files"};
    const std::string loaded = "file=libopenvdb";
    const ProgramResult info = runShadowdag(directory, {"info", asset}, traced);
    EXPECT_EQ(info.status, 0) << info.err;
    EXPECT_THAT(info.err, HasSubstr("file=libc."));
    EXPECT_THAT(info.err, Not(HasSubstr(loaded)));
    const ProgramResult out =
        runShadowdag(directory, {"export", asset, "-o", directory / "g.vdb"}, traced);
    EXPECT_EQ(out.status, 0) << out.err;
    EXPECT_THAT(out.err, HasSubstr(loaded));
}

TEST(Export, AProgramWithoutItsModuleSaysSo) {
    const TemporaryDirectory directory;
    const std::string asset = builtAsset(directory), copy = directory / "copy";
    std::filesystem::copy_file(SDAG_PROGRAM, copy);
    const std::vector<std::string> copied = {"/bin/sh", "-c", "shift; exec '" + copy + "' \"$@\"",
                                             "sh"};
    EXPECT_EQ(runShadowdag(directory, {"info", asset}, copied).status, 0);
    const ProgramResult result =
        runShadowdag(directory, {"export", asset, "-o", directory / "g.vdb"}, copied);
    EXPECT_EQ(result.status, 3) << result.err;
    EXPECT_THAT(result.err, HasSubstr("sdag_openvdb.so"));
    EXPECT_THAT(result.err, HasSubstr("install the program and libopenvdb again"));
    EXPECT_FALSE(std::filesystem::exists(directory / "g.vdb"));
    ASSERT_EQ(runShadowdag(directory, {"export", asset, "-o", directory / "g.vdb"}).status, 0);
    const ProgramResult back = runShadowdag(
        directory, {"import", directory / "g.vdb", "-o", directory / "b.svdag"}, copied);
    EXPECT_EQ(back.status, 3) << back.err;
    EXPECT_THAT(back.err, HasSubstr("sdag_openvdb.so"));
    EXPECT_THAT(back.err, Not(HasSubstr("is damaged"))) << "the grid is not";
}

// OpenVDB allocates a string of the stated length before it reads it.
TEST(Export, ALengthOf4GigabytesInASmallGridIsRefusedInLittleMemory) {
    const TemporaryDirectory directory;
    const std::string grid = directory / "g.vdb", out = directory / "out.svdag";
    ASSERT_EQ(runShadowdag(directory, {"export", builtAsset(directory), "-o", grid}).status, 0);
    std::string bytes = readText(grid);
    const std::string name = "builtin:atrium"; // the grid's; its length is before it
    bytes.replace(bytes.find(name) - 4, 4, std::string("\0\0\0\xf0", 4));
    writeText(grid, bytes);
    const ProgramResult result = runShadowdag(directory, {"import", grid, "-o", out});
    EXPECT_EQ(result.status, 2) << result.err;
    EXPECT_THAT(result.err, HasSubstr("g.vdb: not enough memory to read it within the limit"));
    EXPECT_FALSE(std::filesystem::exists(out));
    struct rusage usage {}; // of the largest process so far
    getrusage(RUSAGE_CHILDREN, &usage);
    EXPECT_LT(usage.ru_maxrss, 600 * 1024) << "KiB";
}

TEST(Export, ReadingThatTakesTooLongIsRefused) {
    const TemporaryDirectory directory;
    const std::string grid = directory / "g.vdb", out = directory / "out.svdag";
    writeText(grid, endlessVdb());
    // The program allows 60 s and more; a lower limit of the caller's is named instead.
    const ProgramResult result = runShadowdag(directory, {"import", grid, "-o", out, "--grid", "x"},
                                              {"/usr/bin/prlimit", "--cpu=1:99"});
    EXPECT_EQ(result.status, 3) << result.err;
    EXPECT_THAT(result.err,
                HasSubstr("g.vdb: reading it took longer than the limit of the shell, 1 s"));
    EXPECT_FALSE(std::filesystem::exists(out));
}

TEST(Export, ALackOfProcessesIsReportedAndNotBlamedOnTheGrid) {
    if (geteuid() != 0)
        GTEST_SKIP() << "only root can be another user, whose processes are counted apart";
    const TemporaryDirectory directory;
    std::filesystem::permissions(directory.path(), std::filesystem::perms::all);
    const std::string grid = directory / "g.vdb", user = std::to_string(100'000 + getpid());
    ProgramResult result;
    // From less than the program's own threads to one too few.
    for (int limit = 2; limit < 100 && result.err.find("start a process") == std::string::npos;
         ++limit)
        result = runShadowdag(directory, {"import", grid, "-o", directory / "a.svdag"},
                              {"/usr/bin/setpriv", "--reuid=" + user, "--clear-groups",
                               "/usr/bin/prlimit", "--nproc=" + std::to_string(limit)});
    EXPECT_EQ(result.status, 3);
    EXPECT_THAT(result.err, HasSubstr("cannot start a process to read '" + grid +
                                      "': Resource temporarily unavailable; raise the limits of "
                                      "the shell (ulimit -u)"));
}

TEST(Export, ErrorsAreReportedAndLeaveNoFile) {
    const TemporaryDirectory directory;
    const std::string asset = builtAsset(directory), grid = directory / "g.vdb";
    ASSERT_EQ(runShadowdag(directory, {"export", asset, "-o", grid}).status, 0);
    writeText(directory / "broken.vdb", readText(grid).substr(0, 2000));
    writeText(directory / "broken.nvdb", std::string(64, 'x')); // longer than a header
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
        {{"import", directory / "broken.nvdb", "-o", out}, 2, "an OpenVDB file must be named .vdb"},
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
