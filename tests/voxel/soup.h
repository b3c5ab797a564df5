// SPDX-License-Identifier: Apache-2.0
// Unconnected triangles for tests.
#pragma once

#include "scenes/world.h"

#include <random>
#include <vector>

namespace shadowdag {

struct Soup {
    std::vector<glm::vec3> positions;
    std::vector<glm::uvec3> triangles;
    std::vector<uint32_t> which;

    void add(const glm::vec3& a, const glm::vec3& b, const glm::vec3& c) {
        const uint32_t first = uint32_t(positions.size());
        which.push_back(uint32_t(triangles.size()));
        positions.insert(positions.end(), {a, b, c});
        triangles.emplace_back(first, first + 1, first + 2);
    }
    TriangleView view() const { return {viewOf(positions), viewOf(triangles)}; }
    View<const uint32_t> all() const { return viewOf(which); }
    Box bounds() const {
        Box box;
        for (const glm::vec3& p : positions)
            box.add(p);
        return box;
    }
};

/// Triangles in [-side, side]^3 of sizes from a hundredth of that to all of it.
inline Soup randomSoup(int count, float side, std::mt19937& random) {
    std::uniform_real_distribution<float> unit(-1, 1);
    const auto point = [&] { return glm::vec3(unit(random), unit(random), unit(random)); };
    Soup soup;
    for (int i = 0; i < count; ++i) {
        const glm::vec3 centre = point() * side;
        const float size = side * std::exp2(-6.5f * std::abs(unit(random)));
        glm::vec3 t[3];
        for (glm::vec3& p : t)
            p = glm::clamp(centre + point() * size, glm::vec3(-side), glm::vec3(side));
        soup.add(t[0], t[1], t[2]);
    }
    return soup;
}

} // namespace shadowdag
