// SPDX-License-Identifier: Apache-2.0
// The glTF reader on small files made here: supported features, ignored ones with their warnings,
// and every error message. More than 500 lines because the broken parts are a table.
#include "scenes/gltf.h"

#include "cuda/error.h"
#include "scenes/scene_folder.h"
#include "scenes/world.h"
#include "tests/scenes/gltf_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sys/stat.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>

namespace shadowdag {
namespace {

using test::GltfParts;
using test::readParts;
using test::TemporaryFolder;
using test::triangleFile;
using testing::HasSubstr;

std::string messageOf(const std::string& fileName, const std::string& content) {
    const TemporaryFolder folder;
    try {
        readGltf(folder.write(fileName, content));
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kInput);
        EXPECT_THAT(error.what(), HasSubstr(fileName)) << "the file is not named";
        return error.what();
    }
    return "no error";
}

std::string messageOf(const GltfParts& parts) {
    return messageOf("t.glb", parts.glb());
}

TEST(Gltf, TriangleIsReadAsWritten) {
    const Scene scene = readParts(triangleFile());
    ASSERT_EQ(scene.meshes.size(), 1u);
    const Mesh& mesh = scene.meshes[0];
    EXPECT_EQ(mesh.positions, (std::vector<glm::vec3>{{0, 0, 0}, {2, 0, 0}, {0, 1, 0}}));
    EXPECT_EQ(mesh.triangles, (std::vector<glm::uvec3>{{0, 1, 2}}));
    EXPECT_EQ(mesh.triangleMaterial, (std::vector<uint32_t>{0}));
    EXPECT_EQ(scene.roots, std::vector<int>{0});
    EXPECT_TRUE(scene.warnings.empty());
}

TEST(Gltf, TextFileWithBufferBesideItIsRead) {
    const TemporaryFolder folder;
    GltfParts parts = triangleFile();
    folder.write("a b.bin", parts.binary);
    parts.set("buffers", R"([{"byteLength":44,"uri":"a%20b.bin"}])");
    EXPECT_EQ(readGltf(folder.write("t.gltf", parts.json())).meshes.at(0).triangles.size(), 1u);
}

TEST(Gltf, TextFileWithDataUriIsRead) {
    const TemporaryFolder folder;
    GltfParts parts = triangleFile();
    // The 36 zero bytes of three equal corners.
    parts
        .set("buffers", R"([{"byteLength":36,"uri":"data:application/octet-stream;base64,)" +
                            std::string(48, 'A') + "\"}]")
        .set("meshes", R"([{"primitives":[{"attributes":{"POSITION":0}}]}])");
    const Scene scene = readGltf(folder.write("t.gltf", parts.json()));
    EXPECT_EQ(scene.meshes.at(0).positions, std::vector<glm::vec3>(3, glm::vec3(0.0f)));
}

TEST(Gltf, DataUrisOfBuffersHaveTheirMessages) {
    GltfParts parts = triangleFile();
    parts.set("meshes", R"([{"primitives":[{"attributes":{"POSITION":0}}]}])");
    const auto messageWith = [&](const std::string& uri) {
        parts.set("buffers", R"([{"byteLength":36,"uri":")" + uri + "\"}]");
        return messageOf("t.gltf", parts.json());
    };
    const std::string zeros(48, 'A');
    for (const char* header : {"DATA:application/octet-stream;base64,", "data:;base64,",
                               "data:application/octet-stream;charset=binary;Base64,"})
        EXPECT_EQ(messageWith(header + zeros), "no error") << header;
    EXPECT_EQ(messageWith("data:;base64," + zeros + "AAAA"), "no error") << "longer than stated";
    EXPECT_THAT(messageWith("data:;base64," + zeros.substr(4)),
                HasSubstr("t.gltf: buffers/0: its data URI has 33 bytes, but its byteLength is 36; "
                          "export the file again"));
    EXPECT_THAT(messageWith("data:text/plain," + zeros),
                HasSubstr("t.gltf: buffers/0: its data URI is not base64"));
}

TEST(Gltf, PositionsAreWithinTheirLimit) {
    for (const float x : {1e9f, -1e9f, 1.000001e9f, 1e20f, -1e29f}) {
        GltfParts parts = triangleFile();
        std::memcpy(parts.binary.data() + 12, &x, sizeof x);
        if (std::fabs(x) <= 1e9f)
            EXPECT_EQ(readParts(parts).meshes.at(0).positions[1].x, x);
        else
            EXPECT_THAT(messageOf(parts), HasSubstr("meshes/0/primitives/0/attributes/POSITION: "
                                                    "element 1 of accessor 0 is ("))
                << x;
    }
}

TEST(Gltf, IndicesOfEveryWidthAreRead) {
    for (int type : {5121, 5123, 5125}) {
        GltfParts parts = triangleFile();
        parts.binary.resize(36);
        if (type == 5121)
            parts.append<uint8_t>({2, 0, 1});
        else if (type == 5123)
            parts.append<uint16_t>({2, 0, 1});
        else
            parts.append<uint32_t>({2, 0, 1});
        const std::string length = std::to_string(parts.binary.size());
        parts.set("buffers", "[{\"byteLength\":" + length + "}]")
            .set("bufferViews", "[{\"buffer\":0,\"byteLength\":36},{\"buffer\":0,\"byteOffset\":36,"
                                "\"byteLength\":" +
                                    std::to_string(parts.binary.size() - 36) + "}]")
            .set("accessors", R"([{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"},)"
                              R"({"bufferView":1,"count":3,"type":"SCALAR","componentType":)" +
                                  std::to_string(type) + "}]");
        EXPECT_EQ(readParts(parts).meshes.at(0).triangles, (std::vector<glm::uvec3>{{2, 0, 1}}))
            << type;
    }
}

// Positions of every type that KHR_mesh_quantization allows, with the decoded value by hand.
TEST(Gltf, QuantizedPositionsAreDecoded) {
    struct Case {
        int type;
        bool isNormalized;
        float expected; // of the largest value of the type
        float lowest;   // of the smallest
    };
    for (const Case& c :
         {Case{5120, false, 127, -128}, Case{5120, true, 1, -1}, Case{5121, false, 255, 0},
          Case{5121, true, 1, 0}, Case{5122, false, 32767, -32768}, Case{5122, true, 1, -1},
          Case{5123, false, 65535, 0}, Case{5123, true, 1, 0}}) {
        GltfParts parts = triangleFile();
        parts.binary.clear();
        // Stride 8: three components and padding.
        for (int corner = 0; corner < 3; ++corner) {
            switch (c.type) {
            case 5120:
                parts.append<int8_t>({127, -128, 0, 0, 0, 0, 0, 0});
                break;
            case 5121:
                parts.append<uint8_t>({255, 0, 0, 0, 0, 0, 0, 0});
                break;
            case 5122:
                parts.append<int16_t>({32767, -32768, 0, 0});
                break;
            default:
                parts.append<uint16_t>({65535, 0, 0, 0});
                break;
            }
        }
        parts.set("buffers", R"([{"byteLength":24}])")
            .set("bufferViews", R"([{"buffer":0,"byteLength":24,"byteStride":8}])")
            .set("accessors", R"([{"bufferView":0,"count":3,"type":"VEC3","componentType":)" +
                                  std::to_string(c.type) +
                                  (c.isNormalized ? ",\"normalized\":true}]" : "}]"))
            .set("meshes", R"([{"primitives":[{"attributes":{"POSITION":0}}]}])")
            .set("extensionsRequired", R"(["KHR_mesh_quantization"])");
        const glm::vec3 p = readParts(parts).meshes.at(0).positions.at(2);
        EXPECT_EQ(p, glm::vec3(c.expected, c.lowest, 0)) << c.type << c.isNormalized;
    }
}

