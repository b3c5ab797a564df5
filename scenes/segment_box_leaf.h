// SPDX-License-Identifier: Apache-2.0
// The slab test of a segment against any box, in double. segment_box.h states its guarantees. A
// leaf text (gl/leaf.h).
#pragma once

#include "gl/leaf.h"

SDAG_LEAF_BEGIN

/// 2^-44 of the segment's largest coordinate: the growth of boxes.
SDAG_CONST double kBoxSlack = 1.0f / 17592186044416.0f;
/// 2^100. An axis along which the segment does not change has its eighth power as inverse: any huge
/// finite number works, unlike infinity, because 0 times infinity is NaN.
SDAG_CONST double kHuge = 1267650600228229401496703205376.0f;

/// A segment prepared for tests of boxes.
struct BoxSlabs {
    dvec3 from, inverse;
    double slack;
};

/// Returns 1 / way, or `huge` where that would be larger.
SDAG_LEAF double boundedInverse(double way, double huge) {
    return magnitude(way) > 1.0f / huge ? 1.0f / way : huge;
}

SDAG_LEAF BoxSlabs makeBoxSlabs(SDAG_IN(dvec3) from, SDAG_IN(dvec3) to) {
    BoxSlabs s;
    s.from = from;
    double huge4 = kHuge * kHuge * kHuge * kHuge, huge = huge4 * huge4;
    double largest = 0.0f;
    for (int a = 0; a < 3; ++a)
        largest = greater(greater(largest, magnitude(from[a])), magnitude(to[a]));
    SDAG_EXACT dvec3 way = to - from;
    s.inverse = dvec3(boundedInverse(way.x, huge), boundedInverse(way.y, huge),
                      boundedInverse(way.z, huge));
    SDAG_EXACT double slack = largest * kBoxSlack;
    s.slack = slack;
    return s;
}

/// Returns whether the closed segment touches the closed box, grown by so much to both sides of
/// each axis; may be true for a box that it passes within the slack. Never for an empty box.
SDAG_LEAF bool touchesBox(SDAG_IN(BoxSlabs) s, SDAG_IN(vec3) least, SDAG_IN(vec3) most,
                          SDAG_IN(dvec3) grown) {
    double enter = 0.0f, leave = 1.0f;
    for (int a = 0; a < 3; ++a) {
        SDAG_EXACT double t0 = (double(least[a]) - (s.slack + grown[a]) - s.from[a]) * s.inverse[a];
        SDAG_EXACT double t1 = (double(most[a]) + (s.slack + grown[a]) - s.from[a]) * s.inverse[a];
        double nearer = t0 < t1 ? t0 : t1, farther = t0 < t1 ? t1 : t0;
        enter = nearer > enter ? nearer : enter;
        leave = farther < leave ? farther : leave;
    }
    return enter <= leave && !(least.x > most.x);
}

SDAG_LEAF_END
