// SPDX-License-Identifier: Apache-2.0
// Shading by shafts and streams: the frames of single rays, bit for bit.
#include "tests/hybrid/fail_stage.h"

#include <gtest/gtest.h>

namespace shadowdag::test {
namespace {

FrameResult framesOf(FailStage& stage, RayBatch batch, const char* model, uint32_t width = 640,
                     uint32_t height = 360) {
    FrameOptions options = failFrame();
    options.width = width;
    options.height = height;
    options.rays.batch = batch;
    stage.renderer->reset();
    return stage.renderer->render(stage.world.cameras().at(0), *makeCostModel(model), options);
}

TEST(ShaftShading, FramesAreThoseOfSingleRays) {
    FailStage stage(hallWithScreen(), 9, 1.0f);
    for (const char* model : {"texels:inf", "texels:700"}) {
        SCOPED_TRACE(model);
        const FrameResult single = framesOf(stage, RayBatch::kSingle, model);
        EXPECT_EQ(single.counts.shafts.askedCount, 0u);
        for (const RayBatch batch : {RayBatch::kStream, RayBatch::kShaft}) {
            const FrameResult other = framesOf(stage, batch, model);
            EXPECT_EQ(other.color, single.color);
            EXPECT_EQ(other.visibility, single.visibility);
            EXPECT_EQ(other.pairRoute, single.pairRoute);
            EXPECT_EQ(other.counts.rayCount, single.counts.rayCount);
            EXPECT_EQ(other.counts.lookupCount, single.counts.lookupCount);
            EXPECT_EQ(other.counts.moverTestCount, single.counts.moverTestCount);
            EXPECT_EQ(other.counts.shafts.pairCount, single.counts.rayCount);
            EXPECT_EQ(other.counts.shafts.litPairCount > 0, batch == RayBatch::kShaft);
        }
    }
}

TEST(ShaftShading, CountsWhatIsProvenBesideWhatIsTrue) {
    FailStage stage(hallWithScreen(), 9, 1.0f);
    const FrameCounts c = framesOf(stage, RayBatch::kShaft, "texels:inf").counts;
    EXPECT_EQ(c.wholeLitPairCount + c.wholeDarkPairCount + c.mixedPairCount, c.rayCount);
    EXPECT_GT(c.wholeLitPairCount, 0u);
    EXPECT_GT(c.wholeDarkPairCount, 0u);
    EXPECT_GT(c.mixedPairCount, 0u);
    EXPECT_LE(c.shafts.litCount + c.shafts.darkCount, c.shafts.askedCount);
    EXPECT_LE(c.shafts.litPairCount + c.shafts.darkPairCount, c.shafts.pairCount);

    // Nothing but a floor, every light above it: all is lit, and nearly all of it is proven.
    FailScene floor = hallWithScreen();
    floor.boxes.resize(1);
    floor.lights.resize(2);
    FailStage bare(floor, 9);
    const FrameCounts lit = framesOf(bare, RayBatch::kShaft, "texels:inf").counts;
    EXPECT_EQ(lit.wholeLitPairCount, lit.rayCount);
    EXPECT_GT(lit.shafts.litPairCount, lit.rayCount * 9 / 10);
    EXPECT_EQ(lit.shafts.darkPairCount, 0u);
}

TEST(ShaftShading, CountsDoNotDependOnThreads) {
    FailStage stage(hallWithScreen(), 8);
    const FrameCounts all = framesOf(stage, RayBatch::kShaft, "texels:inf", 320, 180).counts;
    setThreadCount(1);
    const FrameCounts one = framesOf(stage, RayBatch::kShaft, "texels:inf", 320, 180).counts;
    setThreadCount(0);
    EXPECT_EQ(all.shafts.litPairCount, one.shafts.litPairCount);
    EXPECT_EQ(all.shafts.darkPairCount, one.shafts.darkPairCount);
    EXPECT_EQ(all.shafts.shaftCount, one.shafts.shaftCount);
    EXPECT_EQ(all.shafts.cutCellCount, one.shafts.cutCellCount);
}

} // namespace
} // namespace shadowdag::test