// glTF 2.0, sec. 3.7.2.1: strips {0 1 2} {1 3 2} {2 3 4}, fans {1 2 0} {2 3 0} {3 4 0}.
TEST(Gltf, StripsAndFansBecomeTriangles) {
    GltfParts parts = triangleFile();
    parts.binary.clear();
    parts.append<float>({0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0, 0, 2, 0})
        .set("buffers", R"([{"byteLength":60}])")
        .set("bufferViews", R"([{"buffer":0,"byteLength":60}])")
        .set("accessors", R"([{"bufferView":0,"componentType":5126,"count":5,"type":"VEC3"}])")
        .set("meshes", R"([{"primitives":[{"attributes":{"POSITION":0},"mode":5}]}])");
    EXPECT_EQ(readParts(parts).meshes.at(0).triangles,
              (std::vector<glm::uvec3>{{0, 1, 2}, {1, 3, 2}, {2, 3, 4}}));
    parts.set("meshes", R"([{"primitives":[{"attributes":{"POSITION":0},"mode":6}]}])");
    EXPECT_EQ(readParts(parts).meshes.at(0).triangles,
              (std::vector<glm::uvec3>{{1, 2, 0}, {2, 3, 0}, {3, 4, 0}}));
}

TEST(Gltf, SparsePositionsReplaceDenseOnesAndZeros) {
    GltfParts parts = triangleFile();
    parts.append<uint8_t>({2, 0, 0, 0}).append<float>({7, 8, 9});
    const std::string sparse =
        R"("sparse":{"count":1,"indices":{"bufferView":2,"componentType":5121},)"
        R"("values":{"bufferView":3}})";
    parts.set("buffers", R"([{"byteLength":60}])")
        .set(
            "bufferViews",
            R"([{"buffer":0,"byteLength":36},{"buffer":0,"byteOffset":36,"byteLength":6},)"
            R"({"buffer":0,"byteOffset":44,"byteLength":1},{"buffer":0,"byteOffset":48,"byteLength":12}])")
        .set("accessors",
             R"([{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3",)" + sparse +
                 R"(},{"bufferView":1,"componentType":5123,"count":3,"type":"SCALAR"}])");
    EXPECT_EQ(readParts(parts).meshes.at(0).positions,
              (std::vector<glm::vec3>{{0, 0, 0}, {2, 0, 0}, {7, 8, 9}}));
    parts.set("accessors",
              R"([{"componentType":5126,"count":3,"type":"VEC3",)" + sparse +
                  R"(},{"bufferView":1,"componentType":5123,"count":3,"type":"SCALAR"}])");
    EXPECT_EQ(readParts(parts).meshes.at(0).positions,
              (std::vector<glm::vec3>{{0, 0, 0}, {0, 0, 0}, {7, 8, 9}}));
}

TEST(Gltf, PrimitivesShareVerticesAndDropUnusedOnes) {
    GltfParts parts = triangleFile();
    parts.binary.clear();
    parts.append<float>({9, 9, 9, 0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0})
        .append<uint8_t>({1, 2, 3, 3, 2, 4, 0, 0});
    parts.set("buffers", R"([{"byteLength":68}])")
        .set("bufferViews",
             R"([{"buffer":0,"byteLength":60},{"buffer":0,"byteOffset":60,"byteLength":6}])")
        .set("accessors",
             R"([{"bufferView":0,"componentType":5126,"count":5,"type":"VEC3"},)"
             R"({"bufferView":1,"componentType":5121,"count":3,"type":"SCALAR"},)"
             R"({"bufferView":1,"byteOffset":3,"componentType":5121,"count":3,"type":"SCALAR"}])")
        .set("materials", R"([{},{"pbrMetallicRoughness":{"baseColorFactor":[0.5,0.25,0,1]}}])")
        .set("meshes", R"([{"primitives":[{"attributes":{"POSITION":0},"indices":1,"material":1},)"
                       R"({"attributes":{"POSITION":0},"indices":2}]}])");
    const Scene scene = readParts(parts);
    const Mesh& mesh = scene.meshes.at(0);
    EXPECT_EQ(mesh.positions, (std::vector<glm::vec3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}}));
    EXPECT_EQ(mesh.triangles, (std::vector<glm::uvec3>{{0, 1, 2}, {2, 1, 3}}));
    EXPECT_EQ(mesh.triangleMaterial, (std::vector<uint32_t>{2, 0}));
    EXPECT_EQ(scene.materials.at(2).baseColor, glm::vec3(0.5f, 0.25f, 0.0f));
    EXPECT_EQ(scene.materials.at(1).baseColor, glm::vec3(1.0f)); // glTF's own default
}

TEST(Gltf, EmissionIsScaledByItsStrength) {
    GltfParts parts = triangleFile();
    parts
        .set("materials", R"([{"emissiveFactor":[1,0.5,0],"extensions":)"
                          R"({"KHR_materials_emissive_strength":{"emissiveStrength":8}}}])")
        .set("extensionsRequired", R"(["KHR_materials_emissive_strength"])");
    EXPECT_EQ(readParts(parts).materials.at(1).emission, glm::vec3(8, 4, 0));
}

TEST(Gltf, EmissionBeyondItsLimitIsRefused) {
    GltfParts parts = triangleFile();
    parts
        .set("materials", R"([{"emissiveFactor":[1,1e10,0],"extensions":)"
                          R"({"KHR_materials_emissive_strength":{"emissiveStrength":1e30}}}])")
        .set("extensionsUsed", R"(["KHR_materials_emissive_strength"])");
    EXPECT_THAT(messageOf(parts), HasSubstr("materials/0: its emission is inf, not within 1e30"));
}

TEST(Gltf, DefaultSceneIsTheOneShown) {
    GltfParts parts = triangleFile();
    parts.set("nodes", R"([{},{"mesh":0}])").set("scenes", R"([{"nodes":[0]},{"nodes":[1]}])");
    EXPECT_EQ(readParts(parts).roots, std::vector<int>{0}); // the first, when none is named
    parts.set("scene", "1");
    EXPECT_EQ(readParts(parts).roots, std::vector<int>{1});
    parts.set("scene", "").set("scenes", "");
    EXPECT_EQ(readParts(parts).roots, (std::vector<int>{0, 1})); // all, without scenes
}

