// SPDX-License-Identifier: Apache-2.0
// Frames that are cancelled between two stages do not affect later ones.
#include "tests/hybrid/blocker_stage.h"

#include <gtest/gtest.h>

namespace shadowdag::test {
namespace {

struct Enough {};

/// A room in which one blocker moves from side to side.
Scene movingScene() {
    Scene scene = blockerScene(kManyLights, true);
    TriangleSoup soup;
    soup.addLevelSquare({0, 0.5f, 0}, 0.4f);
    AnimationChannel way;
    way.path = AnimationChannel::Path::kTranslation;
    way.times = {0, 3};
    way.values = {{-1.5f, 0, 0, 0}, {1.5f, 0, 0, 0}};
    addMoving(scene, soup, {}, way);
    return scene;
}

Camera cameraAt(float forward) {
    Camera camera = roomCamera();
    camera.positionWorld += forward * camera.forward;
    return camera;
}

FrameOptions optionsOf(bool keepsMaps) {
    FrameOptions options = smallFrame();
    options.width = 96;
    options.height = 64;
    options.routeMargin = 0.5f;
    options.maps.useStaticOptimization = keepsMaps;
    return options;
}

/// Calls a function before each stage; throws at the `last`-th call.
struct Asked {
    int last = 0, count = 0;
    std::function<void()> function() {
        return [this] {
            if (++count == last)
                throw Enough{};
        };
    }
};

void expectEqual(const FrameResult& a, const FrameResult& b) {
    EXPECT_EQ(a.color, b.color);
    EXPECT_EQ(a.pairs.sampleStart, b.pairs.sampleStart);
    EXPECT_EQ(a.pairs.light, b.pairs.light);
    EXPECT_EQ(a.visibility, b.visibility);
    EXPECT_EQ(a.pairServer, b.pairServer);
    ASSERT_EQ(a.maps.size(), b.maps.size());
    for (size_t i = 0; i < a.maps.size(); ++i) {
        EXPECT_EQ(a.maps[i].route, b.maps[i].route) << i;
        EXPECT_EQ(a.maps[i].heldTexels, b.maps[i].heldTexels) << i;
        EXPECT_EQ(a.maps[i].quantities.previous, b.maps[i].quantities.previous) << i;
    }
    EXPECT_EQ(a.counts.missingTapCount, 0u);
}

TEST(FrameGiveUp, TheNextFrameIsUnaffected) {
    const Scene scene = movingScene();
    World world(scene, {});
    const Dag dag = dagOf(world, 6);
    FrameRenderer disturbed(Backend::kCpu, world, dag);
    const std::unique_ptr<FrameRenderer> calm = disturbed.shareScene();
    uint64_t keptCount = 0;
    for (const char* text : {"texels:0", "texels:inf", "texels:150"})
        for (const bool keepsMaps : {false, true}) {
            const auto model = makeCostModel(text);
            const FrameOptions options = optionsOf(keepsMaps);
            Asked all;
            disturbed.render(cameraAt(0), *model, options, all.function());
            ASSERT_GT(all.count, 6) << "asked before every stage";
            for (int last = 1; last <= all.count; ++last) {
                SCOPED_TRACE(std::string(text) + ", " + std::to_string(last) + " of " +
                             std::to_string(all.count));
                const auto moveTo = [&](float time) {
                    disturbed.worldChanged(world.setTime(time)); // for both
                };
                disturbed.reset();
                calm->reset();
                moveTo(0);
                expectEqual(disturbed.render(cameraAt(0), *model, options),
                            calm->render(cameraAt(0), *model, options));
                moveTo(1);
                // Far nearer: resolutions and routes differ from those before and after.
                Asked asked{last};
                EXPECT_THROW(disturbed.render(cameraAt(2.5f), *model, options, asked.function()),
                             Enough);
                moveTo(2);
                const FrameResult after = disturbed.render(cameraAt(0.05f), *model, options);
                expectEqual(after, calm->render(cameraAt(0.05f), *model, options));
                keptCount += after.counts.maps.keptMapCount;
                disturbed.reset();
                calm->reset();
                expectEqual(disturbed.render(cameraAt(1), *model, options),
                            calm->render(cameraAt(1), *model, options));
            }
        }
    EXPECT_GT(keptCount, 0u) << "nothing was kept that could have been spoilt";
}

TEST(FrameGiveUp, MeasuringLeavesNoState) {
    Stage stage(blockerScene(kManyLights), 6);
    const FrameOptions options = optionsOf(true);
    const auto model = makeCostModel("texels:150");
    const FrameResult before = stage.renderer.render(roomCamera(), *model, options);
    Asked all;
    stage.renderer.measureCosts(roomCamera(), options, 1, all.function());
    ASSERT_GT(all.count, 20);
    for (int last = 1; last <= all.count; last += 3) {
        Asked asked{last};
        EXPECT_THROW(stage.renderer.measureCosts(roomCamera(), options, 1, asked.function()),
                     Enough);
        expectEqual(stage.renderer.render(roomCamera(), *model, options), before);
    }
}

TEST(FrameGiveUp, ResultsDoNotCallThePoll) {
    Stage stage(blockerScene(kManyLights), 6);
    Asked all;
    const FrameResult frame = stage.renderer.render(roomCamera(), *makeCostModel("texels:0"),
                                                    smallFrame(), all.function());
    EXPECT_FALSE(frame.stages.beforeStage);
    EXPECT_FALSE(frame.counting.beforeStage);
    EXPECT_GE(size_t(all.count), frame.stages.stagesMs.size());
}

} // namespace
} // namespace shadowdag::test
