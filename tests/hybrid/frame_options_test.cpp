// SPDX-License-Identifier: Apache-2.0
// Whole frames of a small room with a blocker: effects of options and costs, and refusals.
#include "hybrid/frame.h"

#include "hybrid/frame/frame_shading.h"
#include "tests/hybrid/blocker_stage.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace shadowdag::test {
namespace {

TEST(Frame, WithoutADagRefusesRaysAndDrawsMaps) {
    const Scene scene = blockerScene(kManyLights);
    const World world(scene, {});
    const Dag none;
    FrameRenderer renderer(Backend::kCpu, world, none);
    EXPECT_GT(
        renderer.render(roomCamera(), *makeCostModel("texels:0"), smallFrame()).counts.lookupCount,
        0u);
    try {
        renderer.render(roomCamera(), *makeCostModel("texels:inf"), smallFrame());
        FAIL();
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kUsage);
        EXPECT_THAT(error.what(), testing::HasSubstr("no voxel DAG"));
    }
    EXPECT_THROW(renderer.measureCosts(roomCamera(), smallFrame(), 1), Error);
}

TEST(Frame, DagOfAnAllMovingSceneBlocksNothing) {
    const Scene scene = blockerScene({{0, kLightHeight, 0}});
    const World world(scene, {});
    const Dag nothing = voxelize(world.triangles(), {}, gridAround(world.boundsWorld(), 8));
    ASSERT_TRUE(nothing.empty());
    FrameRenderer renderer(Backend::kCpu, world, nothing);
    FrameOptions options = smallFrame();
    options.recordPairs = true;
    const FrameResult result = renderer.render(roomCamera(), *makeCostModel("texels:inf"), options);
    EXPECT_GT(result.counts.rayCount, 0u);
    EXPECT_EQ(result.counts.lookupCount, 0u);
    ASSERT_FALSE(result.visibility.empty());
    for (const uint8_t visibility : result.visibility)
        ASSERT_EQ(visibility, 255);
    EXPECT_NO_THROW(renderer.measureCosts(roomCamera(), smallFrame(), 1));
}

// It depends on the camera and the size, so no pixel need be drawn first.
TEST(Frame, RefusesTooManyClusterCellsBeforeTheFirstStage) {
    Stage stage(blockerScene({{0, 2, 0}}), 5);
    Camera narrow = roomCamera();
    narrow.yfov = kMinFieldOfView;
    FrameOptions options = smallFrame();
    options.width = 1;
    options.height = 16384;
    size_t stageCount = 0;
    try {
        stage.renderer.render(narrow, *makeCostModel("texels:inf"), options, [&] { ++stageCount; });
        ADD_FAILURE() << "was rendered";
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kResource);
        EXPECT_THAT(error.what(), testing::HasSubstr("are supported: widen the field of view"));
    }
    EXPECT_EQ(stageCount, 0u);
    EXPECT_THROW(stage.renderer.listPairs(narrow, options), Error);
}

TEST(Frame, RefusesContradictoryOptions) {
    Stage stage(blockerScene({{0, 2, 0}}), 5);
    const auto messageOf = [&](auto change) -> std::string {
        FrameOptions options = smallFrame();
        change(options);
        try {
            stage.renderer.render(roomCamera(), *makeCostModel("texels:inf"), options);
        } catch (const Error& error) {
            return error.what();
        }
        return "accepted";
    };
    using testing::HasSubstr;
    EXPECT_EQ(messageOf([](FrameOptions&) {}), "accepted");
    EXPECT_THAT(messageOf([](FrameOptions& o) { o.undersample = 0.0f; }),
                HasSubstr("undersampling"));
    EXPECT_THAT(messageOf([](FrameOptions& o) { o.maxFaceTexels = 8193; }), HasSubstr("8193"));
    EXPECT_THAT(messageOf([](FrameOptions& o) { o.minFaceTexels = 4096; }), HasSubstr("4096"));
    EXPECT_THAT(messageOf([](FrameOptions& o) { o.maps.taps = 1; }), HasSubstr("taps"));
    EXPECT_THAT(messageOf([](FrameOptions& o) { o.rays.offset = NAN; }), HasSubstr("offset"));
    EXPECT_THAT(messageOf([](FrameOptions& o) { o.rays.level = 6; }), HasSubstr("level of detail"));
    EXPECT_THAT(messageOf([](FrameOptions& o) { o.width = 0; }), HasSubstr("image size"));
}

TEST(Frame, UndersamplingDividesTheRequest) {
    Stage stage(blockerScene(kManyLights), 5);
    FrameOptions options = smallFrame();
    const FrameResult full =
        stage.renderer.render(roomCamera(), *makeCostModel("texels:inf"), options);
    options.undersample = 2.0f;
    const FrameResult half =
        stage.renderer.render(roomCamera(), *makeCostModel("texels:inf"), options);
    ASSERT_EQ(full.maps.size(), half.maps.size());
    for (size_t m = 0; m < full.maps.size(); ++m)
        EXPECT_FLOAT_EQ(half.maps[m].quantities.texels, 0.5f * full.maps[m].quantities.texels);
}

