// SPDX-License-Identifier: Apache-2.0
// Base colour textures of glTF files: which material has which, where coordinates are kept, and
// that a texture that cannot be shown is a warning.
#include "cuda/error.h"
#include "scenes/gltf_reader.h"
#include "scenes/world.h"
#include "tests/scenes/gltf_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stb_image_write.h>

namespace shadowdag {
namespace {

using test::GltfParts;
using test::readParts;
using testing::HasSubstr;

std::string pngOf(uint32_t width, uint32_t height, const std::vector<uint8_t>& rgb) {
    std::string bytes;
    stbi_write_png_to_func(
        [](void* out, void* data, int count) {
            static_cast<std::string*>(out)->append(static_cast<const char*>(data), size_t(count));
        },
        &bytes, int(width), int(height), 3, rgb.data(), int(3 * width));
    return bytes;
}

/// Black and red above green and white.
std::string fourTexels() {
    return pngOf(2, 2, {0, 0, 0, 255, 0, 0, 0, 255, 0, 255, 255, 255});
}

/// A square of two triangles with texture coordinates (accessor 2) from (0, 0) to (1, 1) and others
/// (accessor 3) of twice that; buffer view 4 is the image, material 1 has no texture.
GltfParts boardFile(const std::string& image = fourTexels()) {
    GltfParts parts;
    parts.append<float>({0, 0, 0, 1, 0, 0, 1, 0, 1, 0, 0, 1})
        .append<uint16_t>({0, 2, 1, 0, 3, 2})
        .append<float>({0, 0, 1, 0, 1, 1, 0, 1})
        .append<float>({0, 0, 2, 0, 2, 2, 0, 2});
    parts.binary += image;
    parts.members = {
        {"asset", R"({"version":"2.0"})"},
        {"buffers", R"([{"byteLength":)" + std::to_string(parts.binary.size()) + "}]"},
        {"bufferViews",
         R"([{"buffer":0,"byteLength":48},{"buffer":0,"byteOffset":48,"byteLength":12},)"
         R"({"buffer":0,"byteOffset":60,"byteLength":32},{"buffer":0,"byteOffset":92,"byteLength":32},)"
         R"({"buffer":0,"byteOffset":124,"byteLength":)" +
             std::to_string(image.size()) + "}]"},
        {"accessors", R"([{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"},)"
                      R"({"bufferView":1,"componentType":5123,"count":6,"type":"SCALAR"},)"
                      R"({"bufferView":2,"componentType":5126,"count":4,"type":"VEC2"},)"
                      R"({"bufferView":3,"componentType":5126,"count":4,"type":"VEC2"}])"},
        {"meshes", R"([{"primitives":[{"attributes":{"POSITION":0,"TEXCOORD_0":2,"TEXCOORD_1":3},)"
                   R"("indices":1,"material":0}]},)"
                   R"({"primitives":[{"attributes":{"POSITION":0,"TEXCOORD_0":2},"indices":1,)"
                   R"("material":1}]}])"},
        {"materials", R"([{"name":"bark","pbrMetallicRoughness":{"baseColorFactor":[0.5,1,1,1],)"
                      R"("baseColorTexture":{"index":0}}},{}])"},
        {"textures", R"([{"source":0}])"},
        {"images", R"([{"bufferView":4,"mimeType":"image/png"}])"},
        {"nodes", R"([{"mesh":1},{"mesh":0},{"mesh":0,"scale":[-1,1,1]}])"},
        {"scenes", R"([{"nodes":[0,1,2]}])"},
    };
    return parts;
}

