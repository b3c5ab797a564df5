// SPDX-License-Identifier: Apache-2.0
// The demo with a clock that the test steps: its captions, what each shows, and its flight.
#include "tools/window/view_demo.h"

#include "tools/workspace/scene_setup.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

namespace shadowdag {

namespace {

using testing::ElementsAre;
using testing::HasSubstr;

/// A clock in whole and binary parts of a second, and a screen that shows what is asked for.
struct Showing {
    explicit Showing(double captionSeconds) : demo(captionSeconds) { scene.voxelResolution = 1024; }
    /// Returns whether the picture changed.
    bool step(double seconds) {
        now += seconds;
        demo.stepTo(now, request.caption);
        return showMoment(demo.moment(), scene, tour, 0.0f, request);
    }

    Demo demo;
    double now = 1000;
    ViewSceneInfo scene;
    std::vector<TourStop> tour{{Camera{}, false}};
    ViewRequest request;
};

/// What a caption speaks of.
struct Spoken {
    const char* title;
    const char* word; ///< in its text
    const char* left;
    const char* right; ///< "": not split
    ViewOverlay overlay;
};
constexpr Spoken kSpoken[] = {
    {"pair", "a shadow", "dag", "", ViewOverlay::kNone},
    {"Rays through voxels", "one cell", "dag", "", ViewOverlay::kVoxels},
    {"maps", "one page", "maps", "", ViewOverlay::kPages},
    {"Who serves", "sky blue", "hybrid", "", ViewOverlay::kMethods},
    {"truth", "on the right", "maps", "truth", ViewOverlay::kErrors},
    {"threshold", "threshold", "hybrid", "", ViewOverlay::kMethods},
};

TEST(Demo, CaptionsComeInOrderEachWithTheModeThatItSpeaksOf) {
    Showing showing(8);
    std::vector<size_t> captions;
    for (int i = 0; i < 8 * 4 * 7; ++i) { // a lap and the first caption again
        showing.step(0.25);
        const size_t caption = size_t(showing.request.caption);
        if (captions.empty() || captions.back() != caption)
            captions.push_back(caption);
        const Spoken& spoken = kSpoken[caption];
        const ViewRequest& request = showing.request;
        EXPECT_THAT(kDemoCaptions[caption].title, HasSubstr(spoken.title));
        EXPECT_THAT(kDemoCaptions[caption].text, HasSubstr(spoken.word));
        EXPECT_EQ(request.sides[0].method, spoken.left);
        EXPECT_EQ(request.isSplit, spoken.right[0] != '\0');
        EXPECT_TRUE(!request.isSplit || request.sides[1].method == spoken.right);
        EXPECT_EQ(request.overlay, spoken.overlay);
        EXPECT_EQ(std::isinf(request.options.rays.believe), caption == 1);
        EXPECT_EQ(request.voxelLevel, 3u) << "128 cells of 1024";
    }
    EXPECT_THAT(captions, ElementsAre(0, 1, 2, 3, 4, 5, 0));
}

TEST(Demo, IsTheSameHoweverOftenItIsDrawn) {
    Showing often(8), seldom(8);
    often.step(0);
    seldom.step(0);
    for (int second = 0; second < 60; ++second) {
        for (int i = 0; i < 64; ++i)
            often.step(1.0 / 64);
        seldom.step(1.0);
        EXPECT_EQ(often.request.caption, seldom.request.caption) << second;
        EXPECT_EQ(often.request.camera, seldom.request.camera) << second;
        EXPECT_EQ(often.request.sides[0], seldom.request.sides[0]) << second;
    }
}

TEST(Demo, WaitsForThePictureOfACaptionAndSkipsNone) {
    Demo demo(2);
    demo.stepTo(0, 0);
    demo.stepTo(1e6, 0); // a pause of eleven days
    EXPECT_EQ(demo.moment().number, 1u) << "the next caption, not the one of that time";
    demo.stepTo(2e6, 0); // the screen still shows the caption before
    EXPECT_EQ(demo.moment().number, 1u);
    EXPECT_EQ(demo.moment().share, 0.0);
    demo.stepTo(2e6 + 1, 1);
    EXPECT_EQ(demo.moment().share, 0.5);
    demo.stepTo(2e6, 1); // a clock that goes back
    EXPECT_EQ(demo.moment().share, 0.5);
}

TEST(Demo, RestsSoThatThePictureComesAtItsFullSize) {
    Showing showing(10);
    showing.step(0);
    for (int i = 0; i < 4; ++i) // it flies for four seconds
        EXPECT_TRUE(showing.step(1)) << i;
    EXPECT_FALSE(showing.demo.moment().isFlying);
    EXPECT_TRUE(showing.request.pixel.has_value()) << "a pair is shown at rest";
    for (int i = 0; i < 5; ++i)
        EXPECT_FALSE(showing.step(1)) << i << " the picture changes while it should rest";
    EXPECT_TRUE(showing.step(1)) << "the next caption";
    EXPECT_FALSE(showing.request.pixel.has_value());
}

TEST(Demo, TheLastCaptionRaisesTheThreshold) {
    Showing showing(8);
    std::vector<std::string> models;
    for (int i = 0; i < 8 * 8 * 6; ++i) {
        showing.step(0.125);
        if (showing.request.caption == 5 &&
            (models.empty() || models.back() != showing.request.sides[0].model))
            models.push_back(showing.request.sides[0].model);
    }
    EXPECT_THAT(models, ElementsAre("texels:16", "texels:64", "texels:128", "texels:256",
                                    "texels:512", "texels:1024"));
}

Camera cameraAt(const glm::vec3& position, float yawDegrees) {
    Camera camera;
    camera.positionWorld = position;
    const float yaw = glm::radians(yawDegrees);
    camera.forward = {-std::sin(yaw), 0, -std::cos(yaw)};
    return camera;
}

DemoMoment momentAt(size_t number, double flown) {
    DemoMoment moment;
    moment.number = number;
    moment.flown = flown;
    return moment;
}

void expectNear(const glm::vec3& a, const glm::vec3& b, float tolerance) {
    EXPECT_NEAR(glm::length(a - b), 0.0f, tolerance)
        << a.x << " " << a.y << " " << a.z << " is not " << b.x << " " << b.y << " " << b.z;
}

TEST(DemoTour, FliesStraightWhereTheWayIsOpenAndTurnsTheShortWay) {
    const std::vector<TourStop> tour{{cameraAt({0, 1, 0}, 170), true},
                                     {cameraAt({4, 3, 2}, -170), true}};
    const Camera begin = tourCamera(tour, momentAt(1, 0)), end = tourCamera(tour, momentAt(1, 1)),
                 middle = tourCamera(tour, momentAt(1, 0.5));
    expectNear(begin.positionWorld, {0, 1, 0}, 1e-6f);
    expectNear(begin.forward, tour[0].camera.forward, 1e-6f);
    expectNear(end.positionWorld, {4, 3, 2}, 1e-6f);
    expectNear(end.forward, tour[1].camera.forward, 1e-6f);
    expectNear(middle.positionWorld, {2, 2, 1}, 1e-6f);
    expectNear(middle.forward, {0, 0, 1}, 1e-6f); // 180 degrees, not 0
    // From the last stop to the first again.
    expectNear(tourCamera(tour, momentAt(2, 0)).positionWorld, {4, 3, 2}, 1e-6f);
}

TEST(DemoTour, StaysAtItsStopWhereSomethingStandsInTheWay) {
    const std::vector<TourStop> tour{{cameraAt({0, 1, 0}, 0), false},
                                     {cameraAt({4, 3, 2}, 90), false}};
    for (const double flown : {0.0, 0.3, 1.0})
        expectNear(tourCamera(tour, momentAt(1, flown)).positionWorld, {4, 3, 2}, 0.0f);
    EXPECT_LT(glm::dot(tourCamera(tour, momentAt(1, 0)).forward, tour[1].camera.forward), 0.99f);
    expectNear(tourCamera(tour, momentAt(1, 1)).forward, tour[1].camera.forward, 1e-6f);
}

TEST(DemoTour, ASingleViewIsNeverLeft) {
    const std::vector<TourStop> tour{{cameraAt({1, 2, 3}, 30), false}};
    for (size_t number = 0; number < 3; ++number)
        for (const double flown : {0.0, 0.5, 1.0}) {
            const Camera camera = tourCamera(tour, momentAt(number, flown));
            expectNear(camera.positionWorld, {1, 2, 3}, 0.0f);
            expectNear(camera.forward, tour[0].camera.forward, 1e-6f);
        }
    EXPECT_LT(glm::dot(tourCamera(tour, momentAt(0, 0.25)).forward, tour[0].camera.forward), 0.99f);
}

TEST(DemoTour, FindsViewsAndWhichWaysAreOpen) {
    const LoadedScene scene =
        loadSceneAndWorld("builtin:fail-silhouette", -1, 1, true, Console(false));
    const Truth truth(*scene.world);
    const std::vector<TourStop> tour = findTour(*scene.world, truth);
    ASSERT_GT(tour.size(), 1u);
    ASSERT_LE(tour.size(), kDemoCaptionCount);
    for (size_t i = 0; i < tour.size(); ++i) {
        const glm::vec3& from = tour[(i + tour.size() - 1) % tour.size()].camera.positionWorld;
        EXPECT_FALSE(tour[i].isOpen && truth.isBlocked(from, tour[i].camera.positionWorld)) << i;
    }
}

TEST(DemoTour, AnAnimatedCameraIsPlayedFromItsFirstFrameToItsLast) {
    Showing showing(8);
    showing.tour.clear();
    showing.scene.cameraText = "camera";
    showing.scene.frameCount = 301;
    uint32_t before = 0;
    showing.step(0);
    for (int i = 0; i < 8 * 8 * 6 - 1; ++i) {
        showing.step(0.125);
        EXPECT_EQ(showing.request.camera, "camera");
        EXPECT_GE(showing.request.frame, before);
        EXPECT_LE(showing.request.frame - before, 10u) << "it jumps";
        before = showing.request.frame;
    }
    EXPECT_EQ(before, 300u);
    showing.step(0.125);
    EXPECT_EQ(showing.request.frame, 0u) << "the next lap";
}

} // namespace

} // namespace shadowdag