TEST(Gltf, LightsAndCamerasAreRead) {
    GltfParts parts = triangleFile();
    parts.set("extensionsUsed", R"(["KHR_lights_punctual"])")
        .set("extensionsRequired", R"(["KHR_lights_punctual"])")
        .set("extensions",
             R"({"KHR_lights_punctual":{"lights":[)"
             R"({"type":"directional","color":[1,1,0.5],"intensity":1000,"range":7},)"
             R"({"type":"point","color":[1,0.5,0],"intensity":4,"range":3,"name":"lamp"},)"
             R"({"type":"spot","spot":{"innerConeAngle":0.25,"outerConeAngle":0.5}}]}})")
        .set("cameras",
             R"([{"type":"orthographic","orthographic":{"xmag":1,"ymag":1,"znear":0,"zfar":1}},)"
             R"({"type":"perspective","perspective":{"yfov":1,"znear":0.5}}])")
        .set("nodes", R"([{"mesh":0,"extensions":{"KHR_lights_punctual":{"light":0}},"camera":0},)"
                      R"({"extensions":{"KHR_lights_punctual":{"light":1}},"camera":1},)"
                      R"({"extensions":{"KHR_lights_punctual":{"light":2}}}])")
        .set("scenes", R"([{"nodes":[0,1,2]}])");
    const Scene scene = readParts(parts);
    ASSERT_EQ(scene.lights.size(), 3u);
    EXPECT_EQ(scene.lights[0].kind, Light::kSun);
    EXPECT_EQ(scene.lights[0].color, glm::vec3(1, 1, 0.5f));
    EXPECT_EQ(scene.lights[0].intensity, 1000.0f);
    EXPECT_EQ(scene.lights[0].rangeWorld, 0.0f); // the extension ignores a range
    EXPECT_EQ(scene.lights[1].name, "lamp");
    EXPECT_EQ(scene.lights[1].kind, Light::kPoint);
    EXPECT_EQ(scene.lights[1].color, glm::vec3(1, 0.5f, 0));
    EXPECT_EQ(scene.lights[1].intensity, 4.0f);
    EXPECT_EQ(scene.lights[1].rangeWorld, 3.0f);
    EXPECT_EQ(scene.lights[2].kind, Light::kSpot);
    EXPECT_EQ(scene.lights[2].innerConeAngle, 0.25f);
    EXPECT_EQ(scene.lights[2].outerConeAngle, 0.5f);
    EXPECT_EQ(scene.lights[2].rangeWorld, 0.0f);
    EXPECT_EQ(scene.nodes[0].light, 0);
    EXPECT_EQ(scene.nodes[1].light, 1);
    EXPECT_EQ(scene.nodes[2].light, 2);
    ASSERT_EQ(scene.cameras.size(), 1u);
    EXPECT_EQ(scene.cameras[0].yfov, 1.0f);
    EXPECT_TRUE(std::isinf(scene.cameras[0].zfar));
    EXPECT_EQ(scene.nodes[0].camera, kNone);
    EXPECT_EQ(scene.nodes[1].camera, 0);
    EXPECT_THAT(scene.warnings, testing::Contains(HasSubstr("1 orthographic")));
}

/// Expects that a camera's field of view is read as another, with a warning.
void expectFieldOfView(const std::string& authored, float yfov, const std::string& warning) {
    GltfParts parts = triangleFile();
    parts.set("cameras", R"([{"type":"perspective","perspective":{"yfov":)" + authored +
                             R"(,"znear":0.5,"zfar":9}}])");
    const Scene scene = readParts(parts);
    ASSERT_EQ(scene.cameras.size(), 1u);
    EXPECT_EQ(scene.cameras[0].yfov, yfov);
    EXPECT_THAT(scene.warnings, testing::Contains(HasSubstr(warning)));
}

TEST(Gltf, TinyFieldOfViewIsWidenedWithAWarning) {
    expectFieldOfView("1e-17", kMinFieldOfView, "cameras/0/yfov: 1e-17 rad is widened to 0.001");
}

TEST(Gltf, AFieldOfViewOfNearlyPiIsNarrowedWithAWarning) {
    expectFieldOfView("3.1409", kMaxFieldOfView,
                      "cameras/0/yfov: 3.1409 rad is narrowed to 3.0999");
    EXPECT_LT(kMaxFieldOfView, 3.1f) << "which pictures refuse";
}

// What tinygltf would replace by its default.
TEST(Gltf, ValuesOfAnotherTypeAreRefusedByTheirKey) {
    const std::string lights = R"({"KHR_lights_punctual":{"lights":[{"type":"spot","spot":{},)";
    const std::pair<const char*, std::string> cases[] = {
        {"extensions", lights + R"("intensity":"bright"}]}})"},
        {"extensions", lights + R"("intensity": null}]}})"},
        {"extensions", lights + R"("range":"far"}]}})"},
        {"extensions", lights + R"("color":"red"}]}})"},
        {"nodes", R"([{"mesh":0,"scale":"x"}])"},
        {"nodes", R"([{"mesh":0,"translation":1}])"},
        {"nodes", R"([{"mesh":"0"}])"},
        {"materials", R"([{"alphaCutoff":{}}])"}};
    for (const auto& [member, json] : cases) {
        GltfParts parts = triangleFile();
        parts.set(member, json);
        EXPECT_THAT(messageOf(parts), testing::AnyOf(HasSubstr("is no number; export"),
                                                     HasSubstr("is no list; export")))
            << json;
    }
    GltfParts parts = triangleFile();
    parts.set("nodes", R"([{"mesh":0,"scale": [1,2,-3],"extras":{"scale":"x"}}])")
        .set("extensions", R"({"OTHER":{"lights":[{"intensity":"bright"}]}})");
    EXPECT_EQ(messageOf(parts), "no error");
}

