// SPDX-License-Identifier: Apache-2.0
// Maps that are kept from frame to frame: a wall and a board before it, where every triangle that
// is drawn and every page that is cleared is known.
#include "shadowmap/shadow_maps.h"

#include "tests/shadowmap/kept_maps.h"

#include <gtest/gtest.h>

#include <string>

namespace shadowdag {
namespace {

using test::keeping;
using test::SmallScene;

/// One light that looks along +x at a wall of two batches, instances 0 (left) and 1 (right), and a
/// board before it, instance 2; receivers that lie before or behind the board.
class Wall {
public:
    SmallScene scene;
    ShadowMaps maps{Backend::kCpu};
    ShadowMapOptions options = keeping(MapCulling::kCellDepth);
    glm::vec3 light{0.0f};
    uint32_t faceTexels = 64;
    float boardX = 5.0f;
    bool isFar = true; ///< the receivers: at x = 8, behind the board, or at x = 2

    Wall() {
        for (const float side : {-1.0f, 1.0f})
            scene.addQuad({12, 0, 1.5f * side}, {0, 3, 0}, {0, 0, 1.5f}, 2);
        scene.addQuad({boardX, 0, 0}, {0, 0.5f, 0}, {0, 0, 0.5f}, 2);
        std::vector<uint32_t> instances;
        for (uint32_t i = 0; i < 24; ++i)
            instances.push_back(i / 8);
        batches_ = std::make_unique<BatchSet>(scene.view(), instances);
    }
    void moveBoard(float toX) {
        for (size_t v = scene.positions.size() - 9; v < scene.positions.size(); ++v)
            scene.positions[v].x = toX;
        boardX = toX;
        batches_->update(scene.view(), {2});
        moved_ = batches_->movedBatches();
    }
    /// A frame that looks at nothing.
    void buildNothing() {
        StageTimes stages;
        maps.build({}, {}, {}, scene.view(), batches_->view(), options, stages, viewOf(moved_));
        moved_.clear();
    }
    const ShadowMapCounts& build() {
        Box box;
        const float x = isFar ? 8.0f : 2.0f;
        box.add(glm::vec3(x - 0.1f, -0.1f, -0.1f));
        box.add(glm::vec3(x, 0.1f, 0.1f));
        StageTimes stages;
        maps.build({{light, 20.0f, 0, faceTexels}}, {box}, {{0, 0}}, scene.view(), batches_->view(),
                   options, stages, viewOf(moved_));
        moved_.clear();
        // What stands before the receiver darkens it, and nothing else does.
        const uint8_t v = lookupVisibility(maps.view(), 0, {x - 0.05f, 0, 0}, {-1, 0, 0}, {});
        EXPECT_EQ(v, boardX < x ? 0 : 255);
        maps.countSkipped();
        return maps.counts();
    }

private:
    std::unique_ptr<BatchSet> batches_;
    std::vector<uint32_t> moved_;
};

// The switch moves triangleDrawCount: to nothing when nothing changed, and by what was kept.
TEST(StaticOptimization, StaticGeometryIsDrawnOnce) {
    Wall wall;
    const ShadowMapCounts first = wall.build();
    EXPECT_EQ(first.triangleDrawCount, 8u); // the board: the wall is behind the receivers
    EXPECT_EQ(first.triangleKeptCount, 0u);
    const ShadowMapCounts second = wall.build();
    EXPECT_EQ(second.triangleDrawCount, 0u);
    EXPECT_EQ(second.batchFaceCount, 0u);
    EXPECT_EQ(second.triangleKeptCount, 8u);
    EXPECT_EQ(second.batchFaceKeptCount, 1u);
    EXPECT_EQ(second.keptMapCount, 1u);
    EXPECT_EQ(second.pagesCommittedCount + second.pagesClearedCount + second.pagesFreedCount, 0u);
    EXPECT_EQ(second.pageCount, first.pageCount);
    wall.options.useStaticOptimization = false;
    const ShadowMapCounts without = wall.build();
    EXPECT_EQ(without.triangleDrawCount, 8u);
    EXPECT_EQ(without.triangleKeptCount, 0u);
    EXPECT_EQ(without.pagesCommittedCount, without.pageCount);
    EXPECT_EQ(without.pagesFreedCount, second.pageCount);
}

TEST(StaticOptimization, AResetAMovedLightOrAnotherResolutionRedraws) {
    Wall wall;
    wall.build();
    wall.maps.forget();
    EXPECT_EQ(wall.build().triangleDrawCount, 8u);
    wall.light.y = 0.01f;
    EXPECT_EQ(wall.build().triangleDrawCount, 8u);
    EXPECT_EQ(wall.maps.counts().keptMapCount, 0u);
    wall.faceTexels = 100;
    EXPECT_EQ(wall.build().triangleDrawCount, 8u);
    EXPECT_GT(wall.maps.counts().pagesRetainedCount, 0u); // of the map of 64 texels
    wall.faceTexels = 64;                                 // which is still there
    EXPECT_EQ(wall.build().triangleDrawCount, 0u);
    EXPECT_EQ(wall.maps.counts().keptMapCount, 1u);
    wall.options.retainsPages = false;
    wall.build();
    wall.faceTexels = 100;
    wall.build();
    EXPECT_EQ(wall.maps.counts().pagesRetainedCount, 0u);
    wall.faceTexels = 64;
    EXPECT_EQ(wall.build().triangleDrawCount, 8u);
}

TEST(StaticOptimization, BoardThatMovesIsDrawnEveryFrameAndOnceMoreWhenItsOldPlaceIsCleared) {
    Wall wall;
    wall.build();
    for (const float x : {5.5f, 6.0f, 6.5f, 10.0f, 5.0f}) {
        wall.moveBoard(x);
        const ShadowMapCounts counts = wall.build();
        EXPECT_EQ(counts.triangleDrawCount, x < 8.0f ? 8u : 0u);
        EXPECT_EQ(counts.pagesCommittedCount, 0u);
        // Where it stood behind the receivers it was not drawn: nothing to clear.
        EXPECT_EQ(counts.pagesClearedCount, x == 5.0f ? 0u : counts.pageCount) << x;
    }
    EXPECT_EQ(wall.build().triangleDrawCount, 0u);
}

// Depth 5 was drawn when the board was elsewhere; it moved out of view, and stopped there.
TEST(StaticOptimization, BoardThatStoppedOutOfViewIsDrawnWhenVisibleAgain) {
    Wall wall;
    wall.moveBoard(10.0f);
    wall.build();
    wall.isFar = false;
    wall.build();
    wall.moveBoard(5.0f);
    EXPECT_EQ(wall.build().triangleDrawCount, 0u);
    EXPECT_EQ(wall.build().triangleDrawCount, 0u);
    wall.isFar = true;
    EXPECT_EQ(wall.build().triangleDrawCount, 8u);
}

// The same when no map at all is requested while it moves.
TEST(StaticOptimization, BoardThatMovedWhileNoMapWasRequestedIsDrawn) {
    Wall wall;
    wall.moveBoard(10.0f);
    wall.build();
    wall.moveBoard(5.0f);
    wall.buildNothing();
    wall.build(); // expects darkness behind the board
}

TEST(StaticOptimization, UnknownBatchIsRefused) {
    Wall wall;
    StageTimes stages;
    const std::vector<uint32_t> moved{1};
    const SmallScene nothing;
    const BatchSet none = nothing.batches();
    try {
        wall.maps.build({}, {}, {}, nothing.view(), none.view(), wall.options, stages,
                        viewOf(moved));
        FAIL();
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kUsage);
        EXPECT_NE(std::string(error.what()).find("moved batch 1 of 0"), std::string::npos);
    }
}

} // namespace
} // namespace shadowdag
