// SPDX-License-Identifier: Apache-2.0
#include "tools/window/view_camera.h"

#include "tools/settings/camera_text.h"
#include "tools/workspace/scene_setup.h"

#include <gtest/gtest.h>

#include <algorithm>
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

TEST(ViewCamera, TextRoundTripsToTheSameCamera) {
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

/// Returns the camera with its up leaning to the right by an angle in radians.
Camera rolled(Camera camera, double angle) {
    camera.up = float(std::cos(angle)) * camera.up + float(std::sin(angle)) * camera.right();
    return camera;
}

TEST(ViewCamera, RollIsKept) {
    for (const double angle : {0.3, -0.3, 1.6, -3.0})
        for (const glm::vec3 forward : {glm::vec3(0, 0, -1), glm::vec3(1, 0.5f, 0.25f)}) {
            const Camera camera = rolled(cameraAt({1, 2, 3}, forward), angle);
            FlyCamera fly(camera);
            const Camera again = cameraFromText(fly.text());
            expectNear(again.up, camera.up, 3e-6f);
            expectNear(again.forward, camera.forward, 3e-6f);
            FlyInput input; // right, as the picture has it
            input.along = {1, 0, 0};
            fly.step(input, 1, 1, 0);
            const Camera moved = cameraFromText(fly.text());
            expectNear(moved.positionWorld, camera.positionWorld + camera.right(), 1e-5f);
            expectNear(moved.up, camera.up, 3e-6f);
            // The mouse to the right turns towards the picture's right, down towards its bottom.
            for (const glm::vec2 turn : {glm::vec2(1, 0), glm::vec2(0, 1)}) {
                FlyCamera looks(camera);
                FlyInput look;
                look.turn = turn;
                looks.step(look, 0, 1, 0.001);
                const glm::vec3 way =
                    cameraFromText(looks.text()).forward - glm::normalize(camera.forward);
                const glm::vec3 wanted = turn.x > 0 ? camera.right() : -camera.up;
                EXPECT_GT(glm::dot(glm::normalize(way), wanted), 0.9f) << angle;
            }
        }
    const std::string level = FlyCamera(cameraAt({0, 0, 0}, {1, 0.2f, 0})).text();
    EXPECT_EQ(std::count(level.begin(), level.end(), ','), 8) << "no roll, no number for it";
}

TEST(ViewCamera, RollInTextsIsHeldToItsRange) {
    EXPECT_NEAR(cameraFromText("0,0,0,0,0,-1,50,0.1,100,90").up.x, 1.0f, 1e-6f);
    EXPECT_THROW(cameraFromText("0,0,0,0,0,-1,50,0.1,100,181"), Error);
    EXPECT_THROW(cameraFromText("0,0,0,0,0,-1,50,0.1"), Error);
}

TEST(ViewCamera, MovesAlongTheViewDirection) {
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
