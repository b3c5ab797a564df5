// SPDX-License-Identifier: Apache-2.0
// Axis-aligned boxes, closed on all sides.
#pragma once

#include "cuda/macros.h"

#include <glm/glm.hpp>

#include <limits>

namespace shadowdag {

/// A closed axis-aligned box; empty when min > max on any axis, which is how it starts.
struct Box {
    glm::vec3 min{std::numeric_limits<float>::infinity()};
    glm::vec3 max{-std::numeric_limits<float>::infinity()};

    SDAG_HD bool empty() const { return min.x > max.x || min.y > max.y || min.z > max.z; }
    SDAG_HD glm::vec3 center() const { return (min + max) * 0.5f; }
    SDAG_HD glm::vec3 extent() const { return max - min; }
    SDAG_HD void add(const glm::vec3& p) {
        min = glm::min(min, p);
        max = glm::max(max, p);
    }
    SDAG_HD void add(const Box& b) {
        min = glm::min(min, b.min);
        max = glm::max(max, b.max);
    }
    SDAG_HD bool operator==(const Box& b) const { return min == b.min && max == b.max; }
};

/// Returns whether two closed boxes share a point.
SDAG_HD inline bool overlaps(const Box& a, const Box& b) {
    return a.min.x <= b.max.x && b.min.x <= a.max.x && a.min.y <= b.max.y && b.min.y <= a.max.y &&
           a.min.z <= b.max.z && b.min.z <= a.max.z;
}

/// Returns whether all of `inner` lies in `outer`, sides included. False where a side is no number.
SDAG_HD inline bool contains(const Box& outer, const Box& inner) {
    return outer.min.x <= inner.min.x && outer.min.y <= inner.min.y && outer.min.z <= inner.min.z &&
           inner.max.x <= outer.max.x && inner.max.y <= outer.max.y && inner.max.z <= outer.max.z;
}

/// Returns the squared distance from a point to the nearest point of the box; 0 inside.
SDAG_HD inline float distanceSquared(const Box& b, const glm::vec3& p) {
    const glm::vec3 d = glm::max(glm::max(b.min - p, p - b.max), glm::vec3(0.0f));
    return glm::dot(d, d);
}

} // namespace shadowdag