// Exporters put a whole scene into one accessor.
TEST(Gltf, TextureCoordinatesThatManyMeshesShareCountOnce) {
    constexpr int kVertices = 40'000, kMeshes = 400;
    GltfParts parts;
    parts.append(std::vector<float>(3 * kVertices, 1.0f))
        .append(std::vector<float>(2 * kVertices, 0.5f))
        .append<uint16_t>({0, 1, 2});
    const std::string positions = std::to_string(12 * kVertices),
                      uvs = std::to_string(8 * kVertices), count = std::to_string(kVertices);
    std::string meshes, nodes, roots;
    for (int m = 0; m < kMeshes; ++m) {
        const std::string comma = m == 0 ? "" : ",";
        meshes += comma + R"({"primitives":[{"attributes":{"POSITION":0,"TEXCOORD_0":1},)" +
                  R"("indices":2,"material":0}]})";
        nodes += comma + R"({"mesh":)" + std::to_string(m) + "}";
        roots += comma + std::to_string(m);
    }
    parts.members = {
        {"asset", R"({"version":"2.0"})"},
        {"buffers", R"([{"byteLength":)" + std::to_string(parts.binary.size()) + "}]"},
        {"bufferViews", R"([{"buffer":0,"byteLength":)" + positions +
                            R"(},{"buffer":0,"byteOffset":)" + positions + R"(,"byteLength":)" +
                            uvs + R"(},{"buffer":0,"byteOffset":)" +
                            std::to_string(20 * kVertices) + R"(,"byteLength":6}])"},
        {"accessors", R"([{"bufferView":0,"componentType":5126,"count":)" + count +
                          R"(,"type":"VEC3"},{"bufferView":1,"componentType":5126,"count":)" +
                          count + R"(,"type":"VEC2"},)" +
                          R"({"bufferView":2,"componentType":5123,"count":3,"type":"SCALAR"}])"},
        {"meshes", "[" + meshes + "]"},
        {"textures", R"([{"source":0}])"},
        {"nodes", "[" + nodes + "]"},
        {"scenes", R"([{"nodes":[)" + roots + "]}]"}};
    parts
        .set("materials", R"([{"alphaMode":"MASK","pbrMetallicRoughness":)"
                          R"({"baseColorTexture":{"index":0}}}])")
        // An opaque pixel and a hole.
        .set(
            "images",
            R"([{"uri":"data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAIAAAABCAYAAAD0In+KAAAAD0lEQVR4nGP4z8DwHwgZAA/5Av4tR4H0AAAAAElFTkSuQmCC"}])");
    const Scene scene = readParts(parts);
    ASSERT_EQ(scene.meshes.size(), size_t(kMeshes));
    EXPECT_EQ(scene.meshes.back().uv.at(0), glm::vec2(0.5f));
}

TEST(Gltf, LinksOutOfTheFilesFolderAreRefused) {
    const TemporaryFolder elsewhere, folder;
    GltfParts parts = triangleFile();
    elsewhere.write("a.bin", parts.binary);
    folder.write("own.bin", parts.binary);
    std::filesystem::create_symlink(elsewhere.path("a.bin"), folder.path("link.bin"));
    std::filesystem::create_directory_symlink(elsewhere.path(""), folder.path("linked"));
    std::filesystem::create_symlink(folder.path("own.bin"), folder.path("inside.bin"));
    const auto message = [&](const std::string& uri) -> std::string {
        parts.set("buffers", "[{\"byteLength\":44,\"uri\":\"" + uri + "\"}]");
        try {
            readGltf(folder.write("t.gltf", parts.json()));
        } catch (const Error& error) {
            return error.what();
        }
        return "read";
    };
    for (const std::string uri : {"link.bin", "linked/a.bin"}) {
        EXPECT_THAT(message(uri), HasSubstr("is outside the file's folder; put it beside the file, "
                                            "or allow other places with --allow-outside"));
        allowOutsideFiles(true);
        EXPECT_EQ(message(uri), "read");
        allowOutsideFiles(false);
    }
    allowOutsideFiles(true);
    EXPECT_EQ(message(elsewhere.path("a.bin")), "read");
    allowOutsideFiles(false);
    EXPECT_EQ(message("own.bin"), "read");
    EXPECT_EQ(message("inside.bin"), "read");
    // The folder itself may be behind a link.
    std::filesystem::create_directory_symlink(folder.path(""), elsewhere.path("scene"));
    EXPECT_EQ(readGltf(elsewhere.path("scene/t.gltf")).meshes.size(), 1u);
}

TEST(Gltf, AFileMissingBesideALinkIsExplained) {
    const TemporaryFolder elsewhere, folder;
    GltfParts parts = triangleFile();
    parts.set("buffers", "[{\"byteLength\":44,\"uri\":\"ok.bin\"}]");
    folder.write("ok.bin", parts.binary);
    const std::string file = folder.write("t.gltf", parts.json()), link = elsewhere.path("l.gltf");
    std::filesystem::create_symlink(file, link);
    EXPECT_EQ(readGltf(file).meshes.size(), 1u);
    try {
        readGltf(link);
        ADD_FAILURE() << "read";
    } catch (const Error& error) {
        EXPECT_THAT(error.what(), HasSubstr("'" + link + "' is a link to '" + file + "'"));
    }
    std::filesystem::copy_file(folder.path("ok.bin"), elsewhere.path("ok.bin"));
    EXPECT_EQ(readGltf(link).meshes.size(), 1u);
}

TEST(Gltf, NamesWithAZeroByteAreRefused) {
    const TemporaryFolder folder;
    GltfParts parts = triangleFile();
    folder.write("ok.bin", parts.binary);
    for (const std::string uri : {"ok.bin%00", "ok.bin%00../x", "ok.bin\\u0000x"}) {
        parts.set("buffers", "[{\"byteLength\":44,\"uri\":\"" + uri + "\"}]");
        try {
            readGltf(folder.write("t.gltf", parts.json()));
            ADD_FAILURE() << uri;
        } catch (const Error& error) {
            EXPECT_THAT(error.what(), HasSubstr("its name contains a zero byte")) << uri;
        }
    }
}

TEST(Gltf, BuffersOutsideTheFilesFolderAreRefused) {
    for (const char* uri : {"../a.bin", "b/../../a.bin", "%2e%2e/a.bin", "/etc/passwd"}) {
        SCOPED_TRACE(uri);
        GltfParts parts = triangleFile();
        parts.set("buffers", "[{\"byteLength\":44,\"uri\":\"" + std::string(uri) + "\"}]");
        try {
            readParts(parts);
            ADD_FAILURE();
        } catch (const Error& error) {
            EXPECT_THAT(error.what(), HasSubstr("is outside the file's folder"));
        }
    }
}

TEST(Gltf, IgnoredFeaturesAreCountedInWarnings) {
    GltfParts parts = triangleFile();
    parts
        .set("meshes",
             R"([{"primitives":[{"attributes":{"POSITION":0},"indices":1},)"
             R"({"attributes":{"POSITION":0},"mode":0},{"attributes":{"POSITION":0},"mode":1},)"
             R"({"attributes":{"NORMAL":0}},{"attributes":{"POSITION":0},"indices":2}]}])")
        .set("accessors", R"([{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"},)"
                          R"({"bufferView":1,"componentType":5123,"count":3,"type":"SCALAR"},)"
                          R"({"bufferView":1,"componentType":5123,"count":2,"type":"SCALAR"}])")
        .set("materials", R"([{"alphaMode":"BLEND"}])")
        .set("nodes", R"([{"mesh":0,"extensions":{"EXT_mesh_gpu_instancing":{"attributes":{}}}}])")
        .set("images", R"([{"uri":"absent.png"}])")
        .set("textures", R"([{"source":0}])")
        .set("animations", R"([{"channels":[{"sampler":0,"target":{"node":0,"path":"weights"}}],)"
                           R"("samplers":[{"input":0,"output":0}]}])")
        .set("extensionsRequired", R"(["KHR_materials_unlit"])");
    const Scene scene = readParts(parts);
    EXPECT_EQ(scene.meshes.at(0).triangles.size(), 1u);
    for (const char* what : {"2 primitives of points or lines", "1 primitives without positions",
                             "1 primitives end in an incomplete triangle", "1 animation channels",
                             "1 nodes with EXT_mesh_gpu_instancing", "1 translucent", "1 textures",
                             "1 required extensions ignored that change colours only"})
        EXPECT_THAT(scene.warnings, testing::Contains(testing::StartsWith(what)));
}

