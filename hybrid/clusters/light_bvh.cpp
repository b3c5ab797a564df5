// SPDX-License-Identifier: Apache-2.0
// Builds the hierarchy over the lights' spheres.
#include "hybrid/clusters/light_bvh.h"

#include <cmath>
#include <limits>

namespace shadowdag {

Box sphereBox(const Light& light) {
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    Box box;
    // The sphere of a directional light, which contains the scene with a margin, is needed only for
    // the order of the boxes.
    for (int axis = 0; axis < 3; ++axis) {
        box.min[axis] = std::nextafter(light.positionWorld[axis] - light.rangeWorld, -kInfinity);
        box.max[axis] = std::nextafter(light.positionWorld[axis] + light.rangeWorld, kInfinity);
    }
    return box;
}

WideBvh buildLightBvh(const std::vector<Light>& lights) {
    std::vector<Box> boxes;
    boxes.reserve(lights.size());
    for (const Light& light : lights)
        boxes.push_back(sphereBox(light));
    WideBvh bvh;
    bvh.build(viewOf(boxes));
    return bvh;
}

} // namespace shadowdag
