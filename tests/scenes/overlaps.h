// SPDX-License-Identifier: Apache-2.0
// Crowds of triangles whose boxes overlap, in which no hierarchy of boxes leaves most of them out.
#pragma once

#include "scenes/scene.h"

#include <cmath>
#include <random>

namespace shadowdag::test {

enum class Overlap {
    kPile,    ///< one triangle, each copy moved by 1e-7 from the last
    kFan,     ///< a disc around one corner, tilted
    kAxis,    ///< all cross in one line
    kSlivers, ///< long and thin ones, from anywhere to anywhere
};

/// Adds `count` triangles to a mesh, between (0, 0, 0) and (8, 3, 5).
inline void addOverlap(Mesh& mesh, Overlap kind, uint32_t count) {
    std::mt19937 random(1);
    std::uniform_real_distribution<float> uniform(0.0f, 1.0f);
    const auto anywhere = [&] {
        const float x = uniform(random), y = uniform(random), z = uniform(random);
        return glm::vec3(7.9f * x, 2.9f * y, 4.9f * z);
    };
    const auto around = [](float turn) { // a circle of radius 2 that leans
        const float angle = 6.2831853f * turn;
        return glm::vec3(4, 1, 2.5f) +
               2.0f * glm::vec3(std::cos(angle), 0.2f * std::cos(angle), std::sin(angle));
    };
    for (uint32_t i = 0; i < count; ++i) {
        const float part = float(i) / float(count);
        glm::vec3 a(1, 0.5f, 1), b(7, 1.5f, 1), c(1, 1, 4);
        if (kind == Overlap::kPile) {
            const glm::vec3 moved(0, 1e-7f * float(i), 0);
            a += moved;
            b += moved;
            c += moved;
        } else if (kind == Overlap::kFan) {
            a = {4, 1, 2.5f};
            b = around(part + 1.0f / float(count));
            c = around(part);
        } else if (kind == Overlap::kAxis) {
            const glm::vec3 out(std::cos(3.1415927f * part), std::sin(3.1415927f * part), 0);
            a = glm::vec3(4, 1.5f, 0.5f) - out;
            b = glm::vec3(4, 1.5f, 0.5f) + out;
            c = {4, 1.5f, 4.5f};
        } else {
            a = anywhere();
            b = anywhere();
            c = b + glm::vec3(5e-4f, 1e-3f, -5e-4f);
        }
        const auto first = uint32_t(mesh.positions.size());
        mesh.positions.insert(mesh.positions.end(), {a, b, c});
        mesh.triangles.emplace_back(first, first + 1, first + 2);
        mesh.triangleMaterial.push_back(0);
    }
}

} // namespace shadowdag::test