TEST(Gltf, UsedExtensionsThatNothingKnowsOfAreNamed) {
    GltfParts parts = triangleFile();
    parts.set("extensionsUsed",
              R"(["KHR_animation_pointer","KHR_lights_punctual","KHR_materials_unlit"])");
    EXPECT_THAT(readParts(parts).warnings,
                testing::ElementsAre(testing::StartsWith("the extension 'KHR_animation_pointer'")));
    parts.set("materials",
              R"([{"extensions":{"KHR_materials_transmission":{"transmissionFactor":0.5}}}])");
    EXPECT_THAT(readParts(parts).warnings, testing::Contains(testing::StartsWith("1 translucent")));
}

// A node below an invisible one is invisible, too; one beside it is not.
TEST(Gltf, InvisibleNodesShowNothing) {
    const auto meshesOf = [](const std::string& visibility) {
        GltfParts parts = triangleFile();
        parts
            .set("nodes", R"([{"children":[1],"extensions":{"KHR_node_visibility":)" + visibility +
                              R"(}},{"mesh":0},{"mesh":0}])")
            .set("scenes", R"([{"nodes":[0,2]}])")
            .set("extensionsRequired", R"(["KHR_node_visibility"])");
        std::vector<int> meshes;
        for (const Node& node : readParts(parts).nodes)
            meshes.push_back(node.mesh);
        return meshes;
    };
    EXPECT_THAT(meshesOf(R"({"visible":false})"), testing::ElementsAre(kNone, kNone, 0));
    EXPECT_THAT(meshesOf(R"({"visible":true})"), testing::ElementsAre(kNone, 0, 0));
    EXPECT_THAT(meshesOf("{}"), testing::ElementsAre(kNone, 0, 0));
    EXPECT_THROW(meshesOf(R"({"visible":0})"), Error);
}

TEST(Gltf, UnknownRequiredExtensionsAreRefusedByName) {
    for (const char* name :
         {"KHR_meshopt_compression", "EXT_mesh_gpu_instancing", "FAKE_extension"}) {
        GltfParts parts = triangleFile();
        parts.set("extensionsRequired", "[\"" + std::string(name) + "\"]");
        EXPECT_THAT(messageOf(parts),
                    HasSubstr("requires the extension '" + std::string(name) + "'"));
    }
}

TEST(Gltf, ExtensionThatIsOnlyUsedIsNamedWhenReadingFails) {
    GltfParts parts = triangleFile();
    parts.set("extensionsUsed", R"(["KHR_meshopt_compression"])")
        .set("accessors", R"([{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"},)"
                          R"({"bufferView":1,"count":3,"type":"SCALAR"}])");
    EXPECT_THAT(messageOf(parts), HasSubstr("KHR_meshopt_compression"));
}

