// SPDX-License-Identifier: Apache-2.0
// How a pair becomes a ray of the truth, and when a triangle blocks it: the one text that Embree's
// door (truth.h, where the rules stand with their reasons) and our own exact tests share.
//
// A Geometry is whatever has `glm::dvec3 vertex(triangle, corner)` in the local space (exact),
// `glm::dvec3 origin` and `double diagonal` (TruthSpace), and `AlphaMaskView masks()`:
// TruthGeometry here, Truth::State there.
#pragma once

#include "hybrid/gbuffer/gbuffer.h"
#include "scenes/world.h"

#include <cmath>

namespace shadowdag {

/// A segment as the truth is asked for it: local space = world space - origin, t in [0, 1] from
/// start to end.
struct TruthRay {
    glm::vec3 startLocal;
    glm::vec3 direction;             ///< end - start, not unit
    float tFar = 1.0f;               ///< hits with 0 < t < tFar count; <= 0: nothing blocks
    uint32_t receiver = kBackground; ///< triangle that never counts
};

/// The local space and the scene's size.
struct TruthSpace {
    /// World point: per axis 0, or the middle of the bounds where subtracting it from every vertex
    /// is exact (Sterbenz: all coordinates within a factor 2 of it).
    glm::dvec3 origin{0.0};
    double diagonal = 0; ///< of the bounds
};

/// Returns the space of these positions; finite ones.
TruthSpace truthSpaceOf(View<const glm::vec3> positionsWorld);

/// World triangles as a Geometry.
struct TruthGeometry {
    TriangleView triangles;
    glm::dvec3 origin{0.0};
    double diagonal = 0;

    SDAG_HD glm::dvec3 vertex(uint32_t triangle, int corner) const {
        return glm::dvec3(triangles.vertex(triangle, corner)) - origin;
    }
    SDAG_HD const AlphaMaskView& masks() const { return triangles.masks; }
};

/// The plane of a receiver: all that a ray from a known start needs.
struct ReceiverPlane {
    uint32_t triangle;
    double clearance;  ///< c of the head of truth.h
    glm::dvec3 normal; ///< unit, towards the light's side
    double offset;     ///< normal . x over the plane, local

    SDAG_HD double height(const glm::dvec3& p) const { return glm::dot(normal, p) - offset; }
    /// Returns by how much a light is raised along the normal, to c above the plane; >= 0.
    SDAG_HD double lift(const glm::dvec3& lightLocal) const {
        const double missing = clearance - height(lightLocal);
        return missing < 0.0 ? 0.0 : missing;
    }
};

/// The receiver as the ray set-up needs it; the same for all lights of a sample.
struct TruthReceiver : ReceiverPlane {
    glm::dvec3 sample; ///< local
    bool hasTriangle;  ///< the rest is set
    glm::dvec3 corner[3];
    glm::dvec3 inward[3]; ///< per edge: unit, in the plane, towards the triangle
    double inwardOffset[3];

