// SPDX-License-Identifier: Apache-2.0
// Renderers that share the data of their world and DAG.
#include "tests/hybrid/blocker_stage.h"

#include <gtest/gtest.h>

namespace shadowdag::test {
namespace {

/// The room with its lights and loose triangles, and half a square above the floor that a scale of
/// -1 turns into the other half from second to second: its box stays, so that only what says that
/// it moved tells.
Scene turningScene() {
    Scene scene = blockerScene(kManyLights, true);
    TriangleSoup soup;
    soup.add({-0.5f, 0, -0.5f}, {-0.5f, 0, 0.5f}, {0.5f, 0, 0.5f});
    AnimationChannel turn;
    turn.path = AnimationChannel::Path::kScale;
    turn.times = {0, 1, 2, 3};
    turn.values = {{1, 1, 1, 0}, {-1, 1, 1, 0}, {1, 1, 1, 0}, {-1, 1, 1, 0}};
    addMoving(scene, soup, {1, 0.5f, 1}, turn);
    return scene;
}

/// Frames that differ in what they keep and in what they draw.
struct Kind {
    const char* model;
    bool keepsMaps;
    float lodTexels;
};
constexpr Kind kKinds[] = {{"texels:0", false, 0},
                           {"texels:0", true, 0},
                           {"texels:0", true, 1},
                           {"texels:inf", false, 0},
                           {"texels:48", true, 0}};

FrameOptions optionsOf(const Kind& kind) {
    FrameOptions options = smallFrame();
    options.width = 96;
    options.height = 64;
    options.maps.useStaticOptimization = kind.keepsMaps;
    options.maps.lodTexels = kind.lodTexels;
    return options;
}

} // namespace

TEST(SharedScene, SharedRenderersEqualSeparateOnesFrameByFrame) {
    const Scene scene = turningScene();
    World world(scene, {});
    const Dag dag = dagOf(world, 7);
    const FrameRenderer first(Backend::kCpu, world, dag);
    std::vector<std::unique_ptr<FrameRenderer>> sharing, own;
    for (size_t k = 0; k < std::size(kKinds); ++k) {
        sharing.push_back(first.shareScene());
        own.push_back(std::make_unique<FrameRenderer>(Backend::kCpu, world, dag));
    }
    uint64_t keptCount = 0;
    for (const float time : {0.0f, 1.0f, 2.0f, 3.0f}) {
        SCOPED_TRACE(time);
        const std::vector<uint32_t> moved = world.setTime(time);
        sharing.back()->worldChanged(moved); // for all of them
        for (size_t k = 0; k < std::size(kKinds); ++k) {
            SCOPED_TRACE(k);
            own[k]->worldChanged(moved);
            const auto model = makeCostModel(kKinds[k].model);
            const FrameOptions options = optionsOf(kKinds[k]);
            // The last keeps what it drew for two frames: what moved in either is to be drawn.
            if (k == 4 && time == 2.0f)
                continue;
            const FrameResult a = sharing[k]->render(roomCamera(), *model, options),
                              b = own[k]->render(roomCamera(), *model, options);
            EXPECT_EQ(a.visibility, b.visibility);
            EXPECT_EQ(a.pairServer, b.pairServer);
            EXPECT_EQ(a.color, b.color);
            EXPECT_EQ(a.counts.maps.triangleDrawCount, b.counts.maps.triangleDrawCount);
            EXPECT_EQ(a.counts.maps.keptMapCount, b.counts.maps.keptMapCount);
            EXPECT_EQ(a.counts.moverTestCount, b.counts.moverTestCount);
            keptCount += a.counts.maps.keptMapCount;
        }
    }
    EXPECT_GT(keptCount, 0u);
}

TEST(SharedScene, LevelsOfDetailAreTimedSeparately) {
    const Scene scene = turningScene();
    World world(scene, {});
    const Dag dag = dagOf(world, 5);
    const FrameRenderer first(Backend::kCpu, world, dag);
    const std::unique_ptr<FrameRenderer> other = first.shareScene();
    const auto stages = [&](float time) {
        StageTimes ofLevels;
        other->worldChanged(world.setTime(time), &ofLevels);
        return ofLevels.stagesMs.size();
    };
    EXPECT_EQ(stages(1), 0u); // none are drawn yet
    other->render(roomCamera(), *makeCostModel("texels:0"), optionsOf(kKinds[2]));
    EXPECT_EQ(stages(2), 2u); // boxes and their hierarchy
}

// So that frames by rays count it, and frames by maps alone do not.
TEST(SharedScene, MovingGeometryForRaysIsTimedSeparately) {
    const Scene scene = turningScene();
    World world(scene, {});
    const Dag dag = dagOf(world, 5);
    const FrameRenderer first(Backend::kCpu, world, dag);
    const std::unique_ptr<FrameRenderer> maps = first.shareScene(), rays = first.shareScene();
    const auto stages = [&](float time) {
        StageTimes ofRays;
        EXPECT_GT(maps->worldChanged(world.setTime(time), nullptr, &ofRays).stageMs("scene update"),
                  0);
        return ofRays.stagesMs;
    };
    const auto render = [&](FrameRenderer& renderer, const char* model) {
        FrameOptions options = optionsOf(kKinds[1]);
        options.recordPairs = options.recordQuantities = false; // of reports, which count movers
        const FrameResult result = renderer.render(roomCamera(), *makeCostModel(model), options);
        EXPECT_EQ(result.stages.stageMs("scene update"), 0);
        return result;
    };
    EXPECT_TRUE(stages(1).empty());
    render(*maps, "texels:0");
    EXPECT_TRUE(stages(2).empty()) << "no ray has read it";
    render(*rays, "texels:inf");
    ASSERT_EQ(stages(3).size(), 1u);
    EXPECT_TRUE(stages(4).empty()) << "no ray has read it since";
    // It is made up for where it is read.
    FrameRenderer own(Backend::kCpu, world, dag);
    EXPECT_EQ(render(*rays, "texels:inf").color, render(own, "texels:inf").color);
}

TEST(SharedScene, PairsAreListedWithoutChangingKeptState) {
    Stage stage(turningScene());
    const auto model = makeCostModel("texels:0");
    const FrameOptions options = optionsOf(kKinds[1]);
    stage.renderer.render(roomCamera(), *model, options);
    const FrameResult kept = stage.renderer.render(roomCamera(), *model, options);
    ASSERT_GT(kept.counts.maps.keptMapCount, 0u);
    Camera near = roomCamera();
    near.positionWorld += 0.5f * near.forward;
    const std::unique_ptr<FrameRenderer> other = stage.renderer.shareScene();
    const FrameResult expected = other->render(near, *model, options);
    const PairList pairs = stage.renderer.listPairs(near, options);
    EXPECT_EQ(pairs.sampleStart, expected.pairs.sampleStart);
    EXPECT_EQ(pairs.light, expected.pairs.light);
    EXPECT_GT(pairs.count(), 1000u);
    const GBufferView a = stage.renderer.gbuffer(), b = other->gbuffer();
    for (size_t i = 0; i < b.count(); ++i)
        ASSERT_EQ(a.triangle[i], b.triangle[i]);
    const FrameResult again = stage.renderer.render(roomCamera(), *model, options);
    EXPECT_EQ(again.counts.maps.keptMapCount, kept.counts.maps.keptMapCount);
    EXPECT_EQ(again.visibility, kept.visibility);
}

} // namespace shadowdag::test
