// SPDX-License-Identifier: Apache-2.0
// A scene with fewer of its lights, for tests whose time goes into shadow maps.
#pragma once

#include "scenes/scene.h"

namespace shadowdag::test {

/// Returns how many lights are placed.
inline uint32_t lightCount(const Scene& scene) {
    uint32_t count = 0;
    for (const Node& node : scene.nodes)
        count += node.light != kNone;
    return count;
}

/// Returns the scene with every n-th of its lights, static and moving ones alike.
inline Scene withEveryNthLight(Scene scene, uint32_t n) {
    uint32_t index = 0;
    for (Node& node : scene.nodes)
        if (node.light != kNone && index++ % n != 0)
            node.light = kNone;
    return scene;
}

} // namespace shadowdag::test
