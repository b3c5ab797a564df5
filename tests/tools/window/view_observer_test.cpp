// SPDX-License-Identifier: Apache-2.0
#include "tools/window/view_observer.h"

#include <gtest/gtest.h>

#include <cmath>

namespace shadowdag {

namespace {

constexpr uint32_t kSide = 33;

/// A wall z = -5 that a camera at the origin sees whole; triangle 0.
struct Wall {
    explicit Wall(const Camera& camera) {
        const ViewRays view = makeViewRays(camera, kSide, kSide);
        for (uint32_t y = 0; y < kSide; ++y)
            for (uint32_t x = 0; x < kSide; ++x) {
                const glm::dvec3 way = view.direction(x, y);
                const double t = (-5.0 - view.origin.z) / way.z;
                position.push_back(glm::vec3(view.origin + t * way));
                normal.push_back({0, 0, 1});
                depth.push_back(float(t));
                triangle.push_back(0);
            }
    }
    GBufferView view() const {
        return {viewOf(position), viewOf(normal), viewOf(depth), viewOf(triangle), kSide, kSide};
    }
    std::vector<glm::vec3> position, normal;
    std::vector<float> depth;
    std::vector<uint32_t> triangle;
};

TEST(ViewObserver, PointsProjectToTheirPixels) {
    Camera camera;
    camera.positionWorld = {1, 2, 3};
    const ViewRays view = makeViewRays(camera, kSide, kSide);
    for (const glm::uvec2 pixel : {glm::uvec2(0, 0), glm::uvec2(16, 16), glm::uvec2(32, 5)}) {
        const glm::dvec3 at =
            pixelOfPoint(view, view.origin + 7.0 * view.direction(pixel.x, pixel.y));
        EXPECT_NEAR(at.x, pixel.x, 1e-9);
        EXPECT_NEAR(at.y, pixel.y, 1e-9);
        EXPECT_NEAR(at.z, 7.0, 1e-12);
    }
    EXPECT_LT(pixelOfPoint(view, {1, 2, 4}).z, 0.0) << "behind";
}

TEST(ViewObserver, FromItsOwnCameraAFrameIsUnchanged) {
    const Camera camera;
    const Wall wall(camera);
    std::vector<glm::vec3> display;
    for (size_t i = 0; i < wall.position.size(); ++i)
        display.push_back({float(i % 7) / 7, float(i % 5) / 5, 0});
    const std::vector<glm::vec3> seen =
        drawObserved(wall.view(), camera, wall.view(), camera, display, {});
    // But for the frustum's lines, which run along the border from here.
    for (uint32_t y = 1; y + 1 < kSide; ++y)
        for (uint32_t x = 1; x + 1 < kSide; ++x)
            EXPECT_EQ(seen[y * kSide + x], display[y * kSide + x]) << x << " " << y;
}

TEST(ViewObserver, SurfacesThatTheFrozenCameraDidNotSeeAreGrey) {
    const Camera frozen;
    Camera observer;
    observer.positionWorld = {0, 0, 10}; // sees three times as far on each side
    const Wall seen(frozen), observed(observer);
    const std::vector<glm::vec3> red(kSide * kSide, glm::vec3(1, 0, 0));
    const std::vector<glm::vec3> picture =
        drawObserved(observed.view(), observer, seen.view(), frozen, red, {});
    const glm::vec3 corner = picture[0], middle = picture[kSide / 2 * kSide + kSide / 2 + 2];
    EXPECT_EQ(corner.r, corner.g);
    EXPECT_GT(corner.r, 0.0f);
    EXPECT_EQ(middle, glm::vec3(1, 0, 0));
    size_t redCount = 0;
    for (const glm::vec3& p : picture)
        redCount += p == glm::vec3(1, 0, 0);
    EXPECT_NEAR(double(redCount), kSide * kSide / 9.0, 2.5 * kSide); // less the frustum's lines
}

TEST(ViewObserver, BoxesAreDrawnAtTheirCorners) {
    const Camera camera;
    const Wall wall(camera);
    const std::vector<glm::vec3> black(kSide * kSide, glm::vec3(0.0f));
    const Box box{{-0.5f, -0.5f, -4}, {0.5f, 0.5f, -3}};
    const std::vector<Box> boxes{box};
    const std::vector<glm::vec3> plain =
        drawObserved(wall.view(), camera, wall.view(), camera, black, {});
    const std::vector<glm::vec3> drawn =
        drawObserved(wall.view(), camera, wall.view(), camera, black, viewOf(boxes));
    const ViewRays view = makeViewRays(camera, kSide, kSide);
    for (int i = 0; i < 8; ++i) {
        const glm::dvec3 corner((i & 1) ? box.max.x : box.min.x, (i & 2) ? box.max.y : box.min.y,
                                (i & 4) ? box.max.z : box.min.z);
        const glm::dvec3 at = pixelOfPoint(view, corner);
        const size_t pixel = size_t(std::lround(at.y)) * kSide + size_t(std::lround(at.x));
        EXPECT_NE(drawn[pixel], plain[pixel]) << i;
    }
    // Inside of its nearer face nothing is drawn but the farther one's edges.
    const glm::dvec3 inside = pixelOfPoint(view, {0.45, 0.2, -3.0});
    const size_t pixel = size_t(std::lround(inside.y)) * kSide + size_t(std::lround(inside.x));
    EXPECT_EQ(drawn[pixel], plain[pixel]);
}

} // namespace

} // namespace shadowdag
