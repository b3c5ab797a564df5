// SPDX-License-Identifier: Apache-2.0
// Masked materials of glTF files: the place of the image, the meaning of alpha, and every way in
// which it can be missing or broken.
#include "cuda/error.h"
#include "scenes/gltf.h"
#include "scenes/png_alpha.h"
#include "scenes/world.h"
#include "tests/scenes/allocation_peak.h"
#include "tests/scenes/gltf_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stb_image_write.h>

#include <filesystem>
#include <random>

namespace shadowdag {
namespace {

using test::GltfParts;
using test::readParts;
using testing::HasSubstr;

/// Two by two texels of alpha 255, 128 / 51, 0, from a file that this test wrote by hand (zlib's
/// stored block), so that other values than ours are seen.
std::string greyAlphaPng() {
    const auto word = [](uint32_t v) {
        return std::string{char(v >> 24), char(v >> 16), char(v >> 8), char(v)};
    };
    const auto chunk = [&](const std::string& type, const std::string& content) {
        uint32_t c = ~0u;
        for (const char byte : type + content)
            for (int bit = 0; bit < 8; ++bit)
                c = c >> 1 ^ ((c ^ uint32_t(uint8_t(byte) >> bit)) & 1u ? 0xedb88320u : 0u);
        return word(uint32_t(content.size())) + type + content + word(~c);
    };
    const std::string rows = {0, '\x10', '\xff', '\x20', '\x80', 0, '\x30', '\x33', '\x40', 0};
    uint32_t a = 1, b = 0;
    for (const char byte : rows) {
        a = (a + uint8_t(byte)) % 65521;
        b = (b + a) % 65521;
    }
    const std::string stored = {'\x78', '\x01', '\x01', char(rows.size()), 0, char(~rows.size()),
                                '\xff'};
    return std::string("\x89PNG\r\n\x1a\n") +
           chunk("IHDR", word(2) + word(2) + std::string{8, 4, 0, 0, 0}) +
           chunk("IDAT", stored + rows + word(b << 16 | a)) + chunk("IEND", "");
}

/// A square of two triangles with texture coordinates (accessor 2) from (0, 0) to (1, 1) and others
/// (accessor 3) of twice that; buffer view 4 is the image.
GltfParts boardFile(const std::string& image = greyAlphaPng()) {
    GltfParts parts;
    parts
        .append<float>({0, 0, 0, 1, 0, 0, 1, 0, 1, 0, 0, 1}) // 0
        .append<uint16_t>({0, 2, 1, 0, 3, 2})                // 48
        .append<float>({0, 0, 1, 0, 1, 1, 0, 1})             // 60
        .append<float>({0, 0, 2, 0, 2, 2, 0, 2});            // 92
    parts.binary += image;                                   // 124
    const std::string bytes = std::to_string(image.size());
    parts.members = {
        {"asset", R"({"version":"2.0"})"},
        {"buffers", R"([{"byteLength":)" + std::to_string(124 + image.size()) + "}]"},
        {"bufferViews",
         R"([{"buffer":0,"byteLength":48},{"buffer":0,"byteOffset":48,"byteLength":12},)"
         R"({"buffer":0,"byteOffset":60,"byteLength":32},{"buffer":0,"byteOffset":92,"byteLength":32},)"
         R"({"buffer":0,"byteOffset":124,"byteLength":)" +
             bytes + "}]"},
        {"accessors", R"([{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"},)"
                      R"({"bufferView":1,"componentType":5123,"count":6,"type":"SCALAR"},)"
                      R"({"bufferView":2,"componentType":5126,"count":4,"type":"VEC2"},)"
                      R"({"bufferView":3,"componentType":5126,"count":4,"type":"VEC2"}])"},
        {"meshes", R"([{"primitives":[{"attributes":{"POSITION":0,"TEXCOORD_0":2,"TEXCOORD_1":3},)"
                   R"("indices":1,"material":0}]}])"},
        {"materials",
         R"([{"alphaMode":"MASK","pbrMetallicRoughness":{"baseColorTexture":{"index":0}}}])"},
        {"textures", R"([{"source":0}])"},
        {"images", R"([{"bufferView":4,"mimeType":"image/png"}])"},
        {"nodes", R"([{"mesh":0}])"},
        {"scenes", R"([{"nodes":[0]}])"},
    };
    return parts;
}

