// SPDX-License-Identifier: Apache-2.0
// The hierarchy over the lights' spheres.
#pragma once

#include "scenes/light.h"
#include "scenes/wide_bvh.h"

#include <vector>

namespace shadowdag {

/// Returns the box of a light's sphere, rounded outwards.
Box sphereBox(const Light& light);

/// Returns the hierarchy over the sphere boxes of all lights. Cost: linear but for the sort; it is
/// built anew when lights move.
WideBvh buildLightBvh(const std::vector<Light>& lights);

} // namespace shadowdag
