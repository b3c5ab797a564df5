// SPDX-License-Identifier: Apache-2.0
#include "hybrid/judge/smooth_patch.h"

#include "scenes/triangle_tree.h"

#include <algorithm>
#include <array>

namespace shadowdag {

namespace {

using Corners = std::array<glm::vec3, 3>;

Corners cornersOf(const TriangleView& triangles, uint32_t triangle) {
    return {triangles.vertex(triangle, 0), triangles.vertex(triangle, 1),
            triangles.vertex(triangle, 2)};
}

glm::dvec3 crossOf(const Corners& c) {
    return glm::cross(glm::dvec3(c[1]) - glm::dvec3(c[0]), glm::dvec3(c[2]) - glm::dvec3(c[0]));
}

bool shareVertex(const Corners& a, const Corners& b) {
    return std::any_of(a.begin(), a.end(), [&](const glm::vec3& corner) {
        return std::find(b.begin(), b.end(), corner) != b.end();
    });
}

} // namespace

std::vector<uint32_t> smoothPatch(const Truth& truth, const TriangleView& triangles,
                                  uint32_t receiver, const glm::vec3& sampleWorld,
                                  double radiusWorld) {
    const glm::dvec3 normal = crossOf(cornersOf(triangles, receiver));
    std::vector<uint32_t> patch{receiver}, others;
    truth.forTrianglesNear(glm::dvec3(sampleWorld), radiusWorld, [&](uint32_t triangle) {
        const Corners c = cornersOf(triangles, triangle);
        const glm::dvec3 cross = crossOf(c);
        // Of a triangle without area, which has no plane, the product is 0.
        const bool isSmooth = std::fabs(glm::dot(cross, normal)) >=
                                  kSmoothCosine * glm::length(cross) * glm::length(normal) &&
                              glm::length(cross) > 0.0;
        if (triangle != receiver && isSmooth &&
            glm::length(glm::dvec3(closestPoint(sampleWorld, c[0], c[1], c[2])) -
                        glm::dvec3(sampleWorld)) <= radiusWorld)
            others.push_back(triangle);
    });
    for (size_t next = 0; next < patch.size(); ++next) {
        const Corners c = cornersOf(triangles, patch[next]);
        const auto isFar = [&](uint32_t other) {
            return !shareVertex(c, cornersOf(triangles, other));
        };
        const auto found = std::stable_partition(others.begin(), others.end(), isFar);
        patch.insert(patch.end(), found, others.end());
        others.erase(found, others.end());
    }
    return patch;
}

} // namespace shadowdag