    SDAG_HD double inside(int edge, const glm::dvec3& p) const {
        return glm::dot(inward[edge], p) - inwardOffset[edge];
    }
};

namespace detail {

constexpr double kUnit = 5.9604644775390625e-8; // 2^-24, half an ulp of 1.0f

SDAG_HD inline double larger(double a, double b) {
    return a < b ? b : a;
}

/// Returns the point moved within the plane until it is at least c inside all three edges; the
/// incentre where the triangle is too narrow for that. Where an edge meets another room's wall, a
/// sample that rounding put behind the wall comes back.
SDAG_HD inline glm::dvec3 moveInside(const TruthReceiver& r, glm::dvec3 p) {
    const double c = r.clearance;
    // Twice, because at a corner the second edge pushes back over the first; right and obtuse
    // corners are then done.
    for (int pass = 0; pass < 2; ++pass)
        for (int i = 0; i < 3; ++i)
            p += r.inward[i] * larger(c - r.inside(i, p), 0.0);
    const double slack = 0.001 * c;
    if (r.inside(0, p) >= c - slack && r.inside(1, p) >= c - slack && r.inside(2, p) >= c - slack)
        return p;
    // An acute corner: the point c from both its edges lies on the bisector, c / inradius of the
    // way to the incentre.
    double side[3]; // opposite to corner i
    for (int i = 0; i < 3; ++i)
        side[i] = glm::length(r.corner[(i + 2) % 3] - r.corner[(i + 1) % 3]);
    const glm::dvec3 incentre =
        (side[0] * r.corner[0] + side[1] * r.corner[1] + side[2] * r.corner[2]) /
        (side[0] + side[1] + side[2]);
    int nearest = 0;
    for (int i = 1; i < 3; ++i)
        if (glm::length(r.corner[i] - p) < glm::length(r.corner[nearest] - p))
            nearest = i;
    const double inradius = r.inside(0, incentre);
    return r.corner[nearest] + (incentre - r.corner[nearest]) * (inradius > c ? c / inradius : 1.0);
}

} // namespace detail

/// Returns c of the head of truth.h for a receiver: its corners and the sample decide M.
template <class Geometry>
SDAG_HD double truthClearance(const Geometry& geometry, const glm::dvec3& sampleLocal,
                              uint32_t triangle) {
    double largest = 0;
    for (int a = 0; a < 3; ++a) {
        largest = detail::larger(largest, fabs(sampleLocal[a] + geometry.origin[a]));
        if (triangle != kBackground)
            for (int i = 0; i < 3; ++i)
                largest = detail::larger(
                    largest, fabs(geometry.vertex(triangle, i)[a] + geometry.origin[a]));
    }
    return 4.0 * detail::kUnit * largest + 16.0 * detail::kUnit * geometry.diagonal;
}

/// Returns a sample's receiver. @param normalWorld on the light's side @param triangle
/// kBackground: the plane through sample and normal is used
template <class Geometry>
SDAG_HD TruthReceiver makeTruthReceiver(const Geometry& geometry, const glm::vec3& sampleWorld,
                                        const glm::vec3& normalWorld, uint32_t triangle) {
    TruthReceiver r;
    r.triangle = triangle;
    r.sample = glm::dvec3(sampleWorld) - geometry.origin;
    r.clearance = truthClearance(geometry, r.sample, triangle);
    r.normal = glm::normalize(glm::dvec3(normalWorld));
    r.offset = glm::dot(r.normal, r.sample);
    r.hasTriangle = false;
    if (triangle == kBackground)
        return r;
    for (int i = 0; i < 3; ++i)
        r.corner[i] = geometry.vertex(triangle, i);
    const glm::dvec3 cross = glm::cross(r.corner[1] - r.corner[0], r.corner[2] - r.corner[0]);
    const double area = glm::length(cross);
    if (!(area > 0.0)) // degenerate: no camera ray hits it; the G-buffer's plane will do
        return r;
    r.hasTriangle = true;
    r.normal = glm::dot(cross, r.normal) < 0.0 ? cross / -area : cross / area;
    r.offset = glm::dot(r.normal, r.corner[0]);
    for (int i = 0; i < 3; ++i) {
        const glm::dvec3 edge = r.corner[(i + 1) % 3] - r.corner[i];
        r.inward[i] = glm::normalize(glm::cross(cross, edge));
        r.inwardOffset[i] = glm::dot(r.inward[i], r.corner[i]);
    }
    return r;
}

/// Returns the float point next to p at least c above the receiver's plane, moved along the normal
/// only.
SDAG_HD inline glm::vec3 liftOffPlane(const TruthReceiver& r, glm::dvec3 p) {
    p += r.normal * detail::larger(r.clearance - r.height(p), 0.0);
    glm::vec3 rounded(p);
    // Rounding costs at most half an ulp an axis; one axis, the normal's largest, is stepped until
    // the height is kept.
    const glm::dvec3 size = glm::abs(r.normal);
    const int axis = size.x >= size.y ? (size.x >= size.z ? 0 : 2) : (size.y >= size.z ? 1 : 2);
    const float towards = r.normal[axis] > 0.0 ? INFINITY : -INFINITY;
    for (int step = 0; step < 8 && r.height(glm::dvec3(rounded)) < r.clearance; ++step)
        rounded[axis] = nextafterf(rounded[axis], towards);
    return rounded;
}

/// Returns where the receiver's own ray starts.
SDAG_HD inline glm::vec3 truthStart(const TruthReceiver& r) {
    return liftOffPlane(r, r.hasTriangle ? detail::moveInside(r, r.sample) : r.sample);
}

/// Returns the ray from `start` to a light, raised to c above the receiver's plane.
SDAG_HD inline TruthRay truthRay(const ReceiverPlane& r, const glm::vec3& start,
                                 glm::dvec3 lightLocal) {
    // A light lower than c over the plane (a grazing pair, or one whose n.l > 0 is rounding).
    lightLocal += r.normal * r.lift(lightLocal);
    TruthRay ray;
    ray.startLocal = start;
    ray.direction = glm::vec3(lightLocal - glm::dvec3(start));
    const double distance = glm::length(glm::dvec3(ray.direction));
    ray.tFar = distance > r.clearance ? float(1.0 - 16.0 * detail::kUnit) : 0.0f;
    ray.receiver = r.triangle;
    return ray;
}

/// Returns the ray of a pair.
template <class Geometry>
SDAG_HD TruthRay truthPairRay(const Geometry& geometry, const glm::vec3& sampleWorld,
                              const glm::vec3& normalWorld, uint32_t triangle,
                              const glm::vec3& lightWorld) {
    const TruthReceiver r = makeTruthReceiver(geometry, sampleWorld, normalWorld, triangle);
    return truthRay(r, truthStart(r), glm::dvec3(lightWorld) - geometry.origin);
}

/// Returns where the ray crosses the triangle's plane, in double; NaN when they are parallel. The
/// differences of floats are exact or off by 2^-53 relative, so is what follows to a few of those.
template <class Geometry>
SDAG_HD double planeCrossing(const Geometry& geometry, const TruthRay& ray, uint32_t triangle) {
    const glm::dvec3 v0 = geometry.vertex(triangle, 0);
    const glm::dvec3 normal =
        glm::cross(geometry.vertex(triangle, 1) - v0, geometry.vertex(triangle, 2) - v0);
    const double along = glm::dot(normal, glm::dvec3(ray.direction));
    return glm::dot(normal, v0 - glm::dvec3(ray.startLocal)) / (along == 0.0 ? NAN : along);
}

/// Returns whether a triangle is opaque where the ray's line passes through it; a crossing beyond
/// an edge counts as on it.
template <class Geometry>
SDAG_HD bool isOpaqueToRay(const Geometry& geometry, const TruthRay& ray, uint32_t triangle) {
    if (!geometry.masks().isCut(triangle))
        return true;
    const glm::dvec3 start(ray.startLocal), way(ray.direction);
    const glm::dvec3 a = geometry.vertex(triangle, 0) - start,
                     b = geometry.vertex(triangle, 1) - start,
                     c = geometry.vertex(triangle, 2) - start;
    // A corner's weight is the volume of (way, the other two corners).
    return geometry.masks().isOpaque(triangle, glm::dot(way, glm::cross(b, c)),
                                     glm::dot(way, glm::cross(c, a)),
                                     glm::dot(way, glm::cross(a, b)));
}

/// Returns whether a triangle that the ray's line passes through blocks the ray: it is not the
/// receiver's own, lies strictly between the ends and is opaque there.
template <class Geometry>
SDAG_HD bool isBetweenEnds(const Geometry& geometry, const TruthRay& ray, uint32_t triangle) {
    if (triangle == ray.receiver)
        return false;
    const double t = planeCrossing(geometry, ray, triangle);
    return t > 0.0 && t < double(ray.tFar) && isOpaqueToRay(geometry, ray, triangle);
}

/// Returns whether a triangle blocks the ray, wholly in double. Watertight: the sides of an edge
/// that two triangles share are the same number with opposite signs, and a line through the edge
/// itself passes through both. A triangle seen edge-on does not block.
template <class Geometry>
SDAG_HD bool blocksTruthRay(const Geometry& geometry, const TruthRay& ray, uint32_t triangle) {
    const glm::dvec3 start(ray.startLocal), way(ray.direction);
    const glm::dvec3 a = geometry.vertex(triangle, 0) - start,
                     b = geometry.vertex(triangle, 1) - start,
                     c = geometry.vertex(triangle, 2) - start;
    // On which side of an edge the line passes: the volume of (way, the edge's ends).
    const double ab = glm::dot(way, glm::cross(a, b));
    const double bc = glm::dot(way, glm::cross(b, c));
    if ((ab < 0.0 && bc > 0.0) || (ab > 0.0 && bc < 0.0))
        return false;
    const double ca = glm::dot(way, glm::cross(c, a));
    if ((ca < 0.0 && (ab > 0.0 || bc > 0.0)) || (ca > 0.0 && (ab < 0.0 || bc < 0.0)))
        return false;
    return isBetweenEnds(geometry, ray, triangle);
}

} // namespace shadowdag