std::string messageOf(const GltfParts& parts) {
    const test::TemporaryFolder folder;
    try {
        readGltf(folder.write("t.glb", parts.glb()));
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kInput);
        EXPECT_THAT(error.what(), HasSubstr("t.glb"));
        return error.what();
    }
    return "no error";
}

/// The mask of the file's material 0, which follows that of triangles without one.
std::string maskOf(const Scene& scene) {
    return test::maskOf(scene, 1);
}

std::string materialOf(const std::string& members, const std::string& texture = R"("index":0)") {
    return R"([{"alphaMode":"MASK")" + members +
           R"(,"pbrMetallicRoughness":{"baseColorTexture":{)" + texture + "}}}]";
}

// Masks beside a small file may be larger than what such a file itself may declare.
TEST(GltfMasks, ManyMaterialsShareALargeMaskBesideTheFile) {
    constexpr int kSide = 4096, kMaterials = 12;
    std::vector<uint8_t> rgba(size_t(4) * kSide * kSide, 255);
    rgba[3] = 0; // a hole
    const test::TemporaryFolder folder;
    ASSERT_NE(stbi_write_png(folder.path("leaf.png").c_str(), kSide, kSide, 4, rgba.data(), 0), 0);
    GltfParts parts = boardFile();
    std::string materials;
    for (int i = 0; i < kMaterials; ++i)
        materials += std::string(i ? "," : "") +
                     R"({"alphaMode":"MASK","pbrMetallicRoughness":{"baseColorFactor":[1,1,1,0.)" +
                     std::to_string(60 + i) + R"(],"baseColorTexture":{"index":0}}})";
    parts.set("materials", "[" + materials + "]").set("images", R"([{"uri":"leaf.png"}])");
    const Scene scene = readGltf(folder.write("t.glb", parts.glb()));
    EXPECT_EQ(scene.alphaMasks.size(), 1u);
}

TEST(GltfMasks, AlphaTimesFactorIsComparedWithTheCutoff) {
    GltfParts parts = boardFile();
    EXPECT_EQ(maskOf(readParts(parts)), "##/.."); // the default, 0.5
    const auto with = [&](const std::string& cutoff, const std::string& factor) {
        parts.set("materials", R"([{"alphaMode":"MASK","alphaCutoff":)" + cutoff +
                                   R"(,"pbrMetallicRoughness":{"baseColorFactor":[1,1,1,)" +
                                   factor + R"(],"baseColorTexture":{"index":0}}}])");
        return maskOf(readParts(parts));
    };
    EXPECT_EQ(with("0.2", "1"), "##/#.");
    EXPECT_EQ(with("0.200001", "1"), "##/..");
    EXPECT_EQ(with("0.51", "1"), "#./..");
    EXPECT_EQ(with("1", "1"), "#./..");
    EXPECT_EQ(with("1.1", "1"), "../..");
    EXPECT_EQ(with("0", "1"), "opaque");
    EXPECT_EQ(with("0.7", "0.7"), "#./.."); // equal is opaque
    EXPECT_EQ(with("0.5", "0.7"), "#./..");
    EXPECT_EQ(with("0.35", "0.7"), "##/..");
    parts.set("materials", R"([{"alphaMode":"OPAQUE","pbrMetallicRoughness":)"
                           R"({"baseColorTexture":{"index":0}}}])");
    EXPECT_EQ(maskOf(readParts(parts)), "opaque");
}

TEST(GltfMasks, WithoutATextureTheFactorAloneDecides) {
    GltfParts parts = boardFile();
    parts.set("materials", R"([{"alphaMode":"MASK"}])");
    EXPECT_EQ(maskOf(readParts(parts)), "opaque");
    parts.set("materials",
              R"([{"alphaMode":"MASK","pbrMetallicRoughness":{"baseColorFactor":[1,1,1,0.4]}}])");
    const Scene scene = readParts(parts);
    EXPECT_EQ(maskOf(scene), ".");
    const World world(scene, {});
    EXPECT_FALSE(world.triangles().masks.isOpaque(0, 0.2, 0.3, 0.5));
}

