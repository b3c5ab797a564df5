// SPDX-License-Identifier: Apache-2.0
// The question of a pair, as the adjudicator asks it: a family of segments, from any point of one
// box to any point of another. docs/adjudicator.md defines it and derives the boxes. Written from
// the documented geometry alone; it shares no code with the set-up of the truth's rays.
#pragma once

#include "scenes/light.h"
#include "scenes/world.h"

#include <limits>

namespace shadowdag {

/// A closed box of doubles; `center` is the undisturbed point, not always the middle.
struct PointBox {
    glm::dvec3 center{0.0}, low{0.0}, high{0.0};

    /// Returns corner 0..7: bit a of the index selects the high side of axis a.
    glm::dvec3 corner(int index) const {
        return {(index & 1 ? high : low).x, (index & 2 ? high : low).y, (index & 4 ? high : low).z};
    }
};

/// All segments that a pair may mean, world space.
struct SegmentFamily {
    PointBox start, end;
    uint32_t receiver = std::numeric_limits<uint32_t>::max(); ///< the triangle that never counts
    /// Whether the longest segments are, and whether the shortest are, longer than the receiver's
    /// clearance; others are free by definition.
    bool mayBeAsked = true, isSurelyAsked = true;
};

/// A pair as floats give it.
struct FloatPair {
    glm::vec3 sampleWorld, normalWorld; ///< normal: unit, on the light's side
    uint32_t receiver;                  ///< world triangle of the sample
};

/// Makes families of pairs.
class FamilyMaker {
public:
    /// @param triangles a copy of which outlives this
    explicit FamilyMaker(const TriangleView& triangles);

    /// Returns the family of a pair. A receiver that is so thin that its plane is unknown gives
    /// boxes as large as the scene.
    SegmentFamily make(const FloatPair& pair, const Light& light) const;

    /// Returns the diagonal of the bounds of all positions.
    double diagonal() const { return diagonal_; }

private:
    TriangleView triangles_;
    glm::dvec3 extent_{0.0}; ///< of the bounds
    double diagonal_ = 0;
};

/// Returns the family of one segment alone, with ends as given.
SegmentFamily exactSegment(const glm::dvec3& from, const glm::dvec3& to);

} // namespace shadowdag
