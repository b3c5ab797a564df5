// SPDX-License-Identifier: Apache-2.0
// Tests a segment against boxes, in double; never misses a box that the segment touches.
#pragma once

#include "scenes/box.h"
#include "scenes/segment_box_leaf.h"

#include <cmath>

namespace shadowdag {

/// A segment prepared for tests of boxes. Boxes are grown by 2^-44 of the segment's largest
/// coordinate, which is more than all rounding: of the ends, of a plane's distance and of its
/// product with the inverse, each a few 2^-53 of that coordinate while the time of a plane is
/// within [0, 1]; outside of it the sign is certain.
class BoxSegment {
public:
    /// @param from, to finite, as large as floats are
    SDAG_HD BoxSegment(const glm::dvec3& from, const glm::dvec3& to)
        : slabs_(makeBoxSlabs(from, to)) {}

    /// Returns whether the closed segment touches the closed box; may be true for a box that it
    /// passes within the slack. Never for an empty box.
    SDAG_HD bool touches(const Box& box) const { return touches(box, glm::dvec3(0.0)); }

    /// Returns the same of the box grown by so much to both sides of each axis.
    /// @param grown >= 0, world units
    SDAG_HD bool touches(const Box& box, const glm::dvec3& grown) const {
        return touchesBox(slabs_, box.min, box.max, grown);
    }

private:
    BoxSlabs slabs_;
};

/// Segments from anywhere in one box to anywhere in another against boxes, in double: the bundle
/// touches every box that one of them touches. A segment's point at a time is never farther, per
/// axis, from the point of the segment between the boxes' middles at that time than the larger of
/// the boxes' half extents, so that one segment is tested against grown boxes. 2^-40 of the largest
/// coordinate is added, which is more than rounding and than the growth by BoxSegment.
class BoxSegmentBundle {
public:
    /// @param fromMin, fromMax, toMin, toMax finite corners, min <= max
    SDAG_HD BoxSegmentBundle(const glm::dvec3& fromMin, const glm::dvec3& fromMax,
                             const glm::dvec3& toMin, const glm::dvec3& toMax)
        : middle_(0.5 * (fromMin + fromMax), 0.5 * (toMin + toMax)) {
        double largest = 0;
        for (int a = 0; a < 3; ++a) {
            const double from = 0.5 * (fromMax[a] - fromMin[a]), to = 0.5 * (toMax[a] - toMin[a]);
            grown_[a] = from < to ? to : from;
            const double corners[] = {fromMin[a], fromMax[a], toMin[a], toMax[a]};
            for (const double x : corners)
                largest = fabs(x) > largest ? fabs(x) : largest;
        }
        grown_ += glm::dvec3(largest * 9.094947017729282e-13);
    }

    /// Returns whether a segment of the bundle may touch the closed box. Never for an empty box.
    SDAG_HD bool touches(const Box& box) const { return middle_.touches(box, grown_); }

private:
    BoxSegment middle_;
    glm::dvec3 grown_;
};

} // namespace shadowdag
