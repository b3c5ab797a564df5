// SPDX-License-Identifier: Apache-2.0
#include "scenes/light_placement.h"

#include "cuda/cancel.h"
#include "scenes/camera_placement.h"
#include "scenes/gltf.h"
#include "scenes/triangle_tree.h"
#include "scenes/warning.h"
#include "tests/scenes/gltf_files.h"
#include "tests/scenes/overlaps.h"
#include "tests/scenes/room.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <random>

namespace shadowdag {
namespace {

bool areSame(const std::vector<Light>& a, const std::vector<Light>& b) {
    return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(Light)) == 0;
}

TEST(LightPlacement, SameSeedSameLights) {
    const Scene scene = test::room({0, 0, 0}, {8, 3, 5});
    const World world(scene, {});
    EXPECT_TRUE(areSame(placeLights(world, 20, 3), placeLights(world, 20, 3)));
    EXPECT_FALSE(areSame(placeLights(world, 20, 3), placeLights(world, 20, 4)));
    EXPECT_EQ(placeLights(world, 30, 3)[5].positionWorld,
              placeLights(world, 20, 3)[5].positionWorld);
    EXPECT_TRUE(placeLights(world, 0, 3).empty());
}

TEST(LightPlacement, LightsHangFreeInsideTheRoom) {
    const Scene scene = test::room({0, 0, 0}, {8, 3, 5});
    const World world(scene, {});
    const float diagonal = std::sqrt(98.0f);
    for (const Light& light : placeLights(world, 200, 1)) {
        const glm::vec3 p = light.positionWorld;
        const float clearance = std::min({p.x, p.y, p.z, 8 - p.x, 3 - p.y, 5 - p.z});
        EXPECT_GE(clearance, 0.5f * 0.005f * diagonal * 0.999f);
        EXPECT_LE(clearance, 0.03f * diagonal * 1.001f);
        EXPECT_EQ(light.kind, Light::kPoint);
        EXPECT_EQ(light.isMoving, 0u);
    }
}

double lightsPerSurfacePoint(const std::vector<Light>& lights) { // of the 8 x 3 x 5 room
    std::mt19937 random(99);
    std::uniform_real_distribution<float> uniform(0.0f, 1.0f);
    size_t count = 0;
    constexpr int kPointCount = 20000;
    for (int i = 0; i < kPointCount; ++i) {
        const float x = 8 * uniform(random), y = 3 * uniform(random), z = 5 * uniform(random);
        const float side = uniform(random) * (8 * 3 + 3 * 5 + 5 * 8); // areas of the pairs of walls
        const bool end = uniform(random) < 0.5f;
        const glm::vec3 p = side < 24   ? glm::vec3(x, y, end ? 5 : 0)
                            : side < 39 ? glm::vec3(end ? 8 : 0, y, z)
                                        : glm::vec3(x, end ? 3 : 0, z);
        for (const Light& light : lights)
            count += lightReaches(light, p);
    }
    return double(count) / kPointCount;
}

TEST(LightPlacement, TwelveLightsReachASurfacePoint) {
    const Scene scene = test::room({0, 0, 0}, {8, 3, 5});
    const World world(scene, {});
    for (uint64_t seed = 1; seed <= 5; ++seed)
        for (int count : {16, 65, 256})
            EXPECT_NEAR(lightsPerSurfacePoint(placeLights(world, count, seed)), 12.0, 0.8)
                << count << " lights, seed " << seed;
    EXPECT_NEAR(lightsPerSurfacePoint(placeLights(world, 4, 1)), 3.0, 0.3);
}

TEST(LightPlacement, RangesAndIntensitiesFollowTheirRule) {
    const Scene scene = test::room({0, 0, 0}, {8, 3, 5});
    const World world(scene, {});
    const std::vector<Light> lights = placeLights(world, 100, 1);
    float least = 1e30f, most = 0.0f;
    for (const Light& light : lights) {
        least = std::min(least, light.rangeWorld);
        most = std::max(most, light.rangeWorld);
        EXPECT_FLOAT_EQ(light.intensity.x, 0.25f * light.rangeWorld * light.rangeWorld);
    }
    EXPECT_LE(most / least, 4.0f);
    EXPECT_GE(most / least, 2.5f);
}

TEST(LightPlacement, AllGrowsWithTheScene) {
    const Scene small = test::room({0, 0, 0}, {8, 3, 5}),
                large = test::room({0, 0, 0}, {8192, 3072, 5120});
    const std::vector<Light> a = placeLights(World(small, {}), 40, 1),
                             b = placeLights(World(large, {}), 40, 1);
    for (size_t i = 0; i < a.size(); ++i) { // a factor of 2^10 changes no rounding
        EXPECT_EQ(a[i].positionWorld * 1024.0f, b[i].positionWorld);
        EXPECT_FLOAT_EQ(a[i].rangeWorld * 1024.0f, b[i].rangeWorld);
    }
}

TEST(LightPlacement, IsTheSameUpToTheLargestCoordinates) {
    constexpr float kScale = 0x1p26f;
    const Scene small = test::room({-14, -3, -5}, {14, 3, 5}),
                large = test::room(kScale * glm::vec3(-14, -3, -5), kScale * glm::vec3(14, 3, 5));
    const World a(small, {}), b(large, {});
    const std::vector<Light> lights = placeLights(a, 40, 1), far = placeLights(b, 40, 1);
    for (size_t i = 0; i < lights.size(); ++i) {
        EXPECT_EQ(lights[i].positionWorld * kScale, far[i].positionWorld);
        EXPECT_EQ(lights[i].rangeWorld * kScale, far[i].rangeWorld);
        EXPECT_EQ(lights[i].intensity * kScale * kScale, far[i].intensity);
    }
    const Camera camera = placeCamera(a), farCamera = placeCamera(b);
    EXPECT_EQ(camera.positionWorld * kScale, farCamera.positionWorld);
    EXPECT_EQ(camera.forward, farCamera.forward);
}

// As in a file whose exporter wrote a mesh once for each of its users.
TEST(LightPlacement, ManyCoincidentTrianglesTakeNoLongerThanOthers) {
    Scene scene = test::room({0, 0, 0}, {8, 3, 5});
    Mesh& mesh = scene.meshes[0];
    while (mesh.triangles.size() < 300'000)
        mesh.triangles.push_back(mesh.triangles[mesh.triangles.size() - 12]);
    mesh.triangleMaterial.assign(mesh.triangles.size(), 0);
    const Scene room = test::room({0, 0, 0}, {8, 3, 5});
    QueryCost many, few;
    EXPECT_EQ(placeLights(World(scene, {}), 20, 3, &many).size(), 20u);
    EXPECT_EQ(placeLights(World(room, {}), 20, 3, &few).size(), 20u);
    // The surfaces' areas have other rounding: equal kinds of places, not equal places.
    EXPECT_GT(few.stepCount, 0u);
    EXPECT_LE(many.stepCount, few.stepCount + few.stepCount / 10);
    EXPECT_EQ(many.cutCount, 0u);
}

static std::vector<std::string> heardWarnings;

// Decals, copies that lie almost on each other, fans and hedges of real exports.
TEST(LightPlacement, OverlappingTrianglesTakeBoundedWorkAndAWarning) {
    setWarningListener([](const std::string& text) { heardWarnings.push_back(text); });
    for (const test::Overlap kind :
         {test::Overlap::kPile, test::Overlap::kFan, test::Overlap::kAxis}) {
        SCOPED_TRACE(int(kind));
        Scene scene = test::room({0, 0, 0}, {8, 3, 5});
        test::addOverlap(scene.meshes[0], kind, 20'000);
        const World world(scene, {});
        heardWarnings.clear();
        QueryCost cost;
        EXPECT_EQ(placeLights(world, 4, 1, &cost).size(), 4u);
        // 512 places of 27 rays, 13 lines of sight and 26 rays of the rooms, 1024 samples of 96
        // lines of sight, and of each light 64 tries of 28 queries.
        EXPECT_LE(cost.queryCount, 512u * (27 + 13 + 26) + 1024 * 96 + 4 * 64 * 28);
        EXPECT_LE(cost.stepCount,
                  cost.queryCount * (TriangleTree::kFewQuerySteps + 8) +
                      uint64_t(TriangleTree::kMaxLongCuts) * TriangleTree::kMaxQuerySteps);
        EXPECT_GT(cost.cutCount, 0u);
        ASSERT_EQ(heardWarnings.size(), 1u);
        EXPECT_NE(heardWarnings[0].find("lights were cut short"), std::string::npos);
        if (kind != test::Overlap::kPile)
            continue;
        heardWarnings.clear();
        EXPECT_EQ(placeCameras(world, 1, &cost).size(), 1u);
        EXPECT_LE(cost.queryCount, 300'000u);
        EXPECT_LE(cost.stepCount,
                  cost.queryCount * (TriangleTree::kFewQuerySteps + 8) +
                      uint64_t(TriangleTree::kMaxLongCuts) * TriangleTree::kMaxQuerySteps);
        ASSERT_EQ(heardWarnings.size(), 1u);
        EXPECT_NE(heardWarnings[0].find("cameras were cut short"), std::string::npos);
    }
    setWarningListener(nullptr);
}

TEST(LightPlacement, OrdinaryScenesTakeNoWarning) {
    setWarningListener([](const std::string& text) { heardWarnings.push_back(text); });
    heardWarnings.clear();
    const Scene scene = test::hallInShell();
    const World world(scene, {});
    QueryCost cost;
    placeLights(world, 20, 1, &cost);
    placeCameras(world, 2);
    setWarningListener(nullptr);
    EXPECT_TRUE(heardWarnings.empty()) << heardWarnings[0];
    EXPECT_GT(cost.queryCount, 10'000u);
    EXPECT_EQ(cost.cutCount, 0u);
}

TEST(LightPlacement, CanBeCancelledAtAnyTime) {
    static int pollCount, limit;
    struct Cancelled {};
    const Scene scene = test::hallInShell();
    const World world(scene, {});
    setCpuPoll([](double) {
        if (++pollCount > limit)
            throw Cancelled();
    });
    pollCount = 0;
    limit = std::numeric_limits<int>::max();
    placeLights(world, 20, 1);
    const int lightPolls = pollCount;
    placeCamera(world);
    const int cameraPolls = pollCount - lightPolls;
    EXPECT_GT(lightPolls, 1000);
    EXPECT_GT(cameraPolls, 1000);
    for (limit = 0; limit < lightPolls; limit += lightPolls / 7) {
        pollCount = 0;
        EXPECT_THROW(placeLights(world, 20, 1), Cancelled) << limit;
    }
    for (limit = 0; limit < cameraPolls; limit += cameraPolls / 7) {
        pollCount = 0;
        EXPECT_THROW(placeCamera(world), Cancelled) << limit;
    }
    setCpuPoll(nullptr);
}

TEST(LightPlacement, NoLightHangsInTheGapBetweenDoubleWalls) {
    const Scene scene = test::hallInShell();
    for (const Light& light : placeLights(World(scene, {}), 100, 1)) {
        const glm::vec3 p = light.positionWorld;
        EXPECT_TRUE(p.x > 2.2f && p.x < 17.8f && p.z > 2.2f && p.z < 9.8f) << p.x << " " << p.z;
    }
}

TEST(LightPlacement, LightsHangInsideOfSealedRooms) {
    Scene scene = test::room({0, 0, 0}, {10, 4, 8}); // one-sided walls
    test::addMesh(scene, test::room({40, 10, 30}, {50, 15, 42}), false);
    for (const Light& light : placeLights(World(scene, {}), 100, 1)) {
        const glm::vec3 p = light.positionWorld;
        EXPECT_TRUE((p.x < 10 && p.y < 4 && p.z < 8) || (p.x > 40 && p.y > 10 && p.z > 30))
            << p.x << " " << p.y << " " << p.z;
    }
}

TEST(LightPlacement, FlatScenesStillGetTheirLights) {
    const Scene room = test::room({0, 0, 0}, {8, 0, 5}); // no height: nowhere is free
    Scene triangle = room;                               // of the floor
    triangle.meshes[0].triangles.resize(1);
    triangle.meshes[0].triangles[0] = {0, 1, 4};
    triangle.meshes[0].triangleMaterial.resize(1);
    for (const Scene* scene : std::initializer_list<const Scene*>{&room, &triangle})
        for (const Light& light : placeLights(World(*scene, {}), 10, 1)) {
            EXPECT_TRUE(std::isfinite(light.positionWorld.x));
            EXPECT_GT(light.rangeWorld, 0.0f);
            EXPECT_LE(light.rangeWorld, 100.0f);
            EXPECT_TRUE(std::isfinite(light.intensity.x));
        }
}

} // namespace
} // namespace shadowdag
