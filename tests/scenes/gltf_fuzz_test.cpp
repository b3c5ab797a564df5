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

/// One kind of element, of which a file may have many in little text.
struct Crowd {
    const char *member, *first, *element, *last;
};

// Each is parsed into objects of hundreds of bytes.
TEST(GltfFuzz, ManySmallElementsTakeNoMoreMemoryThanTheFilesSizeAllows) {
    const test::TemporaryFolder folder;
    for (const Crowd& crowd : {
             Crowd{"nodes", "[", "{}", "]"},
             Crowd{"nodes", "[", R"({"mesh":0})", "]"},
             Crowd{"meshes", "[", "{}", "]"},
             Crowd{"meshes", R"([{"primitives":[)", R"({"attributes":{"POSITION":0}})", "]}]"},
             Crowd{"meshes", R"([{"primitives":[{"attributes":{"POSITION":0},"targets":[)", "{}",
                   "]}]}]"},
             Crowd{"scenes", "[", "{}", "]"},
             Crowd{"scenes", R"([{"nodes":[)", "0", "]}]"},
             Crowd{"bufferViews", "[", R"({"buffer":0,"byteLength":1})", "]"},
             Crowd{"accessors", "[", R"({"componentType":5126,"count":1,"type":"VEC3"})", "]"},
             Crowd{"images", "[", R"({"bufferView":0})", "]"},
             Crowd{"textures", "[", "{}", "]"},
             Crowd{"samplers", "[", "{}", "]"},
             Crowd{"skins", "[", R"({"joints":[0]})", "]"},
             Crowd{"skins", R"([{"joints":[)", "0", "]}]"},
             Crowd{"animations", "[", "{}", "]"},
             Crowd{"animations", R"([{"channels":[)",
                   R"({"sampler":0,"target":{"node":0,"path":"scale"}})", R"(],"samplers":[]}])"},
             Crowd{"animations", R"([{"channels":[],"samplers":[)", R"({"input":0,"output":0})",
                   "]}]"},
             Crowd{"cameras", "[", R"({"type":"perspective","perspective":{"yfov":1,"znear":1}})",
                   "]"},
             Crowd{"extensions", R"({"KHR_lights_punctual":{"lights":[)", R"({"type":"point"})",
                   "]}}"},
             Crowd{"extensions", R"({"a":{"b":[)", "0", "]}}"},
             Crowd{"extensions", R"({"a":{"b":[)", R"({"c":0})", "]}}"},
             Crowd{"nodes", R"([{"extensions":{"a":{"b":[)", R"("")", "]}}}]"},
             Crowd{"unknown", "[", "{}", "]"},
             Crowd{"unknown", "[", "[]", "]"},
         }) {
        test::GltfParts parts = test::triangleFile();
        constexpr size_t kTextBytes = 2 << 20;
        std::string text = std::string(crowd.first) + crowd.element;
        while (text.size() < kTextBytes)
            text += std::string(",") + crowd.element;
        parts.set(crowd.member, text + crowd.last);
        const std::string path = folder.write("f.glb", parts.glb());
        std::string message;
        test::resetAllocationPeak();
        try {
            readGltf(path);
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::kInput) << error.what();
            message = error.what();
        }
        EXPECT_LE(test::allocationPeakBytes(), (64u << 20) + 64 * parts.glb().size())
            << crowd.member << " " << crowd.element << " " << message;
    }
}

TEST(GltfFuzz, ManyElementsAsExportersWriteThemAreRead) {
    const test::TemporaryFolder folder;
    test::GltfParts parts = test::triangleFile();
    std::string nodes = R"([{"mesh":0})";
    constexpr size_t kNodes = 150'000;
    for (size_t i = 1; i < kNodes; ++i)
        nodes += R"(,{"mesh":0,"translation":[1,2,3]})";
    parts.set("nodes", nodes + "]");
    EXPECT_EQ(readGltf(folder.write("f.glb", parts.glb())).nodes.size(), kNodes);
}

// An accessor without a buffer view is all zeros, of which a file may claim any number.
TEST(GltfFuzz, ZerosTakeNoMoreMemoryThanTheFilesSizeAllows) {
    const test::TemporaryFolder folder;
    constexpr uint64_t kFillBytes = 4u << 20;
    const auto readWith = [&](uint64_t zeroCount, uint64_t sparseCount) {
        test::GltfParts parts = test::triangleFile();
        parts.binary.resize(kFillBytes);
        const std::string zeros =
            R"({"componentType":5126,"type":"VEC3","count":)" + std::to_string(zeroCount);
        const std::string sparse =
            R"(,"sparse":{"count":1,"indices":{"bufferView":1,"componentType":5123},)"
            R"("values":{"bufferView":0}})";
        std::string accessors =
            R"([{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"},)"
            R"({"bufferView":1,"componentType":5123,"count":3,"type":"SCALAR"},)";
        accessors += zeros + (sparseCount > 0 ? sparse : "") + "}]";
        parts.set("accessors", accessors)
            .set("buffers", "[{\"byteLength\":" + std::to_string(kFillBytes) + "}]")
            .set("meshes", R"([{"primitives":[{"attributes":{"POSITION":0},"indices":1},)"
                           R"({"attributes":{"POSITION":2},"indices":1}]}])");
        const std::string path = folder.write("f.glb", parts.glb());
        test::resetAllocationPeak();
        readGltf(path);
    };
    for (const uint64_t sparse : {0, 1}) {
        EXPECT_NO_THROW(readWith(16 * kFillBytes / 12, sparse));
        EXPECT_LE(test::allocationPeakBytes(), (64u << 20) + 32 * kFillBytes);
        try {
            readWith(48 * kFillBytes / 12, sparse);
            ADD_FAILURE() << "was read in " << test::allocationPeakBytes() << " bytes";
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::kInput);
            EXPECT_THAT(error.what(),
                        testing::HasSubstr("f.glb: meshes/0/primitives/1/attributes/POSITION: "
                                           "accessor 2 has no buffer view"));
        }
    }
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