TEST(GltfMasks, WrapModesAreTheSamplers) {
    GltfParts parts = boardFile();
    EXPECT_EQ(readParts(parts).alphaMasks.at(0).wrapU, MaskWrap::kRepeat);
    parts.set("samplers", R"([{"wrapS":33648,"wrapT":33071}])")
        .set("textures", R"([{"source":0,"sampler":0}])");
    EXPECT_EQ(readParts(parts).alphaMasks.at(0).wrapU, MaskWrap::kMirror);
    EXPECT_EQ(readParts(parts).alphaMasks.at(0).wrapV, MaskWrap::kClamp);
}

TEST(GltfMasks, TextureCoordinatesAreThoseOfTheSetNamed) {
    GltfParts parts = boardFile();
    EXPECT_EQ(readParts(parts).meshes.at(0).uv,
              (std::vector<glm::vec2>{{0, 0}, {1, 0}, {1, 1}, {0, 1}}));
    parts.set("materials", materialOf("", R"("index":0,"texCoord":1)"));
    EXPECT_EQ(readParts(parts).meshes.at(0).uv,
              (std::vector<glm::vec2>{{0, 0}, {2, 0}, {2, 2}, {0, 2}}));
    parts.set("materials", R"([{}])");
    EXPECT_TRUE(readParts(parts).meshes.at(0).uv.empty()) << "nothing is cut, nothing is kept";
}

TEST(GltfMasks, PrimitivesThatShareCornersKeepTheirOwnCoordinates) {
    GltfParts parts = boardFile();
    const auto primitive = [](const char* set, int material) {
        return R"({"attributes":{"POSITION":0,"TEXCOORD_0":)" + std::string(set) +
               R"(},"indices":1,"material":)" + std::to_string(material) + "}";
    };
    std::string materials = materialOf("");
    materials.insert(materials.size() - 1, ",{}");
    parts.set("materials", materials)
        .set("meshes", R"([{"primitives":[)" + primitive("2", 1) + "," + primitive("2", 0) + "," +
                           primitive("3", 0) + "," + primitive("3", 1) + "]}]");
    const Scene scene = readParts(parts);
    const Mesh& mesh = scene.meshes.at(0);
    EXPECT_EQ(mesh.positions.size(), 8u) << "solid primitives share the vertices of cut ones";
    const World world(scene, {});
    const AlphaMaskView masks = world.triangles().masks;
    for (uint32_t t = 0; t < 8; ++t)
        EXPECT_EQ(masks.isCut(t), t >= 2 && t < 6);
    EXPECT_EQ(masks.cuts[masks.triangleCut[2]].uv[1], glm::vec2(1, 1));
    EXPECT_EQ(masks.cuts[masks.triangleCut[4]].uv[1], glm::vec2(2, 2));
}

// KHR_texture_transform: scaled, then turned counter-clockwise as seen with v downwards, then
// moved.
TEST(GltfMasks, TextureTransformsAreApplied) {
    GltfParts parts = boardFile();
    parts.set("materials",
              materialOf("", R"("index":0,"extensions":{"KHR_texture_transform":{)"
                             R"("offset":[0.5,0.25],"rotation":1.5707963267948966,"scale":[2,4],)"
                             R"("texCoord":0}})"));
    const std::vector<glm::vec2> uv = readParts(parts).meshes.at(0).uv;
    ASSERT_EQ(uv.size(), 4u);
    const glm::vec2 expected[4] = {{0.5, 0.25}, {0.5, -1.75}, {4.5, -1.75}, {4.5, 0.25}};
    for (int i = 0; i < 4; ++i)
        for (int axis = 0; axis < 2; ++axis)
            EXPECT_NEAR(uv[size_t(i)][axis], expected[i][axis], 1e-6);
}

std::string base64(const std::string& bytes) {
    static const char* kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    for (size_t i = 0; i < bytes.size(); i += 3) {
        uint32_t v = 0;
        for (size_t k = 0; k < 3; ++k)
            v = v << 8 | (i + k < bytes.size() ? uint8_t(bytes[i + k]) : 0u);
        for (size_t k = 0; k < 4; ++k)
            text += i + k <= bytes.size() ? kDigits[v >> (18 - 6 * k) & 63u] : '=';
    }
    return text;
}