TEST(GltfTextures, AMaterialHasItsTextureAndFactor) {
    const Scene scene = readParts(boardFile());
    EXPECT_TRUE(scene.warnings.empty());
    ASSERT_EQ(scene.textures.textures.size(), 1u);
    EXPECT_EQ(scene.materials.at(1).baseColorTexture, 0);
    EXPECT_EQ(scene.materials.at(1).baseColor, glm::vec3(0.5f, 1, 1));
    EXPECT_EQ(scene.materials.at(2).baseColorTexture, kNone);
    EXPECT_EQ(scene.textures.texels.size(), 5u) << "level 0 and its mean";
    EXPECT_EQ(scene.textures.texels[1], 0x0000ffu);
    EXPECT_EQ(scene.textures.texels[2], 0x00ff00u);
}

TEST(GltfTextures, CoordinatesAreKeptForMeshesWithTexturesAlone) {
    const Scene scene = readParts(boardFile());
    EXPECT_FALSE(scene.meshes.at(0).uv.empty());
    EXPECT_TRUE(scene.meshes.at(1).uv.empty());
    const World world(scene, {});
    const BaseColorView colors = world.baseColors();
    EXPECT_EQ(colors.uv.count, 4u) << "instances share them";
    const TriangleView triangles = world.triangles();
    for (size_t t = 2; t < 6; ++t)
        for (int corner = 0; corner < 3; ++corner) {
            const uint32_t vertex = triangles.triangles[t][corner];
            const glm::vec3 p = triangles.positions[vertex];
            const uint32_t instance = world.triangleInstance()[t];
            EXPECT_EQ(colors.uv[vertex + colors.instanceUv[instance]],
                      glm::vec2(std::fabs(p.x), p.z));
        }
    GltfParts parts = boardFile();
    parts.set("materials", "[{},{}]");
    const Scene plain = readParts(parts);
    EXPECT_TRUE(World(plain, {}).baseColors().empty());
    EXPECT_TRUE(plain.meshes.at(0).uv.empty());
}

TEST(GltfTextures, SamplersSetsAndTransformsAreRead) {
    GltfParts parts = boardFile();
    parts.set("samplers", R"([{"wrapS":33648,"wrapT":33071,"magFilter":9728}])")
        .set("textures", R"([{"source":0,"sampler":0},{"source":0}])")
        .set("materials",
             R"([{"pbrMetallicRoughness":{"baseColorTexture":{"index":0,"texCoord":1}}},)"
             R"({"pbrMetallicRoughness":{"baseColorTexture":{"index":1,"extensions":)"
             R"({"KHR_texture_transform":{"offset":[3,0],"scale":[2,1]}}}}}])");
    const Scene scene = readParts(parts);
    ASSERT_EQ(scene.textures.textures.size(), 2u);
    const TextureInfo& first = scene.textures.textures[0];
    EXPECT_EQ(first.wrapU, MaskWrap::kMirror);
    EXPECT_EQ(first.wrapV, MaskWrap::kClamp);
    EXPECT_EQ(first.isNearest, 1u);
    EXPECT_EQ(scene.meshes[0].uv[2], glm::vec2(2, 2));
    EXPECT_EQ(scene.meshes[1].uv[2], glm::vec2(5, 1));
}

TEST(GltfTextures, OneColourBecomesAPartOfTheFactor) {
    const Scene scene = readParts(boardFile(pngOf(2, 1, {255, 128, 0, 255, 128, 0})));
    EXPECT_TRUE(scene.textures.textures.empty());
    EXPECT_EQ(scene.materials[1].baseColorTexture, kNone);
    EXPECT_NEAR(scene.materials[1].baseColor.x, 0.5f, 1e-7f);
    EXPECT_NEAR(scene.materials[1].baseColor.y, 0.2158605f, 1e-6f);
    EXPECT_EQ(scene.materials[1].baseColor.z, 0.0f);
    EXPECT_TRUE(scene.meshes[0].uv.empty());
}