TEST(Frame, SeveralMapsALightServeEveryPairByItsOctaveWithFewerTexels) {
    Stage stage(blockerScene(kManyLights), 5);
    FrameOptions options = smallFrame();
    options.maps.pageTexels = 16;
    const FrameResult one =
        stage.renderer.render(roomCamera(), *makeCostModel("texels:0"), options);
    options.mapsPerLight = 4;
    const FrameResult four =
        stage.renderer.render(roomCamera(), *makeCostModel("texels:0"), options);
    EXPECT_EQ(one.maps.size(), one.counts.mappedLightCount);
    EXPECT_GT(four.maps.size(), one.maps.size());
    EXPECT_LE(four.maps.size(), 4 * one.maps.size());
    EXPECT_EQ(four.counts.mappedLightCount, one.counts.mappedLightCount);
    EXPECT_EQ(four.counts.missingTapCount, 0u);
    EXPECT_LT(four.counts.maps.texelCount, one.counts.maps.texelCount);
    uint64_t samples = 0, sampleOfOne = 0, pairs = 0;
    for (const MapRecord& map : one.maps)
        sampleOfOne += map.quantities.samples;
    for (size_t m = 0; m < four.maps.size(); ++m) {
        const MapQuantities& map = four.maps[m].quantities;
        samples += map.samples;
        pairs += four.maps[m].pairCount;
        // No map requests more than its octave.
        EXPECT_LT(map.texels, float(2u << map.octave));
        if (m > 0 && four.maps[m - 1].quantities.light == map.light) {
            EXPECT_GT(map.octave, four.maps[m - 1].quantities.octave);
        }
    }
    EXPECT_EQ(samples, sampleOfOne);
    EXPECT_EQ(pairs, four.pairs.count());
    for (size_t p = 0; p < four.pairs.count(); ++p)
        ASSERT_EQ(four.maps[four.pairServer[p].map()].quantities.light, four.pairs.light[p]);
}

TEST(Frame, ReorderedLightListsChangeNoVisibilityAndColoursByRoundingOnly) {
    Stage stage(blockerScene(kManyLights), 5);
    FrameOptions options = smallFrame();
    for (const char* model : {"texels:0", "texels:inf"}) {
        options.reorderLights = false;
        const FrameResult plain =
            stage.renderer.render(roomCamera(), *makeCostModel(model), options);
        options.reorderLights = true;
        const FrameResult ordered =
            stage.renderer.render(roomCamera(), *makeCostModel(model), options);
        const FrameResult again =
            stage.renderer.render(roomCamera(), *makeCostModel(model), options);
        EXPECT_EQ(ordered.color, again.color);
        EXPECT_EQ(ordered.pairs.light, plain.pairs.light);
        EXPECT_EQ(ordered.visibility, plain.visibility);
        EXPECT_EQ(ordered.pairServer, plain.pairServer);
        EXPECT_EQ(ordered.counts.pairCount, plain.counts.pairCount);
        for (size_t i = 0; i < plain.color.size(); ++i)
            for (int c = 0; c < 3; ++c)
                ASSERT_NEAR(ordered.color[i][c], plain.color[i][c], 1e-5f * plain.color[i][c]);
        options.recordPairs = false;
        EXPECT_EQ(stage.renderer.render(roomCamera(), *makeCostModel(model), options).color,
                  ordered.color);
        options.recordPairs = true;
    }
}

TEST(Frame, MeasuredCostsNameEveryMapAndRouteTheOracle) {
    Stage stage(blockerScene(kManyLights, true));
    FrameOptions options = smallFrame();
    options.mapsPerLight = 4;
    const FrameResult frame =
        stage.renderer.render(roomCamera(), *makeCostModel("texels:inf"), options);
    FrameCosts costs = stage.renderer.measureCosts(roomCamera(), options, 3);
    ASSERT_EQ(costs.maps.size(), frame.maps.size());
    for (size_t m = 0; m < costs.maps.size(); ++m) {
        EXPECT_EQ(costs.maps[m].light, frame.maps[m].quantities.light);
        EXPECT_EQ(costs.maps[m].octave, frame.maps[m].quantities.octave);
        EXPECT_GT(costs.maps[m].raysMs, 0.0);
        EXPECT_GT(costs.maps[m].mapMs, 0.0);
    }
    const auto oracle = makeCostModel("oracle");
    costs.wholeFrameTexels.reset(); // map by map
    oracle->setCosts(costs);
    const FrameResult routed = stage.renderer.render(roomCamera(), *oracle, options);
    for (size_t m = 0; m < costs.maps.size(); ++m)
        EXPECT_EQ(routed.maps[m].route == Route::kRays, costs.maps[m].raysMs < costs.maps[m].mapMs);
    // A whole frame by one method that was faster than this mixture serves all.
    for (const Route route : {Route::kRays, Route::kMap}) {
        costs.wholeFrameTexels = route == Route::kMap ? 0.0f : INFINITY;
        oracle->setCosts(costs);
        for (const MapRecord& map : stage.renderer.render(roomCamera(), *oracle, options).maps)
            EXPECT_EQ(map.route, route);
    }
}

