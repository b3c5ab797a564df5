// SPDX-License-Identifier: Apache-2.0
// How a pair becomes a ray of the truth, and when a triangle blocks it: the one text that Embree's
// door (truth.h, where the rules stand with their reasons) and our own exact tests share.
//
// A Geometry is whatever has `glm::dvec3 vertex(triangle, corner)` in the local space (exact),
// `glm::dvec3 origin` and `double diagonal` (TruthSpace), and `AlphaMaskView masks()`:
// TruthGeometry here, Truth::State there.
#pragma once

#include "hybrid/gbuffer/gbuffer.h"
#include "hybrid/rays/truth_leaf.h"
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
/// Returns the same. @param boundsWorld of all positions
TruthSpace truthSpaceOf(const Box& boundsWorld);

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

/// What the ray set-up needs of a receiver's triangle, whatever the sample.
struct TruthTriangle : ReceiverEdges {
    uint32_t triangle = kBackground;
    bool hasArea = false; ///< what follows and the edges are set
    glm::dvec3 normal;    ///< unit, along the cross product of two edges
    double offset;        ///< normal . x over the plane
    double largest = 0;   ///< coordinate of a corner, world
};

/// Returns what is needed of a triangle. @param triangle kBackground: none
template <class Geometry>
SDAG_HD TruthTriangle makeTruthTriangle(const Geometry& geometry, uint32_t triangle) {
    TruthTriangle t;
    t.triangle = triangle;
    if (triangle == kBackground)
        return t;
    for (int i = 0; i < 3; ++i) {
        t.corner[i] = geometry.vertex(triangle, i);
        for (int a = 0; a < 3; ++a)
            t.largest = greater(t.largest, fabs(t.corner[i][a] + geometry.origin[a]));
    }
    const glm::dvec3 cross = glm::cross(t.corner[1] - t.corner[0], t.corner[2] - t.corner[0]);
    const double area = glm::length(cross);
    t.hasArea = area > 0.0; // else no camera ray hits it; the G-buffer's plane will do
    if (!t.hasArea)
        return t;
    t.normal = cross / area;
    t.offset = glm::dot(t.normal, t.corner[0]);
    setInward(t, cross);
    return t;
}

/// Returns c of the head of truth.h for a receiver: its corners and the sample decide M.
template <class Geometry>
SDAG_HD double truthClearance(const Geometry& geometry, const glm::dvec3& sampleLocal,
                              const TruthTriangle& of) {
    double largest = of.largest;
    for (int a = 0; a < 3; ++a)
        largest = greater(largest, fabs(sampleLocal[a] + geometry.origin[a]));
    return clearanceOf(largest, geometry.diagonal);
}

/// Returns the float point next to p at least c above the receiver's plane, moved along the normal
/// only.
SDAG_HD inline glm::vec3 liftOffPlane(const ReceiverPlane& r, glm::dvec3 p) {
    p += r.normal * greater(r.clearance - r.height(p), 0.0);
    glm::vec3 rounded(p);
    // Rounding costs at most half an ulp an axis; one axis, the normal's largest, is stepped until
    // the height is kept.
    const int axis = largestAxis(r.normal);
    const float towards = r.normal[axis] > 0.0 ? INFINITY : -INFINITY;
    for (int step = 0; step < 8 && r.height(glm::dvec3(rounded)) < r.clearance; ++step)
        rounded[axis] = nextafterf(rounded[axis], towards);
    return rounded;
}

/// A sample as rays to lights need it; the same for all lights.
struct TruthStart {
    ReceiverPlane plane;
    glm::vec3
        startLocal; ///< at least c above the plane and, where it has the room, inside the triangle
};

