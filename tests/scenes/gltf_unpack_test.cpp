// SPDX-License-Identifier: Apache-2.0
// Compressed geometry (EXT_meshopt_compression, KHR_draco_mesh_compression): what was packed comes
// back, and damaged streams are refused.
#include "cuda/error.h"
#include "scenes/gltf_reader.h"
#include "tests/scenes/allocation_peak.h"
#include "tests/scenes/gltf_files.h"

#include <draco/compression/encode.h>
#include <draco/mesh/triangle_soup_mesh_builder.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <meshoptimizer.h>
#include <tiny_gltf.h>

#include <dlfcn.h>

#include <algorithm>
#include <array>
#include <random>
#include <set>

namespace shadowdag {
namespace {

using test::GltfParts;
using test::TemporaryFolder;
using testing::HasSubstr;

constexpr uint32_t kSide = 9; ///< vertices of the grid along an axis

std::vector<glm::vec3> gridPositions() {
    std::vector<glm::vec3> positions;
    for (uint32_t y = 0; y < kSide; ++y)
        for (uint32_t x = 0; x < kSide; ++x)
            positions.emplace_back(float(x), float(y) * 0.5f, float(x * y) / 16.0f);
    return positions;
}

std::vector<uint32_t> gridIndices() {
    std::vector<uint32_t> indices;
    for (uint32_t y = 0; y + 1 < kSide; ++y)
        for (uint32_t x = 0; x + 1 < kSide; ++x) {
            const uint32_t a = y * kSide + x, b = a + kSide;
            indices.insert(indices.end(), {a, a + 1, b, b, a + 1, b + 1});
        }
    return indices;
}

/// The corners of a triangle, the first of three orders.
using Corners = std::array<std::array<float, 3>, 3>;

std::multiset<Corners> trianglesOf(const std::vector<glm::vec3>& positions,
                                   const std::vector<glm::uvec3>& triangles) {
    std::multiset<Corners> all;
    for (const glm::uvec3& t : triangles) {
        Corners corners;
        for (int c = 0; c < 3; ++c)
            for (int axis = 0; axis < 3; ++axis)
                corners[size_t(c)][size_t(axis)] = positions[t[c]][axis];
        std::rotate(corners.begin(), std::min_element(corners.begin(), corners.end()),
                    corners.end());
        all.insert(corners);
    }
    return all;
}

std::multiset<Corners> gridTriangles() {
    const std::vector<uint32_t> i = gridIndices();
    std::vector<glm::uvec3> triangles;
    for (size_t t = 0; t < i.size(); t += 3)
        triangles.emplace_back(i[t], i[t + 1], i[t + 2]);
    return trianglesOf(gridPositions(), triangles);
}

std::string number(size_t value) {
    return std::to_string(value);
}

/// Returns a file whose one mesh has the views 0 (positions) and 1 (indices of four bytes).
GltfParts gridFile(const std::string& extension) {
    GltfParts parts = test::triangleFile();
    parts.binary.clear();
    parts
        .set("accessors", R"([{"bufferView":0,"componentType":5126,"count":)" +
                              number(kSide * kSide) + R"(,"type":"VEC3"},)" +
                              R"({"bufferView":1,"componentType":5125,"count":)" +
                              number(gridIndices().size()) + R"(,"type":"SCALAR"}])")
        .set("extensionsUsed", "[\"" + extension + "\"]")
        .set("extensionsRequired", "[\"" + extension + "\"]");
    return parts;
}

/// How the grid is packed by meshopt.
struct Packing {
    std::string mode = "TRIANGLES", filter = "NONE";
};

std::string packedView(size_t offset, size_t length, size_t stride, size_t count,
                       const Packing& how) {
    return R"({"buffer":1,"byteLength":)" + number(stride * count) +
           R"(,"extensions":{"EXT_meshopt_compression":{"buffer":0,"byteOffset":)" +
           number(offset) + R"(,"byteLength":)" + number(length) + R"(,"byteStride":)" +
           number(stride) + R"(,"count":)" + number(count) + R"(,"mode":")" + how.mode +
           R"(","filter":")" + how.filter + R"("}}})";
}

