// SPDX-License-Identifier: Apache-2.0
#include "scenes/world.h"

#include "cuda/cancel.h"
#include "cuda/error.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <ctime>
#include <limits>
#include <stdexcept>

namespace shadowdag {
namespace {

using testing::HasSubstr;

Mesh unitTriangle() {
    Mesh mesh;
    mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    mesh.triangles = {{0, 1, 2}};
    mesh.triangleMaterial = {0};
    return mesh;
}

// `count` roots that each show the unit triangle.
Scene triangles(int count) {
    Scene scene;
    scene.name = "test";
    scene.materials.resize(1);
    scene.meshes = {unitTriangle()};
    scene.nodes.resize(size_t(count));
    for (int i = 0; i < count; ++i) {
        scene.nodes[size_t(i)].mesh = 0;
        scene.roots.push_back(i);
    }
    return scene;
}

void adopt(Scene& scene, int parent, int child) {
    scene.nodes[size_t(parent)].children.push_back(child);
    scene.nodes[size_t(child)].parent = parent;
    std::erase(scene.roots, child);
}

AnimationChannel glide(int node, const glm::vec3& to) { // from the origin within one second
    AnimationChannel channel;
    channel.node = node;
    channel.times = {0.0f, 1.0f};
    channel.values = {glm::vec4(0.0f), glm::vec4(to, 0.0f)};
    return channel;
}

std::string messageOf(const Scene& scene, const WorldOptions& options = {}) {
    try {
        World world(scene, options);
    } catch (const Error& error) {
        return error.what();
    }
    return "no error";
}

TEST(World, NestedTransformsMultiplyParentFirst) {
    Scene scene = triangles(2);
    adopt(scene, 0, 1);
    scene.nodes[0].mesh = kNone;
    scene.nodes[0].local.translation = {10, 0, 0};
    scene.nodes[0].local.rotation =
        glm::quat(std::sqrt(0.5f), 0, 0, std::sqrt(0.5f)); // x to y about z
    scene.nodes[1].local.translation = {1, 0, 0};
    scene.nodes[1].local.scale = {2, 3, 4};
    const World world(scene, {});
    // (1, 0, 0) -> scaled (2, 0, 0) -> moved (3, 0, 0) -> turned (0, 3, 0) -> moved (10, 3, 0).
    EXPECT_EQ(world.triangles().vertex(0, 1), glm::vec3(10, 3, 0));
    // (0, 1, 0) -> (0, 3, 0) -> (1, 3, 0) -> (-3, 1, 0) -> (7, 1, 0).
    EXPECT_EQ(world.triangles().vertex(0, 2), glm::vec3(7, 1, 0));
    EXPECT_EQ(world.boundsWorld(), (Box{{7, 1, 0}, {10, 3, 0}}));
}

TEST(World, MatrixAndItsPartsGiveTheSameTransform) {
    Scene parts = triangles(1);
    parts.nodes[0].local.translation = {1, 2, 3};
    parts.nodes[0].local.scale = {2, -3, 0.5f};
    Scene matrix = triangles(1);
    matrix.nodes[0].local.hasMatrix = true;
    matrix.nodes[0].local.matrix = parts.nodes[0].local.parentFromLocal();
    const World a(parts, {}), b(matrix, {});
    for (int corner = 0; corner < 3; ++corner)
        EXPECT_EQ(a.triangles().vertex(0, corner), b.triangles().vertex(0, corner));
}

TEST(World, RotationNeedNotHaveUnitLength) {
    LocalTransform a, b;
    a.rotation = glm::quat(0.5f, 0.5f, -0.5f, 0.5f);
    b.rotation = glm::quat(1.0f, 1.0f, -1.0f, 1.0f);
    EXPECT_EQ(a.parentFromLocal(), b.parentFromLocal());
}

// The triangle faces +z; mirrored along x it must do so still.
TEST(World, MirroredNodesKeepTheirFacesTurnedOutwards) {
    Scene scene = triangles(2);
    scene.nodes[0].local.scale = {-1, 1, 1};
    scene.nodes[1].local.scale = {-1, -1, 1}; // mirrored twice: a rotation
    const World world(scene, {});
    EXPECT_EQ(world.triangles().triangles[0], glm::uvec3(0, 2, 1));
    EXPECT_EQ(world.triangles().triangles[1], glm::uvec3(3, 4, 5));
    for (size_t t = 0; t < 2; ++t) {
        const glm::vec3 a = world.triangles().vertex(t, 0), b = world.triangles().vertex(t, 1),
                        c = world.triangles().vertex(t, 2);
        EXPECT_GT(glm::cross(b - a, c - a).z, 0.0f);
    }
}

TEST(World, OnlyTheDefaultScenesNodesAreShown) {
    Scene scene = triangles(3);
    scene.roots = {2, 0};
    const World world(scene, {});
    ASSERT_EQ(world.instances().size(), 2u); // in node order, whatever the order of roots
    EXPECT_EQ(world.instances()[0].node, 0u);
    EXPECT_EQ(world.instances()[1].node, 2u);
    EXPECT_EQ(world.triangleInstance(), (std::vector<uint32_t>{0, 1}));
}

TEST(World, LongChainsOfNodesDoNotOverflowTheStack) {
    constexpr int kLength = 200'000;
    Scene scene = triangles(kLength);
    scene.roots = {0};
    for (int i = 0; i < kLength; ++i) {
        Node& node = scene.nodes[size_t(i)];
        node.mesh = i + 1 == kLength ? 0 : kNone;
        node.local.translation = {1, 0, 0};
        node.parent = i - 1;
        if (i + 1 < kLength)
            node.children = {i + 1};
    }
    EXPECT_EQ(World(scene, {}).triangles().vertex(0, 0), glm::vec3(kLength, 0, 0));
}

TEST(World, AnimationMovesNodeAndDescendantsOnly) {
    Scene scene = triangles(3);
    adopt(scene, 1, 2);
    scene.animations = {{"a", {glide(1, {0, 0, 8})}}};
    World world(scene, {});
    EXPECT_EQ(world.staticTriangles(), std::vector<uint32_t>{0});
    EXPECT_FALSE(world.instances()[0].isMoving);
    EXPECT_TRUE(world.instances()[1].isMoving);
    EXPECT_TRUE(world.instances()[2].isMoving);
    EXPECT_EQ(world.setTime(0.25f), (std::vector<uint32_t>{1, 2}));
    EXPECT_EQ(world.triangles().vertex(0, 0).z, 0.0f);
    EXPECT_EQ(world.triangles().vertex(1, 0).z, 2.0f);
    EXPECT_EQ(world.triangles().vertex(2, 0).z, 2.0f);
    EXPECT_EQ(world.boundsWorld().max.z, 2.0f);
    EXPECT_EQ(world.instances()[2].worldFromObject[3], glm::vec4(0, 0, 2, 1));
    world.setTime(7.0f); // the last key holds
    EXPECT_EQ(world.triangles().vertex(1, 0).z, 8.0f);
    world.setTime(0.0f); // no trace of earlier times
    EXPECT_EQ(world.boundsWorld(), (Box{{0, 0, 0}, {1, 1, 0}}));
}

TEST(World, ACancelledMoveIsDoneAgain) {
    Scene scene = triangles(3);
    adopt(scene, 1, 2);
    scene.animations = {{"a", {glide(1, {0, 0, 8})}}};
    World world(scene, {});
    setCpuPoll([](double) { throw std::runtime_error("enough"); });
    EXPECT_THROW(world.setTime(0.25f), std::runtime_error);
    setCpuPoll(nullptr);
    EXPECT_NE(world.timeSeconds(), 0.25f);
    EXPECT_EQ(world.setTime(0.25f), (std::vector<uint32_t>{1, 2}));
    EXPECT_EQ(world.triangles().vertex(2, 0).z, 2.0f);
    EXPECT_EQ(world.boundsWorld().max.z, 2.0f);
}

TEST(World, FirstOfTwoAnimationsOfOnePropertyPlays) {
    Scene scene = triangles(1);
    scene.animations = {{"a", {glide(0, {0, 0, 8})}}, {"b", {glide(0, {5, 5, 5})}}};
    World world(scene, {});
    world.setTime(1.0f);
    EXPECT_EQ(world.triangles().vertex(0, 0), glm::vec3(0, 0, 8));
}

TEST(World, ContentHashDependsOnLightsAndOnWhatMoves) {
    Scene scene = triangles(2);
    scene.animations.resize(1);
    scene.animations[0].channels = {glide(1, {1, 0, 0})};
    scene.lights.resize(1);
    scene.nodes[0].light = 0;
    const World base(scene, {});
    EXPECT_EQ(World(scene, {}).contentHash(), base.contentHash());
    Scene lit = scene, placed = scene;
    lit.lights[0].color *= 2.0f;
    placed.nodes[1].local.translation = {0, 3, 0};
    placed.animations[0].channels[0].values = {glm::vec4(0, 3, 0, 0), glm::vec4(1, 3, 0, 0)};
    for (const Scene& other : {lit, placed}) {
        EXPECT_NE(World(other, {}).contentHash(), base.contentHash());
        EXPECT_EQ(World(other, {}).geometryHash(), base.geometryHash());
    }
}

TEST(World, LightsAndCamerasFollowTheirNodes) {
    Scene scene = triangles(3);
    scene.lights = {{"spot", Light::kSpot, {1, 2, 0.5f}, 10.0f, 0.0f, 0.0f, 1.0471976f},
                    {"dark", Light::kPoint, {0, 0, 0}, 10.0f, 0.0f, 0.0f, 0.0f},
                    {"near", Light::kPoint, {1, 1, 1}, 1.0f, 2.5f, 0.0f, 0.0f}};
    scene.cameras = {{"c", 1.0f, 0.5f, std::numeric_limits<float>::infinity()}};
    scene.nodes[0].light = 0;
    scene.nodes[0].camera = 0;
    scene.nodes[0].local.translation = {1, 2, 3};
    scene.nodes[0].local.rotation = glm::quat(std::sqrt(0.5f), 0, -std::sqrt(0.5f), 0); // -z to +x
    scene.nodes[0].local.scale = {3, 3, 3}; // ranges do not scale
    scene.nodes[1].light = 1;
    scene.nodes[2].light = 2;
    scene.animations = {{"a", {glide(2, {4, 0, 0})}}};
    World world(scene, {});
    ASSERT_EQ(world.lights().size(), 2u); // the dark one is left out
    const Light& spot = world.lights()[0];
    EXPECT_EQ(spot.positionWorld, glm::vec3(1, 2, 3));
    EXPECT_NEAR(spot.directionWorld.x, 1.0f, 1e-6f);
    EXPECT_EQ(spot.intensity, glm::vec3(10, 20, 5));
    EXPECT_FLOAT_EQ(spot.rangeWorld, 20.0f); // sqrt(20 cd / 0.05 lux)
    EXPECT_FLOAT_EQ(spot.cosInner, 1.0f);
    EXPECT_FLOAT_EQ(spot.cosOuter, 0.5f);
    EXPECT_EQ(spot.isMoving, 0u);
    EXPECT_EQ(world.lights()[1].rangeWorld, 2.5f);
    EXPECT_EQ(world.lights()[1].isMoving, 1u);
    world.setTime(0.5f);
    EXPECT_EQ(world.lights()[1].positionWorld, glm::vec3(2, 0, 0));

    ASSERT_EQ(world.cameras().size(), 1u);
    const Camera& camera = world.cameras()[0];
    EXPECT_EQ(camera.positionWorld, glm::vec3(1, 2, 3));
    EXPECT_NEAR(camera.forward.x, 1.0f, 1e-6f);
    EXPECT_NEAR(camera.up.y, 1.0f, 1e-6f);
    EXPECT_NEAR(glm::dot(camera.forward, camera.up), 0.0f, 1e-7f);
    EXPECT_EQ(camera.znear, 0.5f);
    for (float x : {world.boundsWorld().min.x, world.boundsWorld().max.x}) // nothing is cut off
        EXPECT_LT(std::fabs(x - camera.positionWorld.x), camera.zfar);
}

TEST(World, GeometryHashCoversStaticTrianglesOnly) {
    Scene scene = triangles(2);
    scene.animations = {{"a", {glide(1, {0, 0, 8})}}};
    World world(scene, {});
    const std::string hash = world.geometryHash();
    EXPECT_THAT(hash, testing::MatchesRegex("[0-9a-f]{32}"));
    EXPECT_EQ(World(scene, {}).geometryHash(), hash);
    world.setTime(1.0f);
    EXPECT_EQ(world.geometryHash(), hash);
    scene.animations[0].channels[0].values[1].x = 3; // the mover takes another way
    EXPECT_EQ(World(scene, {}).geometryHash(), hash);
    scene.nodes[0].local.translation.x = std::nextafter(0.0f, 1.0f); // lost in 1 + x, not in 0 + x
    EXPECT_NE(World(scene, {}).geometryHash(), hash);
}

TEST(World, StaticBoundsIgnoreMovingGeometry) {
    Scene scene = triangles(2);
    scene.animations.resize(1);
    scene.animations[0].channels = {glide(1, {0, 0, 8})};
    World world(scene, {});
    const Box unit{{0, 0, 0}, {1, 1, 0}};
    EXPECT_EQ(world.staticBoundsWorld(), unit);
    world.setTime(1.0f);
    EXPECT_EQ(world.boundsWorld(), (Box{{0, 0, 0}, {1, 1, 8}}));
    EXPECT_EQ(world.staticBoundsWorld(), unit);
    // Another mover leaves hash and bounds, and so the voxel asset, as they are.
    const std::string hash = world.geometryHash();
    scene.animations[0].channels = {glide(1, {5, 0, 0})};
    scene.animations[0].channels[0].values[0].y = -3;
    const World other(scene, {});
    EXPECT_EQ(other.boundsWorld(), (Box{{0, -3, 0}, {1, 1, 0}}));
    EXPECT_EQ(other.staticBoundsWorld(), unit);
    EXPECT_EQ(other.geometryHash(), hash);
}

TEST(World, StaticBoundsOfAnAllMovingSceneAreThoseOfTimeZero) {
    Scene scene = triangles(1);
    scene.animations.resize(1);
    scene.animations[0].channels = {glide(0, {0, 0, 8})};
    World world(scene, {});
    world.setTime(1.0f);
    EXPECT_EQ(world.boundsWorld(), (Box{{0, 0, 8}, {1, 1, 8}}));
    EXPECT_EQ(world.staticBoundsWorld(), (Box{{0, 0, 0}, {1, 1, 0}}));
}

TEST(World, InvalidScenesHaveTheirMessages) {
    Scene scene = triangles(1);
    scene.roots.clear();
    EXPECT_THAT(messageOf(scene), HasSubstr("'test' has no triangle"));
    scene = triangles(1);
    scene.nodes[0].local.scale = glm::vec3(0.0f);
    EXPECT_THAT(messageOf(scene), HasSubstr("'test': no triangle has an area"));
    scene.nodes[0].local.scale = glm::vec3(1e-30f); // squares are not floats
    EXPECT_THAT(messageOf(scene), HasSubstr("'test': no triangle has an area"));
    scene.animations = {{"a", {glide(0, {0, 0, 8})}}};
    EXPECT_EQ(messageOf(scene), "no error") << "it may grow";
    scene = triangles(2);
    scene.meshes[0].triangles = {{0, 0, 1}, {0, 1, 2}};
    scene.meshes[0].triangleMaterial = {0, 0};
    EXPECT_EQ(messageOf(scene), "no error") << "one of two has an area";
    scene = triangles(2);
    scene.nodes[1].name = "flat";
    scene.nodes[1].local.scale = glm::vec3(0.0f);
    scene.nodes[1].light = 0;
    for (const Light::Kind kind : {Light::kSun, Light::kSpot, Light::kPoint}) {
        scene.lights = {{"l", kind, {1, 1, 1}, 1.0f, 0.0f, 0.0f, 1.0f}};
        EXPECT_THAT(messageOf(scene),
                    HasSubstr(kind == Light::kPoint
                                  ? "no error"
                                  : "node 1 ('flat') has the scale 0, so that its light"));
    }
    scene = triangles(2);
    adopt(scene, 0, 1);
    scene.nodes[0].local.scale = glm::vec3(1e8f);
    scene.nodes[1].local.scale = glm::vec3(1e8f);
    scene.nodes[1].name = "far";
    EXPECT_THAT(messageOf(scene), HasSubstr("node 1 ('far') places vertex 1 of mesh 0"));
    scene = triangles(3);
    WorldOptions options;
    options.maxTriangleCount = 2;
    EXPECT_THAT(messageOf(scene, options), HasSubstr("3 instanced triangles"));
}

TEST(World, CoordinatesAreWithinTheirLimit) {
    Scene scene = triangles(1);
    scene.lights = {{"lamp", Light::kPoint, {1, 1, 1}, 1.0f, 2.5f, 0.0f, 0.0f}};
    scene.cameras.resize(1);
    scene.nodes[0].light = scene.nodes[0].camera = 0;
    scene.nodes[0].local.translation = glm::vec3(-float(kMaxCoordinate));
    EXPECT_EQ(messageOf(scene), "no error");
    scene.nodes[0].mesh = kNone;
    scene.nodes.push_back(triangles(1).nodes[0]);
    scene.roots.push_back(1);
    for (const float beyond : {1.000001e9f, -1e20f, 1e29f}) {
        for (int axis = 0; axis < 3; ++axis) {
            Scene far = scene;
            far.nodes[1].local.translation[axis] = beyond;
            EXPECT_THAT(messageOf(far), HasSubstr("node 1 places vertex 0 of mesh 0 at (")) << axis;
            EXPECT_THAT(messageOf(far), HasSubstr("not within 1e9 of the origin"));
            far = scene;
            far.nodes[0].local.translation[axis] = beyond;
            EXPECT_THAT(messageOf(far), HasSubstr("node 0 places its light at (")) << axis;
            far.nodes[0].light = kNone;
            EXPECT_THAT(messageOf(far), HasSubstr("node 0 places its camera at (")) << axis;
        }
    }
}

// As many nodes as joints: a set of matrices for each node would take minutes.
TEST(World, NodesWithOneSkinShareItsMatrices) {
    constexpr int kNodes = 20'000;
    Scene scene = triangles(kNodes);
    scene.meshes[0].jointsPerVertex = 1;
    scene.meshes[0].jointWeights = {{0, 1.0f}, {1, 1.0f}, {kNodes - 1, 1.0f}};
    scene.skins.resize(1);
    for (int i = 0; i < kNodes; ++i) {
        scene.nodes[size_t(i)].skin = 0;
        scene.nodes[size_t(i)].local.translation = glm::vec3(0, 0, i);
        scene.skins[0].joints.push_back(i);
    }
    scene.skins[0].jointFromMesh.assign(kNodes, glm::mat4(1.0f));
    scene.animations = {{"a", {glide(1, {0, 8, 0})}}};
    const std::clock_t start = std::clock();
    World world(scene, {});
    EXPECT_EQ(world.setTime(1.0f).size(), size_t(kNodes));
    EXPECT_LT(double(std::clock() - start) / CLOCKS_PER_SEC, 10.0);
    for (const size_t instance : {size_t(0), size_t(kNodes - 1)}) {
        EXPECT_EQ(world.triangles().vertex(instance, 0), glm::vec3(0, 0, 0));
        EXPECT_EQ(world.triangles().vertex(instance, 1), glm::vec3(1, 8, 0));
        EXPECT_EQ(world.triangles().vertex(instance, 2), glm::vec3(0, 1, kNodes - 1));
    }
}

// Joints may be outside of the scene, and each skin moves by its own.
TEST(World, EachSkinHasTheMatricesOfItsOwnJoints) {
    Scene scene = triangles(3);
    scene.meshes[0].jointsPerVertex = 1;
    scene.meshes[0].jointWeights.assign(3, {0, 1.0f});
    scene.nodes.resize(6); // 3 to 5: joints, 4 below 3
    for (const int joint : {3, 4, 5})
        scene.nodes[size_t(joint)].local.translation = glm::vec3(joint, 0, 0);
    scene.nodes[3].children = {4};
    scene.nodes[4].parent = 3;
    for (int s = 0; s < 3; ++s) {
        scene.nodes[size_t(s)].skin = s;
        scene.skins.push_back({"", {3 + s}, {glm::mat4(1.0f)}});
    }
    scene.animations = {{"a", {glide(3, {0, 0, 8})}}};
    World world(scene, {});
    const auto firstCorner = [&](size_t triangle) { return world.triangles().vertex(triangle, 0); };
    EXPECT_EQ(firstCorner(0), glm::vec3(0, 0, 0));
    EXPECT_EQ(firstCorner(1), glm::vec3(4, 0, 0));
    EXPECT_EQ(firstCorner(2), glm::vec3(5, 0, 0));
    EXPECT_EQ(world.setTime(1.0f), (std::vector<uint32_t>{0, 1}));
    EXPECT_EQ(firstCorner(0), glm::vec3(0, 0, 8));
    EXPECT_EQ(firstCorner(1), glm::vec3(4, 0, 8));
    EXPECT_EQ(firstCorner(2), glm::vec3(5, 0, 0));
}

TEST(World, PlacedLightsReplaceAuthoredOnes) {
    Scene scene = triangles(1);
    scene.lights = {{"near", Light::kPoint, {1, 1, 1}, 1.0f, 2.5f, 0.0f, 0.0f}};
    scene.nodes[0].light = 0;
    WorldOptions options;
    EXPECT_EQ(World(scene, options).lights().size(), 1u);
    options.placedLightCount = 0;
    EXPECT_EQ(World(scene, options).lights().size(), 0u);
    options.placedLightCount = 7;
    World world(scene, options);
    EXPECT_EQ(world.lights().size(), 7u);
    world.setTime(1.0f);
    EXPECT_EQ(world.lights().size(), 7u);
}

} // namespace
} // namespace shadowdag
