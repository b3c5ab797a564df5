// SPDX-License-Identifier: Apache-2.0
// Hysteresis of routing: a map keeps its method while costs vary by less than the margin.
#include "hybrid/frame.h"
#include "hybrid/routing/cost_terms.h"
#include "tests/hybrid/triangle_soup.h"
#include "voxel/voxelize.h"

#include <gtest/gtest.h>

namespace shadowdag::test {
namespace {

MapQuantities mapWith(float texels, PreviousRoute previous) {
    MapQuantities map;
    map.texels = texels;
    map.previous = previous;
    return map;
}

/// Returns how often the route changes while the request wavers between two values.
int countFlaps(const CostModel& model, double margin, float low, float high) {
    PreviousRoute previous = PreviousRoute::kNone;
    int flaps = 0;
    for (int frame = 0; frame < 40; ++frame) {
        const Route route = model.route({mapWith(frame % 2 ? high : low, previous)}, margin)[0];
        const PreviousRoute now =
            route == Route::kRays ? PreviousRoute::kRays : PreviousRoute::kMap;
        flaps += previous != PreviousRoute::kNone && now != previous;
        previous = now;
    }
    return flaps;
}

TEST(RouteHold, ARequestThatVariesWithinTheMarginKeepsItsRoute) {
    const auto model = makeCostModel("texels:96");
    EXPECT_EQ(countFlaps(*model, 0.0, 92, 100), 39);
    EXPECT_EQ(countFlaps(*model, 0.1, 92, 100), 0);
    EXPECT_EQ(countFlaps(*model, 0.1, 100, 92), 0);
    EXPECT_EQ(countFlaps(*model, 0.1, 80, 120), 39);
}

TEST(RouteHold, TheBorderIsTheFactorOfOneAndTheMargin) {
    const auto model = makeCostModel("texels:100");
    EXPECT_EQ(model->route({mapWith(124, PreviousRoute::kRays)}, 0.25)[0], Route::kRays);
    EXPECT_EQ(model->route({mapWith(125, PreviousRoute::kRays)}, 0.25)[0], Route::kMap);
    EXPECT_EQ(model->route({mapWith(80, PreviousRoute::kMap)}, 0.25)[0], Route::kMap);
    EXPECT_EQ(model->route({mapWith(79, PreviousRoute::kMap)}, 0.25)[0], Route::kRays);
    EXPECT_EQ(model->route({mapWith(99, PreviousRoute::kNone)}, 0.25)[0], Route::kRays);
    EXPECT_EQ(model->route({mapWith(100, PreviousRoute::kNone)}, 0.25)[0], Route::kMap);
}

TEST(RouteHold, SingleMethodsAndSignsAreNeverHeld) {
    EXPECT_EQ(makeCostModel("texels:0")->route({mapWith(0, PreviousRoute::kRays)}, 9)[0],
              Route::kMap);
    EXPECT_EQ(makeCostModel("texels:inf")->route({mapWith(8000, PreviousRoute::kMap)}, 9)[0],
              Route::kRays);
    EXPECT_EQ(makeCostModel("expr:1")->route({mapWith(1, PreviousRoute::kMap)}, 9)[0],
              Route::kRays);
    EXPECT_EQ(makeCostModel("expr:0")->route({mapWith(1, PreviousRoute::kRays)}, 9)[0],
              Route::kMap);
}

TEST(RouteHold, ARendererHoldsRoutesUntilItIsReset) {
    TriangleSoup soup;
    soup.addLevelSquare({0, 0, 0}, 6.0f);
    soup.addLevelSquare({0, 1, 0}, 0.5f);
    Scene scene;
    scene.materials.resize(1);
    scene.meshes = {soup.mesh()};
    scene.nodes.resize(2);
    scene.nodes[0].mesh = 0;
    scene.lights.resize(1);
    scene.lights[0].rangeWorld = 9.0f;
    scene.nodes[1].light = 0;
    scene.nodes[1].local.translation = {0, 2, 0};
    scene.roots = {0, 1};
    const World world(scene, {});
    const Dag dag = voxelize(world.triangles(), viewOf(world.staticTriangles()),
                             gridAround(world.boundsWorld(), 6));
    FrameRenderer renderer(Backend::kCpu, world, dag);
    Camera camera;
    camera.positionWorld = {0.3f, 4.0f, 5.0f};
    camera.forward = glm::normalize(glm::vec3(-0.05f, -0.75f, -1.0f));
    camera.up =
        glm::normalize(glm::cross(glm::cross(camera.forward, glm::vec3(0, 1, 0)), camera.forward));
    FrameOptions options;
    options.width = 64;
    options.height = 40;
    const auto routeOf = [&](const std::string& model) {
        const FrameResult frame = renderer.render(camera, *makeCostModel(model), options);
        EXPECT_EQ(frame.maps.size(), 1u);
        return frame.maps[0].route;
    };
    const float texels =
        renderer.render(camera, *makeCostModel("texels:0"), options).maps[0].quantities.texels;
    const std::string over = "texels:" + std::to_string(1.05f * texels),
                      far = "texels:" + std::to_string(1.2f * texels);
    EXPECT_EQ(routeOf(over), Route::kRays); // without a margin the past says nothing
    renderer.render(camera, *makeCostModel("texels:0"), options);
    options.routeMargin = 0.1f;
    EXPECT_EQ(routeOf(over), Route::kMap); // held
    EXPECT_EQ(routeOf(far), Route::kRays); // cheaper by more than the margin
    renderer.render(camera, *makeCostModel("texels:0"), options);
    renderer.reset();
    EXPECT_EQ(routeOf(over), Route::kRays); // forgotten
    options.routeMargin = -1;
    EXPECT_THROW(routeOf(over), Error);
}

} // namespace
} // namespace shadowdag::test
