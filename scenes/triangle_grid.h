// SPDX-License-Identifier: Apache-2.0
// A uniform grid over triangles for the few thousand rays and distances by which lights and cameras
// are placed. Neither fast nor watertight: shadows and truth have their own tracers.
#pragma once

#include "scenes/world.h"

#include <cstdint>
#include <vector>

namespace shadowdag {

/// Returns the point of a triangle nearest to p; corner a where the triangle has no area. Source:
/// Ericson, Real-Time Collision Detection, 2005, sec. 5.1.5.
glm::vec3 closestPoint(const glm::vec3& p, const glm::vec3& a, const glm::vec3& b,
                       const glm::vec3& c);

/// The same results on every machine: only add, multiply, divide and square root.
class TriangleGrid {
public:
    /// Copies nothing: the triangles must outlive the grid and not move. @param bounds encloses
    /// them.
    TriangleGrid(TriangleView triangles, const Box& bounds);

    struct Hit {
        float distance;        ///< along the ray, world units; infinity: nothing was hit
        bool isFrontFace;      ///< the corners turn counter-clockwise as seen from the origin
        uint32_t triangle = 0; ///< which was hit; 0 when none was
    };
    /// Returns the first triangle along a ray. @param direction unit. Rays through edges may miss.
    Hit trace(const glm::vec3& origin, const glm::vec3& direction) const;

    /// Returns the distance from a point to the nearest triangle, or `limit` when none is nearer.
    float distance(const glm::vec3& point, float limit) const;

private:
    glm::ivec3 cellOf(const glm::vec3& p) const;
    size_t index(const glm::ivec3& cell) const {
        return (size_t(cell.z) * size_t(size_.y) + size_t(cell.y)) * size_t(size_.x) +
               size_t(cell.x);
    }

    TriangleView triangles_;
    Box bounds_;
    glm::ivec3 size_{1};
    glm::vec3 cellExtent_{1.0f};
    std::vector<uint32_t> cellStart_; // cellCount + 1; into items_
    std::vector<uint32_t> items_;
};

} // namespace shadowdag