TEST(GltfMasks, ImagesAreFoundInBuffersInTheTextAndBesideTheFile) {
    const test::TemporaryFolder folder;
    std::filesystem::create_directory(folder.path("tex"));
    folder.write("tex/a leaf.png", greyAlphaPng());
    folder.write("odd.name", greyAlphaPng());
    GltfParts parts = boardFile();
    for (const std::string& image :
         {std::string(R"({"bufferView":4,"mimeType":"image/png"})"),
          R"({"uri":"data:image/png;base64,)" + base64(greyAlphaPng()) + "\"}",
          std::string(R"({"uri":"tex/a%20leaf.png"})"), std::string(R"({"uri":"odd.name"})")}) {
        parts.set("images", "[" + image + "]");
        EXPECT_EQ(maskOf(readGltf(folder.write("t.glb", parts.glb()))), "##/..") << image;
    }
}

TEST(GltfMasks, DataUrisOfEverySpellingAreRead) {
    const std::string data = base64(greyAlphaPng());
    std::string escaped; // as System.Text.Json and PHP write it
    for (const char c : data)
        escaped += c == '+' ? "\\u002B" : c == '/' ? "\\/" : std::string(1, c);
    std::string percent, lines;
    for (size_t i = 0; i < data.size(); ++i) {
        percent += data[i] == '=' ? "%3D" : data[i] == '+' ? "%2b" : std::string(1, data[i]);
        lines += data[i] + std::string(i % 76 == 75 ? "\\r\\n" : "");
    }
    const std::string unpadded = data.substr(0, data.find('='));
    GltfParts parts = boardFile();
    for (const std::string& uri :
         {"DATA:image/png;base64," + data, "data:image/png;BASE64," + data, "data:;base64," + data,
          "data:image/png;charset=utf-8;base64," + data, "data:image\\/png;base64," + escaped,
          "data:application/x-anything;base64," + percent, "data:image/png;base64," + lines,
          "data:image/png;base64," + unpadded}) {
        parts.set("images", "[{\"uri\":\"" + uri + "\"}]");
        EXPECT_EQ(maskOf(readParts(parts)), "##/..") << uri;
    }
}

TEST(GltfMasks, DataUrisThatCannotBeReadAreRefusedByTheirImage) {
    const std::string data = base64(greyAlphaPng());
    GltfParts parts = boardFile();
    for (const auto& [uri, problem] : std::vector<std::pair<std::string, std::string>>{
             {"data:image/png," + data, "its data URI is not base64"},
             {"data:image/svg+xml;utf8,<svg/>", "its data URI is not base64"},
             {"data:image/png;base64", "its data URI has no comma before its data"},
             {"data:image/png;base64,", "its data URI is empty"},
             {"data:image/png;base64,AAAA!AAA", "its data URI has '!' in its base64"},
             {"data:image/png;base64,AAAAA", "its data URI ends within a byte"},
         }) {
        parts.set("images", "[{\"uri\":\"" + uri + "\"}]");
        EXPECT_THAT(messageOf(parts), HasSubstr("t.glb: images/0: " + problem)) << uri;
    }
    // Of colours alone it is a warning.
    parts.set("materials", R"([{"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}}])");
    EXPECT_THAT(readParts(parts).warnings,
                testing::ElementsAre(HasSubstr("images/0: its data URI ends within a byte")));
}

TEST(GltfMasks, EqualMasksAreKeptOnceAndSharedImagesDecodeAlike) {
    GltfParts parts = boardFile();
    std::string list;
    for (const char* cutoff : {"0.5", "0.1", "0.5", "1.1"})
        list += std::string(list.empty() ? "" : ",") + R"({"alphaMode":"MASK","alphaCutoff":)" +
                cutoff + R"(,"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}})";
    parts.set("materials", "[" + list + "]");
    const Scene scene = readParts(parts);
    EXPECT_EQ(scene.alphaMasks.size(), 3u);
    EXPECT_EQ(scene.materials[1].alphaMask, scene.materials[3].alphaMask);
    EXPECT_NE(scene.materials[1].alphaMask, scene.materials[2].alphaMask);
}

