// SPDX-License-Identifier: Apache-2.0
// docs/file_formats.md against the files that the program writes: its reader is run as it stands.
#include "tests/tools/program/program_runner.h"
#include "tests/tools/report/report_runner.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>

namespace shadowdag {
namespace {

const std::string kDocument = SDAG_SOURCE_DIR "/docs/file_formats.md";

TEST(ProgramFormats, TheReaderOfTheDocumentReadsAnAsset) {
    const TemporaryDirectory directory;
    const std::string document = readText(kDocument), mark = "```python\n";
    const size_t begin = document.find(mark) + mark.size();
    writeText(directory / "read.py", document.substr(begin, document.find("```", begin) - begin));
    for (const char* resolution : {"4", "8", "512"}) {
        const std::string asset = directory / "asset.svdag";
        ProgramResult result =
            runShadowdag(directory, {"voxelize", "builtin:fail-lantern", "--resolution", resolution,
                                     "--packing", "fast", "-o", asset, "--json"});
        ASSERT_EQ(result.status, 0) << result.err;
        result = runShadowdag(directory, {"info", asset, "--json"});
        ASSERT_EQ(result.status, 0) << result.err;
        const Json info = result.json();
        std::string said;
        ASSERT_EQ(runProgram({"/usr/bin/python3", directory / "read.py", asset}, &said), 0) << said;
        EXPECT_EQ(said, std::string(resolution) + " " +
                            std::to_string(info["voxel_count"].get<uint64_t>()) + "\n");
    }
}

/// Reads numbers from a file's bytes, one after the other.
struct Bytes {
    std::string bytes;
    size_t at = 0;

    template <class T> T take() {
        T value{};
        std::memcpy(&value, bytes.data() + at, sizeof value);
        at += sizeof value;
        return value;
    }
};

TEST(ProgramFormats, APartHasTheFieldsOfTheDocument) {
    const TemporaryDirectory directory;
    const std::string part = directory / "a.svpart";
    const ProgramResult result =
        runShadowdag(directory, {"voxelize", "builtin:fail-lantern", "--resolution", "1024",
                                 "--part", "2/3", "-o", part, "--json"});
    ASSERT_EQ(result.status, 0) << result.err;
    Bytes in{readText(part)};
    EXPECT_EQ(in.bytes.substr(0, 8), "SVPRT\r\n\x1a");
    in.at = 8;
    EXPECT_EQ(in.take<uint32_t>(), 1u);
    const uint32_t headerBytes = in.take<uint32_t>();
    EXPECT_EQ(in.take<uint32_t>(), 10u);
    in.at += 4 * sizeof(double);
    EXPECT_EQ(in.take<uint32_t>(), 2u);
    EXPECT_EQ(in.take<uint32_t>(), 3u);
    in.at += sizeof(uint64_t);
    const uint64_t subtrees = in.take<uint64_t>(), voxels = in.take<uint64_t>();
    EXPECT_EQ(voxels, result.json()["voxel_count"].get<uint64_t>());
    in.at += 18 * sizeof(uint64_t);
    uint64_t nodeBytes = 0, lastLevel = 0;
    for (uint64_t level = 0; level < 18; ++level) {
        const uint64_t nodes = in.take<uint64_t>(), pointers = in.take<uint64_t>();
        nodeBytes += level == 2 ? 8 * nodes : nodes + 4 * pointers;
        lastLevel = nodes ? level : lastLevel;
    }
    EXPECT_EQ(lastLevel, 8u) << "tasks are cells of 2^8 voxels";
    for (int text = 0; text < 4; ++text)
        in.at += in.take<uint32_t>(); // the length is taken first
    EXPECT_EQ(in.at + 16, headerBytes);
    EXPECT_EQ(in.bytes.size(), headerBytes + nodeBytes + 12 * subtrees + 16);
}

} // namespace
} // namespace shadowdag