/// Returns the start of a sample. @param normalWorld on the light's side @param of the sample's
/// triangle; without area the plane through sample and normal is used
template <class Geometry>
SDAG_HD TruthStart makeTruthStart(const Geometry& geometry, const TruthTriangle& of,
                                  const glm::vec3& sampleWorld, const glm::vec3& normalWorld) {
    const glm::dvec3 sample = glm::dvec3(sampleWorld) - geometry.origin;
    TruthStart start;
    ReceiverPlane& plane = start.plane;
    plane.triangle = of.triangle;
    plane.clearance = truthClearance(geometry, sample, of);
    plane.normal = unitOf(glm::dvec3(normalWorld));
    plane.offset = glm::dot(plane.normal, sample);
    if (of.hasArea) {
        const bool isFlipped = glm::dot(of.normal, plane.normal) < 0.0;
        plane.normal = isFlipped ? -of.normal : of.normal;
        plane.offset = isFlipped ? -of.offset : of.offset;
    }
    start.startLocal =
        liftOffPlane(plane, of.hasArea ? moveInside(of, plane.clearance, sample) : sample);
    return start;
}

/// Makes the starts of many samples: neighbours often share their triangle.
template <class Geometry> class TruthStarts {
public:
    explicit TruthStarts(const Geometry& geometry) : geometry_(geometry) {}

    /// Returns makeTruthStart of the sample.
    TruthStart make(const glm::vec3& sampleWorld, const glm::vec3& normalWorld, uint32_t triangle) {
        if (!isMade_ || of_.triangle != triangle)
            of_ = makeTruthTriangle(geometry_, triangle);
        isMade_ = true;
        return makeTruthStart(geometry_, of_, sampleWorld, normalWorld);
    }

private:
    const Geometry& geometry_;
    TruthTriangle of_;
    bool isMade_ = false;
};

/// Returns the ray from `start` to a light, raised to c above the receiver's plane.
SDAG_HD inline TruthRay truthRay(const ReceiverPlane& r, const glm::vec3& start,
                                 glm::dvec3 lightLocal) {
    // A light lower than c over the plane (a grazing pair, or one whose n.l > 0 is rounding).
    lightLocal += r.normal * r.lift(lightLocal);
    TruthRay ray;
    ray.startLocal = start;
    ray.direction = glm::vec3(lightLocal - glm::dvec3(start));
    ray.tFar = rayEndOf(lengthOf(glm::dvec3(ray.direction)), r.clearance);
    ray.receiver = r.triangle;
    return ray;
}

/// Returns the ray of a pair.
template <class Geometry>
SDAG_HD TruthRay truthPairRay(const Geometry& geometry, const glm::vec3& sampleWorld,
                              const glm::vec3& normalWorld, uint32_t triangle,
                              const glm::vec3& lightWorld) {
    const TruthStart start =
        makeTruthStart(geometry, makeTruthTriangle(geometry, triangle), sampleWorld, normalWorld);
    return truthRay(start.plane, start.startLocal, glm::dvec3(lightWorld) - geometry.origin);
}

/// Returns crossingOf a ray and a triangle.
template <class Geometry>
SDAG_HD double planeCrossing(const Geometry& geometry, const TruthRay& ray, uint32_t triangle) {
    return crossingOf(glm::dvec3(ray.startLocal), glm::dvec3(ray.direction),
                      geometry.vertex(triangle, 0), geometry.vertex(triangle, 1),
                      geometry.vertex(triangle, 2));
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

/// Returns whether a triangle blocks the ray, wholly in double (passesThrough). A triangle seen
/// edge-on does not block.
template <class Geometry>
SDAG_HD bool blocksTruthRay(const Geometry& geometry, const TruthRay& ray, uint32_t triangle) {
    const glm::dvec3 start(ray.startLocal);
    glm::dvec3 weights;
    return passesThrough(glm::dvec3(ray.direction), geometry.vertex(triangle, 0) - start,
                         geometry.vertex(triangle, 1) - start, geometry.vertex(triangle, 2) - start,
                         weights) &&
           isBetweenEnds(geometry, ray, triangle);
}

} // namespace shadowdag