TEST(GltfMasks, UnsupportedMasksAreReported) {
    GltfParts parts = boardFile();
    const auto expectWarning = [&](const std::string& start) {
        EXPECT_THAT(readParts(parts).warnings, testing::Contains(testing::StartsWith(start)));
    };
    EXPECT_TRUE(readParts(parts).warnings.empty()) << "a grey image";
    parts.set("materials", R"([{"alphaMode":"BLEND"}])");
    expectWarning("1 translucent materials taken as opaque");
    parts = boardFile(std::string("\xff\xd8\xff\xe0 no pixels are needed"));
    EXPECT_EQ(maskOf(readParts(parts)), "opaque") << "a JPEG has no alpha";
    expectWarning("materials/0 has its base colour factor alone: images/0: the JPEG is damaged");
    parts = boardFile("RIFF....WEBPVP8 ");
    EXPECT_EQ(maskOf(readParts(parts)), "opaque");
    expectWarning("1 masked materials taken as opaque: their textures are neither PNG nor JPEG");
    parts = boardFile();
    parts.set("textures", R"([{"extensions":{"EXT_texture_webp":{"source":0}}}])");
    expectWarning("1 masked materials taken as opaque");
    parts = boardFile();
    parts.set("meshes", R"([{"primitives":[{"attributes":{"POSITION":0,"COLOR_0":0},)"
                        R"("indices":1,"material":0}]}])");
    expectWarning("1 primitives with a masked material have no texture coordinates");
    expectWarning("1 primitives with a masked material have vertex colours");
}

TEST(GltfMasks, EveryBrokenPartHasItsMessage) {
    struct Case {
        const char *member, *text, *message;
    };
    const std::string texture =
        R"([{"alphaMode":"MASK","pbrMetallicRoughness":{"baseColorTexture":)";
    const std::string wrong[] = {texture + R"({"index":7}}}])",
                                 texture + R"({"index":0,"texCoord":-2}}}])",
                                 texture + R"({"index":0,"extensions":{"KHR_texture_transform":)"
                                           R"({"scale":[1]}}}}}])",
                                 texture + R"({"index":0,"extensions":{"KHR_texture_transform":)"
                                           R"({"offset":[1,"x"]}}}}}])",
                                 texture + R"({"index":0,"extensions":{"KHR_texture_transform":)"
                                           R"({"texCoord":1000}}}}}])"};
    for (
        const Case& c : {
            Case{"materials", wrong[0].c_str(), "refers to texture 7 of 1"},
            Case{"materials", wrong[1].c_str(), "-2 is no set of coordinates"},
            Case{"materials", wrong[2].c_str(), "scale: is not a pair of numbers"},
            Case{"materials", wrong[3].c_str(), "is not a number within 1e30"},
            Case{"materials", wrong[4].c_str(), "is no set of coordinates"},
            Case{"textures", R"([{"source":3}])", "refers to image 3 of 1"},
            Case{"textures", R"([{"source":0,"sampler":1}])", "refers to sampler 1 of 0"},
            Case{"images", R"([{"uri":"absent.png"}])",
                 "images/0 ('absent.png'): no such file; put it beside"},
            Case{"images", R"([{"uri":"../leaf.png"}])", "is outside the file's folder"},
            Case{"images", R"([{"uri":"/etc/leaf.png"}])", "is outside the file's folder"},
            Case{"images", R"([{"uri":"%2e%2e/leaf.png"}])", "is outside the file's folder"},
            Case{"images", R"([{"bufferView":4,"name":"leaf"},{"uri":"x.png"}])", "no error"},
            Case{
                "meshes",
                R"([{"primitives":[{"attributes":{"POSITION":0,"TEXCOORD_0":1},"indices":1,"material":0}]}])",
                "components an element, not 2"},
        }) {
        GltfParts parts = boardFile();
        parts.set(c.member, c.text);
        EXPECT_THAT(messageOf(parts), HasSubstr(c.message));
    }
    GltfParts parts = boardFile();
    parts.set("samplers", R"([{"wrapS":1}])").set("textures", R"([{"source":0,"sampler":0}])");
    EXPECT_THAT(messageOf(parts), HasSubstr("wrap mode 1 does not exist"));
    std::string damaged = greyAlphaPng();
    damaged[50] = char(damaged[50] ^ 4);
    EXPECT_THAT(messageOf(boardFile(damaged)), HasSubstr("images/0: the PNG is damaged"));
    parts = boardFile(damaged);
    parts.set("images", R"([{"bufferView":4,"name":"leaf"}])");
    EXPECT_THAT(messageOf(parts), HasSubstr("images/0 ('leaf'): the PNG is damaged"));
}

