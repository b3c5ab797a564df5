// SPDX-License-Identifier: Apache-2.0
// A workspace: when its parts are created, and that all of them are updated to the same time.
#include "tools/workspace/workspace.h"

#include "cuda/cancel.h"
#include "cuda/error.h"
#include "scenes/builtin.h"
#include "tests/tools/workspace/sliding_scene.h"
#include "tools/workspace/judge.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <thread>

namespace shadowdag {

namespace {

using testing::ElementsAre;

FrameOptions smallFrame() {
    FrameOptions options;
    options.width = 96;
    options.height = 64;
    return options;
}

FrameResult render(Workspace& workspace, uint32_t resolutionLog2, const char* model,
                   size_t role = 0) {
    FrameRenderer& renderer = workspace.renderer(resolutionLog2, role);
    renderer.reset();
    return renderer.render(workspace.camera(), *makeCostModel(model), smallFrame());
}

} // namespace

TEST(Workspace, RenderersAreMadeOnceForEachResolutionAndRole) {
    Workspace workspace = slidingWorkspace();
    FrameRenderer& first = workspace.renderer(5);
    EXPECT_EQ(&first, &workspace.renderer(5));
    EXPECT_NE(&first, &workspace.renderer(5, 1));
    EXPECT_NE(&first, &workspace.renderer(6));
    EXPECT_EQ(&first, &workspace.renderer(5)); // where it was
    EXPECT_EQ(render(workspace, 5, "texels:inf").visibility,
              render(workspace, 5, "texels:inf", 1).visibility);
}

// The loops of a scene that takes long, made of ones that wait.
TEST(Workspace, PreparingARendererIsAStepThatIsShown) {
    const Console console(false, 0.1);
    WorkspaceOptions options;
    options.console = &console;
    Workspace workspace(loadedScene(makeBuiltin("fail-contact")), options);
    testing::internal::CaptureStderr();
    static int waitCount;
    waitCount = 0;
    setCpuPoll([](double fraction) {
        if (waitCount++ == 0)
            std::this_thread::sleep_for(std::chrono::milliseconds(1500));
        pollLoops(fraction);
    });
    workspace.renderer(kNoVoxels);
    setCpuPoll(nullptr);
    EXPECT_GT(waitCount, 0);
    EXPECT_THAT(testing::internal::GetCapturedStderr(),
                testing::ContainsRegex("prepare fail-contact: [0-9]+ %, "));
}

TEST(Workspace, VoxelsHaveTheRequestedResolution) {
    Workspace workspace = slidingWorkspace();
    EXPECT_EQ(workspace.dag(5).grid.resolutionLog2, 5u);
    EXPECT_EQ(workspace.dag(5).grid, workspace.grid(5));
    EXPECT_FALSE(workspace.dag(kNoVoxels).isBuilt());
    EXPECT_THAT(workspace.obtainVoxels({6, 4}), ElementsAre(6, 4));
    RunParameters run;
    run.method = "maps";
    EXPECT_EQ(workspace.voxelsOf(run), 6u);
    run.method = "dag";
    run.resolution = 16;
    EXPECT_EQ(workspace.voxelsOf(run), 4u);
}

TEST(Workspace, WithoutVoxelsMapsAreDrawnAndRaysRefused) {
    Workspace workspace = slidingWorkspace();
    EXPECT_GT(render(workspace, kNoVoxels, "texels:0").pairs.count(), 100u);
    EXPECT_THROW(render(workspace, kNoVoxels, "texels:inf"), Error);
}

TEST(Workspace, RenderersAndTruthAreUpdatedWithTheWorld) {
    Workspace moved = slidingWorkspace(), fresh = slidingWorkspace();
    const auto truthOf = [](Workspace& workspace) {
        const PairList pairs = workspace.renderer(5).listPairs(workspace.camera(), smallFrame());
        return workspace.truth().visibility(workspace.renderer(5).gbuffer(),
                                            workspace.world().lights(), pairs);
    };
    const std::vector<uint8_t> before = render(moved, 5, "texels:inf").visibility;
    const std::vector<uint8_t> truthBefore = truthOf(moved);
    const Truth* truth = &moved.truth();
    moved.renderer(5, 1);
    moved.setTime(3);
    fresh.setTime(3);
    const std::vector<uint8_t> after = render(fresh, 5, "texels:inf").visibility;
    EXPECT_EQ(render(moved, 5, "texels:inf").visibility, after);
    EXPECT_EQ(render(moved, 5, "texels:inf", 1).visibility, after);
    EXPECT_NE(before, after);
    EXPECT_EQ(truthOf(moved), truthOf(fresh));
    EXPECT_NE(truthOf(moved), truthBefore);
    EXPECT_EQ(&moved.truth(), truth);
}

TEST(Workspace, UpdateTimesAreThoseOfTheLastChange) {
    Workspace workspace = slidingWorkspace();
    workspace.renderer(5);
    workspace.setTime(workspace.world().timeSeconds()); // nothing to follow
    EXPECT_TRUE(workspace.followTimes(5).stages.stagesMs.empty());
    workspace.advance(workspace.world().timeSeconds()); // updated nevertheless
    EXPECT_FALSE(workspace.followTimes(5).stages.stagesMs.empty());
    workspace.setTime(1);
    EXPECT_FALSE(workspace.followTimes(5).stages.stagesMs.empty());
    workspace.renderer(6); // made since
    EXPECT_TRUE(workspace.followTimes(6).stages.stagesMs.empty());
}

TEST(Workspace, NewVoxelsReplaceAllOthers) {
    Workspace workspace = slidingWorkspace();
    workspace.obtainVoxels({4});
    workspace.renderer(4, 2);
    Dag dag = workspace.dag(5);
    workspace.replaceVoxels(std::move(dag));
    RunParameters maps;
    maps.method = "maps";
    EXPECT_EQ(workspace.voxelsOf(maps), 5u);
    EXPECT_GT(render(workspace, 5, "texels:inf").pairs.count(), 100u);
    workspace.setBackend(Backend::kCpu);
    EXPECT_GT(render(workspace, 5, "texels:inf", 2).pairs.count(), 100u);
}

TEST(Workspace, APlacedCameraStaysWhereItWasFirstRequested) {
    WorkspaceOptions options;
    options.camera = "auto";
    Workspace workspace(slidingScene(), options);
    workspace.setTime(3);
    const Camera placed = workspace.camera();
    workspace.setTime(0);
    EXPECT_EQ(workspace.camera().positionWorld, placed.positionWorld);
}

} // namespace shadowdag
