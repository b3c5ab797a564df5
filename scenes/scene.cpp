// SPDX-License-Identifier: Apache-2.0
#include "scenes/scene.h"

#include <algorithm>
#include <cstdio>

namespace shadowdag {

std::string pointText(const glm::dvec3& p) {
    char text[96];
    std::snprintf(text, sizeof text, "(%g, %g, %g)", p.x, p.y, p.z);
    return text;
}

glm::dmat4 LocalTransform::parentFromLocalDouble() const {
    if (hasMatrix)
        return glm::dmat4(matrix);
    // The quaternion's matrix with the factor 2 / |q|^2 in place of 2, so that no root is needed.
    const double x = rotation.x, y = rotation.y, z = rotation.z, w = rotation.w;
    const double lengthSquared = x * x + y * y + z * z + w * w;
    const double f = lengthSquared > 0.0 ? 2.0 / lengthSquared : 0.0;
    const glm::dvec3 s(scale);
    glm::dmat4 m(1.0);
    m[0] =
        glm::dvec4(1.0 - f * (y * y + z * z), f * (x * y + w * z), f * (x * z - w * y), 0.0) * s.x;
    m[1] =
        glm::dvec4(f * (x * y - w * z), 1.0 - f * (x * x + z * z), f * (y * z + w * x), 0.0) * s.y;
    m[2] =
        glm::dvec4(f * (x * z + w * y), f * (y * z - w * x), 1.0 - f * (x * x + y * y), 0.0) * s.z;
    m[3] = glm::dvec4(glm::dvec3(translation), 1.0);
    return m;
}

float Scene::durationSeconds() const {
    float duration = 0.0f;
    for (const Animation& animation : animations)
        for (const AnimationChannel& channel : animation.channels)
            if (!channel.times.empty())
                duration = std::max(duration, channel.times.back());
    return duration;
}

} // namespace shadowdag