TEST(GltfTextures, WhatCannotBeShownIsAWarningThatNamesTheMaterial) {
    const auto expectWarning = [](const GltfParts& parts, const std::string& reason) {
        const Scene scene = readParts(parts);
        EXPECT_EQ(scene.materials[1].baseColorTexture, kNone);
        EXPECT_EQ(scene.materials[1].baseColor, glm::vec3(0.5f, 1, 1));
        ASSERT_EQ(scene.warnings.size(), 1u) << reason;
        EXPECT_THAT(scene.warnings[0],
                    HasSubstr("materials/0 ('bark') has its base colour factor alone: " + reason));
    };
    std::string damaged = fourTexels();
    damaged[45] = char(damaged[45] ^ 4);
    expectWarning(boardFile(damaged), "images/0: the PNG is damaged");
    expectWarning(boardFile("\xabKTX 20\xbb\r\n\x1a\n"), "images/0: a KTX2 image, but only");
    GltfParts parts = boardFile();
    parts.set("images", R"([{"uri":"absent.png"}])");
    expectWarning(parts, "images/0 ('absent.png'): no such file");
    parts.set("images", R"([{"uri":"../leaf.png"}])");
    expectWarning(parts, "images/0 ('../leaf.png'): ");
    parts = boardFile();
    parts.set("textures", R"([{"extensions":{"KHR_texture_basisu":{"source":0}}}])");
    expectWarning(parts, "its texture: has an image only by an extension");
}

// A vertex has one pair of texture coordinates, which the mask needs.
TEST(GltfTextures, ATextureWithOtherCoordinatesThanItsMaterialsMaskIsAWarning) {
    GltfParts parts = boardFile();
    parts.set("materials", R"([{"name":"bark","alphaMode":"MASK","pbrMetallicRoughness":)"
                           R"({"baseColorTexture":{"index":0}}},{}])");
    const std::string bytes = parts.glb();
    const auto readWith = [&](const OpacityMap& map) {
        const test::TemporaryFolder folder;
        return readGltf(folder.path("t.obj"), {{bytes.begin(), bytes.end()}, {map, {}}, {}});
    };
    OpacityMap map;
    map.texture = 0;
    map.mayBeGrey = 1;
    const Scene alike = readWith(map);
    EXPECT_NE(alike.materials[1].alphaMask, kNone);
    EXPECT_NE(alike.materials[1].baseColorTexture, kNone);
    EXPECT_THAT(alike.warnings, testing::IsEmpty());
    OpacityMap scaled = map, moved = map, other = map;
    scaled.uvScale = {2, 2};
    moved.uvOffset = {0, 0.5f};
    other.texCoord = 1;
    for (const OpacityMap& unlike : {scaled, moved, other}) {
        const Scene scene = readWith(unlike);
        EXPECT_NE(scene.materials[1].alphaMask, kNone);
        EXPECT_EQ(scene.materials[1].baseColorTexture, kNone);
        ASSERT_EQ(scene.warnings.size(), 1u);
        EXPECT_THAT(scene.warnings[0],
                    HasSubstr("materials/0 ('bark') has its base colour factor alone: its texture "
                              "and its opacity map have different texture coordinates"));
    }
    // A mask that cuts nothing needs no coordinates.
    parts.set("materials", R"([{"alphaMode":"MASK","alphaCutoff":0,"pbrMetallicRoughness":)"
                           R"({"baseColorTexture":{"index":0}}},{}])");
    const std::string whole = parts.glb();
    const test::TemporaryFolder folder;
    const Scene uncut =
        readGltf(folder.path("t.obj"), {{whole.begin(), whole.end()}, {scaled, {}}, {}});
    EXPECT_NE(uncut.materials[1].baseColorTexture, kNone);
}

