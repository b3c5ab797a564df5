// SPDX-License-Identifier: Apache-2.0
#include "voxel/asset.h"

#include "cuda/backend.h"
#include "cuda/error.h"
#include "scenes/content_hash.h"
#include "tests/voxel/voxel_sets.h"
#include "voxel/asset_encoding.h"
#include "voxel/compact_encoding.h"
#include "voxel/range_coder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <utility>

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

constexpr AssetPacking kPackings[] = {AssetPacking::kCompact, AssetPacking::kFast};

void expectEqual(const Asset& a, const Asset& b) {
    EXPECT_EQ(a.dag.words, b.dag.words);
    EXPECT_EQ(a.dag.rootAddress, b.dag.rootAddress);
    EXPECT_EQ(a.dag.grid, b.dag.grid);
    EXPECT_EQ(a.provenance.sceneName, b.provenance.sceneName);
    EXPECT_EQ(a.provenance.sceneHash, b.provenance.sceneHash);
    EXPECT_EQ(a.provenance.programVersion, b.provenance.programVersion);
    EXPECT_EQ(a.provenance.options, b.provenance.options);
}

TEST(Asset, RoundTripIsExact) {
    const TempFile file("round_trip.svdag");
    for (uint32_t log2 = 0; log2 <= 6; ++log2)
        for (const double density : {0.0, 0.03, 0.5, 1.0}) {
            const Asset asset = sampleAsset(log2, density, log2);
            for (const AssetPacking packing : kPackings) {
                const uint64_t bytes = writeAsset(asset, file.path, packing);
                EXPECT_EQ(bytes, std::filesystem::file_size(file.path));
                expectEqual(readAsset(file.path), asset);
            }
        }
}

TEST(Asset, SameAssetGivesTheSameBytes) {
    const TempFile a("same_a.svdag"), b("same_b.svdag");
    for (const AssetPacking packing : kPackings) {
        writeAsset(sampleAsset(5, 0.05, 1), a.path, packing);
        writeAsset(readAsset(a.path), b.path, packing);
        EXPECT_EQ(a.read(), b.read());
    }
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
    for (const AssetPacking packing : kPackings) {
        writeAsset(asset, file.path, packing);
        const Asset back = readAsset(file.path);
        expectEqual(back, asset);
        EXPECT_TRUE(isOccupied(back.dag.view(), 131071, 131071, 131071));
    }
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
    for (const AssetPacking packing : kPackings) {
        writeAsset(sampleAsset(4, 0.1, 2), file.path, packing);
        const Bytes whole = file.read();
        for (size_t size = 0; size < whole.size(); ++size)
            ASSERT_NE(refusal(file, Bytes(whole.begin(), whole.begin() + long(size))), "") << size;
        Bytes longer = whole;
        longer.push_back(0);
        EXPECT_NE(refusal(file, longer), "");
    }
}

