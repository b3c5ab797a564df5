// SPDX-License-Identifier: Apache-2.0
// Derivations of the clearances: docs/adjudicator.md, "The family of a pair".
#include "hybrid/judge/segment_family.h"

#include <algorithm>
#include <cmath>

namespace shadowdag {

namespace {

constexpr double kHalfUlpOfFloat = 0x1p-24; ///< u
constexpr double kDoubleSlack = 0x1p-48;    ///< a few roundings of doubles, relative
constexpr double kEndCut = 16.0 * kHalfUlpOfFloat;

/// The receiver's plane and outline, in double.
struct Outline {
    glm::dvec3 corner[3];
    glm::dvec3 normal{0.0};    ///< unit, on the light's side
    glm::dvec3 inward[3] = {}; ///< unit, in the plane, of edge i from corner i
    bool hasArea = false;
    double normalError = 0; ///< bound of the normal's error, radians: slivers
    double inradius = 0;
    glm::dvec3 incentre{0.0};

    double inside(int edge, const glm::dvec3& p) const {
        return glm::dot(inward[edge], p - corner[edge]);
    }
    double height(const glm::dvec3& p) const { return glm::dot(normal, p - corner[0]); }
};

Outline outlineOf(const glm::dvec3 (&corner)[3], const glm::dvec3& sampleWorld,
                  const glm::dvec3& normalWorld) {
    Outline o;
    std::copy(corner, corner + 3, o.corner);
    const glm::dvec3 side1 = corner[1] - corner[0], side2 = corner[2] - corner[0];
    const glm::dvec3 cross = glm::cross(side1, side2);
    const double area = glm::length(cross);
    o.hasArea = area > 0.0;
    if (!o.hasArea) {
        o.normal = glm::normalize(normalWorld);
        std::fill(o.corner, o.corner + 3, sampleWorld);
        return o;
    }
    o.normal = glm::dot(cross, normalWorld) < 0.0 ? cross / -area : cross / area;
    o.normalError = kDoubleSlack * glm::length(side1) * glm::length(side2) / area;
    double length[3], perimeter = 0; // of the edge across from corner i
    for (int i = 0; i < 3; ++i) {
        o.inward[i] = glm::normalize(glm::cross(cross, corner[(i + 1) % 3] - corner[i]));
        length[i] = glm::distance(corner[(i + 1) % 3], corner[(i + 2) % 3]);
        perimeter += length[i];
    }
    o.incentre =
        (length[0] * corner[0] + length[1] * corner[1] + length[2] * corner[2]) / perimeter;
    o.inradius = area / perimeter;
    return o;
}

void include(PointBox& box, const glm::dvec3& p) {
    box.low = glm::min(box.low, p);
    box.high = glm::max(box.high, p);
}

void widen(PointBox& box, const glm::dvec3& by) {
    box.low -= by;
    box.high += by;
}

/// Returns where in the receiver's plane the segments start: the sample, or as far inside the
/// outline as is documented. Where two edges are near, any point that the documents allow.
PointBox insideOutline(const Outline& o, const glm::dvec3& sample, double c, double slack) {
    PointBox box{sample, sample, sample};
    if (!o.hasArea)
        return box;
    glm::dvec3 moved = sample;
    int nearCount = 0;
    for (int i = 0; i < 3; ++i)
        if (const double missing = c - o.inside(i, sample); missing > -slack) {
            ++nearCount;
            moved += o.inward[i] * std::max(missing, 0.0);
        }
    bool isInside = nearCount <= 1;
    if (nearCount == 1)
        for (int i = 0; i < 3; ++i)
            isInside &= c - o.inside(i, moved) < slack;
    if (isInside) {
        box = {moved, moved, moved};
        return box;
    }
    // Any feasible point no farther from the sample than the farthest of the documented ones.
    double nearest = glm::distance(o.corner[0], sample);
    for (int i = 1; i < 3; ++i)
        nearest = std::min(nearest, glm::distance(o.corner[i], sample));
    double reach = 0;
    for (int i = 0; i < 3; ++i) {
        if (glm::distance(o.corner[i], sample) > 2.0 * nearest + 16.0 * c)
            continue;
        const double share = o.inradius > c ? c / o.inradius : 1.0;
        const glm::dvec3 onBisector = o.corner[i] + (o.incentre - o.corner[i]) * share;
        box.center = onBisector;
        include(box, onBisector);
        reach = std::max(reach, glm::distance(onBisector, sample));
    }
    const glm::dvec3 across = glm::sqrt(glm::max(1.0 - o.normal * o.normal, glm::dvec3(0.0)));
    widen(box, reach * across);
    return box;
}

} // namespace

FamilyMaker::FamilyMaker(const TriangleView& triangles) : triangles_(triangles) {
    glm::dvec3 low(std::numeric_limits<double>::infinity()), high(-low);
    for (const glm::vec3& p : triangles.positions) {
        low = glm::min(low, glm::dvec3(p));
        high = glm::max(high, glm::dvec3(p));
    }
    if (triangles.positions.count > 0)
        extent_ = high - low;
    diagonal_ = glm::length(extent_);
}

SegmentFamily FamilyMaker::make(const FloatPair& pair, const Light& light) const {
    constexpr double u = kHalfUlpOfFloat;
    const glm::dvec3 sample(pair.sampleWorld), givenNormal(pair.normalWorld);
    glm::dvec3 corner[3];
    glm::dvec3 largest = glm::abs(sample);
    for (int i = 0; i < 3; ++i) {
        corner[i] = glm::dvec3(triangles_.vertex(pair.receiver, i));
        largest = glm::max(largest, glm::abs(corner[i]));
    }
    const double m = std::max({largest.x, largest.y, largest.z});
    const double c = 4.0 * u * m + 16.0 * u * diagonal_;
    const Outline o = outlineOf(corner, sample, givenNormal);
    SegmentFamily family;
    family.receiver = pair.receiver;

    // The start: inside the outline, lifted, rounded to a float of the local frame.
    const double slack = kDoubleSlack * (m + diagonal_) + o.normalError * diagonal_ + 4.0 * u * c;
    PointBox& start = family.start = insideOutline(o, sample, c, slack);
    const double lift = std::max(c - o.height(start.center), 0.0);
    for (glm::dvec3* p : {&start.center, &start.low, &start.high})
        *p += o.normal * lift;
    const glm::dvec3 rounding = u * (1.5 * (1.0 + 0x1p-20) * extent_ + c);
    widen(start, rounding + slack);
    int axis = 0;
    for (int a = 1; a < 3; ++a)
        if (std::fabs(o.normal[a]) > std::fabs(o.normal[axis]))
            axis = a;
    const double lost = glm::dot(glm::abs(o.normal), rounding); // of height
    for (int a = 0; a < 3; ++a) { // where two axes are nearly as large, either may be stepped
        if (std::fabs(o.normal[a]) < std::fabs(o.normal[axis]) - 0x1p-20)
            continue;
        const double stepped = (lost / std::fabs(o.normal[a]) + 2.0 * rounding[a]) * (1 + 0x1p-20);
        (o.normal[a] > 0.0 ? start.high : start.low)[a] += o.normal[a] > 0.0 ? stepped : -stepped;
    }

    // The end: the light, raised to c, cut, along a direction whose components are floats.
    glm::dvec3 end(light.positionWorld), endError(0.0);
    if (light.kind == Light::kSun) {
        const glm::dvec3 way =
            glm::dvec3(light.directionWorld) * double(light.directionalDistanceWorld);
        end = sample - way;
        endError = u * (1.0 + 0x1p-20) * glm::abs(end); // the product by a power of two is exact
    }
    const double heightError = kDoubleSlack * (glm::length(end - corner[0]) + m) +
                               o.normalError * glm::length(end - o.corner[0]) +
                               glm::dot(glm::abs(o.normal), endError);
    const double missing = c - o.height(end);
    if (missing > -heightError) {
        end += o.normal * std::max(missing, 0.0);
        endError += heightError * glm::abs(o.normal) + o.normalError * std::max(missing, 0.0);
    }
    const glm::dvec3 way = end - start.center;
    family.end.center = end - way * kEndCut;
    family.end.low = family.end.high = family.end.center;
    const glm::dvec3 startSize = start.high - start.low;
    widen(family.end, endError + u * (1.0 + 0x1p-20) * (glm::abs(way) + startSize + endError) +
                          kEndCut * startSize +
                          glm::dvec3(kDoubleSlack * (glm::length(end) + m + diagonal_)));

    double longest = 0, shortest = 0;
    for (int a = 0; a < 3; ++a) {
        const double far =
            std::max(family.end.high[a] - start.low[a], start.high[a] - family.end.low[a]);
        const double near =
            std::max({family.end.low[a] - start.high[a], start.low[a] - family.end.high[a], 0.0});
        longest += far * far;
        shortest += near * near;
    }
    family.mayBeAsked = std::sqrt(longest) > c;
    family.isSurelyAsked = std::sqrt(shortest) > c * (1.0 + kEndCut);
    return family;
}

SegmentFamily exactSegment(const glm::dvec3& from, const glm::dvec3& to) {
    SegmentFamily family;
    family.start = {from, from, from};
    family.end = {to, to, to};
    return family;
}

} // namespace shadowdag
