// SPDX-License-Identifier: Apache-2.0
// placeCamera of scenes/world.h.
#include "scenes/camera_placement.h"

#include "scenes/gltf.h"
#include "scenes/view_score.h"
#include "scenes/world.h"
#include "tests/scenes/gltf_files.h"
#include "tests/scenes/room.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstring>

namespace shadowdag {
namespace {

/// Returns whether all corners of a box lie in a picture of 16 by 9.
bool isAllInFrame(const Camera& camera, const Box& bounds) {
    const float tangent = std::tan(0.5f * camera.yfov);
    for (int corner = 0; corner < 8; ++corner) {
        const glm::vec3 at(corner & 1 ? bounds.max.x : bounds.min.x,
                           corner & 2 ? bounds.max.y : bounds.min.y,
                           corner & 4 ? bounds.max.z : bounds.min.z);
        const glm::vec3 to = at - camera.positionWorld;
        const float depth = glm::dot(to, camera.forward);
        if (depth < camera.znear || std::fabs(glm::dot(to, camera.up)) > depth * tangent ||
            std::fabs(glm::dot(to, camera.right())) > depth * tangent * 16.0f / 9.0f)
            return false;
    }
    return true;
}

void expectSound(const Camera& camera, const Box& bounds) {
    EXPECT_TRUE(distanceSquared(bounds, camera.positionWorld) == 0.0f ||
                isAllInFrame(camera, bounds))
        << "outside the bounds";
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

/// What the lights do in a picture of 32 by 18 samples.
ViewLight lightOf(const World& world, const Camera& camera) {
    const OpenSpace open(world.triangles(), world.boundsWorld(), world.lights(), 1);
    const ViewScore score(world, open, open.typicalOpenness());
    std::vector<ViewSample> view;
    const float tangent = std::tan(0.5f * camera.yfov);
    for (int y = 0; y < 18; ++y)
        for (int x = 0; x < 32; ++x) {
            const float u = (2.0f * (float(x) + 0.5f) / 32.0f - 1.0f) * 16.0f / 9.0f;
            const float v = 1.0f - 2.0f * (float(y) + 0.5f) / 18.0f;
            view.push_back(score.look(
                camera.positionWorld,
                glm::normalize(camera.forward + (camera.right() * u + camera.up * v) * tangent)));
        }
    return score.light(view, 64);
}

void addLight(Scene& scene, const glm::vec3& position, float range) {
    if (scene.lights.empty())
        scene.lights.resize(1);
    scene.lights[0].rangeWorld = range;
    scene.nodes.emplace_back();
    scene.nodes.back().light = 0;
    scene.nodes.back().local.translation = position;
    scene.roots.push_back(uint32_t(scene.nodes.size() - 1));
}

// The large hall is the better sight, but three lights hang there and forty in the small room.
TEST(CameraPlacement, OfManyLightsItShowsMany) {
    Scene scene = test::room({0, 0, 0}, {30, 8, 20});
    for (int i = 0; i < 12; ++i) {
        const float x = 4.0f + 4.0f * float(i % 6), z = 6.0f + 8.0f * float(i / 6);
        test::addMesh(scene, test::room({x, 0, z}, {x + 0.6f, 7, z + 0.6f}), true);
    }
    test::addMesh(scene, test::room({40, 0, 0}, {48, 4, 10}), false);
    test::addMesh(scene, test::room({43, 0, 4}, {44, 1.5f, 5}), true);
    for (int i = 0; i < 3; ++i)
        addLight(scene, {5.0f + 9.0f * float(i), 7.5f, 3.0f}, 4.0f);
    for (int i = 0; i < 40; ++i)
        addLight(scene, {40.6f + 0.95f * float(i % 8), 3.7f, 0.8f + 1.9f * float(i / 8)}, 4.0f);
    const World world(scene, {});
    const ViewLight light = lightOf(world, placeCamera(world));
    EXPECT_GE(light.seenCount(), 20u);
    EXPECT_GT(light.darkCount, 0u);
    EXPECT_GT(double(light.litCount), 0.5 * double(light.hitCount));
}

TEST(CameraPlacement, SeveralViewsDifferAndTheFirstOnesStay) {
    const Scene scene = test::hallInShell();
    WorldOptions options;
    options.placedLightCount = 40;
    const World world(scene, options);
    const std::vector<Camera> three = placeCameras(world, 3), one = placeCameras(world, 1);
    ASSERT_EQ(three.size(), 3u);
    ASSERT_EQ(one.size(), 1u);
    EXPECT_EQ(std::memcmp(&three[0], &one[0], sizeof(Camera)), 0);
    for (size_t i = 0; i < 3; ++i) {
        expectSound(three[i], world.boundsWorld());
        for (size_t k = 0; k < i; ++k)
            EXPECT_TRUE(glm::length(three[i].positionWorld - three[k].positionWorld) > 1.0f ||
                        glm::dot(three[i].forward, three[k].forward) < 0.8f)
                << "views " << k << " and " << i;
    }
}

TEST(CameraPlacement, ProgressIsTheShareOfTheRaysAndChangesNothing) {
    const Scene scene = test::hallInShell();
    for (const int lightCount : {0, 5}) {
        WorldOptions options;
        options.placedLightCount = lightCount;
        const World world(scene, options);
        std::vector<double> shares;
        const std::vector<Camera> shown =
            placeCameras(world, 1, nullptr, [&](double fraction) { shares.push_back(fraction); });
        EXPECT_GT(shares.size(), 50u);
        EXPECT_TRUE(std::is_sorted(shares.begin(), shares.end()));
        EXPECT_GT(shares.front(), 0.0);
        EXPECT_EQ(shares.back(), 1.0);
        EXPECT_GT(std::count_if(shares.begin(), shares.end(),
                                [](double share) { return share > 0.3 && share < 0.9; }),
                  10);
        EXPECT_EQ(std::memcmp(&shown[0], &placeCameras(world, 1)[0], sizeof(Camera)), 0);
    }
}

TEST(CameraPlacement, ProgressMayEndThePlacing) {
    const Scene scene = test::hallInShell();
    const World world(scene, {});
    struct End {};
    EXPECT_THROW(placeCameras(world, 1, nullptr, [](double) { throw End{}; }), End);
}

// Half of the rooms have a light; each further view shows light and shadow in one of them.
TEST(CameraPlacement, FurtherViewsShowLightAndShadow) {
    Scene scene;
    for (int i = 0; i < 6; ++i) {
        const float x = 20.0f * float(i);
        if (i == 0)
            scene = test::room({0, 0, 0}, {10, 4, 8});
        else
            test::addMesh(scene, test::room({x, 0, 0}, {x + 10, 4, 8}), false);
        test::addMesh(scene, test::room({x + 4, 0, 3}, {x + 5, 2, 4}), true);
        if (i % 2 == 0)
            addLight(scene, {x + 2, 3.5f, 3.5f}, 30.0f);
    }
    const World world(scene, {});
    const std::vector<Camera> cameras = placeCameras(world, 6);
    ASSERT_EQ(cameras.size(), 6u);
    std::array<int, 3> roomCount{};
    for (const Camera& camera : cameras) {
        const ViewLight light = lightOf(world, camera);
        EXPECT_GT(light.litCount, 0u) << camera.positionWorld.x;
        EXPECT_GT(light.darkCount, 0u) << camera.positionWorld.x;
        ++roomCount[size_t(camera.positionWorld.x / 40.0f)];
    }
    for (const int count : roomCount)
        EXPECT_GE(count, 1);
}

// A model that stands alone is seen from outside, all of it.
TEST(CameraPlacement, AModelAloneIsInTheFrameAsAWhole) {
    Scene scene = test::room({-1, 0, -0.5f}, {1, 2, 0.5f});
    for (glm::uvec3& t : scene.meshes[0].triangles)
        std::swap(t.y, t.z);
    test::addMesh(scene, test::room({-0.3f, 2, -0.3f}, {0.3f, 2.6f, 0.3f}), true);
    const World world(scene, {});
    EXPECT_TRUE(isAllInFrame(placeCamera(world), world.boundsWorld()));
}

// Levels with hundreds of lights: each view shows many of them, in dark and in light.
TEST(CameraPlacement, LevelsOfManyLightsShowManyOfThem) {
    if (test::sharedScenes().empty())
        GTEST_SKIP() << "the shared scenes are absent; SDAG_SHARED_SCENES names their folder";
    for (const char* name :
         {"lq_e0m2", "lq_e1m1", "lq_e1m2", "lq_e1m5", "lq_e2m3", "lq_start_e0"}) {
        SCOPED_TRACE(name);
        const Scene scene = readGltf(test::sharedScenes() + "glb/" + name + ".glb");
        const World world(scene, {});
        const ViewLight light = lightOf(world, placeCamera(world));
        EXPECT_GE(light.seenCount(), 8u);
        EXPECT_GE(light.pairCount, 2 * light.hitCount);
        const double dark = double(light.darkCount) / double(light.tracedCount);
        EXPECT_GT(dark, 0.1);
        EXPECT_LT(dark, 0.9);
    }
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

TEST(CameraPlacement, LooksAtLitSurfaces) {
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
    const Scene scene = test::room({0, 0, 0}, {8, 0, 5}); // World refuses one without an area
    const World world(scene, {});
    expectSound(placeCamera(world), world.boundsWorld());
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