// Each line: the member that is broken, its text, and what the message must say.
TEST(Gltf, EveryBrokenPartHasItsMessage) {
    struct Case {
        const char *member, *json, *message;
    };
    const char* const indices =
        R"({"bufferView":1,"componentType":5123,"count":3,"type":"SCALAR"})";
    const std::string tail = std::string(",") + indices + "]";
    const auto accessor = [&](const char* text) { return std::string("[") + text + tail; };
    const std::vector<std::pair<std::string, Case>> cases = {
        {accessor(R"({"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"})"),
         {"accessors", "", "end beyond buffer view 0 of 36 bytes"}},
        {accessor(
             R"({"bufferView":0,"byteOffset":18446744073709551612,"componentType":5126,"count":3,"type":"VEC3"})"),
         {"accessors", "", "end beyond"}},
        {accessor(
             R"({"bufferView":0,"componentType":5126,"count":18446744073709551615,"type":"VEC3"})"),
         {"accessors", "", "its counts are wrong"}},
        {accessor(R"({"componentType":5126,"count":4000000000,"type":"VEC3"})"),
         {"accessors", "", "its counts are wrong"}},
        {accessor(R"({"bufferView":0,"componentType":5126,"count":0,"type":"VEC3"})"),
         {"accessors", "", "has count 0"}},
        {accessor(R"({"bufferView":0,"componentType":5124,"count":3,"type":"VEC3"})"),
         {"accessors", "", "component type 5124"}},
        {accessor(R"({"bufferView":0,"componentType":5126,"count":3,"type":"VEC2"})"),
         {"accessors", "", "2 components an element, not 3"}},
        {accessor(R"({"bufferView":0,"componentType":5126,"count":3,"type":"MAT4"})"),
         {"accessors", "", "components an element, not 3"}},
        {accessor(R"({"bufferView":7,"componentType":5126,"count":3,"type":"VEC3"})"),
         {"accessors", "", "buffer view 7 of 2"}},
        {accessor(
             R"({"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","sparse":{"count":-1,"indices":{"bufferView":1,"componentType":5123},"values":{"bufferView":0}}})"),
         {"accessors", "", "replaces -1 of 3"}},
        {accessor(
             R"({"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","sparse":{"count":4,"indices":{"bufferView":1,"componentType":5123},"values":{"bufferView":0}}})"),
         {"accessors", "", "replaces 4 of 3"}},
        {accessor(
             R"({"bufferView":0,"componentType":5126,"count":2,"type":"VEC3","sparse":{"count":2,"indices":{"bufferView":1,"byteOffset":2,"componentType":5123},"values":{"bufferView":0}}})"),
         {"accessors", "", "sparse index 2 is not below the count 2"}},
        {accessor(
             R"({"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","sparse":{"count":1,"indices":{"bufferView":1,"byteOffset":-2,"componentType":5123},"values":{"bufferView":0}}})"),
         {"accessors", "", "byte offset -2"}},
        {accessor(
             R"({"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","sparse":{"count":1,"indices":{"bufferView":1,"componentType":5126},"values":{"bufferView":0}}})"),
         {"accessors", "", "sparse indices have component type 5126"}},
        {R"([{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"},{"bufferView":1,"componentType":5122,"count":3,"type":"SCALAR"}])",
         {"accessors", "", "indices need a SCALAR accessor"}},
        {R"([{"bufferView":0,"componentType":5126,"count":2,"type":"VEC3"},{"bufferView":1,"componentType":5123,"count":3,"type":"SCALAR"}])",
         {"accessors", "", "index 2 is 2, but there are 2 vertices"}},
        {R"([{"buffer":0,"byteOffset":20,"byteLength":36},{"buffer":0,"byteOffset":36,"byteLength":6}])",
         {"bufferViews", "", "ends beyond buffer 0 of 44 bytes"}},
        {R"([{"buffer":0,"byteOffset":18446744073709551600,"byteLength":36},{"buffer":0,"byteOffset":36,"byteLength":6}])",
         {"bufferViews", "", "ends beyond buffer 0"}},
        {R"([{"buffer":3,"byteLength":36},{"buffer":0,"byteOffset":36,"byteLength":6}])",
         {"bufferViews", "", "buffer 3 of 1"}},
        {R"([{"buffer":0,"byteLength":36,"byteStride":8},{"buffer":0,"byteOffset":36,"byteLength":6}])",
         {"bufferViews", "", "stride 8, less than an element of 12"}},
        {R"([{"primitives":[{"attributes":{"POSITION":9}}]}])", {"meshes", "", "accessor 9 of 2"}},
        {R"([{"primitives":[{"attributes":{"POSITION":0},"mode":7}]}])",
         {"meshes", "", "mode 7 does not exist"}},
        {R"([{"primitives":[{"attributes":{"POSITION":0},"material":0}]}])",
         {"meshes", "", "material 0 of 0"}},
        {R"([{"mesh":1}])", {"nodes", "", "mesh 1 of 1"}},
        {R"([{"camera":0}])", {"nodes", "", "camera 0 of 0"}},
        {R"([{"children":[1]}])", {"nodes", "", "node 1 of 1"}},
        {R"([{"children":[-1]}])", {"nodes", "", "node -1 of 1"}},
        {R"([{},{"children":[2]},{"children":[1]}])", {"nodes", "", "loop of parents"}},
        {R"([{},{"children":[1]}])", {"nodes", "", "loop of parents"}},
        {R"([{"children":[2]},{"children":[2]},{}])",
         {"nodes", "", "node 2 has another parent, node 0"}},
        {R"([{"matrix":[1,0,0]}])", {"nodes", "", "3 numbers instead of 16"}},
        {R"([{"matrix":[1,0,0,1,0,1,0,0,0,0,1,0,0,0,0,1]}])", {"nodes", "", "bottom row"}},
        {R"([{"translation":[1e300,0,0]}])", {"nodes", "", "is not a number within 1e30"}},
        {R"([{"rotation":[0,0,0,0]}])", {"nodes", "", "quaternion is zero"}},
        {R"([{"extensions":{"KHR_lights_punctual":{"light":0}}}])", {"nodes", "", "light 0 of 0"}},
        {R"([{"extensions":{"KHR_lights_punctual":{}}}])",
         {"nodes", "", "\"light\" is not an integer"}},
        {R"([{"nodes":[5]}])", {"scenes", "", "node 5 of 1"}},
        {R"([{"nodes":[0,0]}])", {"scenes", "", "node 0 appears twice"}},
        {R"(3)", {"scene", "", "3, but there are 1 scenes"}},
        {R"({"version":"1.0"})", {"asset", "", "only glTF 2 is supported"}},
        {R"({"version":"2.1","minVersion":"2.1"})", {"asset", "", "only glTF 2.0 is supported"}},
        {R"({})", {"asset", "", "not a readable glTF 2.0 file"}},
        {R"([{"pbrMetallicRoughness":{"baseColorFactor":[1e39,1,1,1]}}])",
         {"materials", "", "is not a number within 1e30"}},
        {R"([{"type":"perspective","perspective":{"yfov":4,"znear":1}}])",
         {"cameras", "", "is not within 0 and pi"}},
        {R"([{"type":"perspective","perspective":{"yfov":1,"znear":0}}])",
         {"cameras", "", "is not above 0"}},
        {R"([{"type":"perspective","perspective":{"yfov":1,"znear":2,"zfar":1}}])",
         {"cameras", "", "is not above znear"}},
        {R"({"KHR_lights_punctual":{"lights":[{"type":"moon"}]}})",
         {"extensions", "", "'moon' is not a kind of light"}},
        {R"({"KHR_lights_punctual":{"lights":[{"type":"point","intensity":-1}]}})",
         {"extensions", "", "is negative"}},
        {R"({"KHR_lights_punctual":{"lights":[{"type":"point","color":[1e20,0,0],"intensity":1e20}]}})",
         {"extensions", "", "exceeds 1e30"}},
        {R"({"KHR_lights_punctual":{"lights":[{"type":"point","color":[1,1]}]}})",
         {"extensions", "", "2 numbers instead of 3"}},
        {R"({"KHR_lights_punctual":{"lights":[{"type":"point","range":1e20}]}})",
         {"extensions", "", "exceeds 1e18 metres"}},
        {R"({"KHR_lights_punctual":{"lights":[{"type":"spot","spot":{"innerConeAngle":1,"outerConeAngle":0.5}}]}})",
         {"extensions", "", "needed: 0 <= inner < outer"}},
        {R"([{"channels":[{"sampler":0,"target":{"node":0,"path":"scale"}}],"samplers":[]}])",
         {"animations", "", "sampler 0 of 0"}},
        {R"([{"channels":[{"sampler":0,"target":{"node":4,"path":"scale"}}],"samplers":[{"input":1,"output":0}]}])",
         {"animations", "", "node 4 of 1"}},
        {R"([{"channels":[{"sampler":0,"target":{"node":0,"path":"scale"}}],"samplers":[{"input":0,"output":0}]}])",
         {"animations", "", "3 components an element, not 1"}},
        {R"([{"channels":[{"sampler":0,"target":{"node":0,"path":"scale"}}],"samplers":[{"input":1,"output":0,"interpolation":"MAGIC"}]}])",
         {"animations", "", "interpolation 'MAGIC' does not exist"}},
        {R"([{"channels":[{"sampler":0,"target":{"node":0,"path":"scale"}}],"samplers":[{"input":1,"output":0,"interpolation":"CUBICSPLINE"}]}])",
         {"animations", "", "3 values for 3 keys; 9 are needed"}},
    };
    for (const auto& [json, c] : cases) {
        GltfParts parts = triangleFile();
        parts.set(c.member, json);
        EXPECT_THAT(messageOf(parts), HasSubstr(c.message)) << c.member << ": " << json;
    }
}

TEST(Gltf, AnimationThatCannotBePlayedHasItsMessage) {
    GltfParts parts = triangleFile();
    parts.set("animations", R"([{"channels":[{"sampler":0,"target":{"node":0,"path":"scale"}}],)"
                            R"("samplers":[{"input":1,"output":0}]}])");
    EXPECT_NO_THROW(readParts(parts));
    GltfParts moved = parts;
    moved.set("nodes", R"([{"mesh":0,"matrix":[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1]}])");
    EXPECT_THAT(messageOf(moved), HasSubstr("placed by a matrix"));
    parts.binary[38] = 0; // the second index, here the second key time: 0, 0, 2
    EXPECT_THAT(messageOf(parts), HasSubstr("times must ascend"));
}

