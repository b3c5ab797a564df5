// SPDX-License-Identifier: Apache-2.0
// The parts of a truth ray and of its test against a triangle, in double. truth_ray.h combines
// them. A leaf text (gl/leaf.h).
#pragma once

#include "gl/leaf.h"

SDAG_LEAF_BEGIN

/// 2^-24, half an ulp of 1.0f.
SDAG_CONST double kHalfUlp = 1.0f / 16777216.0f;

SDAG_LEAF double lengthOf(SDAG_IN(dvec3) v) {
    return squareRoot(dotInOrder(v, v));
}

SDAG_LEAF dvec3 unitOf(SDAG_IN(dvec3) v) {
    SDAG_EXACT double inverse = 1.0f / squareRoot(dotInOrder(v, v));
    SDAG_EXACT dvec3 u = v * inverse;
    return u;
}

/// A receiver's triangle, and per edge a unit vector in the plane, towards the triangle.
struct ReceiverEdges {
    dvec3 corner[3];
    dvec3 inward[3];
    double inwardOffset[3];
};

/// Sets what follows from the corners. @param across normal of any length, not 0
SDAG_LEAF void setInward(SDAG_INOUT(ReceiverEdges) e, SDAG_IN(dvec3) across) {
    for (int i = 0; i < 3; ++i) {
        SDAG_EXACT dvec3 edge = e.corner[(i + 1) % 3] - e.corner[i];
        e.inward[i] = unitOf(crossInOrder(across, edge));
        e.inwardOffset[i] = dotInOrder(e.inward[i], e.corner[i]);
    }
}

SDAG_LEAF double insideEdge(SDAG_IN(ReceiverEdges) e, int edge, SDAG_IN(dvec3) p) {
    SDAG_EXACT double inside = dotInOrder(e.inward[edge], p) - e.inwardOffset[edge];
    return inside;
}

/// Returns the point moved within the plane until it is at least c inside all three edges; the
/// incentre where the triangle is too narrow for that. Where an edge meets another room's wall, a
/// sample that rounding put behind the wall comes back.
SDAG_LEAF dvec3 moveInside(SDAG_IN(ReceiverEdges) e, double c, SDAG_IN(dvec3) from) {
    if (insideEdge(e, 0, from) >= c && insideEdge(e, 1, from) >= c && insideEdge(e, 2, from) >= c)
        return from;
    SDAG_EXACT dvec3 p = from;
    // Twice, because at a corner the second edge pushes back over the first; right and obtuse
    // corners are then done.
    for (int pass = 0; pass < 2; ++pass)
        for (int i = 0; i < 3; ++i)
            p += e.inward[i] * greater(c - insideEdge(e, i, p), double(0.0f));
    SDAG_EXACT double slack = double(1.0f) / double(1000.0f) * c;
    if (insideEdge(e, 0, p) >= c - slack && insideEdge(e, 1, p) >= c - slack &&
        insideEdge(e, 2, p) >= c - slack)
        return p;
    // An acute corner: the point c from both its edges lies on the bisector, c / inradius of the
    // way to the incentre.
    double side[3]; // opposite to corner i
    for (int i = 0; i < 3; ++i)
        side[i] = lengthOf(e.corner[(i + 2) % 3] - e.corner[(i + 1) % 3]);
    SDAG_EXACT dvec3 incentre =
        (side[0] * e.corner[0] + side[1] * e.corner[1] + side[2] * e.corner[2]) /
        (side[0] + side[1] + side[2]);
    int nearest = 0;
    for (int i = 1; i < 3; ++i)
        if (lengthOf(e.corner[i] - p) < lengthOf(e.corner[nearest] - p))
            nearest = i;
    double inradius = insideEdge(e, 0, incentre);
    SDAG_EXACT dvec3 moved = e.corner[nearest] + (incentre - e.corner[nearest]) *
                                                     (inradius > c ? c / inradius : double(1.0f));
    return moved;
}

/// Returns c of the head of truth.h. @param largest coordinate of the receiver and its sample
SDAG_LEAF double clearanceOf(double largest, double diagonal) {
    double fine = 4.0f * kHalfUlp, coarse = 16.0f * kHalfUlp; // powers of two: exact
    SDAG_EXACT double c = fine * largest + coarse * diagonal;
    return c;
}

/// Returns the axis of the largest magnitude.
SDAG_LEAF int largestAxis(SDAG_IN(dvec3) v) {
    dvec3 size = magnitude(v);
    return size.x >= size.y ? (size.x >= size.z ? 0 : 2) : (size.y >= size.z ? 1 : 2);
}

/// Returns the end of a ray of that length: hits nearer than it count, 0: none does.
SDAG_LEAF float rayEndOf(double distance, double clearance) {
    return distance > clearance ? float(1.0f - 16.0f * kHalfUlp) : 0.0f;
}

/// Returns whether the line along `way` passes through a triangle. Watertight: the sides of an edge
/// that two triangles share are the same number with opposite signs, and a line through the edge
/// itself passes through both.
/// @param a,b,c corners relative to a point of the line
/// @param weights of the corners at the crossing, in any common unit and sign
SDAG_LEAF bool passesThrough(SDAG_IN(dvec3) way, SDAG_IN(dvec3) a, SDAG_IN(dvec3) b,
                             SDAG_IN(dvec3) c, SDAG_OUT(dvec3) weights) {
    // On which side of an edge the line passes: the volume of (way, the edge's ends), which is the
    // weight of the corner across from it.
    double ab = dotInOrder(way, crossInOrder(a, b)), bc = dotInOrder(way, crossInOrder(b, c));
    weights = dvec3(bc, 0.0f, ab);
    if ((ab < 0.0f && bc > 0.0f) || (ab > 0.0f && bc < 0.0f))
        return false;
    double ca = dotInOrder(way, crossInOrder(c, a));
    weights.y = ca;
    return !((ca < 0.0f && (ab > 0.0f || bc > 0.0f)) || (ca > 0.0f && (ab < 0.0f || bc < 0.0f)));
}

/// Returns where the ray crosses the triangle's plane; -1 where they are parallel. The differences
/// of floats are exact or off by 2^-53 relative, so is what follows to a few of those.
SDAG_LEAF double crossingOf(SDAG_IN(dvec3) start, SDAG_IN(dvec3) way, SDAG_IN(dvec3) v0,
                            SDAG_IN(dvec3) v1, SDAG_IN(dvec3) v2) {
    SDAG_EXACT dvec3 side1 = v1 - v0, side2 = v2 - v0, fromStart = v0 - start;
    dvec3 normal = crossInOrder(side1, side2);
    double along = dotInOrder(normal, way);
    if (along == 0.0f)
        return double(-1.0f);
    SDAG_EXACT double t = dotInOrder(normal, fromStart) / along;
    return t;
}

SDAG_LEAF_END
