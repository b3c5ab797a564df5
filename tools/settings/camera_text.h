// SPDX-License-Identifier: Apache-2.0
// The numeric text form of a camera, as --camera takes it.
#pragma once

#include "scenes/camera.h"

#include <string>

namespace shadowdag {

/// Returns the camera of px,py,pz,tx,ty,tz[,fovDegrees[,near,far[,rollDegrees]]], the form that
/// --camera takes. Throws Error kUsage naming the error.
Camera cameraFromText(const std::string& text);

/// Returns that text of a camera, with all ten numbers. Reading it gives the same camera up to
/// rounding.
std::string cameraText(const Camera& camera);

} // namespace shadowdag
