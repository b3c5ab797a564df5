// SPDX-License-Identifier: Apache-2.0
#include "hybrid/judge/error.h"

#include <gtest/gtest.h>

namespace shadowdag {
namespace {

TEST(ShadePairs, OneSampleIsTheHandComputedOne) {
    Scene scene;
    scene.materials = {{"default", glm::vec3(0.8f), glm::vec3(0.0f)},
                       {"red", {0.5f, 0.25f, 0.0f}, {0.0f, 0.0f, 0.125f}}};
    Mesh mesh;
    mesh.positions = {{-5, 0, -5}, {-5, 0, 5}, {5, 0, -5}};
    mesh.triangles = {{0, 1, 2}};
    mesh.triangleMaterial = {1};
    scene.meshes.push_back(mesh);
    Node floor;
    floor.mesh = 0;
    scene.nodes.push_back(floor);
    for (int i = 0; i < 2; ++i) {
        Node lamp;
        lamp.local.translation = {0, 2, 0};
        lamp.light = i;
        scene.nodes.push_back(lamp);
        LightSource source;
        source.intensity = 100.0f;
        source.rangeWorld = 4.0f;
        scene.lights.push_back(source);
    }
    scene.roots = {0, 1, 2};
    const World world(scene, {});
    ASSERT_EQ(world.lights().size(), 2u);

    const std::vector<glm::vec3> position{{0, 0, 0}, {0, 0, 0}}, normal{{0, 1, 0}, {0, 0, 0}};
    const std::vector<float> depth{1, 0};
    const std::vector<uint32_t> triangle{0, kBackground};
    const GBufferView gbuffer{
        viewOf(position), viewOf(normal), viewOf(depth), viewOf(triangle), 2, 1};
    const PairList pairs{{0, 2, 2}, {0, 1}};

    // At half the range the window is 1 - 1/16, at 2 m a quarter of 100 cd is left, n.l =
    // 1: 23.4375 lux from a whole light; the second is seen by a fifth. Radiance = albedo / pi
    // * 1.2 * 23.4375 + emission + ambient * albedo.
    const std::vector<glm::vec3> color = shadePairs(gbuffer, world, pairs, {255, 51});
    const float irradiance = 1.2f * 23.4375f / 3.14159265f;
    EXPECT_NEAR(color[0].x, 0.5f * (irradiance + kAmbientRadiance), 1e-5f);
    EXPECT_NEAR(color[0].y, 0.25f * (irradiance + kAmbientRadiance), 1e-5f);
    EXPECT_NEAR(color[0].z, 0.125f, 1e-6f);
    EXPECT_EQ(color[1], glm::vec3(0.0f)) << "background";
    const std::vector<glm::vec3> dark = shadePairs(gbuffer, world, pairs, {0, 0});
    EXPECT_NEAR(dark[0].x, 0.5f * kAmbientRadiance, 1e-6f);
}

} // namespace
} // namespace shadowdag
