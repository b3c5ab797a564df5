// SPDX-License-Identifier: Apache-2.0
// placeCamera of scenes/world.h.
#include "scenes/gltf.h"
#include "scenes/world.h"
#include "tests/scenes/gltf_files.h"
#include "tests/scenes/room.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

namespace shadowdag {
namespace {

void expectSound(const Camera& camera, const Box& bounds) {
    EXPECT_EQ(distanceSquared(bounds, camera.positionWorld), 0.0f) << "outside the bounds";
    EXPECT_NEAR(glm::length(camera.forward), 1.0f, 1e-6f);
    EXPECT_NEAR(glm::length(camera.up), 1.0f, 1e-6f);
    EXPECT_NEAR(glm::dot(camera.forward, camera.up), 0.0f, 1e-6f);
    EXPECT_GT(camera.up.y, 0.0f);
    EXPECT_GT(camera.znear, 0.0f);
    // No corner of the scene is cut off.
    const glm::vec3 reach = glm::max(glm::abs(bounds.min - camera.positionWorld),
                                     glm::abs(bounds.max - camera.positionWorld));
    EXPECT_GT(camera.zfar, glm::length(reach));
}

TEST(CameraPlacement, LooksAlongTheLengthOfACorridor) {
    const Scene scene = test::room({0, 0, 0}, {4, 5, 40});
    const World world(scene, {});
    const Camera camera = placeCamera(world);
    expectSound(camera, world.boundsWorld());
    EXPECT_GT(std::fabs(camera.forward.z), 0.8f);
    // From one end to the other.
    EXPECT_GT(camera.forward.z > 0 ? 40 - camera.positionWorld.z : camera.positionWorld.z, 25.0f);
}

TEST(CameraPlacement, GrowsWithTheScene) {
    const Scene small = test::room({0, 0, 0}, {8, 3, 5}),
                large = test::room({0, 0, 0}, {8192, 3072, 5120});
    const Camera a = placeCamera(World(small, {})), b = placeCamera(World(large, {}));
    EXPECT_EQ(a.positionWorld * 1024.0f, b.positionWorld);
    EXPECT_EQ(a.forward, b.forward);
    EXPECT_FLOAT_EQ(a.znear * 1024.0f, b.znear);
}

TEST(CameraPlacement, StaysOutOfASolidBlock) {
    // A room with a solid block, faces outwards, that fills most of it but one side.
    Scene scene = test::room({0, 0, 0}, {20, 6, 20});
    Scene block = test::room({0.5f, 0.1f, 0.5f}, {15, 5.9f, 19.5f});
    for (glm::uvec3& t : block.meshes[0].triangles)
        std::swap(t.y, t.z);
    scene.meshes.push_back(block.meshes[0]);
    scene.nodes.resize(2);
    scene.nodes[1].mesh = 1;
    scene.roots = {0, 1};
    const World world(scene, {});
    const Camera camera = placeCamera(world);
    expectSound(camera, world.boundsWorld());
    EXPECT_GT(camera.positionWorld.x, 15.0f);
}

bool isInHall(const glm::vec3& p) { // of hallInShell
    return p.x > 2.2f && p.x < 17.8f && p.z > 2.2f && p.z < 9.8f;
}

TEST(CameraPlacement, StandsInTheHallAndNotInTheGapAroundIt) {
    const Scene scene = test::hallInShell();
    for (int lightCount : {-1, 40}) {
        WorldOptions options;
        options.placedLightCount = lightCount;
        const World world(scene, options);
        const Camera camera = placeCamera(world);
        expectSound(camera, world.boundsWorld());
        EXPECT_TRUE(isInHall(camera.positionWorld))
            << camera.positionWorld.x << " " << camera.positionWorld.z;
    }
}

TEST(CameraPlacement, NeverLooksAtASealedMapFromOutside) {
    // Rooms with one-sided walls apart from each other: most of the bounds is outside of both.
    Scene scene = test::room({0, 0, 0}, {10, 4, 8});
    test::addMesh(scene, test::room({40, 10, 30}, {50, 15, 42}), false);
    const World world(scene, {});
    const glm::vec3 p = placeCamera(world).positionWorld;
    const bool isInFirst = p.x < 10 && p.y < 4 && p.z < 8;
    const bool isInSecond = p.x > 40 && p.y > 10 && p.z > 30;
    EXPECT_TRUE(isInFirst || isInSecond) << p.x << " " << p.y << " " << p.z;
}

TEST(CameraPlacement, LooksAtWhatTheLightsReach) {
    // Two equal rooms; all lights hang in the second.
    Scene scene = test::room({0, 0, 0}, {10, 4, 8});
    test::addMesh(scene, test::room({20, 0, 0}, {30, 4, 8}), false);
    scene.lights.resize(1);
    scene.lights[0].rangeWorld = 5.0f;
    for (int i = 0; i < 8; ++i) {
        scene.nodes.emplace_back();
        scene.nodes.back().light = 0;
        scene.nodes.back().local.translation = {21.0f + float(i), 3.0f, 4.0f};
        scene.roots.push_back(uint32_t(scene.nodes.size() - 1));
    }
    const World world(scene, {});
    EXPECT_GT(placeCamera(world).positionWorld.x, 20.0f);
}

TEST(CameraPlacement, SceneWithoutVolumeStillGetsACamera) {
    for (const Scene& scene :
         {test::room({0, 0, 0}, {8, 0, 5}), test::room({1, 1, 1}, {1, 1, 1})}) {
        const World world(scene, {});
        expectSound(placeCamera(world), world.boundsWorld());
    }
}

TEST(CameraPlacement, RealScenesGetASoundCameraTwiceTheSame) {
    if (test::sharedScenes().empty())
        GTEST_SKIP() << "the shared scenes are absent; SDAG_SHARED_SCENES names their folder";
    for (const char* name :
         {"crytek_sponza_half", "conference", "teapot", "lq_e2m3", "cornell_original"}) {
        SCOPED_TRACE(name);
        const Scene scene = readGltf(test::sharedScenes() + "glb/" + name + ".glb");
        const World world(scene, {});
        const Camera camera = placeCamera(world);
        expectSound(camera, world.boundsWorld());
        const Camera again = placeCamera(world);
        EXPECT_EQ(std::memcmp(&camera, &again, sizeof camera), 0);
    }
}

} // namespace
} // namespace shadowdag
