// SPDX-License-Identifier: Apache-2.0
// Skins and morph targets of glTF files: vertices in closed form over time, and every error
// message.
#include "cuda/error.h"
#include "scenes/gltf.h"
#include "scenes/polygon_lod.h"
#include "scenes/world.h"
#include "tests/scenes/gltf_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace shadowdag {
namespace {

using test::GltfParts;
using test::morphedFile;
using test::readParts;
using test::skinnedFile;
using test::TemporaryFolder;
using testing::HasSubstr;

std::string messageOf(const GltfParts& parts) {
    try {
        const Scene scene = readParts(parts);
        World(scene, {});
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kInput);
        return error.what();
    }
    return "no error";
}

std::vector<glm::vec3> cornersOf(const World& world) {
    return {world.triangles().vertex(0, 0), world.triangles().vertex(0, 1),
            world.triangles().vertex(0, 2)};
}

TEST(GltfDeform, ASkinnedMeshFollowsItsJointsAndNotItsNode) {
    const Scene scene = readParts(skinnedFile());
    EXPECT_TRUE(scene.warnings.empty());
    World world(scene, {});
    ASSERT_EQ(world.instances().size(), 1u);
    EXPECT_TRUE(world.instances()[0].isMoving);
    EXPECT_TRUE(world.staticTriangles().empty());
    const float share = 191.0f / 255.0f; // of joint 1; joint 0 has the rest
    const auto expectAt = [&](float height) {
        const std::vector<glm::vec3> corners = cornersOf(world);
        EXPECT_EQ(corners[0], glm::vec3(10, 0, 0));
        EXPECT_EQ(corners[1], glm::vec3(12, height, -1));
        for (int axis = 0; axis < 3; ++axis)
            EXPECT_NEAR(corners[2][axis], glm::vec3(10, 1 + share * height, -share)[axis], 1e-6f);
        EXPECT_EQ(world.boundsWorld().max.y, std::max(height, 1 + share * height));
    };
    expectAt(5);
    EXPECT_EQ(world.setTime(1.0f), std::vector<uint32_t>{0});
    expectAt(9);
    world.setTime(2.0f);
    expectAt(13);
    world.setTime(0.0f);
    expectAt(5);
}

TEST(GltfDeform, JointsThatStandStillGiveAStaticMesh) {
    GltfParts parts = skinnedFile();
    parts.members.erase("animations");
    const Scene scene = readParts(parts);
    const World world(scene, {});
    EXPECT_EQ(world.staticTriangles().size(), 1u);
    EXPECT_EQ(cornersOf(world)[1], glm::vec3(12, 5, -1));
    // The joints need not be in the scene.
    parts.set("scenes", R"([{"nodes":[0]}])");
    const Scene outside = readParts(parts);
    EXPECT_EQ(cornersOf(World(outside, {}))[1], glm::vec3(12, 5, -1));
    // Without matrices, the joints' own space is the mesh's.
    parts.set("skins", R"([{"joints":[1,2]}])");
    const Scene plain = readParts(parts);
    EXPECT_EQ(cornersOf(World(plain, {}))[1], glm::vec3(12, 5, 0));
}

TEST(GltfDeform, MorphTargetsDisplaceVerticesByTheWeightsOfMeshNodeAndTime) {
    const Scene scene = readParts(morphedFile());
    EXPECT_TRUE(scene.warnings.empty());
    EXPECT_EQ(scene.durationSeconds(), 2.0f);
    World world(scene, {});
    const auto corner1 = [&](size_t triangle) { return world.triangles().vertex(triangle, 1); };
    EXPECT_EQ(world.staticTriangles(), (std::vector<uint32_t>{0, 1}));
    EXPECT_EQ(corner1(0), glm::vec3(2, 0, 2)) << "weights of the mesh";
    EXPECT_EQ(corner1(1), glm::vec3(4, 0, 0)) << "weights of the node";
    EXPECT_EQ(corner1(2), glm::vec3(10, 3, 0)) << "weights of the animation at its start";
    EXPECT_EQ(world.setTime(1.0f), std::vector<uint32_t>{2});
    EXPECT_EQ(corner1(2), glm::vec3(8, 3, 2));
    EXPECT_EQ(corner1(0), glm::vec3(2, 0, 2));
    world.setTime(5.0f);
    EXPECT_EQ(corner1(2), glm::vec3(6, 3, 4));
}

TEST(GltfDeform, PrimitivesShareVerticesOnlyWithTheSameTargets) {
    GltfParts parts = morphedFile();
    parts.set(
        "meshes",
        R"([{"weights":[1,0],"primitives":[)"
        R"({"attributes":{"POSITION":0},"targets":[{"POSITION":2},{"NORMAL":2}],"indices":1},)"
        R"({"attributes":{"POSITION":0},"targets":[{"POSITION":3},{"NORMAL":2}],"indices":1}]}])");
    parts.members.erase("animations");
    const Scene scene = readParts(parts);
    EXPECT_EQ(scene.meshes.at(0).positions.size(), 6u);
    const World world(scene, {});
    EXPECT_EQ(world.triangles().vertex(0, 1), glm::vec3(2, 0, 4));
    EXPECT_EQ(world.triangles().vertex(1, 1), glm::vec3(10, 0, 0));
}