TEST(Asset, AThousandBitFlipsAreRefused) {
    const TempFile file("flipped.svdag");
    std::mt19937 random(51);
    for (const AssetPacking packing : kPackings) {
        writeAsset(sampleAsset(4, 0.1, 3), file.path, packing);
        const Bytes whole = file.read();
        for (int i = 0; i < 1000; ++i) {
            Bytes bytes = whole;
            const size_t bit = random() % (bytes.size() * 8);
            bytes[bit / 8] ^= uint8_t(1u << (bit % 8));
            ASSERT_NE(refusal(file, bytes), "") << "bit " << bit;
        }
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
    for (const uint32_t log2 : {1u, 2u, 4u, 6u, 11u, 12u, 14u, 16u}) {
        // From 11 on the same once more, compact.
        const bool isCompact = log2 > 10;
        const uint32_t size = isCompact ? log2 - 10 : log2;
        Asset asset = sampleAsset(size, size == 6 ? 0.002 : 0.2, size);
        writeAsset(asset, file.path, isCompact ? AssetPacking::kCompact : AssetPacking::kFast);
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

/// Returns voxels whose streams take over two megabytes, and more than 4096 nodes in some levels.
const Asset& largeAsset() {
    static const Asset kAsset = sampleAsset(8, 0.12, 61);
    return kAsset;
}

/// Returns where the zstd frames of an asset begin (RFC 8878, section 3.1.1, has their first
/// bytes).
std::vector<size_t> framesOf(const Bytes& bytes) {
    const uint8_t magic[4] = {0x28, 0xb5, 0x2f, 0xfd};
    std::vector<size_t> begins;
    for (auto at = bytes.begin();
         (at = std::search(at, bytes.end(), magic, magic + 4)) != bytes.end(); ++at)
        begins.push_back(size_t(at - bytes.begin()));
    return begins;
}

// Streams of several zstd frames, unpacked and decoded by several threads.
TEST(Asset, LargeOnesAreTheSameForAnyThreadCount) {
    const TempFile file("large.svdag");
    const Asset& asset = largeAsset();
    Bytes first;
    for (const int threads : {1, 3}) {
        setThreadCount(threads);
        writeAsset(asset, file.path, AssetPacking::kFast);
        const Bytes bytes = file.read();
        if (first.empty())
            first = bytes;
        EXPECT_EQ(bytes, first);
        const Asset back = readAsset(file.path);
        EXPECT_TRUE(back.dag.words == asset.dag.words);
    }
    setThreadCount(0);
    EXPECT_GE(framesOf(first).size(), 2u);
}

// Wherever in a level the damage is, the error names the first place.
TEST(Asset, DamagedLargeStreamsGiveTheSameAnswerForAnyThreadCount) {
    constexpr unsigned kSeed = 67;
    std::mt19937 random(kSeed);
    const Dag& dag = largeAsset().dag;
    EncodedCounts counts;
    const Bytes whole = encodeDag(dag, counts);
    ASSERT_GT(counts.innerCount, 3u * 4096);
    ASSERT_GT(counts.referenceCount, 100u);
    const uint64_t leaves = whole.size() - 8 * counts.leafCount;
    int refused = 0, sound = 0;
    for (int i = 0; i < 60; ++i) {
        Bytes bytes = whole;
        for (int flips = 0; flips < 3; ++flips) // most bytes are leaves'
            bytes[random() % (i % 4 == 0 ? bytes.size() : leaves)] ^= uint8_t(1u << (random() % 8));
        std::vector<std::string> answers;
        for (const int threads : {1, 3}) {
            setThreadCount(threads);
            try {
                const Dag damaged = decodeDag(viewOf(std::as_const(bytes)), counts, dag.grid, "x");
                const auto hash =
                    contentHash(damaged.words.data(), damaged.words.size() * sizeof(uint32_t));
                answers.emplace_back(hash.begin(), hash.end());
                ++sound;
            } catch (const Error& error) {
                EXPECT_EQ(error.kind(), ErrorKind::kInput);
                answers.push_back(error.what());
                ++refused;
            }
        }
        EXPECT_EQ(answers[0], answers[1]) << "seed " << kSeed << " round " << i;
    }
    setThreadCount(0);
    EXPECT_GT(refused, 10);
    EXPECT_GT(sound, 10);
}

TEST(Asset, TheFirstOfSeveralDamagedLeavesIsNamed) {
    const Dag& dag = largeAsset().dag;
    EncodedCounts counts;
    Bytes bytes = encodeDag(dag, counts);
    for (const uint64_t leaf : {200000, 5000, 70000})
        for (uint64_t plane = 0; plane < 8; ++plane)
            bytes.at(bytes.size() - (8 - plane) * counts.leafCount + leaf) = 0;
    try {
        decodeDag(viewOf(std::as_const(bytes)), counts, dag.grid, "x");
        ADD_FAILURE() << "it was read";
    } catch (const Error& error) {
        EXPECT_THAT(error.what(), testing::HasSubstr("leaf 5000 is empty"));
    }
}

// Every pointer of a level leads to a new node, where the file has none left; then references in
// parts of the level that other threads read.
TEST(Asset, ALevelWithoutNodesIsRefusedWhereverItIsRead) {
    VoxelGrid grid;
    grid.resolutionLog2 = 8;
    EncodedCounts counts;
    for (uint64_t nodes = 1; nodes <= 4096; nodes *= 8)
        counts.innerCount += nodes;
    counts.pointerCount = 8 * counts.innerCount;
    counts.referenceCount = 4096;
    counts.leafCount = 1;
    Bytes bytes(counts.byteCount(), 0);
    std::fill_n(bytes.begin(), counts.innerCount + counts.pointerCount / 8, 0xff);
    const size_t references = counts.innerCount + counts.pointerCount / 8;
    for (size_t p = counts.pointerCount - 4096; p < counts.pointerCount; p += 2)
        bytes[counts.innerCount + p / 8] ^= uint8_t(1u << (p % 8));
    std::fill_n(bytes.begin() + ptrdiff_t(references), counts.referenceCount, 1);
    for (const int threads : {1, 3}) {
        setThreadCount(threads);
        try {
            decodeDag(viewOf(std::as_const(bytes)), counts, grid, "x");
            ADD_FAILURE() << "it was read";
        } catch (const Error& error) {
            EXPECT_THAT(error.what(),
                        testing::HasSubstr("level 3 has more nodes than the file holds"));
        }
    }
    setThreadCount(0);
}

// A payload whose checksum is right, but whose frames are not what the counts say.
TEST(Asset, FramesOfOtherSizesAreRefused) {
    const TempFile file("frames.svdag");
    writeAsset(largeAsset(), file.path, AssetPacking::kFast);
    const Bytes whole = file.read();
    const std::vector<size_t> frames = framesOf(whole);
    ASSERT_GE(frames.size(), 2u);
    const auto first = ptrdiff_t(frames[0]), second = ptrdiff_t(frames[1]);
    const auto with = [&](const std::function<void(Bytes&)>& change) {
        Bytes bytes = whole;
        change(bytes);
        const uint64_t payloadBytes = bytes.size() - frames[0];
        std::memcpy(&bytes[kPayloadBytesAt], &payloadBytes, 8);
        correctChecksums(bytes);
        return refusal(file, bytes);
    };
    EXPECT_EQ(with([](Bytes&) {}), "");
    const auto saysSo = testing::HasSubstr("does not unpack to");
    EXPECT_THAT(with([&](Bytes& b) { b.resize(frames.back()); }), saysSo);
    EXPECT_THAT(with([&](Bytes& b) {
                    const Bytes frame(b.begin() + first, b.begin() + second);
                    b.insert(b.end(), frame.begin(), frame.end());
                }),
                saysSo);
    EXPECT_THAT(with([](Bytes& b) { b.pop_back(); }), saysSo);
    EXPECT_THAT(with([](Bytes& b) { b.push_back(7); }), saysSo);
    const Bytes empty = {0x28, 0xb5, 0x2f, 0xfd, 0x20, 0, 1, 0, 0}; // a frame of no bytes
    EXPECT_THAT(with([&](Bytes& b) { b.insert(b.end(), empty.begin(), empty.end()); }), saysSo);
    const Bytes unsized = {0x28, 0xb5, 0x2f, 0xfd, 0, 0x58, 1, 0, 0}; // a window, no content size
    EXPECT_THAT(
        with([&](Bytes& b) { b.insert(b.begin() + second, unsized.begin(), unsized.end()); }),
        saysSo);
    EXPECT_THAT(with([&](Bytes& b) { b[size_t(second)] ^= 1; }), saysSo);     // its magic
    EXPECT_THAT(with([&](Bytes& b) { b[size_t(second) + 5] ^= 1; }), saysSo); // its size
}

// The streams themselves damaged, below zstd.
TEST(Asset, DamagedStreamsAreRefusedOrSound) {
    std::mt19937 random(53);
    const Dag dag = sampleAsset(5, 0.02, 5).dag;
    EncodedCounts counts;
    const Bytes whole = encodeDag(dag, counts);
    EXPECT_EQ(decodeDag(viewOf(whole), counts, dag.grid, "x").words, dag.words);
    int refused = 0, sound = 0;
    for (int i = 0; i < 5000; ++i) {
        Bytes bytes = whole;
        bytes[random() % bytes.size()] ^= uint8_t(1u << (random() % 8));
        try {
            const Dag damaged = decodeDag(viewOf(std::as_const(bytes)), counts, dag.grid, "x");
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

TEST(CompactEncoding, GridsOfAllSizesComeBack) {
    std::mt19937 random(54);
    for (uint32_t log2 = 0; log2 <= 7; ++log2)
        for (const double density : {0.0005, 0.02, 0.3, 1.0}) {
            const Dag dag = dagOf(randomGrid(log2, density, random));
            EncodedCounts counts;
            const Bytes bytes = encodeCompact(dag, counts);
            EXPECT_LE(counts.wordCount(), compactWordLimit(bytes.size()));
            const Dag back = decodeCompact(bytes, counts, dag.grid, "x");
            EXPECT_EQ(back.words, dag.words) << log2 << " " << density;
            EXPECT_EQ(back.rootAddress, dag.rootAddress);
        }
}

// A block that is new and repeated in the same cube of 16^3 is not yet known while it is coded.
TEST(CompactEncoding, BlocksRepeatedInTheirFirstCubeComeBack) {
    DenseGrid grid(5);
    std::mt19937 random(55);
    for (int i = 0; i < 60; ++i) {
        const uint32_t x = uint32_t(random() % 8), y = uint32_t(random() % 8),
                       z = uint32_t(random() % 8);
        for (uint32_t b = 0; b < 64; b += 1 + uint32_t(random() % 2))
            grid.set(x + 8 * (b & 3), y + 8 * (b >> 2 & 3), z + 8 * (b >> 4));
        for (uint32_t b = 0; i == 59 && b < 8; ++b) // whole cubes alike as well
            grid.set(1 + 16 * (b & 1), 2 + 16 * (b >> 1 & 1), 3 + 16 * (b >> 2));
        const Dag dag = dagOf(grid);
        EncodedCounts counts;
        const Bytes bytes = encodeCompact(dag, counts);
        ASSERT_EQ(decodeCompact(bytes, counts, dag.grid, "x").words, dag.words) << i;
    }
}

TEST(CompactEncoding, AWallTakesAFractionOfABitAVoxel) {
    DenseGrid grid(7);
    for (uint32_t x = 0; x < 128; ++x)
        for (uint32_t y = 0; y < 128; ++y)
            grid.set(x, y, (3 * x + 5 * y) / 9);
    const Dag dag = dagOf(grid);
    EncodedCounts counts, fastCounts;
    const size_t compact = encodeCompact(dag, counts).size();
    EXPECT_LT(8.0 * double(compact), 0.5 * 128 * 128);
    EXPECT_LT(2 * compact, encodeDag(dag, fastCounts).size());
}

TEST(CompactEncoding, DamagedBytesAreRefusedOrSound) {
    std::mt19937 random(56);
    int refused = 0, sound = 0;
    for (const uint32_t log2 : {2u, 3u, 5u, 6u}) {
        const Dag dag = sampleAsset(log2, 0.02, 5).dag;
        EncodedCounts counts;
        const Bytes whole = encodeCompact(dag, counts);
        for (int i = 0; i < 900; ++i) {
            Bytes bytes = whole;
            EncodedCounts c = counts;
            bytes[random() % bytes.size()] ^= uint8_t(1u << (random() % 8));
            if (i % 3 == 1)
                bytes.resize(random() % bytes.size());
            if (i % 3 == 2)
                (i % 2 ? c.innerCount : c.leafCount) += random() % 3;
            try {
                const Dag damaged = decodeCompact(bytes, c, dag.grid, "x");
                ++sound;
                ASSERT_EQ(damaged.words.size(), c.wordCount());
                computeDagStats(damaged);
            } catch (const Error& e) {
                EXPECT_EQ(e.kind(), ErrorKind::kInput);
                ++refused;
            }
        }
    }
    EXPECT_GT(refused, 1000);
    EXPECT_GT(sound, 10);
}

TEST(CompactEncoding, EachFaultIsNamed) {
    const Dag dag = sampleAsset(6, 0.02, 7).dag;
    EncodedCounts counts;
    const Bytes bytes = encodeCompact(dag, counts);
    const auto message = [](const Bytes& b, const EncodedCounts& c, const VoxelGrid& grid) {
        try {
            decodeCompact(b, c, grid, "x");
        } catch (const Error& e) {
            return std::string(e.what());
        }
        return std::string();
    };
    using testing::HasSubstr;
    EncodedCounts c = counts;
    c.innerCount = uint64_t(1) << 62;
    EXPECT_THAT(message(bytes, c, dag.grid), HasSubstr("x: its counts"));
    c = counts;
    c.referenceCount = 1;
    EXPECT_THAT(message(bytes, c, dag.grid), HasSubstr("its counts"));
    c = counts;
    --c.innerCount;
    EXPECT_THAT(message(bytes, c, dag.grid), HasSubstr("has more nodes or pointers"));
    c = counts;
    c.leafCount += 1;
    EXPECT_THAT(message(bytes, c, dag.grid), HasSubstr("exceed what the root reaches"));
    c = counts;
    c.leafCount -= 1;
    EXPECT_THAT(message(bytes, c, dag.grid), HasSubstr("more leaves than its"));
    const Bytes half(bytes.begin(), bytes.begin() + long(bytes.size() / 2));
    EXPECT_NE(message(half, counts, dag.grid), "");
    EXPECT_THAT(message(Bytes(400, 0xff), counts, dag.grid), HasSubstr("has no child"));
    VoxelGrid single; // of one voxel: a leaf of two does not fit it
    DenseGrid two(2);
    two.set(0, 0, 0);
    two.set(1, 0, 0);
    EncodedCounts one;
    const Bytes leaf = encodeCompact(dagOf(two), one);
    EXPECT_THAT(message(leaf, one, single), HasSubstr("outside the grid"));
}

TEST(RangeCoder, BitsRoundTripWithAnyProbability) {
    std::mt19937 random(57);
    for (int round = 0; round < 200; ++round) {
        // Long runs, then the unexpected; and chances that force carries.
        std::vector<uint32_t> bits;
        const uint32_t rare = 1 + uint32_t(random() % 300);
        for (int i = 0; i < 3000; ++i)
            bits.push_back((random() % rare == 0) ^ (round & 1));
        RangeEncoder encoder;
        AdaptiveBit model[4];
        for (size_t i = 0; i < bits.size(); ++i)
            i % 5 == 0 ? encoder.evenBit(bits[i]) : encoder.bit(model[i % 4], bits[i]);
        const Bytes bytes = encoder.finish();
        RangeDecoder decoder(bytes.data(), bytes.size());
        AdaptiveBit learned[4];
        for (size_t i = 0; i < bits.size(); ++i)
            ASSERT_EQ(i % 5 == 0 ? decoder.evenBit() : decoder.bit(learned[i % 4]), bits[i])
                << round << " " << i;
        EXPECT_FALSE(decoder.isPastEnd());
        for (int i = 0; i < 200; ++i)
            decoder.evenBit();
        EXPECT_TRUE(decoder.isPastEnd());
    }
}

// As often 1 as not: 1 bit. Once in 128: 0.066 bits, if the chance is learned.
TEST(RangeCoder, BitsCostTheirEntropy) {
    std::mt19937 random(58);
    for (const auto& [rare, expected] : {std::pair{2u, 1.0}, std::pair{128u, 0.0659}}) {
        RangeEncoder encoder;
        AdaptiveBit model;
        const int count = 200000;
        for (int i = 0; i < count; ++i)
            encoder.bit(model, random() % rare == 0);
        EXPECT_NEAR(8.0 * double(encoder.finish().size()) / count, expected, 0.03);
    }
}

TEST(Asset, EachStructuralFaultIsNamed) {
    const TempFile file("fault.svdag");
    Asset asset = sampleAsset(4, 0.1, 6);
    DenseGrid repeated(4); // two equal leaves, hence a reference
    repeated.set(1, 1, 1);
    repeated.set(5, 1, 1);
    repeated.set(9, 1, 2);
    asset.dag.words = dagOf(repeated).words;
    writeAsset(asset, file.path, AssetPacking::kFast);
    const Bytes whole = file.read();
    const auto with = [&](size_t at, uint64_t value, size_t count) {
        Bytes bytes = whole;
        std::memcpy(&bytes[at], &value, count);
        correctChecksums(bytes);
        return refusal(file, bytes);
    };
    using testing::HasSubstr;
    EXPECT_THAT(with(0, 'X', 1), HasSubstr("has no .svdag signature"));
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
            decodeDag(viewOf(std::as_const(bytes)), c, grid, "x");
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
    EXPECT_THROW(decodeDag(viewOf(std::as_const(leaf)), one, single, "x"), Error); // empty leaf
    leaf[0] = 3;
    EXPECT_THROW(decodeDag(viewOf(std::as_const(leaf)), one, single, "x"),
                 Error); // a voxel outside a grid of one
    leaf[0] = 1;
    EXPECT_NO_THROW(decodeDag(viewOf(std::as_const(leaf)), one, single, "x"));
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
