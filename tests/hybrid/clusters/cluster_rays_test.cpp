// SPDX-License-Identifier: Apache-2.0
// Shading by streams of rays: the frames of single rays, bit for bit.
#include "hybrid/clusters/cluster_rays.h"

#include "tests/hybrid/fail_stage.h"

#include <gtest/gtest.h>

namespace shadowdag::test {
namespace {

FrameResult frameOf(FailStage& stage, RayBatch batch, const char* model,
                    float believe = RayOptions{}.believe) {
    FrameOptions options = failFrame();
    options.width = 640;
    options.height = 360;
    options.rays.batch = batch;
    options.rays.believe = believe;
    stage.renderer->reset();
    return stage.renderer->render(stage.world.cameras().at(0), *makeCostModel(model), options);
}

TEST(ClusterRays, FramesAreThoseOfSingleRays) {
    FailStage stage(hallWithScreen(), 9, 1.0f);
    struct Case {
        const char* model;
        float believe;
    };
    constexpr float kAll = std::numeric_limits<float>::infinity();
    for (const auto& [model, believe] :
         {Case{"texels:inf", kAll}, Case{"texels:700", kAll}, Case{"texels:inf", 8.0f},
          Case{"texels:inf", 0.0f}, Case{"texels:700", 0.0f}}) {
        SCOPED_TRACE(std::string(model) + ", believe " + std::to_string(believe));
        const FrameResult single = frameOf(stage, RayBatch::kSingle, model, believe),
                          streams = frameOf(stage, RayBatch::kStream, model, believe);
        EXPECT_EQ(streams.color, single.color);
        EXPECT_EQ(streams.visibility, single.visibility);
        EXPECT_EQ(streams.pairServer, single.pairServer);
        EXPECT_EQ(streams.counts.rayCount, single.counts.rayCount);
        EXPECT_EQ(streams.counts.lookupCount, single.counts.lookupCount);
        EXPECT_EQ(streams.counts.moverTestCount, single.counts.moverTestCount);
        EXPECT_EQ(streams.counts.exactRayCount, single.counts.exactRayCount);
    }
}

TEST(ClusterRays, PairsOfWholeClustersAreCounted) {
    FailStage stage(hallWithScreen(), 9, 1.0f);
    const FrameCounts c = frameOf(stage, RayBatch::kStream, "texels:inf").counts;
    EXPECT_EQ(c.wholeLitPairCount + c.wholeDarkPairCount + c.mixedPairCount, c.rayCount);
    EXPECT_GT(c.wholeLitPairCount, 0u);
    EXPECT_GT(c.wholeDarkPairCount, 0u);
    EXPECT_GT(c.mixedPairCount, 0u);

    // Nothing but a floor, every light above it: all is lit.
    FailScene floor = hallWithScreen();
    floor.boxes.resize(1);
    floor.lights.resize(2);
    FailStage bare(floor, 9);
    const FrameCounts lit = frameOf(bare, RayBatch::kStream, "texels:inf").counts;
    EXPECT_EQ(lit.wholeLitPairCount, lit.rayCount);
}

TEST(ClusterRays, VoxelRaysOfTheFinestLevelAndExactRaysAreStreamed) {
    RayOptions options;
    EXPECT_TRUE(ClusterRays::canStream(options));
    options.level = 1;
    EXPECT_FALSE(ClusterRays::canStream(options));
    options = {};
    options.lod = LodRule::kFootprint;
    EXPECT_FALSE(ClusterRays::canStream(options));
    options.believe = 2.0f;
    EXPECT_FALSE(ClusterRays::canStream(options));
    options.lod = LodRule::kFixed;
    EXPECT_TRUE(ClusterRays::canStream(options));
    options.believe = 0.0f;
    options.lod = LodRule::kFootprint; // no voxel is asked
    EXPECT_TRUE(ClusterRays::canStream(options));
}

} // namespace
} // namespace shadowdag::test
