// SPDX-License-Identifier: Apache-2.0
// Files of writeGlb read back as the same scene and follow the format.
#include "cuda/error.h"
#include "scenes/gltf.h"
#include "scenes/world.h"
#include "tests/scenes/gltf_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>
#include <random>
#include <sstream>

namespace shadowdag {
namespace {

// A scene with everything: shared meshes, odd names, nested and mirrored nodes, a matrix, every
// kind of light, camera and animation. Numbers are random, so that none is short by chance.
Scene richScene(unsigned seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> uniform(-10.0f, 10.0f);
    const auto vector = [&] {
        return glm::vec3(uniform(random), uniform(random), uniform(random));
    };
    Scene scene;
    scene.name = "rich \"scene\"\n\x01 \xc3\xa4";
    scene.materials.resize(3);
    scene.materials[1] = {"red", {1, 0.25f, 0.1f}, {0, 0, 0}};
    scene.materials[2] = {"lamp", {0.5f, 0.5f, 0.5f}, {30.3f, 20.2f, 0.7f}};
    for (int m = 0; m < 2; ++m) {
        Mesh mesh;
        mesh.name = "mesh" + std::to_string(m);
        for (int i = 0; i < 30; ++i)
            mesh.positions.push_back(vector());
        for (uint32_t i = 0; i < 30; i += 3) {
            mesh.triangles.emplace_back(i, i + 2, i + 1);
            mesh.triangleMaterial.push_back(i / 9 % 3);
        }
        scene.meshes.push_back(mesh);
    }
    scene.meshes.emplace_back(); // empty: glTF cannot hold it
    scene.lights.resize(3);
    scene.lights[0] = {"point", Light::kPoint, {1, 0.5f, 0.3f}, 12.3f, 4.56f, 0.0f, 0.7853982f};
    scene.lights[1] = {"open", Light::kPoint, {1, 1, 1}, 0.1f, 0.0f, 0.0f, 0.7853982f};
    scene.lights[2] = {"spot", Light::kSpot, {0.2f, 1, 1}, 7.7f, 9.9f, 0.3f, 0.6f};
    scene.cameras.push_back({"closed", 0.77f, 0.013f, 123.4f});
    scene.cameras.push_back({"open", 1.1f, 0.1f, std::numeric_limits<float>::infinity()});
    scene.nodes.resize(6);
    for (int i = 0; i < 6; ++i) {
        Node& node = scene.nodes[size_t(i)];
        node.name = "n" + std::to_string(i);
        node.local.translation = vector();
        node.local.rotation = glm::normalize(glm::quat(uniform(random), vector()));
        node.local.scale = vector(); // mirrored as often as not
        node.mesh = i % 3;
        node.light = i % 4 == 3 ? kNone : i % 4;
        node.camera = i < 2 ? i : kNone;
    }
    for (int i : {1, 2}) {
        scene.nodes[size_t(i)].parent = 0;
        scene.nodes[0].children.push_back(i);
    }
    scene.nodes[3].parent = 2;
    scene.nodes[2].children.push_back(3);
    scene.nodes[4].local.hasMatrix = true;
    for (int c = 0; c < 4; ++c)
        scene.nodes[4].local.matrix[c] = glm::vec4(vector(), c == 3 ? 1.0f : 0.0f);
    scene.roots = {0, 4, 5};
    Animation animation{"move", {}};
    for (int i = 0; i < 3; ++i) {
        AnimationChannel channel;
        channel.node = i;
        channel.path = AnimationChannel::Path(i);
        channel.interpolation = AnimationChannel::Interpolation(2 - i);
        channel.times = {0.1f, 0.3f, 1.7f};
        const size_t count =
            channel.interpolation == AnimationChannel::Interpolation::kCubicSpline ? 9 : 3;
        for (size_t k = 0; k < count; ++k)
            channel.values.push_back(channel.path == AnimationChannel::Path::kRotation
                                         ? glm::normalize(glm::vec4(vector(), 1.0f))
                                         : glm::vec4(vector(), 0.0f));
        animation.channels.push_back(channel);
    }
    scene.animations = {animation};
    return scene;
}

void expectSameWorld(const Scene& a, const Scene& b, float timeSeconds) {
    World worldA(a, {}), worldB(b, {});
    worldA.setTime(timeSeconds);
    worldB.setTime(timeSeconds);
    const TriangleView ta = worldA.triangles(), tb = worldB.triangles();
    ASSERT_EQ(ta.count(), tb.count());
    for (size_t t = 0; t < ta.count(); ++t)
        for (int corner = 0; corner < 3; ++corner) {
            const glm::vec3 pa = ta.vertex(t, corner), pb = tb.vertex(t, corner);
            ASSERT_EQ(std::memcmp(&pa, &pb, sizeof pa), 0)
                << "triangle " << t << " at " << timeSeconds << " s";
        }
    EXPECT_EQ(worldA.geometryHash(), worldB.geometryHash());
    ASSERT_EQ(worldA.lights().size(), worldB.lights().size());
    for (size_t i = 0; i < worldA.lights().size(); ++i)
        EXPECT_EQ(std::memcmp(&worldA.lights()[i], &worldB.lights()[i], sizeof(Light)), 0)
            << "light " << i;
    ASSERT_EQ(worldA.cameras().size(), worldB.cameras().size());
    for (size_t i = 0; i < worldA.cameras().size(); ++i)
        EXPECT_EQ(std::memcmp(&worldA.cameras()[i], &worldB.cameras()[i], sizeof(Camera)), 0)
            << "camera " << i;
    for (size_t t = 0; t < ta.count(); ++t) {
        const Material& ma = a.materials[worldA.triangleMaterial()[t]];
        const Material& mb = b.materials[worldB.triangleMaterial()[t]];
        ASSERT_EQ(ma.name, mb.name);
        ASSERT_EQ(ma.baseColor, mb.baseColor);
        for (int c = 0; c < 3; ++c)
            ASSERT_FLOAT_EQ(ma.emission[c], mb.emission[c]);
    }
}

TEST(GltfWriter, SceneReadsBackBitForBit) {
    const test::TemporaryFolder folder;
    for (unsigned seed = 1; seed <= 20; ++seed) {
        SCOPED_TRACE(seed);
        const Scene scene = richScene(seed);
        writeGlb(scene, folder.path("s.glb"));
        const Scene back = readGltf(folder.path("s.glb"));
        test::expectSound(back, "s.glb");
        EXPECT_TRUE(back.warnings.empty());
        EXPECT_EQ(back.animations.size(), 1u);
        EXPECT_EQ(back.nodes[3].name, "n3");
        EXPECT_EQ(back.durationSeconds(), 1.7f);
        for (float time : {0.0f, 0.2f, 1.0f, 5.0f})
            expectSameWorld(scene, back, time);
    }
}

TEST(GltfWriter, WritingAReadSceneGivesTheSameFile) {
    // The scene takes its name from the file, hence one name in two folders.
    const test::TemporaryFolder first, second, third;
    const auto content = [](const test::TemporaryFolder& folder) {
        std::stringstream text;
        text << std::ifstream(folder.path("s.glb"), std::ios::binary).rdbuf();
        return text.str();
    };
    writeGlb(richScene(1), first.path("s.glb")); // holds an empty mesh, which the file cannot
    writeGlb(readGltf(first.path("s.glb")), second.path("s.glb"));
    writeGlb(readGltf(second.path("s.glb")), third.path("s.glb"));
    EXPECT_EQ(content(second), content(third));
}

// glTF 2.0: chunk alignment (4.4.3), accessor alignment (3.6.2.4), bounds of POSITION (3.7.2.1), no
// empty arrays.
TEST(GltfWriter, FileFollowsTheFormat) {
    const test::TemporaryFolder folder;
    const Scene scene = richScene(7);
    writeGlb(scene, folder.path("s.glb"));
    std::stringstream stream;
    stream << std::ifstream(folder.path("s.glb"), std::ios::binary).rdbuf();
    const std::string bytes = stream.str();
    uint32_t header[5];
    std::memcpy(header, bytes.data(), sizeof header);
    EXPECT_EQ(header[1], 2u);
    EXPECT_EQ(header[2], bytes.size());
    EXPECT_EQ(header[3] % 4, 0u);
    const nlohmann::json json = nlohmann::json::parse(bytes.substr(20, header[3]));
    EXPECT_EQ(json["scenes"][0]["name"], scene.name);
    EXPECT_EQ(json["meshes"].size(), 2u);
    EXPECT_EQ(json["nodes"][0]["name"], "n0");
    for (const nlohmann::json& accessor : json["accessors"]) {
        const nlohmann::json& view = json["bufferViews"][accessor["bufferView"].get<size_t>()];
        EXPECT_EQ(view["byteOffset"].get<size_t>() % 4, 0u);
        EXPECT_LE(view["byteOffset"].get<size_t>() + view["byteLength"].get<size_t>(),
                  json["buffers"][0]["byteLength"].get<size_t>());
    }
    const auto position =
        json["meshes"][0]["primitives"][0]["attributes"]["POSITION"].get<size_t>();
    Box bounds;
    for (const glm::vec3& p : scene.meshes[0].positions)
        bounds.add(p);
    for (int axis = 0; axis < 3; ++axis) {
        EXPECT_EQ(json["accessors"][position]["min"][size_t(axis)].get<float>(), bounds.min[axis]);
        EXPECT_EQ(json["accessors"][position]["max"][size_t(axis)].get<float>(), bounds.max[axis]);
    }
    const std::function<void(const nlohmann::json&)> noEmptyArrays =
        [&](const nlohmann::json& value) {
            if (value.is_array()) {
                EXPECT_FALSE(value.empty());
            }
            if (value.is_structured())
                for (const nlohmann::json& inner : value)
                    noEmptyArrays(inner);
        };
    noEmptyArrays(json);
    EXPECT_LE(json["materials"][1]["emissiveFactor"][0].get<float>(), 1.0f);
}

TEST(GltfWriter, WriteErrorsAreReportedAndLeaveNoFile) {
    const test::TemporaryFolder folder;
    try {
        writeGlb(richScene(1), folder.path("absent/s.glb"));
        FAIL() << "wrote into a folder that does not exist";
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kResource);
        EXPECT_THAT(error.what(), testing::HasSubstr("absent/s.glb"));
    }
}

TEST(GltfWriter, RealSceneReadsBackBitForBit) {
    if (test::sharedScenes().empty())
        GTEST_SKIP() << "the shared scenes are absent; SDAG_SHARED_SCENES names their folder";
    const test::TemporaryFolder folder;
    const Scene scene = readGltf(test::sharedScenes() + "glb/kaykit_dungeon_4.glb");
    writeGlb(scene, folder.path("kaykit_dungeon_4.glb"));
    expectSameWorld(scene, readGltf(folder.path("kaykit_dungeon_4.glb")), 0.0f);
}

} // namespace
} // namespace shadowdag