// A warm frame draws nothing again, answers as a cold one, and a cold one follows from nothing.
TEST(Frame, AWarmFrameKeepsItsMaps) {
    Stage stage(blockerScene(kManyLights), 5);
    const auto maps = makeCostModel("texels:0");
    FrameOptions options = smallFrame();
    options.recordPairs = true;
    options.start = FrameStart::kCold;
    const FrameResult cold = renderFrom(stage.renderer, roomCamera(), *maps, options);
    EXPECT_GT(cold.counts.maps.triangleDrawCount, 0u);
    EXPECT_EQ(cold.counts.maps.keptMapCount, 0u);
    options.start = FrameStart::kWarm;
    const FrameResult warm = renderFrom(stage.renderer, roomCamera(), *maps, options);
    EXPECT_EQ(warm.counts.maps.triangleDrawCount, 0u);
    EXPECT_EQ(warm.counts.maps.keptMapCount, warm.maps.size());
    EXPECT_EQ(warm.visibility, cold.visibility);
    EXPECT_EQ(warm.color, cold.color);
    options.start = FrameStart::kCold;
    EXPECT_EQ(
        renderFrom(stage.renderer, roomCamera(), *maps, options).counts.maps.triangleDrawCount,
        cold.counts.maps.triangleDrawCount);
}

TEST(Frame, WithoutLightsShowsTheUnlitWorld) {
    Stage stage(blockerScene({}), 5);
    const FrameResult frame =
        stage.renderer.render(roomCamera(), *makeCostModel("texels:96"), smallFrame());
    EXPECT_EQ(frame.counts.pairCount, 0u);
    EXPECT_TRUE(frame.maps.empty());
    EXPECT_GT(frame.counts.sampleCount, 1000u);
    EXPECT_EQ(frame.pairs.sampleStart.size(), size_t(160 * 96 + 1));
}

} // namespace
// A kernel of fewer needs would leave out code that a pair runs into.
TEST(PairNeeds, CoverThoseThatNeedNoMore) {
    const auto needsOf = [](uint32_t bits) {
        const auto bit = [bits](int i) { return (bits >> i & 1) != 0; };
        return PairNeeds{bit(0), bit(1), bit(2), {bit(3), bit(4), bit(5), bit(6)}};
    };
    for (uint32_t code = 0; code < 128; ++code)
        for (uint32_t asked = 0; asked < 128; ++asked)
            ASSERT_EQ(needsOf(code).cover(needsOf(asked)), (asked & ~code) == 0)
                << code << " " << asked;
    PairNeeds four = needsOf(2), nine = four, any = four, rays = needsOf(1);
    four.taps = 4;
    nine.taps = 9;
    rays.taps = 9;
    EXPECT_TRUE(any.cover(four) && four.cover(four));
    EXPECT_FALSE(four.cover(nine) || four.cover(any));
    PairNeeds both = needsOf(3);
    both.taps = 4;
    EXPECT_TRUE(both.cover(rays)); // no map is looked up
}

TEST(PairNeeds, AreThoseOfTheFrame) {
    std::vector<Light> lights(2);
    const uint8_t near[2] = {};
    const RayInputs voxels{};
    PairNeeds needs = needsOf(true, false, lights, voxels);
    EXPECT_TRUE(needs.rays && !needs.maps && !needs.directional);
    EXPECT_TRUE(needs.ofRays.voxels && !needs.ofRays.levels && !needs.ofRays.triangles &&
                !needs.ofRays.movers);
    RayInputs moving = voxels, level = voxels, followed = voxels, some = voxels, none = voxels;
    moving.movers.isNearLight = {near, 2};
    EXPECT_TRUE(needsOf(true, true, lights, moving).ofRays.movers);
    EXPECT_TRUE(needsOf(true, true, lights, moving).maps);
    EXPECT_FALSE(needsOf(false, true, lights, moving).ofRays.movers);
    level.options.level = 1;
    followed.options.lod = LodRule::kFootprint;
    some.options.believe = 2.0f;
    none.options.believe = 0.0f;
    EXPECT_TRUE(needsOf(true, false, lights, level).ofRays.levels);
    EXPECT_TRUE(needsOf(true, false, lights, followed).ofRays.levels);
    needs = needsOf(true, false, lights, some);
    EXPECT_TRUE(needs.ofRays.voxels && needs.ofRays.triangles);
    needs = needsOf(true, false, lights, none);
    EXPECT_TRUE(!needs.ofRays.voxels && needs.ofRays.triangles);
    lights[1].kind = Light::kSun;
    EXPECT_TRUE(needsOf(false, true, lights, voxels).directional);
    EXPECT_EQ(needsOf(false, true, lights, voxels, 9).taps, 9u);
}

} // namespace shadowdag::test
