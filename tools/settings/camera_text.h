// SPDX-License-Identifier: Apache-2.0
// The numeric text form of a camera, as --camera takes it.
#pragma once

#include "scenes/camera.h"

#include <string>

namespace shadowdag {

/// The vertical angles that the text takes: from a little less than kMinFieldOfView.
constexpr double kLeastDegrees = 0.057, kMostDegrees = 170;

/// Returns the camera of px,py,pz,tx,ty,tz[,fovDegrees[,near,far[,rollDegrees]]], the form that
/// --camera takes. Throws Error kUsage naming the error.
Camera cameraFromText(const std::string& text);

/// Returns px,py,pz,tx,ty,tz of a view: its position, of nine digits, and a target ahead, by a
/// metre or, far from the origin, by more, of as many digits as give the same direction in floats
/// when they are read.
/// @param forward unit
std::string viewText(const glm::dvec3& positionWorld, const glm::dvec3& forward);

/// Returns that text of a camera, with all ten numbers. Reading it gives the same position, the
/// same direction and planes, and the same up and angle up to rounding, anywhere within 1e9 m of
/// the origin.
std::string cameraText(const Camera& camera);

} // namespace shadowdag
