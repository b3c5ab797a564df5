// SPDX-License-Identifier: Apache-2.0
// The convex hull of a family of segments: what it surely misses. Part of the adjudicator.
#pragma once

#include "hybrid/judge/segment_family.h"

#include <span>

namespace shadowdag {

/// The points of all segments from one box to another: the hull of both boxes.
class FamilyHull {
public:
    FamilyHull(const PointBox& start, const PointBox& end)
        : start_(start), end_(end), way_(end.center - start.center) {}

    /// Returns whether a plane was found that strictly separates the hull from all points, which
    /// proves that it misses theirs. Tried are planes parallel to a pair of edges of both, and to
    /// the points' own plane; the order along a plane's normal is exact.
    bool misses(std::span<const glm::dvec3> points) const;

private:
    bool isSeparatedAlong(const glm::dvec3& axis, std::span<const glm::dvec3> points) const;

    PointBox start_, end_;
    glm::dvec3 way_;
};

} // namespace shadowdag
