// SPDX-License-Identifier: Apache-2.0
// A segment against boxes, in double, never missing a box that it touches.
#pragma once

#include "scenes/box.h"

#include <cmath>

namespace shadowdag {

/// A segment made ready for boxes. Boxes are grown by 2^-44 of the segment's largest coordinate,
/// which is more than all rounding: of the ends, of a plane's distance and of its product with the
/// inverse, each a few 2^-53 of that coordinate while the time of a plane is within [0, 1], and
/// outside of it the sign is not in doubt.
class BoxSegment {
public:
    /// @param from, to finite, as large as floats are
    SDAG_HD BoxSegment(const glm::dvec3& from, const glm::dvec3& to) : from_(from) {
        double largest = 0;
        for (int a = 0; a < 3; ++a) {
            const double way = to[a] - from[a];
            // An axis along which nothing changes: any huge inverse, as 0 times infinity is none.
            inverse_[a] = fabs(way) > 1e-250 ? 1.0 / way : 1e250;
            largest = fabs(from[a]) > largest ? fabs(from[a]) : largest;
            largest = fabs(to[a]) > largest ? fabs(to[a]) : largest;
        }
        slack_ = largest * 5.684341886080802e-14;
    }

    /// Returns whether the closed segment touches the closed box; may say so of a box that it
    /// passes within the slack. Never for an empty box.
    SDAG_HD bool touches(const Box& box) const {
        double enter = 0.0, leave = 1.0;
        for (int a = 0; a < 3; ++a) {
            const double t0 = (double(box.min[a]) - slack_ - from_[a]) * inverse_[a];
            const double t1 = (double(box.max[a]) + slack_ - from_[a]) * inverse_[a];
            const double nearer = t0 < t1 ? t0 : t1, farther = t0 < t1 ? t1 : t0;
            enter = nearer > enter ? nearer : enter;
            leave = farther < leave ? farther : leave;
        }
        return enter <= leave && !(box.min.x > box.max.x);
    }

private:
    glm::dvec3 from_, inverse_;
    double slack_;
};

} // namespace shadowdag
