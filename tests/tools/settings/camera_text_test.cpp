// SPDX-License-Identifier: Apache-2.0
#include "tools/settings/camera_text.h"

#include "cuda/error.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace shadowdag {
namespace {

using testing::HasSubstr;

std::string cameraRefusal(const std::string& text) {
    try {
        cameraFromText(text);
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kUsage);
        return error.what();
    }
    return "";
}

TEST(CameraText, IsReadAsWritten) {
    const Camera camera = cameraFromText("1,2,3,4,2,-1,60,0.5,100,30");
    const Camera again = cameraFromText(cameraText(camera));
    EXPECT_NEAR(glm::distance(camera.forward, again.forward), 0, 1e-6f);
    EXPECT_NEAR(glm::distance(camera.up, again.up), 0, 1e-6f);
    EXPECT_EQ(camera.positionWorld, again.positionWorld);
    EXPECT_FLOAT_EQ(camera.yfov, again.yfov);
    EXPECT_EQ(camera.znear, again.znear);
    EXPECT_EQ(camera.zfar, again.zfar);
}

TEST(CameraText, TakesBlanksAroundItsNumbers) {
    EXPECT_EQ(cameraText(cameraFromText(" 0, 1,\t5, 0 ,1, 0 ")),
              cameraText(cameraFromText("0,1,5,0,1,0")));
    EXPECT_THAT(cameraRefusal("0 1, 2, 3, 4, 5, 6"), HasSubstr("must be a number"));
    EXPECT_THAT(cameraRefusal("0, , 3, 4, 5, 6"), HasSubstr("must be a number"));
}

TEST(CameraText, GivesTheSameViewFarFromTheOrigin) {
    for (const float away : {0.3f, 37.0f, 1e4f, 4.5e6f, 1e8f, 9e8f})
        for (const glm::vec3& target : {glm::vec3(960, -1280, 7), glm::vec3(1280, -960, 7)}) {
            Camera camera;
            camera.positionWorld = {away, -away / 3, away / 7};
            camera.forward = glm::vec3(glm::normalize(glm::dvec3(target)));
            const std::string text = cameraText(camera);
            const Camera again = cameraFromText(text);
            EXPECT_EQ(again.positionWorld, camera.positionWorld) << text;
            EXPECT_LT(glm::distance(again.forward, camera.forward), 1e-7f) << text;
            EXPECT_EQ(cameraText(again), text);
        }
    // A user's numbers that floats do not tell apart.
    EXPECT_EQ(cameraFromText("100000003,0,0,100000003,0,-1").forward, glm::vec3(0, 0, -1));
    EXPECT_EQ(cameraText(cameraFromText("1,2,3,1,2,-4")).substr(0, 11), "1,2,3,1,2,2");
}

// Squares of such distances are not numbers.
TEST(CameraText, ATargetMayBeAsNearAsNumbersAre) {
    for (const char* distance : {"1e-22", "3e-23", "1e-38", "1e-60", "1e-300"}) {
        const Camera camera = cameraFromText(std::string("0,0,0,") + distance + ",0,0");
        EXPECT_EQ(camera.forward, glm::vec3(1, 0, 0)) << distance;
        EXPECT_NEAR(glm::length(camera.up), 1, 1e-6f) << distance;
    }
    EXPECT_THAT(cameraRefusal("1,2,3,1,2,3"), HasSubstr("the same point"));
}

// Near the vertical nothing turns over: as of a camera that looks along -z and tilts.
TEST(CameraText, LooksStraightDownAsOneThatTiltsDown) {
    for (const char* z : {"3", "0.2", "0.001", "0"})
        EXPECT_NEAR(glm::distance(cameraFromText(std::string("0,12,") + z + ",0,0,0").up,
                                  glm::normalize(glm::vec3(0, std::stof(z), -12))),
                    0, 1e-5f)
            << z;
    EXPECT_NEAR(glm::distance(cameraFromText("0,0,0,0,5,0").up, glm::vec3(0, 0, 1)), 0, 1e-6f);
}

TEST(CameraText, PlanesDifferAsFloats) {
    EXPECT_THAT(cameraRefusal("0,0,0,1,0,0,60,1e-60,1"), HasSubstr("0 < near < far"));
    EXPECT_THAT(cameraRefusal("0,0,0,1,0,0,60,1,1.00000000001"), HasSubstr("0 < near < far"));
}

} // namespace
} // namespace shadowdag