/// Returns a file as gltfpack writes it: what is unpacked lies in a buffer without data.
GltfParts meshoptFile(const Packing& indices = {}, const std::string& filter = "NONE") {
    const std::vector<uint32_t> list = gridIndices();
    std::vector<glm::vec3> positions = gridPositions();
    if (filter == "EXPONENTIAL") { // as they are stored: exact for these numbers
        std::vector<uint32_t> stored(positions.size() * 3);
#if MESHOPTIMIZER_VERSION >= 190 // before, exponents were always shared by a vector
        meshopt_encodeFilterExp(stored.data(), positions.size(), sizeof(glm::vec3), 24,
                                &positions[0].x, meshopt_EncodeExpSharedVector);
#else
        meshopt_encodeFilterExp(stored.data(), positions.size(), sizeof(glm::vec3), 24,
                                &positions[0].x);
#endif
        std::memcpy(positions.data(), stored.data(), stored.size() * sizeof(uint32_t));
    }
    std::vector<unsigned char> vertices(
        meshopt_encodeVertexBufferBound(positions.size(), sizeof(glm::vec3)));
    vertices.resize(meshopt_encodeVertexBuffer(vertices.data(), vertices.size(), positions.data(),
                                               positions.size(), sizeof(glm::vec3)));
    std::vector<unsigned char> packed(
        indices.mode == "INDICES" ? meshopt_encodeIndexSequenceBound(list.size(), positions.size())
                                  : meshopt_encodeIndexBufferBound(list.size(), positions.size()));
    packed.resize(
        indices.mode == "INDICES"
            ? meshopt_encodeIndexSequence(packed.data(), packed.size(), list.data(), list.size())
            : meshopt_encodeIndexBuffer(packed.data(), packed.size(), list.data(), list.size()));
    GltfParts parts = gridFile("EXT_meshopt_compression");
    parts.append(vertices).append(packed);
    parts
        .set(
            "buffers",
            R"([{"byteLength":)" + number(parts.binary.size()) +
                R"(},{"byteLength":123456789,"extensions":{"EXT_meshopt_compression":{"fallback":true}}}])")
        .set("bufferViews",
             "[" +
                 packedView(0, vertices.size(), sizeof(glm::vec3), positions.size(),
                            {"ATTRIBUTES", filter}) +
                 "," + packedView(vertices.size(), packed.size(), 4, list.size(), indices) + "]");
    return parts;
}

/// Returns the grid as Draco packs it, without quantization. @param method draco::MESH_*
std::string dracoStream(int method) {
    const std::vector<glm::vec3> positions = gridPositions();
    const std::vector<uint32_t> indices = gridIndices();
    draco::TriangleSoupMeshBuilder builder;
    builder.Start(int(indices.size() / 3));
    const int position =
        builder.AddAttribute(draco::GeometryAttribute::POSITION, 3, draco::DT_FLOAT32);
    const int uv = builder.AddAttribute(draco::GeometryAttribute::TEX_COORD, 2, draco::DT_FLOAT32);
    for (uint32_t f = 0; f < indices.size() / 3; ++f) {
        std::array<glm::vec2, 3> at;
        for (size_t c = 0; c < 3; ++c)
            at[c] = glm::vec2(positions[indices[3 * f + c]]) / 16.0f;
        builder.SetAttributeValuesForFace(position, draco::FaceIndex(f), &positions[indices[3 * f]],
                                          &positions[indices[3 * f + 1]],
                                          &positions[indices[3 * f + 2]]);
        builder.SetAttributeValuesForFace(uv, draco::FaceIndex(f), &at[0], &at[1], &at[2]);
    }
    const std::unique_ptr<draco::Mesh> mesh = builder.Finalize();
    draco::Encoder encoder;
    encoder.SetEncodingMethod(method);
    draco::EncoderBuffer buffer;
    EXPECT_TRUE(encoder.EncodeMeshToBuffer(*mesh, &buffer).ok());
    return {buffer.data(), buffer.size()};
}

constexpr const char* kDracoMeshes =
    R"([{"primitives":[{"attributes":{"POSITION":0,"TEXCOORD_0":2},"indices":1,"material":0,)"
    R"("extensions":{"KHR_draco_mesh_compression":{"bufferView":0,"attributes":{"POSITION":0,"TEXCOORD_0":1}}}}]}])";

GltfParts dracoFile(const std::string& stream) {
    GltfParts parts = gridFile("KHR_draco_mesh_compression");
    parts.binary = stream;
    parts.set("buffers", R"([{"byteLength":)" + number(stream.size()) + "}]")
        .set("bufferViews", R"([{"buffer":0,"byteLength":)" + number(stream.size()) + "}]")
        .set("accessors", R"([{"componentType":5126,"count":81,"type":"VEC3"},)"
                          R"({"componentType":5123,"count":384,"type":"SCALAR"},)"
                          R"({"componentType":5126,"count":81,"type":"VEC2"}])")
        .set("materials", R"([{"alphaMode":"MASK","pbrMetallicRoughness":)"
                          R"({"baseColorTexture":{"index":0}}}])")
        .set("textures", R"([{"source":0}])")
        // An opaque pixel and a hole.
        .set(
            "images",
            R"([{"uri":"data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAIAAAABCAYAAAD0In+KAAAAD0lEQVR4nGP4z8DwHwgZAA/5Av4tR4H0AAAAAElFTkSuQmCC"}])")
        .set("meshes", kDracoMeshes);
    return parts;
}

