// SPDX-License-Identifier: Apache-2.0
#include "voxel/asset.h"

#include "cuda/error.h"
#include "scenes/content_hash.h"
#include "tests/voxel/voxel_sets.h"
#include "voxel/asset_encoding.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <unistd.h>

#include <cstring>
#include <filesystem>
#include <fstream>

namespace shadowdag {
namespace {

using Bytes = std::vector<uint8_t>;

std::string tempPath(const std::string& name) {
    return (std::filesystem::temp_directory_path() /
            ("shadowdag_asset_" + std::to_string(getpid()) + "_" + name))
        .string();
}

/// A path that is removed with the object.
struct TempFile {
    std::string path;
    explicit TempFile(const std::string& name) : path(tempPath(name)) {}
    ~TempFile() { std::filesystem::remove(path); }
    Bytes read() const {
        std::ifstream in(path, std::ios::binary);
        return Bytes(std::istreambuf_iterator<char>(in), {});
    }
};

Asset sampleAsset(uint32_t log2, double density, unsigned seed) {
    std::mt19937 random(seed);
    Asset asset;
    asset.dag = dagOf(randomGrid(log2, density, random));
    asset.dag.grid.originWorld = {-1.5, 2.25, 1e5};
    asset.dag.grid.voxelSizeWorld = 0.0073;
    asset.provenance = {"sample.glb", "0123456789abcdef0123456789abcdef", "0.1.0", ""};
    return asset;
}

void expectEqual(const Asset& a, const Asset& b) {
    EXPECT_EQ(a.dag.words, b.dag.words);
    EXPECT_EQ(a.dag.rootAddress, b.dag.rootAddress);
    EXPECT_EQ(a.dag.grid, b.dag.grid);
    EXPECT_EQ(a.provenance.sceneName, b.provenance.sceneName);
    EXPECT_EQ(a.provenance.sceneHash, b.provenance.sceneHash);
    EXPECT_EQ(a.provenance.programVersion, b.provenance.programVersion);
    EXPECT_EQ(a.provenance.options, b.provenance.options);
}

TEST(Asset, ReadsBackWhatWasWritten) {
    const TempFile file("round_trip.svdag");
    for (uint32_t log2 = 0; log2 <= 6; ++log2)
        for (const double density : {0.0, 0.03, 0.5, 1.0}) {
            const Asset asset = sampleAsset(log2, density, log2);
            const uint64_t bytes = writeAsset(asset, file.path);
            EXPECT_EQ(bytes, std::filesystem::file_size(file.path));
            expectEqual(readAsset(file.path), asset);
        }
}

TEST(Asset, SameAssetGivesTheSameBytes) {
    const TempFile a("same_a.svdag"), b("same_b.svdag");
    writeAsset(sampleAsset(5, 0.05, 1), a.path);
    writeAsset(readAsset(a.path), b.path);
    EXPECT_EQ(a.read(), b.read());
}

TEST(Asset, HighestLevelSurvives) {
    const TempFile file("deep.svdag");
    DagBuilder builder(kMaxResolutionLog2);
    uint32_t node = builder.addLeaf(uint64_t(1) << 63);
    for (uint32_t level = kLeafLog2 + 1; level <= kMaxResolutionLog2; ++level) {
        uint32_t children[8] = {kNoNode, kNoNode, kNoNode, kNoNode,
                                kNoNode, kNoNode, kNoNode, node};
        node = builder.addInner(level, children);
    }
    Asset asset;
    VoxelGrid grid;
    grid.resolutionLog2 = kMaxResolutionLog2;
    asset.dag = builder.finish(kMaxResolutionLog2, node, grid);
    writeAsset(asset, file.path);
    const Asset back = readAsset(file.path);
    expectEqual(back, asset);
    EXPECT_TRUE(isOccupied(back.dag.view(), 131071, 131071, 131071));
}

/// Reads bytes that should not be an asset; returns the message, fails when something else than
/// Error kInput comes.
std::string refusal(const TempFile& file, const Bytes& bytes) {
    try {
        parseAsset(bytes, file.path);
    } catch (const Error& e) {
        EXPECT_EQ(e.kind(), ErrorKind::kInput) << e.what();
        EXPECT_NE(std::string(e.what()).find(file.path), std::string::npos);
        return e.what();
    }
    return "";
}

TEST(Asset, EveryTruncationIsRefused) {
    const TempFile file("truncated.svdag");
    writeAsset(sampleAsset(4, 0.1, 2), file.path);
    const Bytes whole = file.read();
    for (size_t size = 0; size < whole.size(); ++size)
        ASSERT_NE(refusal(file, Bytes(whole.begin(), whole.begin() + long(size))), "") << size;
    Bytes longer = whole;
    longer.push_back(0);
    EXPECT_NE(refusal(file, longer), "");
}

TEST(Asset, AThousandBitFlipsAreRefused) {
    const TempFile file("flipped.svdag");
    writeAsset(sampleAsset(4, 0.1, 3), file.path);
    const Bytes whole = file.read();
    std::mt19937 random(51);
    for (int i = 0; i < 1000; ++i) {
        Bytes bytes = whole;
        const size_t bit = random() % (bytes.size() * 8);
        bytes[bit / 8] ^= uint8_t(1u << (bit % 8));
        ASSERT_NE(refusal(file, bytes), "") << "bit " << bit;
    }
}

// Where things are in the file (asset.cpp's table).
constexpr size_t kResolutionAt = 12, kCountsAt = 48, kPackingAt = 80, kPayloadBytesAt = 84,
                 kPayloadHashAt = 92;

/// Makes the checksums of a damaged file right again, so that the checks behind them are reached.
void correctChecksums(Bytes& bytes) {
    uint64_t payloadBytes = 0;
    std::memcpy(&payloadBytes, &bytes[kPayloadBytesAt], 8);
    if (payloadBytes > bytes.size() - 16)
        return;
    const size_t payload = bytes.size() - size_t(payloadBytes);
    const auto payloadHash = contentHash(bytes.data() + payload, size_t(payloadBytes));
    std::memcpy(&bytes[kPayloadHashAt], payloadHash.data(), 16);
    const auto headerHash = contentHash(bytes.data(), payload - 16);
    std::memcpy(&bytes[payload - 16], headerHash.data(), 16);
}

// With right checksums a flip may give another valid asset, but never a crash, and never one that
// cannot be walked.
TEST(Asset, BitFlipsWithRightChecksumsAreRefusedOrSound) {
    const TempFile file("checksummed.svdag");
    std::mt19937 random(52);
    int refused = 0, sound = 0;
    for (const uint32_t log2 : {1u, 2u, 4u, 6u}) {
        Asset asset = sampleAsset(log2, log2 == 6 ? 0.002 : 0.2, log2);
        writeAsset(asset, file.path);
        const Bytes whole = file.read();
        for (int i = 0; i < 1500; ++i) {
            Bytes bytes = whole;
            for (uint32_t flips = 1 + random() % 3; flips > 0; --flips) {
                const size_t bit = random() % (bytes.size() * 8);
                bytes[bit / 8] ^= uint8_t(1u << (bit % 8));
            }
            correctChecksums(bytes);
            if (refusal(file, bytes) != "") {
                ++refused;
                continue;
            }
            ++sound;
            const Dag dag = parseAsset(bytes, file.path).dag;
            const DagStats stats = computeDagStats(dag);
            ASSERT_LE(stats.voxelCount, uint64_t(1) << (3 * dag.grid.resolutionLog2));
            for (int v = 0; v < 100; ++v)
                isOccupied(dag.view(), random() % dag.grid.resolution(),
                           random() % dag.grid.resolution(), random() % dag.grid.resolution());
        }
    }
    EXPECT_GT(refused, 1000);
    EXPECT_GT(sound, 100);
}

// The streams themselves damaged, below zstd.
TEST(Asset, DamagedStreamsAreRefusedOrSound) {
    std::mt19937 random(53);
    const Dag dag = sampleAsset(5, 0.02, 5).dag;
    EncodedCounts counts;
    const Bytes whole = encodeDag(dag, counts);
    EXPECT_EQ(decodeDag(whole, counts, dag.grid, "x").words, dag.words);
    int refused = 0, sound = 0;
    for (int i = 0; i < 5000; ++i) {
        Bytes bytes = whole;
        bytes[random() % bytes.size()] ^= uint8_t(1u << (random() % 8));
        try {
            const Dag damaged = decodeDag(bytes, counts, dag.grid, "x");
            ++sound;
            EXPECT_EQ(damaged.words.size(), dag.words.size());
            computeDagStats(damaged);
        } catch (const Error& e) {
            EXPECT_EQ(e.kind(), ErrorKind::kInput);
            ++refused;
        }
    }
    EXPECT_GT(refused, 100);
    EXPECT_GT(sound, 100);
}

TEST(Asset, EachStructuralFaultIsNamed) {
    const TempFile file("fault.svdag");
    Asset asset = sampleAsset(4, 0.1, 6);
    DenseGrid repeated(4); // two equal leaves, hence a reference
    repeated.set(1, 1, 1);
    repeated.set(5, 1, 1);
    repeated.set(9, 1, 2);
    asset.dag.words = dagOf(repeated).words;
    writeAsset(asset, file.path);
    const Bytes whole = file.read();
    const auto with = [&](size_t at, uint64_t value, size_t count) {
        Bytes bytes = whole;
        std::memcpy(&bytes[at], &value, count);
        correctChecksums(bytes);
        return refusal(file, bytes);
    };
    using testing::HasSubstr;
    EXPECT_THAT(with(0, 'X', 1), HasSubstr("does not begin as an .svdag"));
    EXPECT_THAT(with(8, 2, 4), HasSubstr("version 2"));
    EXPECT_THAT(with(kResolutionAt, 18, 4), HasSubstr("2^18"));
    EXPECT_THAT(with(40, 0, 8), HasSubstr("transform"));
    EXPECT_THAT(with(kCountsAt, uint64_t(1) << 40, 8), HasSubstr("counts"));
    EXPECT_THAT(with(kCountsAt + 24, ~uint64_t(0), 8), HasSubstr("counts"));
    EXPECT_THAT(with(kPackingAt, 7, 4), HasSubstr("packing 7"));
    EXPECT_THAT(with(kPayloadBytesAt, uint64_t(1) << 50, 8),
                HasSubstr("checksum")); // cannot be corrected
    EXPECT_THAT(with(kPayloadHashAt + 16, 1u << 30, 4), HasSubstr("scene name claims"));
    Bytes flipped = whole;
    flipped.back() ^= 1;
    EXPECT_THAT(refusal(file, flipped), HasSubstr("payload does not match its checksum"));
    EXPECT_THAT(refusal(file, Bytes(whole.begin(), whole.end() - 1)),
                HasSubstr("payload should be"));

    EncodedCounts counts;
    const Bytes streams = encodeDag(asset.dag, counts);
    const auto streamsWith = [&](size_t at, uint8_t value, const EncodedCounts& c,
                                 const VoxelGrid& grid) {
        Bytes bytes = streams;
        bytes.resize(c.byteCount());
        if (at < bytes.size())
            bytes[at] = value;
        try {
            decodeDag(bytes, c, grid, "x");
        } catch (const Error& e) {
            return std::string(e.what());
        }
        return std::string();
    };
    const VoxelGrid& grid = asset.dag.grid;
    const size_t flags = counts.innerCount, references = flags + (counts.pointerCount + 7) / 8;
    ASSERT_GT(counts.referenceCount, 0u);
    EXPECT_THAT(streamsWith(0, 0, counts, grid), HasSubstr("node 0 of level 4 has no child"));
    EXPECT_THAT(streamsWith(flags, 0, counts, grid), HasSubstr("reference 0 leads"));
    EXPECT_THAT(streamsWith(references, 0, counts, grid), HasSubstr("leads"));
    EncodedCounts more = counts;
    ++more.leafCount;
    EXPECT_THAT(streamsWith(~size_t(0), 0, more, grid), HasSubstr("exceed what the root reaches"));
    EncodedCounts less = counts;
    less.innerCount = 1;
    EXPECT_THAT(streamsWith(~size_t(0), 0, less, grid), HasSubstr("more"));
    VoxelGrid single;
    Bytes leaf(8, 0);
    EncodedCounts one;
    one.leafCount = 1;
    EXPECT_THROW(decodeDag(leaf, one, single, "x"), Error); // empty leaf
    leaf[0] = 3;
    EXPECT_THROW(decodeDag(leaf, one, single, "x"), Error); // a voxel outside a grid of one
    leaf[0] = 1;
    EXPECT_NO_THROW(decodeDag(leaf, one, single, "x"));
}

TEST(Asset, AbsentFileAndFolderAreRefusedByName) {
    EXPECT_THROW(readAsset(tempPath("absent")), Error);
    try {
        readAsset(std::filesystem::temp_directory_path().string());
        FAIL();
    } catch (const Error& e) {
        EXPECT_EQ(e.kind(), ErrorKind::kInput);
    }
}

} // namespace
} // namespace shadowdag