TEST(Gltf, NonFinitePositionsAreRefused) {
    for (const float bad :
         {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
        GltfParts parts = triangleFile();
        std::memcpy(parts.binary.data() + 16, &bad, 4);
        EXPECT_THAT(messageOf(parts), HasSubstr("element 1 of accessor 0 is"));
    }
}

TEST(Gltf, NodeUnderAnotherCannotBeARoot) {
    GltfParts parts = triangleFile();
    parts.set("nodes", R"([{"mesh":0},{"children":[0]}])");
    EXPECT_THAT(messageOf(parts), HasSubstr("node 0 is no root: it has the parent 1"));
}

TEST(Gltf, TruncatedAndForeignFilesHaveTheirMessages) {
    const std::string good = triangleFile().glb();
    EXPECT_THAT(messageOf("t.glb", ""), HasSubstr("the file is empty"));
    EXPECT_THAT(messageOf("t.glb", good.substr(0, 10)), HasSubstr("the file ends after 10 bytes"));
    EXPECT_THAT(messageOf("t.glb", good.substr(0, good.size() - 1)), HasSubstr("fetch it again"));
    std::string other = good;
    other[4] = 1;
    EXPECT_THAT(messageOf("t.glb", other), HasSubstr("version 1; only version 2"));
    other = good;
    other[14] = 1; // JSON chunk of 64 KiB more
    EXPECT_THAT(messageOf("t.glb", other), HasSubstr("GLB JSON chunk"));
    other = good;
    const size_t binary = good.find(std::string("BIN\0", 4)) - 4;
    other[binary] += 8; // runs 8 bytes beyond the file: tinygltf does not notice
    EXPECT_THAT(messageOf("t.glb", other), HasSubstr("GLB BIN chunk"));
    EXPECT_THAT(messageOf("t.gltf", "[]"),
                HasSubstr("starts with a JSON list; a glTF file is a JSON object"));
}

// Each is named by how it begins or, if that says nothing, by its extension.
TEST(Gltf, FilesOfOtherKindsAreNamedWithHowToConvertThem) {
    const struct {
        const char *file, *content, *kind;
        bool isConvertible;
    } cases[] = {{"a.ply", "ply\nformat ascii 1.0\n", "a PLY file", true},
                 {"a.bin", "ply\r\nformat ascii 1.0\r\n", "a PLY file", true},
                 {"a.fbx", "Kaydara FBX Binary  ", "an FBX file", true},
                 {"a.glb", "; FBX 7.3.0 project file", "an FBX file", true},
                 {"a.stl", "solid cube\n", "an STL file", true},
                 {"b.STL", "exported by a scanner", "an STL file", true},
                 {"a.obj", "# made by hand\nv 0 0 0\n", "an OBJ file", true},
                 {"a.blend", "BLENDER-v300", "a Blender file", true},
                 {"a.3DS", "MM", "a 3DS file", true},
                 {"a.dae", "<?xml version=\"1.0\"?>", "an XML file, such as COLLADA", true},
                 {"a.zip", "PK\3\4", "a ZIP archive; unpack it", false},
                 {"a.npz", "PK\3\4", "a file of numpy arrays", false},
                 {"a.bin", "SDAGRAYS\1", "a set of rays, which shadowdag rays reads", false},
                 {"a.bin", "SDAGANSW\1", "a tracer's answers", false},
                 {"a.mtl", "newmtl red", "a material library", false}};
    for (const auto& c : cases) {
        const std::string message = messageOf(c.file, c.content);
        EXPECT_THAT(message, HasSubstr(std::string(c.file) + ": not glTF but " + c.kind));
        EXPECT_EQ(message.find("assimp export FILE OUT.glb") != std::string::npos, c.isConvertible)
            << message;
    }
    EXPECT_THAT(messageOf("t.gltf", "a poem"), HasSubstr("neither JSON nor binary glTF"));
    EXPECT_THAT(messageOf("t.gltf", "\xef\xbb\xbf{"), HasSubstr("not a readable glTF 2.0 file"));
    for (const std::string& start : {std::string("\xff\xfe{\0", 4), std::string("\xfe\xff\0{", 4),
                                     std::string("{\0", 2), std::string("\0{", 2)})
        EXPECT_THAT(messageOf("t.gltf", start), HasSubstr("t.gltf: is UTF-16; save it as UTF-8"));
}

TEST(Gltf, ProblemsOfJsonHaveMessagesOfOurs) {
    const auto message = [](const std::string& number) {
        GltfParts parts = triangleFile();
        parts.set("nodes", "[{\"mesh\":0,\"translation\":[" + number + ",0,0]}]");
        const std::string text = messageOf(parts);
        EXPECT_THAT(text, testing::Not(HasSubstr("json.exception")));
        return text;
    };
    for (const char* number : {"NaN", "Infinity", "-Infinity", "nan", "inf"})
        EXPECT_THAT(message(number), testing::AllOf(HasSubstr("is not JSON at line 1, column"),
                                                    HasSubstr("JSON has no NaN and no Infinity")));
    EXPECT_THAT(message("1e999"), HasSubstr("the number '1e999' is beyond 1.8e308"));
    EXPECT_THAT(message("maps"), testing::AllOf(HasSubstr("is not JSON at line 1, column"),
                                                testing::Not(HasSubstr("NaN"))));
    GltfParts parts = triangleFile();
    parts.set("nodes", R"([{"mesh":0,"translation":[1e308,0,0]}])");
    EXPECT_THAT(messageOf(parts), HasSubstr(": 1e+308 is not a number within 1e30"));
}

TEST(Gltf, BytesAfterTheLengthOfAGlbAreAWarning) {
    const TemporaryFolder folder;
    const std::string glb = triangleFile().glb();
    EXPECT_TRUE(readGltf(folder.write("a.glb", glb)).warnings.empty());
    const Scene scene = readGltf(folder.write("b.glb", glb + "junk"));
    ASSERT_EQ(scene.warnings.size(), 1u);
    EXPECT_THAT(scene.warnings[0],
                HasSubstr("4 bytes after the length that the GLB header states"));
}

TEST(Gltf, AnUnsupportedCompressionIsRefusedWithTheToolThatDecompressesIt) {
    GltfParts parts = triangleFile();
    parts.set("extensionsUsed", R"(["KHR_meshopt_compression"])")
        .set("extensionsRequired", R"(["KHR_meshopt_compression"])");
    EXPECT_THAT(messageOf(parts), HasSubstr("KHR_meshopt_compression"));
    EXPECT_THAT(messageOf(parts), HasSubstr("gltfpack -noq -i IN.glb"));
}

TEST(Gltf, ABufferFileMayBeLongerThanItsBuffers) {
    const TemporaryFolder folder;
    GltfParts parts = triangleFile();
    const size_t length = parts.binary.size();
    folder.write("a long.bin", parts.binary + "and more");
    const std::string buffer =
        "{\"uri\":\"a%20long.bin\", \"byteLength\" : " + std::to_string(length) + "}";
    const std::string tiny = R"({"byteLength":3,"uri":"a%20long.bin"})";
    for (const std::string& buffers : {"[" + buffer + "]", "[" + buffer + "," + tiny + "]"}) {
        parts.set("buffers", buffers);
        const Scene scene = readGltf(folder.write("t.gltf", parts.json()));
        ASSERT_EQ(scene.meshes.size(), 1u) << buffers;
        EXPECT_EQ(scene.meshes[0].positions, readParts(triangleFile()).meshes[0].positions);
    }
}

TEST(Gltf, AbsentFilesHaveTheirMessages) {
    const TemporaryFolder folder;
    const auto message = [](const std::string& path) {
        try {
            readGltf(path);
        } catch (const Error& error) {
            return std::string(error.what());
        }
        return std::string("no error");
    };
    EXPECT_THAT(message(folder.path("absent.glb")), HasSubstr("no such file"));
    EXPECT_THAT(message(folder.path(".")), HasSubstr("not a regular file"));
    std::filesystem::create_symlink("loop", folder.path("loop"));
    EXPECT_THAT(message(folder.path("loop")), HasSubstr("Too many levels of symbolic links"));
    GltfParts parts = triangleFile();
    ASSERT_EQ(mkfifo(folder.path("pipe").c_str(), 0600), 0);
    for (const auto& [uri, what] :
         {std::pair{"pipe", "is a pipe, where a regular file is read"},
          std::pair{"loop", "cannot be opened: Too many levels of symbolic links"},
          std::pair{"none.bin", "no such file; put it beside the file that names it"},
          std::pair{"http://host/a.bin", "nothing is fetched from the network; put the file"}}) {
        parts.set("buffers", R"([{"byteLength":44,"uri":")" + std::string(uri) + R"("}])");
        EXPECT_THAT(message(folder.write("t.gltf", parts.json())), HasSubstr(what));
    }
    parts = triangleFile();
    parts.set("accessors", R"([{"bufferView":0,"componentType":5126,"count":-3,"type":"VEC3"}])");
    EXPECT_THAT(message(folder.write("t.glb", parts.glb())),
                HasSubstr("accessors/0: 'count' is not a positive integer"));
    parts = triangleFile();
    parts.set("buffers", R"([{"byteLength":44,"uri":"absent.bin"}])");
    EXPECT_THAT(message(folder.write("t.gltf", parts.json())), HasSubstr("absent.bin"));
    folder.write("short.bin", "123");
    parts.set("buffers", R"([{"byteLength":44,"uri":"short.bin"}])");
    EXPECT_THAT(message(folder.write("t.gltf", parts.json())),
                HasSubstr("buffers/0 ('short.bin'): has 3 bytes, but its buffer has 44; fetch"));
    parts.set("buffers",
              R"([{"byteLength":3,"uri":"short.bin"},{"byteLength":3,"uri":"short.bin"},)"
              R"({"byteLength":3,"uri":"short.bin"},{"byteLength":3,"uri":"short.bin"},)"
              R"({"byteLength":3,"uri":"short.bin"}])");
    EXPECT_THAT(message(folder.write("t.gltf", parts.json())), HasSubstr("more than 4 buffers"));
}

// The parser's own messages name no place and use its own words.
TEST(Gltf, WhatCannotBeParsedIsNamedByItsPlaceAndARemedy) {
    struct Case {
        const char *member, *json, *message;
    };
    for (const Case& c : {
             Case{"accessors",
                  R"([{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"},{"count":3}])",
                  "accessors/1: 'componentType' is missing"},
             Case{"accessors", R"([{"bufferView":0,"componentType":5126,"type":"VEC3"}])",
                  "accessors/0: 'count' is missing"},
             Case{"bufferViews", R"([{"buffer":0,"byteLength":36},{"buffer":0}])",
                  "bufferViews/1: "},
             Case{"buffers", R"([{}])", "buffers/0: 'byteLength' is missing"},
             Case{"buffers", R"([3])", "'buffers' has something other than JSON objects"},
             Case{"meshes", R"([{"primitives":[{"attributes":{"POSITION":0},"indices":7}]}])",
                  "meshes/0/primitives/0/indices: refers to accessor 7 of 2"},
             Case{"images", R"([{"uri":"a.png"},{}])", "images/1: "},
             Case{"skins", R"([{}])", "skins/0: cannot be read"},
             Case{"cameras", R"([{"type":"perspective"}])", "cameras/0: "},
             Case{"asset", R"({"generator":"x"})", "'version' is missing in the asset"},
         }) {
        GltfParts parts = triangleFile();
        const std::string message = messageOf(parts.set(c.member, c.json));
        EXPECT_THAT(message,
                    HasSubstr(std::string("t.glb: not a readable glTF 2.0 file: ") + c.message));
        EXPECT_THAT(message, testing::EndsWith("; export the file again")) << c.json;
        for (const char* word : {"property", "`", "\n", "ParseAccessor", "tinygltf"})
            EXPECT_THAT(message, testing::Not(HasSubstr(word))) << c.json;
    }
    // Only the BIN chunk of a GLB can stand for a URI.
    GltfParts parts = triangleFile();
    parts.set("buffers", R"([{"byteLength":44}])");
    EXPECT_THAT(messageOf("t.gltf", parts.json()),
                testing::EndsWith("t.gltf: not a readable glTF 2.0 file: buffers/0: 'uri' is "
                                  "missing, so it has no data; export the file again"));
}