TEST(GltfMasks, ManyMasksOfOneImageAreRefusedBeforeTheyFillTheMemory) {
    // Rows of every alpha, so that each cutoff gives another mask.
    constexpr int kSide = 4096;
    std::vector<uint8_t> greyAlpha(size_t(2) * kSide * kSide);
    for (size_t i = 0; i < greyAlpha.size() / 2; ++i)
        greyAlpha[2 * i + 1] = uint8_t(i / kSide);
    std::string png;
    stbi_write_png_to_func(
        [](void* out, void* data, int count) {
            static_cast<std::string*>(out)->append(static_cast<const char*>(data), size_t(count));
        },
        &png, kSide, kSide, 2, greyAlpha.data(), 2 * kSide);
    GltfParts parts = boardFile(png);
    std::string list;
    for (int i = 0; i < 100; ++i)
        list += std::string(i ? "," : "") + R"({"alphaMode":"MASK","alphaCutoff":0.)" +
                std::to_string(100 + i) +
                R"(,"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}})";
    parts.set("materials", "[" + list + "]");
    EXPECT_THAT(messageOf(parts), HasSubstr("declares more than"));
}

// Bit flips and cuts over a file whose mask is read: an error or a sound scene, in little memory.
TEST(GltfMasks, DamagedFilesAreRefusedOrSound) {
    const test::TemporaryFolder folder;
    const std::string whole = boardFile().glb();
    constexpr unsigned kSeed = 20260301;
    std::mt19937 random(kSeed);
    size_t readCount = 0;
    const auto survives = [&](const std::string& bytes) {
        test::resetAllocationPeak();
        try {
            const Scene scene = readGltf(folder.write("f.glb", bytes));
            test::expectSound(scene, "f.glb");
            ++readCount;
            const World world(scene, {});
            const AlphaMaskView masks = world.triangles().masks;
            for (uint32_t t = 0; t < world.triangles().count(); ++t)
                if (masks.isCut(t))
                    masks.isOpaque(t, 0.25, 0.5, 0.25);
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::kInput) << error.what();
        }
        EXPECT_LE(test::allocationPeakBytes(), 64u << 20);
    };
    for (size_t length = 0; length < whole.size(); length += 3)
        survives(whole.substr(0, length));
    EXPECT_EQ(readCount, 0u);
    for (int i = 0; i < 1000; ++i) {
        std::string damaged = whole;
        const size_t bit = random() % (8 * whole.size());
        damaged[bit / 8] = char(damaged[bit / 8] ^ (1 << (bit % 8)));
        survives(damaged);
        ASSERT_FALSE(HasFailure()) << "seed " << kSeed << ", flip " << i << ", bit " << bit;
    }
    EXPECT_GT(readCount, 100u);
    EXPECT_LT(readCount, 900u);
}

// The files of Khronos' asset generator, whose image is a placeholder without alpha here: only the
// cutoff of 1.1 is out of reach.
TEST(GltfMasks, AssetGeneratorsFilesAreCutByTheirCutoff) {
    if (test::sharedScenes().empty())
        GTEST_SKIP() << "the shared scenes are absent; SDAG_SHARED_SCENES names their folder";
    for (int i = 0; i <= 6; ++i) {
        const Scene scene = readGltf(test::sharedScenes() +
                                     "conformance/asset-generator-0.6/Material_AlphaMask/"
                                     "Material_AlphaMask_0" +
                                     std::to_string(i) + ".gltf");
        EXPECT_EQ(maskOf(scene), i == 3 ? "." : "opaque") << i;
    }
}

} // namespace
} // namespace shadowdag
