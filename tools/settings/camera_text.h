// SPDX-License-Identifier: Apache-2.0
// A camera as --camera spells it in numbers.
#pragma once

#include "scenes/camera.h"

#include <string>

namespace shadowdag {

/// Returns the camera of px,py,pz,tx,ty,tz[,fovDegrees[,near,far[,rollDegrees]]]: what --camera
/// takes. Throws Error kUsage naming what is wrong with them.
Camera cameraFromText(const std::string& text);

} // namespace shadowdag