TEST(Gltf, UnreasonableTextIsRefusedBeforeItIsParsed) {
    GltfParts parts = triangleFile();
    std::string nested(300, '[');
    nested.append(300, ']');
    parts.set("weird", nested);
    EXPECT_THAT(messageOf(parts), HasSubstr("nested deeper than 256"));
    parts = triangleFile();
    parts.set("\\u0062uffers", "[]");
    EXPECT_THAT(messageOf(parts), HasSubstr("contains escape sequences"));
    parts = triangleFile();
    std::string objects = "[{}";
    for (int i = 0; i < 2'000'000; ++i)
        objects += ",{}";
    parts.set("weird", objects + "]");
    EXPECT_THAT(messageOf(parts), HasSubstr("more than 2000000 objects"));
    parts = triangleFile();
    std::string materials = "[{}";
    for (int i = 0; i < 16'384; ++i)
        materials += ",{}";
    parts.set("materials", materials + "]");
    EXPECT_THAT(messageOf(parts), HasSubstr("materials: more than 16384; join those"));
    parts = triangleFile();
    parts.binary.resize(1 << 20);
    std::string buffers = R"([{"byteLength":44})";
    for (int i = 0; i < 1000; ++i)
        buffers += R"(,{"byteLength":1048576})";
    parts.set("buffers", buffers + "]");
    EXPECT_THAT(messageOf(parts), HasSubstr("1001 buffers over a BIN chunk"));
}

TEST(Gltf, ExtrasMayContainAnything) {
    GltfParts parts = triangleFile();
    parts.set("extras", R"({"a":[1,2,{"extras":"}]","b":"\"{"}],"c":null})")
        .set("nodes", R"([{"extras":[{},{}],"mesh":0},{"extras":"\\"},{"extras" : 3 }])");
    const Scene scene = readParts(parts);
    EXPECT_EQ(scene.nodes.size(), 3u);
    EXPECT_EQ(scene.nodes[0].mesh, 0);
}

} // namespace
} // namespace shadowdag