std::string messageOf(const GltfParts& parts) {
    const TemporaryFolder folder;
    try {
        readGltf(folder.write("t.glb", parts.glb()));
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kInput);
        return error.what();
    }
    return "was read";
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
    const size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return text.replace(at, from.size(), to);
}

} // namespace

// Debian's libdraco exports a tinygltf, too, of another version (cmake/ShadowDagPackages.cmake).
TEST(GltfUnpack, TinygltfIsNotThatOfDraco) {
    Dl_info found{};
    ASSERT_NE(dladdr(reinterpret_cast<void*>(&tinygltf::FileExists), &found), 0);
    EXPECT_THAT(found.dli_fname, HasSubstr("libtinygltf"));
}

TEST(GltfUnpack, MeshoptViewsGiveTheTrianglesThatWerePacked) {
    const TemporaryFolder folder;
    for (const char* mode : {"TRIANGLES", "INDICES"})
        for (const char* filter : {"NONE", "EXPONENTIAL"}) {
            SCOPED_TRACE(std::string(mode) + " " + filter);
            const Scene scene =
                readGltf(folder.write("t.glb", meshoptFile({mode, "NONE"}, filter).glb()));
            ASSERT_EQ(scene.meshes.size(), 1u);
            EXPECT_EQ(trianglesOf(scene.meshes[0].positions, scene.meshes[0].triangles),
                      gridTriangles());
        }
    // Text with its data beside, and a buffer without data that is written in another order.
    GltfParts parts = meshoptFile();
    folder.write("d.bin", parts.binary);
    parts.set("buffers",
              R"([{"uri":"d.bin","byteLength":)" + number(parts.binary.size()) +
                  R"(},{"extensions" : {"EXT_meshopt_compression" : {} } ,"byteLength" : 9}])");
    const Scene scene = readGltf(folder.write("t.gltf", parts.json()));
    EXPECT_EQ(trianglesOf(scene.meshes[0].positions, scene.meshes[0].triangles), gridTriangles());
}

TEST(GltfUnpack, BrokenMeshoptViewsHaveTheirMessages) {
    const GltfParts whole = meshoptFile();
    const std::string views = whole.members.at("bufferViews");
    const std::pair<std::pair<const char*, const char*>, const char*> cases[] = {
        {{R"("buffer":0)", R"("buffer":7)"}, "refers to buffer 7 of 2"},
        {{R"("byteOffset":0)", R"("byteOffset":1e9)"}, "end beyond buffer 0"},
        {{R"("byteOffset":0)", R"("byteOffset":-1)"}, "'byteOffset' is missing, or no whole"},
        {{R"("count":81)", R"("count":0)"}, "count 0 does not fit mode ATTRIBUTES"},
        {{R"("count":81)", R"("count":2000000000)"}, "claim to unpack to 24000000000"},
        {{R"("count":81)", R"("count":600)"}, "its bytes cannot be unpacked; the file is damaged"},
        {{R"("count":384)", R"("count":383)"}, "count 383 does not fit mode TRIANGLES"},
        {{R"("byteStride":12)", R"("byteStride":10)"}, "byteStride 10 does not fit"},
        {{R"("byteStride":4)", R"("byteStride":8)"}, "byteStride 8 does not fit mode TRIANGLES"},
        {{"ATTRIBUTES", "POINTS"}, "mode 'POINTS' does not exist"},
        {{"NONE", "QUATERNION"}, "filter 'QUATERNION' does not fit mode ATTRIBUTES with"},
    };
    for (const auto& [change, message] : cases) {
        GltfParts parts = whole;
        parts.set("bufferViews", replaced(views, change.first, change.second));
        EXPECT_THAT(messageOf(parts), HasSubstr(message)) << change.second;
    }
    // The accessor of what is not packed.
    GltfParts parts = whole;
    parts.set("bufferViews",
              R"([{"buffer":1,"byteLength":972},)" + views.substr(views.rfind(R"({"buffer":1)")));
    EXPECT_THAT(messageOf(parts), HasSubstr("ends beyond buffer 1 of 1 bytes"));
}

TEST(GltfUnpack, DracoStreamsGiveTheTrianglesThatWerePacked) {
    const TemporaryFolder folder;
    for (const int method : {draco::MESH_SEQUENTIAL_ENCODING, draco::MESH_EDGEBREAKER_ENCODING}) {
        SCOPED_TRACE(method);
        const Scene scene = readGltf(folder.write("t.glb", dracoFile(dracoStream(method)).glb()));
        ASSERT_EQ(scene.meshes.size(), 1u);
        const Mesh& mesh = scene.meshes[0];
        EXPECT_EQ(trianglesOf(mesh.positions, mesh.triangles), gridTriangles());
        ASSERT_EQ(mesh.uv.size(), mesh.positions.size());
        for (size_t v = 0; v < mesh.uv.size(); ++v)
            EXPECT_EQ(mesh.uv[v], glm::vec2(mesh.positions[v]) / 16.0f);
    }
}

