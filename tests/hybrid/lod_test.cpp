// SPDX-License-Identifier: Apache-2.0
// Rays whose level of detail follows the footprint: the footprint computed from a frame, its
// offset, and whole frames, each pair of which is traced again by hand.
#include "hybrid/frame.h"

#include "cuda/error.h"
#include "tests/hybrid/fail_stage.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>

namespace shadowdag::test {
namespace {

using testing::HasSubstr;

RayOptions raysBy(LodRule rule, float scale = 1.0f, float coverage = 0.5f) {
    RayOptions rays;
    rays.lod = rule;
    rays.footprintScale = scale;
    rays.coverage = coverage;
    return rays;
}

/// Nothing in it moves, so its rays are tested against voxels alone.
FailScene stillFailScene() {
    for (const FailScene& scene : failScenes())
        if (scene.boxes.size() >= 2 &&
            std::all_of(scene.boxes.begin(), scene.boxes.end(),
                        [](const FailBox& box) { return box.velocity == glm::dvec3(0.0); }))
            return scene;
    throw Error(ErrorKind::kUsage, "every failure scene moves");
}

FrameOptions coarseFrame(const RayOptions& rays) {
    FrameOptions options = failFrame();
    options.width = 96;
    options.height = 54; // wide pixels
    options.rays = rays;
    return options;
}

// A pixel 8 voxels wide at depth 4 m; the light 6 m away.
TEST(RayLod, StartsAtThePixelsLevelAndItsOffsetToo) {
    Dag dag;
    dag.grid.resolutionLog2 = 10;
    dag.grid.voxelSizeWorld = 0.01;
    const ShadowPair pair{{0, 1, 4}, {0, 1, 0}, {0, 7, 4}, 0, 0};
    const float squared = 30.0f * 30.0f;
    const std::vector<uint32_t> demand{std::bit_cast<uint32_t>(squared)};
    RayInputs inputs{dag.view(), raysBy(LodRule::kFootprint), {}, {}, {}};
    inputs.detail = {{0, 1, 0}, {0, 0, 1}, 0.02, {}};
    const Footprint bare = footprintOf(inputs, pair);
    EXPECT_NEAR(bare.start, 8.0, 1e-6);
    EXPECT_NEAR(bare.slope, 8.0 / 600.0, 1e-8);
    inputs.detail.resolutionSquaredBits = viewOf(demand); // 2 / 30 a voxel: wider than the pixel's
    EXPECT_NEAR(footprintOf(inputs, pair).slope, 2.0 / 30.0, 1e-8);
    inputs.options.footprintScale = 0.5f;
    EXPECT_NEAR(footprintOf(inputs, pair).start, 4.0, 1e-6);

    inputs.options.footprintScale = 1.001f; // 8 itself is a rounding away
    const PairSegment asked = pairSegment(inputs, pair);
    EXPECT_EQ(asked.startLevel, 3u);
    const DagSegment level3 = shadowSegment(dag.grid, pair.positionWorld, pair.normalWorld,
                                            pair.lightWorld, inputs.options.offset, 3);
    EXPECT_EQ(asked.segment.from, level3.from);
    EXPECT_EQ(asked.segment.to, level3.to);
}

TEST(RayLod, FramesEqualASingleRayInEveryPair) {
    FailStage stage(stillFailScene(), 9);
    size_t differing = 0;
    for (const RayOptions& rays : {raysBy(LodRule::kFootprint), raysBy(LodRule::kFootprint, 3.0f),
                                   raysBy(LodRule::kCoverage, 2.0f, 0.75f)}) {
        const FailOutcome outcome = stage.run("texels:inf", coarseFrame(rays));
        const FrameResult& frame = outcome.frame;
        const GBufferView gbuffer = stage.renderer->gbuffer();
        const RayInputs inputs = stage.renderer->rayInputs(rays);
        const Dag covered = withCoverage(stage.dag);
        ASSERT_GT(frame.pairs.count(), 1000u);
        for (size_t sample = 0; sample < gbuffer.count(); ++sample)
            for (uint64_t p = frame.pairs.sampleStart[sample];
                 p < frame.pairs.sampleStart[sample + 1]; ++p) {
                const uint32_t light = frame.pairs.light[p];
                const ShadowPair pair{gbuffer.positionWorld[sample], gbuffer.normalWorld[sample],
                                      stage.world.lights()[light].positionWorld,
                                      gbuffer.triangle[sample], light};
                const PairSegment asked = pairSegment(inputs, pair);
                const uint32_t threshold =
                    rays.lod == LodRule::kCoverage ? coverageThreshold(rays.coverage) : 0;
                const bool isDark = occludedByLevels(
                    covered.view(), asked.segment,
                    footprintLodTimes(stage.dag.grid, asked.segment, asked.footprint), threshold);
                ASSERT_EQ(frame.visibility[p], isDark ? 0 : 255);
                differing += isDark != occluded(stage.dag.view(),
                                                shadowSegment(stage.dag.grid, pair.positionWorld,
                                                              pair.normalWorld, pair.lightWorld,
                                                              rays.offset, 0));
            }
        // What is wrong is explained with the level that was hit.
        EXPECT_EQ(outcome.report.total.acneCount, 0u);
        EXPECT_EQ(outcome.report.coarserCellCount, 0u);
    }
    EXPECT_GT(differing, 0u) << "no footprint reached two voxels: the test shows nothing";
}

TEST(RayLod, SmallFootprintsGiveTheFrameOfLevelZero) {
    FailStage stage(stillFailScene(), 9);
    const FailOutcome exact = stage.run("texels:inf", coarseFrame({}));
    for (const LodRule rule : {LodRule::kFootprint, LodRule::kCoverage}) {
        const FailOutcome lod = stage.run("texels:inf", coarseFrame(raysBy(rule, 1e-4f)));
        EXPECT_EQ(lod.frame.visibility, exact.frame.visibility);
        EXPECT_EQ(lod.frame.color, exact.frame.color);
    }
}

TEST(RayLod, ContradictoryOptionsAreNamed) {
    FailStage stage(stillFailScene(), 6);
    const auto messageOf = [&](RayOptions rays) -> std::string {
        try {
            stage.run("texels:inf", coarseFrame(rays));
        } catch (const Error& error) {
            return error.what();
        }
        return "accepted";
    };
    RayOptions rays = raysBy(LodRule::kFootprint);
    EXPECT_EQ(messageOf(rays), "accepted");
    rays.level = 2;
    EXPECT_THAT(messageOf(rays), HasSubstr("level of detail 2"));
    EXPECT_THAT(messageOf(raysBy(LodRule::kFootprint, NAN)), HasSubstr("footprint scale"));
    EXPECT_THAT(messageOf(raysBy(LodRule::kFootprint, 0.0f)), HasSubstr("footprint scale"));
    EXPECT_THAT(messageOf(raysBy(LodRule::kCoverage, 1.0f, 0.0f)), HasSubstr("coverage"));
    EXPECT_THAT(messageOf(raysBy(LodRule::kCoverage, 1.0f, 1.5f)), HasSubstr("coverage"));
}

} // namespace
} // namespace shadowdag::test