TEST(GltfTextures, ImagesOfOneSourceAreOne) {
    GltfParts parts = boardFile();
    std::string images, textures, materials;
    for (int i = 0; i < 40; ++i) {
        const std::string comma = i == 0 ? "" : ",", n = std::to_string(i);
        images += comma + (i == 20 ? R"({"bufferView":5,"mimeType":"image/png"})"
                                   : R"({"bufferView":4,"mimeType":"image/png"})");
        textures += comma + R"({"source":)" + n + "}";
        materials += comma + R"({"pbrMetallicRoughness":{"baseColorTexture":{"index":)" + n + "}}}";
    }
    // Another view of the same bytes but the last, which ends the file's last chunk.
    const std::string& views = parts.members.at("bufferViews");
    const size_t count = fourTexels().size();
    parts.set("bufferViews", views.substr(0, views.size() - 1) +
                                 R"(,{"buffer":0,"byteOffset":124,"byteLength":)" +
                                 std::to_string(count - 1) + "}]");
    parts.set("images", "[" + images + "]").set("textures", "[" + textures + "]");
    parts.set("materials", "[" + materials + "]");
    const std::string bytes = parts.glb();
    const gltf::Document document = gltf::loadDocument("t.glb", {bytes.begin(), bytes.end()});
    for (int i = 0; i < 40; ++i)
        EXPECT_EQ(document.firstAlike.at(size_t(i)), i == 20 ? 20 : 0);
    const Scene scene = readParts(parts);
    EXPECT_EQ(scene.textures.textures.size(), 1u);
    ASSERT_EQ(scene.warnings.size(), 1u);
    EXPECT_THAT(scene.warnings[0], HasSubstr("materials/20 has its base colour factor alone"));
}

TEST(GltfTextures, ImagesOfMoreTexelsThanAnySceneHasAreNotDecoded) {
    gltf::Document document;
    document.path = "t.glb";
    document.inputBytes = 1000;
    gltf::AccessorReader accessors(document);
    const std::string file = fourTexels();
    const gltf::ImageBytes bytes{reinterpret_cast<const uint8_t*>(file.data()), file.size(), {}};
    EXPECT_EQ(gltf::decodeColors(document, accessors, bytes, "images/0").rgb.size(), 12u);
    EXPECT_EQ(gltf::decodeAlpha(document, accessors, bytes, "images/0").alpha.size(), 4u);
    accessors.addTexels(4 * kMaxSceneTexels + 64 * 1000 - 8);
    EXPECT_EQ(gltf::decodeColors(document, accessors, bytes, "images/1").width, 2u);
    const std::string cut = file.substr(0, 40);
    const gltf::ImageBytes damaged{reinterpret_cast<const uint8_t*>(cut.data()), cut.size(), {}};
    gltf::AccessorReader others(document);
    others.addTexels(4 * kMaxSceneTexels + 64 * 1000);
    EXPECT_THROW(gltf::decodeColors(document, others, damaged, "images/1"), Error);
    EXPECT_THROW(others.checkTexels(0, "images/2"), Error) << "a damaged one was decoded as well";
    EXPECT_NO_THROW(others.checkTexels(1 << 20, "images/2")) << "a large file beside may hold more";
    for (const bool isColor : {true, false})
        try {
            if (isColor)
                gltf::decodeColors(document, accessors, bytes, "images/2");
            else
                gltf::decodeAlpha(document, accessors, bytes, "images/2");
            ADD_FAILURE() << "was decoded";
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::kInput);
            EXPECT_THAT(error.what(),
                        testing::StartsWith("t.glb: images/2: the images before it have "
                                            "1073805828 texels, and 1073805824 are the most"));
        }
}

TEST(GltfTextures, ManyThatCannotBeShownAreCounted) {
    GltfParts parts = boardFile("DDS ");
    std::string list;
    for (int i = 0; i < 9; ++i)
        list += std::string(i ? "," : "") +
                R"({"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}})";
    parts.set("materials", "[" + list + "]");
    const Scene scene = readParts(parts);
    ASSERT_EQ(scene.warnings.size(), 5u);
    EXPECT_THAT(scene.warnings[4], HasSubstr("5 more materials have their base colour factor"));
}

} // namespace
} // namespace shadowdag
