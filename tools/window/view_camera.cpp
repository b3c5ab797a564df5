// SPDX-License-Identifier: Apache-2.0
#include "tools/window/view_camera.h"

#include "tools/settings/camera_text.h"

#include <glm/gtc/constants.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace shadowdag {

namespace {

/// A view straight up has no horizontal right axis; at this angle from it cameraFromText still has
/// one.
constexpr double kSteepest = 1.5;

/// Less roll than this is treated as none: half a picture of 1000 pixels moves by 0.005 of a pixel.
constexpr double kLeastRoll = 1e-5;

glm::dvec3 directionOf(double yaw, double pitch) {
    return {-std::sin(yaw) * std::cos(pitch), std::sin(pitch), -std::cos(yaw) * std::cos(pitch)};
}

glm::dvec3 levelRightOf(double yaw) {
    return {std::cos(yaw), 0.0, -std::sin(yaw)};
}

} // namespace

FlyCamera::FlyCamera(const Camera& camera)
    : position_(camera.positionWorld), yaw_(std::atan2(-camera.forward.x, -camera.forward.z)),
      pitch_(std::clamp(std::asin(std::clamp(double(camera.forward.y), -1.0, 1.0)), -kSteepest,
                        kSteepest)),
      yfov_(camera.yfov), znear_(camera.znear), zfar_(camera.zfar) {
    const glm::dvec3 right = levelRightOf(yaw_), up = glm::cross(right, directionOf(yaw_, pitch_));
    roll_ = std::atan2(glm::dot(glm::dvec3(camera.up), right), glm::dot(glm::dvec3(camera.up), up));
}

void FlyCamera::step(const FlyInput& input, double seconds, double metresPerSecond,
                     double radiansPerPixel) {
    // The mouse's movement in the level frame: the picture's right is cos r right - sin r up, its
    // up cos r up + sin r right.
    const double c = std::cos(roll_), s = std::sin(roll_);
    const double turnRight = c * double(input.turn.x) - s * double(input.turn.y);
    const double turnDown = s * double(input.turn.x) + c * double(input.turn.y);
    yaw_ = std::remainder(yaw_ - turnRight * radiansPerPixel, glm::two_pi<double>());
    pitch_ = std::clamp(pitch_ - turnDown * radiansPerPixel, -kSteepest, kSteepest);
    const glm::dvec3 forward = directionOf(yaw_, pitch_), level = levelRightOf(yaw_);
    const glm::dvec3 right = c * level - s * glm::cross(level, forward);
    const double way = seconds * metresPerSecond * (input.isFast ? 4.0 : 1.0);
    position_ += (right * double(input.along.x) + glm::dvec3(0, 1, 0) * double(input.along.y) +
                  forward * double(input.along.z)) *
                 way;
}

std::string FlyCamera::text() const {
    std::string text = viewText(position_, directionOf(yaw_, pitch_));
    char number[32];
    const auto append = [&](double value) {
        std::snprintf(number, sizeof number, ",%.9g", value);
        text += number;
    };
    append(std::clamp(glm::degrees(yfov_), kLeastDegrees, kMostDegrees));
    append(double(znear_));
    append(double(zfar_));
    if (std::abs(roll_) >= kLeastRoll)
        append(glm::degrees(roll_));
    return text;
}

double flySpeed(float sceneDiagonalWorld) {
    return std::max(double(sceneDiagonalWorld) / 10.0, 1e-3);
}

} // namespace shadowdag
