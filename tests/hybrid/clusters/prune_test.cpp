// SPDX-License-Identifier: Apache-2.0
// Pruning of (cluster, light) pairs: no result changes except where voxels prove light, and pages,
// texels and lookups are saved.
#include "hybrid/frame/frame_state.h"

#include "tests/hybrid/fail_stage.h"

#include <gtest/gtest.h>

namespace shadowdag::test {
namespace {

FrameResult frameOf(FailStage& stage, PairPruning pruning, const char* model,
                    float believe = RayOptions{}.believe) {
    FrameOptions options = failFrame();
    options.width = 640;
    options.height = 360;
    options.pruning = pruning;
    options.rays.believe = believe;
    stage.renderer->reset();
    return stage.renderer->render(stage.world.cameras().at(0), *makeCostModel(model), options);
}

TEST(PairPruning, ByFacingChangesNoRayAndSavesClusterLightPairs) {
    FailStage stage(hallWithScreen(), 9, 1.0f);
    const FrameResult all = frameOf(stage, PairPruning::kNone, "texels:inf");
    const FrameResult facing = frameOf(stage, PairPruning::kFacing, "texels:inf");
    EXPECT_EQ(facing.visibility, all.visibility);
    EXPECT_EQ(facing.color, all.color);
    EXPECT_EQ(facing.counts.rayCount, all.counts.rayCount);
    EXPECT_EQ(facing.counts.provenPairCount, 0u);
    EXPECT_EQ(all.counts.prunedClusterLightCount, 0u);
    EXPECT_GT(facing.counts.prunedClusterLightCount, all.counts.clusterLightCount / 50);
    EXPECT_LT(facing.counts.prunedClusterLightCount, all.counts.clusterLightCount);
    uint64_t clusters = 0, pairs = 0;
    for (const MapRecord& map : facing.maps) {
        clusters += map.quantities.clusters;
        pairs += map.pairCount;
    }
    EXPECT_EQ(clusters, all.counts.clusterLightCount - facing.counts.prunedClusterLightCount);
    EXPECT_EQ(pairs, facing.pairs.count());
}

TEST(PairPruning, ProvenPairsAreThoseThatVoxelRaysFindLitAndNeedNoPage) {
    FailScene still = hallWithScreen();
    still.boxes.pop_back(); // the plate
    FailStage stage(still, 9);
    const FrameResult rays = frameOf(stage, PairPruning::kNone, "texels:inf");
    const FrameResult maps = frameOf(stage, PairPruning::kFacing, "texels:0");
    const FrameResult lit = frameOf(stage, PairPruning::kLit, "texels:0");
    EXPECT_EQ(lit.counts.missingTapCount, 0u);
    EXPECT_GT(lit.counts.provenPairCount, lit.counts.pairCount / 10);
    EXPECT_EQ(lit.counts.provenPairCount + lit.counts.lookupCount, maps.counts.lookupCount);
    EXPECT_LT(lit.counts.maps.pageCount, maps.counts.maps.pageCount);
    ASSERT_EQ(lit.pairs.light, rays.pairs.light);
    uint64_t proven = 0;
    for (size_t p = 0; p < lit.pairs.count(); ++p)
        if (lit.pairServer[p] == PairServer::proof()) {
            ++proven;
            ASSERT_EQ(lit.visibility[p], kLit);
            ASSERT_EQ(rays.visibility[p], kLit) << "pair " << p;
        }
    EXPECT_EQ(proven, lit.counts.provenPairCount);

    // Proofs are by voxels, also where rays believe none.
    const FrameResult beside = frameOf(stage, PairPruning::kLit, "texels:0", 0.0f);
    EXPECT_EQ(beside.counts.provenPairCount, lit.counts.provenPairCount);
    EXPECT_TRUE(beside.visibility == lit.visibility);

    // Lights that a plate in motion may shadow are not proven.
    FailStage moving(hallWithScreen(), 9, 1.0f);
    EXPECT_TRUE(moving.renderer->movers().mayShadow(0) && moving.renderer->movers().mayShadow(1));
    const FrameResult kept = frameOf(moving, PairPruning::kLit, "texels:0");
    for (size_t p = 0; p < kept.pairs.count(); ++p)
        ASSERT_TRUE(kept.pairServer[p].by() != ServedBy::kProof ||
                    !moving.renderer->movers().mayShadow(kept.pairs.light[p]));
}

TEST(PairPruning, RefusesProofsWithoutVoxelsOrAtOtherLevels) {
    FailStage stage(hallWithScreen(), 9, 1.0f);
    FrameOptions options = failFrame();
    options.pruning = PairPruning::kLit;
    options.rays.level = 1;
    EXPECT_THROW(
        stage.renderer->render(stage.world.cameras().at(0), *makeCostModel("texels:0"), options),
        Error);
    options.rays.level = 0;
    const Dag none;
    FrameRenderer without(Backend::kCpu, stage.world, none);
    EXPECT_THROW(without.render(stage.world.cameras().at(0), *makeCostModel("texels:0"), options),
                 Error);
}

} // namespace
} // namespace shadowdag::test
