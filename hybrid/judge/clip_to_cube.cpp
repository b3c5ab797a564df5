// SPDX-License-Identifier: Apache-2.0
#include "hybrid/judge/clip_to_cube.h"

#include <utility>

namespace shadowdag {

std::vector<glm::dvec3> clipToCube(std::vector<glm::dvec3> polygon, const glm::dvec3& least,
                                   const glm::dvec3& most) {
    for (int plane = 0; plane < 6 && !polygon.empty(); ++plane) {
        const int axis = plane / 2;
        const bool isMost = plane % 2 == 1;
        const auto inside = [&](const glm::dvec3& p) {
            return isMost ? most[axis] - p[axis] : p[axis] - least[axis];
        };
        std::vector<glm::dvec3> kept;
        for (size_t i = 0; i < polygon.size(); ++i) {
            const glm::dvec3 a = polygon[i], b = polygon[(i + 1) % polygon.size()];
            const double insideA = inside(a), insideB = inside(b);
            if (insideA >= 0.0)
                kept.push_back(a);
            if ((insideA < 0.0) != (insideB < 0.0))
                kept.push_back(a + (b - a) * (insideA / (insideA - insideB)));
        }
        polygon = std::move(kept);
    }
    return polygon;
}

} // namespace shadowdag
