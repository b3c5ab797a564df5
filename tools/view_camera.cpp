// SPDX-License-Identifier: Apache-2.0
#include "tools/view_camera.h"

#include <glm/gtc/constants.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace shadowdag {

namespace {

/// Straight up has no right-hand side; this far from it cameraFromText still has one.
constexpr double kSteepest = 1.5;

glm::dvec3 directionOf(double yaw, double pitch) {
    return {-std::sin(yaw) * std::cos(pitch), std::sin(pitch), -std::cos(yaw) * std::cos(pitch)};
}

} // namespace

FlyCamera::FlyCamera(const Camera& camera)
    : position_(camera.positionWorld), yaw_(std::atan2(-camera.forward.x, -camera.forward.z)),
      pitch_(std::clamp(std::asin(std::clamp(double(camera.forward.y), -1.0, 1.0)), -kSteepest,
                        kSteepest)),
      yfov_(camera.yfov), znear_(camera.znear), zfar_(camera.zfar) {}

void FlyCamera::step(const FlyInput& input, double seconds, double metresPerSecond,
                     double radiansPerPixel) {
    yaw_ -= double(input.turn.x) * radiansPerPixel;
    yaw_ = std::remainder(yaw_, glm::two_pi<double>());
    pitch_ = std::clamp(pitch_ - double(input.turn.y) * radiansPerPixel, -kSteepest, kSteepest);
    const glm::dvec3 forward = directionOf(yaw_, pitch_);
    const glm::dvec3 right(std::cos(yaw_), 0.0, -std::sin(yaw_));
    const double way = seconds * metresPerSecond * (input.isFast ? 4.0 : 1.0);
    position_ += (right * double(input.along.x) + glm::dvec3(0, 1, 0) * double(input.along.y) +
                  forward * double(input.along.z)) *
                 way;
}

std::string FlyCamera::text() const {
    const glm::dvec3 target = position_ + directionOf(yaw_, pitch_);
    char text[256];
    std::snprintf(text, sizeof text, "%.9g,%.9g,%.9g,%.9g,%.9g,%.9g,%.9g,%.9g,%.9g", position_.x,
                  position_.y, position_.z, target.x, target.y, target.z,
                  std::clamp(glm::degrees(yfov_), 1.0, 170.0), double(znear_), double(zfar_));
    return text;
}

double flySpeed(float sceneDiagonalWorld) {
    return std::max(double(sceneDiagonalWorld) / 10.0, 1e-3);
}

} // namespace shadowdag
