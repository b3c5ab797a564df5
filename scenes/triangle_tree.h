// SPDX-License-Identifier: Apache-2.0
// A hierarchy over triangles for the few hundred thousand rays and distances by which lights and
// cameras are placed. Neither fast nor watertight: shadows and truth have their own tracers.
#pragma once

#include "scenes/world.h"

#include <cstdint>
#include <vector>

namespace shadowdag {

/// Returns the point of a triangle nearest to p; corner a where the triangle has no area. Source:
/// Ericson, Real-Time Collision Detection, 2005, sec. 5.1.5.
glm::vec3 closestPoint(const glm::vec3& p, const glm::vec3& a, const glm::vec3& b,
                       const glm::vec3& c);

/// The same results on every machine: only add, multiply, divide and square root. A binary tree
/// over the triangles in Morton order, each node of it half of its parent's: building costs n log n
/// and memory n for any input, and triangles that coincide corner by corner are kept once.
class TriangleTree {
public:
    /// Copies nothing: the triangles must outlive the tree and not move. @param bounds encloses
    /// them. Throws the exceptions of pollCpu.
    TriangleTree(TriangleView triangles, const Box& bounds);

    struct Hit {
        float distance;        ///< along the ray, world units; infinity: nothing was hit
        bool isFrontFace;      ///< the corners turn counter-clockwise as seen from the origin
        uint32_t triangle = 0; ///< which was hit, the first of several; 0 when none was
    };
    /// Returns the first triangle along a ray. @param direction unit. Rays through edges may miss.
    Hit trace(const glm::vec3& origin, const glm::vec3& direction) const;

    /// Returns the distance from a point to the nearest triangle, or `limit` when none is nearer.
    float distance(const glm::vec3& point, float limit) const;

    /// Returns how many different triangles there are.
    size_t distinctCount() const { return items_.size(); }

private:
    struct Node {
        Box box;
        uint32_t first;
        uint32_t count; ///< of items_ from first; 0: children are the next node and node `first`
    };
    Box boxOf(uint32_t triangle) const;
    void dropCoincident(const std::vector<uint64_t>& codes);
    uint32_t build(uint32_t begin, uint32_t end);

    TriangleView triangles_;
    std::vector<uint32_t> items_; // triangles in the order of the leaves
    std::vector<Node> nodes_;     // a parent before its children
};

} // namespace shadowdag
