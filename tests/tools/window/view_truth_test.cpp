// SPDX-License-Identifier: Apache-2.0
#include "tools/window/view_truth.h"

#include "hybrid/frame.h"
#include "tools/workspace/scene_setup.h"

#include <gtest/gtest.h>

#include <set>

namespace shadowdag {

namespace {

/// A small frame with its pairs and truth.
struct TruthFrame {
    TruthFrame(uint32_t width, uint32_t height)
        : scene(loadSceneAndWorld("builtin:fail-silhouette", -1, 1, true, Console(false))),
          renderer(Backend::kCpu, *scene.world, dag), truth(*scene.world) {
        FrameOptions options;
        options.width = width;
        options.height = height;
        pairs = renderer.listPairs(chooseCamera(*scene.world, ""), options);
    }

    LoadedScene scene;
    Dag dag;
    FrameRenderer renderer;
    Truth truth;
    PairList pairs;
};

TEST(ViewTruth, RefinedInFullIsTheTruth) {
    TruthFrame f(83, 45); // no multiple of the grid
    ASSERT_GT(f.pairs.count(), 1000u);
    const auto& lights = f.scene.world->lights();
    TruthRefinement refinement(f.renderer.gbuffer(), lights, f.pairs);
    std::set<uint32_t> answered;
    size_t count = 0;
    double share = 0;
    while (!refinement.isDone()) {
        for (const uint32_t sample : refinement.step(f.truth)) {
            EXPECT_TRUE(answered.insert(sample).second) << "asked twice: " << sample;
            EXPECT_TRUE(refinement.isAnswered(sample));
        }
        EXPECT_GE(refinement.doneShare(), share);
        share = refinement.doneShare();
        ++count;
    }
    EXPECT_GE(count, 4u) << "a chunk a grid at least";
    EXPECT_EQ(answered.size(), f.renderer.gbuffer().count());
    EXPECT_EQ(share, 1.0);
    const std::vector<uint8_t> whole = f.truth.visibility(f.renderer.gbuffer(), lights, f.pairs);
    EXPECT_EQ(refinement.visibility(), whole);

    TruthRefinement atOnce(f.renderer.gbuffer(), lights, f.pairs);
    atOnce.finish(f.truth);
    EXPECT_TRUE(atOnce.isDone());
    EXPECT_EQ(atOnce.visibility(), whole);

    TruthRefinement halfWay(f.renderer.gbuffer(), lights, f.pairs);
    halfWay.step(f.truth);
    halfWay.finish(f.truth);
    EXPECT_EQ(halfWay.visibility(), whole);
}

TEST(ViewTruth, CoarseSamplesRepresentTheirNeighbours) {
    TruthFrame f(64, 32);
    TruthRefinement refinement(f.renderer.gbuffer(), f.scene.world->lights(), f.pairs);
    EXPECT_EQ(refinement.stand(3 * 64 + 5), 3u * 64 + 5) << "nothing is known";
    refinement.step(f.truth); // rows 0 .. 31 of every eighth sample
    EXPECT_EQ(refinement.stand(3 * 64 + 5), 0u);
    EXPECT_EQ(refinement.stand(17 * 64 + 30), 16u * 64 + 24);
    refinement.step(f.truth); // every fourth
    EXPECT_EQ(refinement.stand(3 * 64 + 5), 0u * 64 + 4);
}

TEST(ViewTruth, NothingToRefineIsDone) {
    TruthRefinement refinement;
    EXPECT_TRUE(refinement.isDone());
    EXPECT_EQ(refinement.doneShare(), 1.0);
}

} // namespace

} // namespace shadowdag
