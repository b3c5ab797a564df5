// SPDX-License-Identifier: Apache-2.0
// A hierarchy over triangles for the few hundred thousand rays and distances by which lights and
// cameras are placed. Neither fast nor watertight: shadows and truth have their own tracers.
#pragma once

#include "scenes/world.h"

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

namespace shadowdag {

/// Returns the point of a triangle nearest to p; corner a where the triangle has no area. Source:
/// Ericson, Real-Time Collision Detection, 2005, sec. 5.1.5.
glm::vec3 closestPoint(const glm::vec3& p, const glm::vec3& a, const glm::vec3& b,
                       const glm::vec3& c);

/// Returns the squared distance of a point from triangle `t`.
float distanceSquared(const TriangleView& triangles, uint32_t t, const glm::vec3& p);

/// What queries took. A step is a node that was visited or a triangle that was tested.
struct QueryCost {
    uint64_t queryCount = 0, stepCount = 0;
    uint64_t cutCount = 0; ///< queries that were ended at their limit of steps
    QueryCost& operator+=(const QueryCost& other) {
        queryCount += other.queryCount;
        stepCount += other.stepCount;
        cutCount += other.cutCount;
        return *this;
    }
};

/// Warns (scenes/warning.h) if queries were cut. @param what was placed by them, such as "lights"
void warnOfCutQueries(const QueryCost& cost, const std::string& what);

/// The same results on every machine: only add, multiply, divide and square root. A binary tree
/// over the triangles in Morton order, each node of it half of its parent's: building costs n log n
/// and memory n for any input, and triangles that coincide corner by corner are kept once.
/// Queries count what they take, so a tree answers one thread at a time. Where thousands of
/// triangles lie in the way whose boxes overlap, as in piles, fans and crowds of long ones, no
/// order of the tree leaves most of them out: a query ends after kMaxQuerySteps, whatever it has
/// found.
class TriangleTree {
public:
    /// Twice what the most expensive query of the built-in scenes takes, or more; their mean is
    /// below 512.
    static constexpr uint32_t kMaxQuerySteps = 4096, kFewQuerySteps = 512;
    static constexpr uint32_t kMaxLongCuts = 4096;

    /// Copies nothing: the triangles must outlive the tree and not move. @param bounds encloses
    /// them. Throws the exceptions of pollCpu.
    TriangleTree(TriangleView triangles, const Box& bounds);

    struct Hit {
        float distance;        ///< along the ray, world units; infinity: nothing was hit
        bool isFrontFace;      ///< the corners turn counter-clockwise as seen from the origin
        uint32_t triangle = 0; ///< which was hit, the first of several; 0 when none was
    };
    /// Returns the first triangle along a ray that is nearer than `reach`. @param direction unit.
    /// Rays through edges may miss. If the query is cut, the first of those that it tested.
    Hit trace(const glm::vec3& origin, const glm::vec3& direction,
              float reach = std::numeric_limits<float>::infinity()) const;

    /// Returns whether trace(origin, direction, reach) hits something, for less: any hit will do.
    /// True if the query is cut, because so many triangles are seldom seen through.
    bool isBlocked(const glm::vec3& origin, const glm::vec3& direction, float reach) const;

    /// Returns the distance from a point to the nearest triangle, or `limit` when none is nearer.
    /// If the query is cut, to the nearest of those that it tested.
    float distance(const glm::vec3& point, float limit) const;

    /// Returns how many different triangles there are.
    size_t distinctCount() const { return items_.size(); }
    /// Returns the sum over all queries so far.
    const QueryCost& cost() const { return cost_; }

private:
    struct Node {
        Box box;
        uint32_t first;
        uint32_t count; ///< of items_ from first; 0: children are the next node and node `first`
    };
    Box boxOf(uint32_t triangle) const;
    void dropCoincident(const std::vector<uint64_t>& codes);
    uint32_t build(uint32_t begin, uint32_t end);
    template <class Bound, class Beyond, class Test>
    bool visit(const Bound& bound, const Beyond& isBeyond, const Test& test) const;

    TriangleView triangles_;
    std::vector<uint32_t> items_; // triangles in the order of the leaves
    std::vector<Node> nodes_;     // a parent before its children
    mutable QueryCost cost_;
};

} // namespace shadowdag
