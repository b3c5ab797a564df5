// SPDX-License-Identifier: Apache-2.0
#include "hybrid/judge/smooth_patch.h"

#include "scenes/triangle_tree.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

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

/// A corner of a triangle in a list, ordered by its place. Negative zero is zero.
struct Corner {
    std::array<float, 3> at;
    uint32_t triangle = 0; ///< its index in the list

    Corner(const glm::vec3& p, uint32_t index)
        : at{p.x + 0.0f, p.y + 0.0f, p.z + 0.0f}, triangle(index) {}
    bool operator<(const Corner& other) const { return at < other.at; }
};

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
    // By corners, so that the time grows with the triangles within the radius, times the logarithm.
    std::vector<Corner> corners;
    corners.reserve(3 * others.size());
    for (uint32_t i = 0; i < others.size(); ++i)
        for (const glm::vec3& p : cornersOf(triangles, others[i]))
            corners.emplace_back(p, i);
    std::sort(corners.begin(), corners.end());
    std::vector<bool> isTaken(others.size()), isAsked(corners.size()); // by the first at a place
    for (size_t next = 0; next < patch.size(); ++next)
        for (const glm::vec3& p : cornersOf(triangles, patch[next])) {
            const auto [first, last] =
                std::equal_range(corners.begin(), corners.end(), Corner(p, 0));
            if (first == last || isAsked[size_t(first - corners.begin())])
                continue;
            isAsked[size_t(first - corners.begin())] = true;
            for (auto found = first; found != last; ++found)
                if (!isTaken[found->triangle]) {
                    isTaken[found->triangle] = true;
                    patch.push_back(others[found->triangle]);
                }
        }
    return patch;
}

} // namespace shadowdag
