// SPDX-License-Identifier: Apache-2.0
// Shading by streams of rays: the frames of single rays, bit for bit.
#include "hybrid/clusters/cluster_rays.h"

#include "tests/hybrid/fail_stage.h"

#include <gtest/gtest.h>

namespace shadowdag::test {
namespace {

FrameResult frameOf(FailStage& stage, RayBatch batch, const char* model) {
    FrameOptions options = failFrame();
    options.width = 640;
    options.height = 360;
    options.rays.batch = batch;
    stage.renderer->reset();
    return stage.renderer->render(stage.world.cameras().at(0), *makeCostModel(model), options);
}

TEST(ClusterRays, FramesAreThoseOfSingleRays) {
    FailStage stage(hallWithScreen(), 9, 1.0f);
    for (const char* model : {"texels:inf", "texels:700"}) {
        SCOPED_TRACE(model);
        const FrameResult single = frameOf(stage, RayBatch::kSingle, model),
                          streams = frameOf(stage, RayBatch::kStream, model);
        EXPECT_EQ(streams.color, single.color);
        EXPECT_EQ(streams.visibility, single.visibility);
        EXPECT_EQ(streams.pairServer, single.pairServer);
        EXPECT_EQ(streams.counts.rayCount, single.counts.rayCount);
        EXPECT_EQ(streams.counts.lookupCount, single.counts.lookupCount);
        EXPECT_EQ(streams.counts.moverTestCount, single.counts.moverTestCount);
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

TEST(ClusterRays, OnlyVoxelRaysOfTheFinestLevelAreStreamed) {
    RayOptions options;
    EXPECT_TRUE(ClusterRays::canStream(options));
    options.level = 1;
    EXPECT_FALSE(ClusterRays::canStream(options));
    options = {};
    options.lod = LodRule::kFootprint;
    EXPECT_FALSE(ClusterRays::canStream(options));
    options = {};
    options.kind = RayKind::kExact;
    EXPECT_FALSE(ClusterRays::canStream(options));
}

} // namespace
} // namespace shadowdag::test
