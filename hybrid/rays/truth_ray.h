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
struct TruthReceiver : ReceiverPlane, ReceiverEdges {
    glm::dvec3 sample; ///< local
    bool hasTriangle;  ///< the edges are set
};

/// Returns c of the head of truth.h for a receiver: its corners and the sample decide M.
template <class Geometry>
SDAG_HD double truthClearance(const Geometry& geometry, const glm::dvec3& sampleLocal,
                              uint32_t triangle) {
    double largest = 0;
    for (int a = 0; a < 3; ++a) {
        largest = greater(largest, fabs(sampleLocal[a] + geometry.origin[a]));
        if (triangle != kBackground)
            for (int i = 0; i < 3; ++i)
                largest =
                    greater(largest, fabs(geometry.vertex(triangle, i)[a] + geometry.origin[a]));
    }
    return clearanceOf(largest, geometry.diagonal);
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
    r.normal = unitOf(glm::dvec3(normalWorld));
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
    setInward(r, cross);
    return r;
}

/// Returns the float point next to p at least c above the receiver's plane, moved along the normal
/// only.
SDAG_HD inline glm::vec3 liftOffPlane(const TruthReceiver& r, glm::dvec3 p) {
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

/// Returns where the receiver's own ray starts.
SDAG_HD inline glm::vec3 truthStart(const TruthReceiver& r) {
    return liftOffPlane(r, r.hasTriangle ? moveInside(r, r.clearance, r.sample) : r.sample);
}

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
    const TruthReceiver r = makeTruthReceiver(geometry, sampleWorld, normalWorld, triangle);
    return truthRay(r, truthStart(r), glm::dvec3(lightWorld) - geometry.origin);
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