TEST(GltfUnpack, AttributesThatPrimitivesShareAreUnpackedOnce) {
    GltfParts parts = dracoFile(dracoStream(draco::MESH_EDGEBREAKER_ENCODING));
    const std::string start = R"([{"primitives":[)", all = kDracoMeshes;
    const std::string one = all.substr(start.size(), all.size() - start.size() - 3);
    parts.set("meshes", start + one + "," + one + "," + one + "]}]");
    const std::string bytes = parts.glb();
    const gltf::Document document = gltf::loadDocument("t.glb", {bytes.begin(), bytes.end()});
    EXPECT_EQ(document.model.accessors.size(), 3u + 3u) << "positions, coordinates and indices";
    for (const tinygltf::Primitive& primitive : document.model.meshes.at(0).primitives)
        EXPECT_EQ(primitive.attributes, document.model.meshes[0].primitives[0].attributes);
}

TEST(GltfUnpack, BrokenDracoStreamsHaveTheirMessages) {
    const std::string stream = dracoStream(draco::MESH_EDGEBREAKER_ENCODING);
    const auto changed = [&](size_t at, char value) {
        std::string bytes = stream;
        bytes[at] = value;
        return dracoFile(bytes);
    };
    EXPECT_THAT(messageOf(changed(0, 'X')), HasSubstr("its bytes are no Draco stream"));
    EXPECT_THAT(messageOf(changed(6, 1)), HasSubstr("has version 2.1; glTF has 2.2"));
    EXPECT_THAT(messageOf(changed(7, 0)), HasSubstr("is a cloud of points, not a mesh"));
    // After the header of 11 bytes and a kind of traversal: how many vertices, how many faces.
    EXPECT_THAT(messageOf(dracoFile(stream.substr(0, 12) + "\xff\xff\xff\x7f" + stream.substr(12))),
                HasSubstr("claim to unpack to"));
    EXPECT_THAT(messageOf(dracoFile(stream.substr(0, 12))), HasSubstr("ends too early"));
    EXPECT_THAT(messageOf(dracoFile(stream.substr(0, stream.size() / 2))),
                HasSubstr("Draco cannot unpack it"));
    GltfParts parts = dracoFile(stream);
    parts.set("meshes", replaced(kDracoMeshes, R"("TEXCOORD_0":1)", R"("TEXCOORD_0":5)"));
    EXPECT_THAT(messageOf(parts), HasSubstr("has no attribute 5"));
    parts.set("meshes", replaced(kDracoMeshes, R"({"POSITION":0,"TEXCOORD_0":1})", "{}"));
    EXPECT_THAT(messageOf(parts), HasSubstr("'attributes' has no POSITION"));
    parts.set("meshes",
              replaced(kDracoMeshes, R"({"POSITION":0,"TEXCOORD_0":1})", R"({"POSITION":1})"));
    EXPECT_THAT(messageOf(parts), HasSubstr("POSITION has 2 components"));
    parts.set("meshes", replaced(kDracoMeshes, R"("bufferView":0)", R"("bufferView":4)"));
    EXPECT_THAT(messageOf(parts), HasSubstr("refers to buffer view 4 of 1"));
}

TEST(GltfUnpack, DamagedStreamsAreRefusedOrSound) {
    const TemporaryFolder folder;
    constexpr unsigned kSeed = 20251124;
    std::mt19937 random(kSeed);
    const auto read = [&](const GltfParts& parts) {
        const std::string path = folder.write("f.glb", parts.glb());
        test::resetAllocationPeak();
        try {
            test::expectSound(readGltf(path), path);
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::kInput) << error.what();
        }
        EXPECT_LE(test::allocationPeakBytes(), 64u << 20);
    };
    for (const GltfParts& whole :
         {meshoptFile(), dracoFile(dracoStream(draco::MESH_SEQUENTIAL_ENCODING)),
          dracoFile(dracoStream(draco::MESH_EDGEBREAKER_ENCODING))}) {
        for (size_t length = 1; length < whole.binary.size(); ++length) {
            GltfParts cut = whole;
            std::fill(cut.binary.begin() + ptrdiff_t(length), cut.binary.end(), 0);
            read(cut);
        }
        for (int i = 0; i < 1000; ++i) {
            GltfParts damaged = whole;
            const size_t bit = random() % (8 * whole.binary.size());
            damaged.binary[bit / 8] = char(damaged.binary[bit / 8] ^ (1 << (bit % 8)));
            read(damaged);
            ASSERT_FALSE(HasFailure()) << "seed " << kSeed << ", flip " << i << ", bit " << bit;
        }
    }
}

} // namespace shadowdag
