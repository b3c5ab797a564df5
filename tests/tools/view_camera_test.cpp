// SPDX-License-Identifier: Apache-2.0
#include "tools/view_camera.h"

#include "tools/scene_setup.h"

#include <gtest/gtest.h>

#include <cmath>

namespace shadowdag {

namespace {

Camera cameraAt(const glm::vec3& position, const glm::vec3& forward) {
    Camera camera;
    camera.positionWorld = position;
    camera.forward = glm::normalize(forward);
    camera.up =
        glm::normalize(glm::cross(glm::cross(camera.forward, glm::vec3(0, 1, 0)), camera.forward));
    return camera;
}

void expectNear(const glm::vec3& a, const glm::vec3& b, float tolerance) {
    EXPECT_NEAR(a.x, b.x, tolerance);
    EXPECT_NEAR(a.y, b.y, tolerance);
    EXPECT_NEAR(a.z, b.z, tolerance);
}

TEST(ViewCamera, TextMeansTheCameraItWasMadeFrom) {
    for (const glm::vec3 forward : {glm::vec3(0, 0, -1), glm::vec3(1, 0, 0), glm::vec3(0, 0, 1),
                                    glm::vec3(-1, 0.5f, 0.25f), glm::vec3(0.3f, -2, 0.1f)}) {
        Camera camera = cameraAt({1, 2, 3}, forward);
        camera.znear = 0.001f;
        camera.zfar = 12345;
        const Camera again = cameraFromText(FlyCamera(camera).text());
        expectNear(again.positionWorld, camera.positionWorld, 1e-6f);
        expectNear(again.forward, camera.forward, 2e-6f);
        EXPECT_NEAR(again.yfov, camera.yfov, 1e-6f);
        EXPECT_EQ(again.znear, camera.znear);
        EXPECT_EQ(again.zfar, camera.zfar);
    }
}

TEST(ViewCamera, WalksWhereItLooks) {
    FlyCamera fly(cameraAt({0, 0, 0}, {1, 0, 0}));
    FlyInput input;
    input.along = {0, 0, 1};
    fly.step(input, 0.5, 4.0, 0.0);
    expectNear(cameraFromText(fly.text()).positionWorld, {2, 0, 0}, 1e-5f);
    input.along = {1, 0, 0}; // right of +x is +z
    input.isFast = true;
    fly.step(input, 0.5, 1.0, 0.0);
    expectNear(cameraFromText(fly.text()).positionWorld, {2, 0, 2}, 1e-5f);
    input.along = {0, 1, 0};
    input.isFast = false;
    fly.step(input, 1.0, 1.0, 0.0);
    expectNear(cameraFromText(fly.text()).positionWorld, {2, 1, 2}, 1e-5f);
}

TEST(ViewCamera, MouseToTheRightTurnsRightAndDownLooksDown) {
    FlyCamera fly(cameraAt({0, 0, 0}, {0, 0, -1}));
    FlyInput input;
    input.turn = {100, 0};
    fly.step(input, 0, 1, 0.001);
    EXPECT_GT(cameraFromText(fly.text()).forward.x, 0.05f);
    input.turn = {0, 100};
    fly.step(input, 0, 1, 0.001);
    EXPECT_LT(cameraFromText(fly.text()).forward.y, -0.05f);
}

TEST(ViewCamera, NeverTipsOver) {
    FlyCamera fly(cameraAt({0, 0, 0}, {0, 0, -1}));
    FlyInput input;
    input.turn = {0, -10000};
    fly.step(input, 0, 1, 0.01);
    const Camera up = cameraFromText(fly.text());
    EXPECT_GT(up.forward.y, 0.99f);
    EXPECT_LT(up.forward.y, 0.9999f);
    EXPECT_TRUE(std::isfinite(up.up.x + up.up.y + up.up.z));
}

} // namespace

} // namespace shadowdag
