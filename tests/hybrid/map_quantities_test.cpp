// SPDX-License-Identifier: Apache-2.0
// Quantities of maps for cost models, in closed form and compared with the frame's exact pairs; and
// costs that are scaled to whole frames.
#include "cuda/statistics.h"
#include "hybrid/frame/frame_state.h"
#include "scenes/builtin.h"
#include "tests/hybrid/fail_stage.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace shadowdag::test {
namespace {

/// Two movers over a floor: a plate of 1.2 x 0.02 x 1.2 m within the first light's sphere, a rod of
/// 0.1 x 0.1 x 0.4 m within the spheres of both; nothing moves near the third.
FailScene plateAndRod() {
    FailScene s{
        "plate-and-rod",
        "movers and lights",
        {},
        {{{0.0, 4.0, 0.0}, 12.0, 12.0}, {{4.0, 1.0, 2.0}, 1.2, 1.0}, {{-4.5, 0.6, -2.0}, 1.0, 1.0}},
        {0, 6, 7},
        {0, 0, 0}};
    FailBox floor, plate, rod;
    floor.center = {0.0, -0.1, 0.0};
    floor.half = {5.0, 0.1, 3.0};
    plate.center = {0.0, 1.5, 0.0};
    plate.half = {0.6, 0.01, 0.6};
    plate.velocity = {0.25, 0.0, 0.0};
    rod.center = {4.0, 0.5, 2.0};
    rod.half = {0.05, 0.05, 0.2};
    rod.velocity = {0.0, 0.0, 0.01};
    s.boxes = {floor, plate, rod};
    return s;
}

TEST(MapQuantities, CrossingsAreTheMoversSurfaceOverTheSpheres) {
    FailStage stage(plateAndRod(), 6);
    const std::vector<MapRecord> maps = stage.run("expr:1").frame.maps;
    ASSERT_EQ(maps.size(), 3u);
    const double plate = 2 * (1.2 * 1.2 + 2 * 1.2 * 0.02), rod = 2 * (0.1 * 0.1 + 2 * 0.1 * 0.4);
    const auto sphere = [](double range) { return 4 * std::numbers::pi * range * range; };
    // A box is one batch or more; a batch's box is its faces' own, so that sums of parts are at
    // most the whole and, for a closed box in one batch, equal to it.
    EXPECT_EQ(maps[0].quantities.movers, 2u);
    EXPECT_NEAR(maps[0].quantities.moverCrossings, (plate + rod) / sphere(12.0), 1e-7);
    EXPECT_EQ(maps[1].quantities.movers, 1u);
    EXPECT_NEAR(maps[1].quantities.moverCrossings, rod / sphere(1.2), 1e-6);
    EXPECT_EQ(maps[2].quantities.movers, 0u);
    EXPECT_EQ(maps[2].quantities.moverCrossings, 0.0f);
}

TEST(MapQuantities, EstimatedPairsAreNearTheExactOnes) {
    FailStage stage(hallWithScreen(), 6);
    const FrameResult frame = stage.run("expr:1").frame;
    ASSERT_EQ(frame.maps.size(), 3u);
    for (const MapRecord& map : frame.maps) {
        SCOPED_TRACE(map.quantities.light);
        ASSERT_GT(map.pairCount, 1000u);
        // A cluster's error is at most a sample's share; of many clusters it averages out.
        EXPECT_NEAR(double(map.quantities.pairs), double(map.pairCount),
                    0.05 * double(map.quantities.samples));
        EXPECT_LE(map.quantities.pairs, map.quantities.samples);
    }
}

TEST(MapQuantities, AreTheSameForModelsAndReports) {
    FailStage stage(plateAndRod(), 6);
    const auto quantitiesBy = [&](const std::string& model) {
        std::vector<MapQuantities> all;
        for (const MapRecord& map : stage.run(model).frame.maps)
            all.push_back(map.quantities);
        return all;
    };
    const std::vector<MapQuantities> asked = quantitiesBy(
                                         "expr:pages + triangles + pairs + movers > 0"),
                                     told = quantitiesBy("texels:96");
    ASSERT_EQ(asked.size(), told.size());
    for (size_t m = 0; m < asked.size(); ++m) {
        EXPECT_EQ(asked[m].pages, told[m].pages);
        EXPECT_EQ(asked[m].triangles, told[m].triangles);
        EXPECT_EQ(asked[m].batches, told[m].batches);
        EXPECT_EQ(asked[m].pairs, told[m].pairs);
        EXPECT_EQ(asked[m].movers, told[m].movers);
        EXPECT_EQ(asked[m].moverCrossings, told[m].moverCrossings);
    }
    EXPECT_EQ(asked[0].triangles, 3 * 12u); // the first light's sphere holds all
}

// Lights that move are counted anew, lights that stand keep what was counted; either way as if it
// were counted now.
TEST(MapQuantities, TrianglesFollowLightsAndMovers) {
    const Scene scene = makeBuiltin("necropolis"); // figures that carry lamps
    World world(scene, {});
    const Dag none;
    FrameRenderer kept(Backend::kCpu, world, none), fresh(Backend::kCpu, world, none);
    FrameOptions options = failFrame();
    options.width = 96;
    options.height = 54;
    options.recordPairs = false;
    const auto mapsOf = [&](FrameRenderer& renderer) {
        renderer.reset();
        return renderer.render(world.cameras().at(0), *makeCostModel("expr:0"), options).maps;
    };
    mapsOf(kept);
    const std::vector<Light> before = world.lights();
    const std::vector<uint32_t> moved = world.setTime(3.0f);
    kept.worldChanged(moved);
    fresh.worldChanged(moved);
    size_t movedLightCount = 0;
    for (size_t l = 0; l < before.size(); ++l)
        movedLightCount += before[l].positionWorld != world.lights()[l].positionWorld;
    ASSERT_GT(movedLightCount, 10u);
    ASSERT_LT(movedLightCount, before.size());
    const std::vector<MapRecord> told = mapsOf(kept), now = mapsOf(fresh);
    ASSERT_EQ(told.size(), now.size());
    ASSERT_GT(now.size(), 50u);
    for (size_t m = 0; m < now.size(); ++m) {
        EXPECT_EQ(told[m].quantities.triangles, now[m].quantities.triangles);
        EXPECT_EQ(told[m].quantities.batches, now[m].quantities.batches);
        EXPECT_EQ(told[m].quantities.moverCrossings, now[m].quantities.moverCrossings);
    }
}

TEST(MapQuantities, ADirectionalLightCountsEverythingInItsWindow) {
    FailStage stage(failSceneOf("fail-sun"), 6);
    const std::vector<MapRecord> maps = stage.run("expr:1").frame.maps;
    ASSERT_FALSE(maps.empty());
    for (const MapRecord& map : maps) {
        EXPECT_GT(map.quantities.triangles, 0u);
        EXPECT_GT(map.quantities.pairs, 0u);
    }
}

TEST(FrameCosts, OfAllMapsByOneMethodAddUpToTheFrame) {
    FailStage stage(hallWithScreen(), 6);
    const Camera& camera = stage.world.cameras().at(0);
    FrameOptions options = failFrame();
    options.recordPairs = false;
    const FrameCosts costs = stage.renderer->measureCosts(camera, options, 3);
    ASSERT_EQ(costs.maps.size(), 3u);
    EXPECT_GT(costs.raysScale, 0.0);
    EXPECT_GT(costs.mapsScale, 0.0);
    const auto frameMs = [&](const char* model) {
        std::vector<double> times;
        for (int repeat = 0; repeat < 5; ++repeat) {
            stage.renderer->reset();
            times.push_back(
                servingMs(stage.renderer->render(camera, *makeCostModel(model), options).stages));
        }
        return median(times);
    };
    double raysMs = 0, mapsMs = 0;
    for (const MapCost& cost : costs.maps) {
        raysMs += cost.raysMs;
        mapsMs += cost.mapMs;
    }
    // Times of a shared machine: a factor detects only missing stages.
    EXPECT_GT(raysMs, frameMs("texels:inf") / 4);
    EXPECT_LT(raysMs, frameMs("texels:inf") * 4);
    EXPECT_GT(mapsMs, frameMs("texels:0") / 4);
    EXPECT_LT(mapsMs, frameMs("texels:0") * 4);
    EXPECT_EQ(costs.degradeDivisor, 1.0);
}

TEST(FrameCosts, AreScaledByOneFactorAMethod) {
    FrameCosts costs{7, {{0, 0, 1.0, 6.0}, {1, 0, 3.0, 2.0}}};
    scaleCosts(costs, 2.0, 12.0);
    EXPECT_EQ(costs.raysScale, 0.5);
    EXPECT_EQ(costs.mapsScale, 1.5);
    EXPECT_EQ(costs.maps[0].raysMs, 0.5);
    EXPECT_EQ(costs.maps[1].raysMs, 1.5);
    EXPECT_EQ(costs.maps[0].mapMs, 9.0);
    EXPECT_EQ(costs.maps[1].mapMs, 3.0);
    FrameCosts nothing{7, {{0, 0, 0.0, 1.0}}};
    scaleCosts(nothing, 5.0, 2.0);
    EXPECT_EQ(nothing.raysScale, 1.0);
    EXPECT_EQ(nothing.maps[0].raysMs, 0.0);
    EXPECT_EQ(nothing.maps[0].mapMs, 2.0);
}

TEST(FrameCosts, AThresholdServesAllMapsWhereItsFrameIsFasterThanThatOfTheCheaperOfEach) {
    FrameCosts costs{7, {{0, 0, 1.0, 6.0}, {1, 0, 3.0, 2.0}}};
    takeWholeFrame(costs, {{INFINITY, 5.0}, {0.0f, 9.0}}, 4.0);
    EXPECT_EQ(costs.wholeFrameTexels, std::nullopt);
    takeWholeFrame(costs, {{INFINITY, 5.0}, {0.0f, 9.0}}, 6.0);
    EXPECT_EQ(costs.wholeFrameTexels, INFINITY);
    takeWholeFrame(costs, {{INFINITY, 9.0}, {0.0f, 5.0}, {32.0f, 5.5}}, 6.0);
    EXPECT_EQ(costs.wholeFrameTexels, 0.0f);
    takeWholeFrame(costs, {{INFINITY, 9.0}, {0.0f, 5.0}, {32.0f, 4.5}, {96.0f, 4.5}}, 6.0);
    EXPECT_EQ(costs.wholeFrameTexels, 32.0f);
}

TEST(FrameCosts, ThresholdsBetweenRequestsRouteDifferently) {
    EXPECT_TRUE(thresholdsBetween({}).empty());
    EXPECT_TRUE(thresholdsBetween({7, 7, 7}).empty());
    EXPECT_EQ(thresholdsBetween({9, 2, 9}), std::vector<float>{9}); // traces the 2 alone
    std::vector<float> many;
    for (int i = 0; i < 700; ++i)
        many.push_back(float((i * 331) % 700));
    EXPECT_EQ(thresholdsBetween(many), (std::vector<float>{100, 200, 300, 400, 500, 600}));
}

TEST(ServingMs, SumsTheStagesThatRoutesDecide) {
    StageTimes stages;
    for (const char* stage :
         {"g-buffer", "clusters", "light assignment", "pair pruning", "resolution", "routing"})
        stages.add(stage, 1000);
    EXPECT_EQ(servingMs(stages), 0.0);
    double sum = 0;
    for (const char* stage : kShadowMapStages) {
        sum = 2 * sum + 1;
        stages.add(stage, sum);
    }
    stages.add("shading", 0.5);
    EXPECT_EQ(servingMs(stages), 2 * sum - double(std::size(kShadowMapStages)) + 0.5);
    EXPECT_EQ(stages.stageMs("shading"), 0.5);
    EXPECT_EQ(stages.stageMs("absent"), 0.0);
}

} // namespace
} // namespace shadowdag::test
