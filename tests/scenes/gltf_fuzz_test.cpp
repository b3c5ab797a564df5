// SPDX-License-Identifier: Apache-2.0
// The glTF reader on cut and damaged files: an Error or a sound scene, in little memory.
#include "cuda/error.h"
#include "scenes/gltf.h"
#include "scenes/world.h"
#include "tests/scenes/allocation_peak.h"
#include "tests/scenes/gltf_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

namespace shadowdag {
namespace {

// A file with everything that the reader reads: sparse, animation, light, camera, material.
test::GltfParts richFile() {
    test::GltfParts parts = test::triangleFile();
    parts
        .append<uint8_t>({2, 0, 0, 0})            // 44: sparse index
        .append<float>({7, 8, 9})                 // 48: sparse value
        .append<float>({0, 1})                    // 60: key times
        .append<float>({0, 0, 0, 1, 0, 1, 0, 0}); // 68: rotations
    parts.set("buffers", R"([{"byteLength":100}])")
        .set(
            "bufferViews",
            R"([{"buffer":0,"byteLength":36},{"buffer":0,"byteOffset":36,"byteLength":6},)"
            R"({"buffer":0,"byteOffset":44,"byteLength":1},{"buffer":0,"byteOffset":48,"byteLength":12},)"
            R"({"buffer":0,"byteOffset":60,"byteLength":8},{"buffer":0,"byteOffset":68,"byteLength":32}])")
        .set("accessors",
             R"([{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","sparse":{"count":1,)"
             R"("indices":{"bufferView":2,"componentType":5121},"values":{"bufferView":3}}},)"
             R"({"bufferView":1,"componentType":5123,"count":3,"type":"SCALAR"},)"
             R"({"bufferView":4,"componentType":5126,"count":2,"type":"SCALAR"},)"
             R"({"bufferView":5,"componentType":5126,"count":2,"type":"VEC4"}])")
        .set("meshes",
             R"([{"primitives":[{"attributes":{"POSITION":0},"indices":1,"material":0}]}])")
        .set("materials", R"([{"pbrMetallicRoughness":{"baseColorFactor":[1,0.5,0.25,1]}}])")
        .set("extensionsUsed", R"(["KHR_lights_punctual"])")
        .set("extensions",
             R"({"KHR_lights_punctual":{"lights":[{"type":"spot","range":3,"spot":{}}]}})")
        .set("cameras", R"([{"type":"perspective","perspective":{"yfov":1,"znear":0.5}}])")
        .set(
            "nodes",
            R"([{"children":[1,2],"rotation":[0,0,0,1]},{"mesh":0,"scale":[1,-2,1]},)"
            R"({"camera":0,"extensions":{"KHR_lights_punctual":{"light":0}},"translation":[0,1,5]}])")
        .set("animations", R"([{"channels":[{"sampler":0,"target":{"node":0,"path":"rotation"}}],)"
                           R"("samplers":[{"input":2,"output":3}]}])");
    return parts;
}

// Reads the bytes; returns whether they were read. Everything but an Error that names the file
// fails.
bool survives(const test::TemporaryFolder& folder, const std::string& bytes) {
    const std::string path = folder.write("f.glb", bytes);
    test::resetAllocationPeak();
    bool isRead = false;
    try {
        const Scene scene = readGltf(path);
        test::expectSound(scene, path);
        isRead = true;
        World world(scene, {});
        world.setTime(0.5f);
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kInput) << error.what();
    }
    // 16 MiB are free to tiny files (see AccessorReader), and as much again holds what is made of
    // them.
    EXPECT_LE(test::allocationPeakBytes(), 64u << 20);
    return isRead;
}

TEST(GltfFuzz, WholeFileIsRead) {
    const test::TemporaryFolder folder;
    EXPECT_TRUE(survives(folder, richFile().glb()));
    EXPECT_TRUE(survives(folder, richFile().json()) == false) << "the text alone has no buffer";
}

TEST(GltfFuzz, EveryTruncationIsRefused) {
    const test::TemporaryFolder folder;
    const std::string whole = richFile().glb();
    for (size_t length = 0; length < whole.size(); ++length)
        ASSERT_FALSE(survives(folder, whole.substr(0, length))) << length << " bytes";
}

TEST(GltfFuzz, ThousandBitFlipsAreRefusedOrSound) {
    const test::TemporaryFolder folder;
    const std::string whole = richFile().glb();
    constexpr unsigned kSeed = 20250117;
    std::mt19937 random(kSeed);
    size_t readCount = 0;
    for (int i = 0; i < 1000; ++i) {
        std::string damaged = whole;
        const size_t bit = random() % (8 * whole.size());
        damaged[bit / 8] = char(damaged[bit / 8] ^ (1 << (bit % 8)));
        readCount += survives(folder, damaged);
        ASSERT_FALSE(HasFailure()) << "seed " << kSeed << ", flip " << i << ", bit " << bit;
    }
    EXPECT_GT(readCount, 100u) << "nearly all are refused: the flips test little";
    EXPECT_LT(readCount, 900u);
}

// Numbers are where files lie; a flipped bit seldom makes a large one.
TEST(GltfFuzz, ReplacedNumbersAreRefusedOrSound) {
    const test::TemporaryFolder folder;
    const test::GltfParts whole = richFile();
    constexpr const char* kNumbers[] = {"-1",
                                        "0",
                                        "1",
                                        "3",
                                        "255",
                                        "65536",
                                        "2147483647",
                                        "4294967295",
                                        "18446744073709551615",
                                        "-9223372036854775808",
                                        "1e300",
                                        "0.5",
                                        "-1e-300"};
    for (const auto& [member, text] : whole.members) {
        for (size_t at = 0; at < text.size(); ++at) {
            if (!std::isdigit(static_cast<unsigned char>(text[at])) ||
                (at > 0 && std::isalnum(static_cast<unsigned char>(text[at - 1]))) ||
                text[at - 1] == '.')
                continue;
            size_t end = at;
            while (std::isdigit(static_cast<unsigned char>(text[end])) || text[end] == '.')
                ++end;
            for (const char* number : kNumbers) {
                test::GltfParts damaged = whole;
                damaged.set(member, text.substr(0, at) + number + text.substr(end));
                survives(folder, damaged.glb());
                ASSERT_FALSE(HasFailure()) << damaged.members[member];
            }
        }
    }
}

} // namespace
} // namespace shadowdag
