// SPDX-License-Identifier: Apache-2.0
// Frames that guess the lengths of their lists are the same as those that read them, for right and
// for too short guesses.
#include "hybrid/frame/frame_state.h"

#include "tests/cuda/backends.h"
#include "tests/hybrid/blocker_stage.h"

#include <gtest/gtest.h>

#include <random>
#include <utility>

namespace shadowdag::test {
namespace {

/// A scene of some lights seen by cameras from far and near, in turn, so that lists grow and
/// shrink.
class GuessedListsOn : public OnBackend {
protected:
    static Scene lit() {
        std::vector<glm::vec3> lights;
        std::mt19937_64 random(5);
        std::uniform_real_distribution<float> unit(-5.0f, 5.0f);
        for (int i = 0; i < 40; ++i)
            lights.emplace_back(unit(random), 1.0f + 0.2f * float(i % 9), unit(random));
        return blockerScene(lights, true);
    }
    static std::vector<Camera> path() {
        std::vector<Camera> cameras;
        for (const float metres :
             {-20.0f, 0.0f, 0.0f, 2.5f, -4.0f, 3.0f, 0.0f, -20.0f, 3.9f, 0.0f}) {
            Camera camera = roomCamera();
            camera.positionWorld += metres * camera.forward;
            cameras.push_back(camera);
        }
        // Nothing in sight: all lists are empty, and then long again.
        cameras.insert(cameras.begin() + 4, roomCamera());
        cameras[4].forward = {0, 1, 0};
        cameras[4].up = {0, 0, 1};
        return cameras;
    }

    static constexpr size_t kRoomForAll = size_t(1) << 17;

    const Scene scene = lit();
    const World world{scene, {}};
    const Dag dag = dagOf(world, 8);
};

TEST_P(GuessedListsOn, GiveTheFramesOfReadLengths) {
    for (const size_t spare : {size_t(1), kRoomForAll})
        for (const auto& [model, bounds] : {std::pair("texels:0", ClusterBounds::kTight),
                                            std::pair("texels:48", ClusterBounds::kExplicit)}) {
            FrameOptions options = smallFrame();
            options.width = 112;
            options.height = 72;
            options.maxFaceTexels = 64; // lists are of pages and triangles, not of texels
            options.clusterBounds = bounds;
            options.maps.useAtomicRasterizer = spare == 1; // as a device draws
            FrameRenderer asking(GetParam(), world, dag), guessing(GetParam(), world, dag);
            asking.guessLengths(false);
            guessing.guessLengths(true, spare);
            uint64_t rerunCount = 0;
            size_t step = 0;
            for (const Camera& camera : path()) {
                SCOPED_TRACE(testing::Message() << model << ", spare " << spare << ", bounds "
                                                << int(bounds) << ", step " << step++);
                const FrameResult a = asking.render(camera, *makeCostModel(model), options);
                const FrameResult g = guessing.render(camera, *makeCostModel(model), options);
                EXPECT_EQ(a.counts.listRerunCount, 0u);
                rerunCount += g.counts.listRerunCount;
                EXPECT_EQ(a.color, g.color);
                EXPECT_EQ(a.visibility, g.visibility);
                EXPECT_EQ(a.pairs.light, g.pairs.light);
                EXPECT_EQ(a.pairServer, g.pairServer);
                EXPECT_EQ(a.counts.sampleCount, g.counts.sampleCount);
                EXPECT_EQ(a.counts.clusterCount, g.counts.clusterCount);
                EXPECT_EQ(a.counts.clusterLightCount, g.counts.clusterLightCount);
                EXPECT_EQ(a.counts.prunedClusterLightCount, g.counts.prunedClusterLightCount);
                EXPECT_EQ(a.counts.maps.batchFaceCount, g.counts.maps.batchFaceCount);
                EXPECT_EQ(a.counts.maps.triangleDrawCount, g.counts.maps.triangleDrawCount);
                EXPECT_EQ(a.counts.maps.batchFaceKeptCount, g.counts.maps.batchFaceKeptCount);
                EXPECT_EQ(asking.clusters().count(), guessing.clusters().count());
                EXPECT_EQ(asking.clusterLights().lights.count,
                          guessing.clusterLights().lights.count);
            }
            // From little room many frames are made again, and never with all the room.
            EXPECT_EQ(rerunCount > 0, spare < kRoomForAll) << model << ", " << spare;
        }
}

TEST_P(GuessedListsOn, AreMadeOnceForAStaticCamera) {
    FrameRenderer renderer(GetParam(), world, dag);
    renderer.guessLengths(true, 1);
    for (int frame = 0; frame < 4; ++frame)
        EXPECT_EQ(renderer.render(roomCamera(), *makeCostModel("texels:48"), smallFrame())
                      .counts.listRerunCount,
                  0u);
}

// A frame after a reset depends on itself alone: also how long it takes. On the way of the test
// above, guesses of the camera before are too short.
TEST_P(GuessedListsOn, AreReadAfterAReset) {
    FrameRenderer renderer(GetParam(), world, dag);
    renderer.guessLengths(true, 1);
    FrameOptions options = smallFrame();
    options.maxFaceTexels = 64;
    for (const Camera& camera : path()) {
        renderer.reset();
        const FrameResult frame = renderer.render(camera, *makeCostModel("texels:0"), options);
        EXPECT_EQ(frame.counts.listRerunCount, 0u);
    }
}

// What frames draw in turn by several methods does not make the guess of the next too short.
TEST_P(GuessedListsOn, OutliveFramesOfRaysAndFramesThatDrawNothingAnew) {
    FrameRenderer renderer(GetParam(), world, dag);
    renderer.guessLengths(true, 1);
    FrameOptions options = smallFrame();
    for (const char* model : {"texels:0", "texels:0", "texels:inf", "texels:inf", "texels:0",
                              "texels:inf", "texels:0"}) {
        const FrameResult frame = renderer.render(roomCamera(), *makeCostModel(model), options);
        EXPECT_EQ(frame.counts.listRerunCount, 0u) << model;
    }
}

INSTANTIATE_TEST_SUITE_P(Both, GuessedListsOn, kBothBackends, backendSuffix);

} // namespace
} // namespace shadowdag::test