TEST(GltfDeform, WhatCannotDeformIsRefusedByItsPlace) {
    const struct {
        const char* member;
        const char* json;
        const char* message;
    } skins[] = {
        {"skins", R"([{"joints":[]}])", "skins/0: has no joints"},
        {"skins", R"([{"joints":[1,3]}])", "skins/0/joints: refers to node 3 of 3"},
        {"skins", R"([{"joints":[1]}])",
         "nodes/0/skin: mesh 0 refers to joint 1 of skin 0, which has 1"},
        {"skins", R"([{"joints":[1,2,1],"inverseBindMatrices":4}])", "2 matrices for 3 joints"},
        {"skins", R"([{"joints":[1,2],"inverseBindMatrices":2}])", "components an element, not 16"},
        {"nodes", R"([{"mesh":0,"skin":1},{"children":[2]},{}])", "refers to skin 1 of 1"},
        {"meshes", R"([{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}])",
         "mesh 0 has no JOINTS_0 and WEIGHTS_0"},
        {"meshes", R"([{"primitives":[{"attributes":{"POSITION":0,"JOINTS_0":2},"indices":1}]}])",
         "has one of JOINTS_0 and WEIGHTS_0 without the other"},
        {"meshes",
         R"([{"primitives":[{"attributes":{"POSITION":0,"JOINTS_0":3,"WEIGHTS_0":3},"indices":1}]}])",
         "meshes/0/JOINTS_0: vertex 2 has joint 0.749020, which is not a whole number below 65536"},
        {"meshes",
         R"([{"primitives":[{"attributes":{"POSITION":0,"JOINTS_0":2,"WEIGHTS_0":6},"indices":1}]}])",
         "components an element, not 4"},
        {"meshes",
         R"([{"primitives":[{"attributes":{"POSITION":0,"JOINTS_0":2,"WEIGHTS_0":3},"indices":1},)"
         R"({"attributes":{"POSITION":0},"indices":1}]}])",
         "meshes/0/primitives/1: only some primitives of its mesh have JOINTS_0"},
    };
    for (const auto& broken : skins)
        EXPECT_THAT(messageOf(skinnedFile().set(broken.member, broken.json)),
                    HasSubstr(broken.message));
    GltfParts projecting = skinnedFile();
    const float one = 1.0f;
    std::memcpy(projecting.binary.data() + 68 + 12, &one, sizeof one);
    EXPECT_THAT(messageOf(projecting), HasSubstr("the bottom row of matrix 0 holds 1.0"));
    GltfParts negative = skinnedFile();
    negative.set("accessors",
                 std::string(negative.members["accessors"])
                     .replace(negative.members["accessors"].find("5121,\"norm"), 4, "5120"));
    negative.binary[56] = char(-127);
    EXPECT_THAT(messageOf(negative), HasSubstr("weight -1.000000, which is negative"));

    const std::string primitive = R"([{"primitives":[{"attributes":{"POSITION":0},"indices":1,)";
    const struct {
        const char* member;
        std::string json;
        const char* message;
    } morphs[] = {
        {"meshes", primitive + R"("targets":[{"POSITION":9},{}]}]}])",
         "meshes/0/targets/0/POSITION: refers to accessor 9 of 6"},
        {"meshes", primitive + R"("targets":[{},{"POSITION":1}]}]}])",
         "meshes/0/targets/1/POSITION: accessor 1 has 1 components an element, not 3"},
        {"meshes", primitive + R"("targets":[{},{}]}],"weights":[1]}])",
         "meshes/0/weights: 1 weights for 2 morph targets"},
        {"meshes", primitive + R"("targets":[{},{}]},{"attributes":{"POSITION":0},"indices":1}]}])",
         "meshes/0/primitives/1: has 0 morph targets, another primitive of its mesh has 2"},
        {"nodes", R"([{"mesh":0},{"mesh":0,"weights":[0,0.25,1]},{"mesh":0}])",
         "nodes/1/weights: 3 weights for 2 morph targets"},
        {"animations",
         R"([{"channels":[{"sampler":0,"target":{"node":2,"path":"weights"}}],)"
         R"("samplers":[{"input":4,"output":4}]}])",
         "2 values for 2 keys; 4 are needed"},
    };
    for (const auto& broken : morphs)
        EXPECT_THAT(messageOf(morphedFile().set(broken.member, broken.json)),
                    HasSubstr(broken.message));
}

TEST(GltfDeform, DeformedMeshesAreDrawnInFullDetailAndNotWritten) {
    const TemporaryFolder folder;
    for (const GltfParts& parts : {skinnedFile(), morphedFile()}) {
        Scene scene = readParts(parts);
        EXPECT_THROW(writeGlb(scene, folder.path("out.glb")), Error);
        // A fan of 64 by 64 squares in the plane is simplified unless it deforms.
        Mesh& mesh = scene.meshes[0];
        const Mesh small = mesh;
        mesh.positions.clear();
        mesh.triangles.clear();
        mesh.jointWeights.clear();
        for (uint32_t y = 0; y < 65; ++y)
            for (uint32_t x = 0; x < 65; ++x) {
                mesh.positions.push_back({float(x), float(y), 0.0f});
                for (uint32_t k = 0; k < small.jointsPerVertex; ++k)
                    mesh.jointWeights.push_back(small.jointWeights[k]);
                const uint32_t v = y * 65 + x;
                if (x < 64 && y < 64) {
                    mesh.triangles.push_back({v, v + 1, v + 66});
                    mesh.triangles.push_back({v, v + 66, v + 65});
                }
            }
        mesh.triangleMaterial.assign(mesh.triangles.size(), 0);
        for (std::vector<glm::vec3>& target : mesh.morphTargets)
            target.assign(mesh.positions.size(), glm::vec3(0, 0, 1));
        const World world(scene, {});
        EXPECT_EQ(PolygonLod(world).triangles().count(), world.triangles().count());
    }
}

} // namespace
} // namespace shadowdag
