// SPDX-License-Identifier: Apache-2.0
// How a pair becomes a ray of the truth: off the receiver's plane, inside its outline, short of the
// light.
#include "hybrid/truth_state.h"

#include <algorithm>
#include <cmath>

namespace shadowdag {
namespace {

constexpr double kUnit = 5.9604644775390625e-8; // 2^-24, half an ulp of 1.0f

/// The receiver as the ray set-up needs it.
struct Receiver {
    glm::dvec3 normal;    ///< unit, towards the light's side
    double offset;        ///< normal . x over the plane
    glm::dvec3 inward[3]; ///< per edge: unit, in the plane, towards the triangle
    double inwardOffset[3];
    glm::dvec3 corner[3];
    bool hasTriangle;

    double inside(int edge, const glm::dvec3& p) const {
        return glm::dot(inward[edge], p) - inwardOffset[edge];
    }
};

Receiver makeReceiver(const Truth::State& state, const glm::dvec3& sampleLocal,
                      const glm::vec3& normalWorld, uint32_t triangle) {
    Receiver r;
    r.normal = glm::normalize(glm::dvec3(normalWorld));
    r.offset = glm::dot(r.normal, sampleLocal);
    r.hasTriangle = false;
    if (triangle == kBackground)
        return r;
    glm::dvec3(&v)[3] = r.corner;
    for (int i = 0; i < 3; ++i)
        v[i] = state.vertex(triangle, i);
    const glm::dvec3 cross = glm::cross(v[1] - v[0], v[2] - v[0]);
    const double area = glm::length(cross);
    if (!(area > 0.0)) // degenerate: no camera ray hits it; the G-buffer's plane will do
        return r;
    r.hasTriangle = true;
    r.normal = glm::dot(cross, r.normal) < 0.0 ? cross / -area : cross / area;
    r.offset = glm::dot(r.normal, v[0]);
    for (int i = 0; i < 3; ++i) {
        const glm::dvec3 edge = v[(i + 1) % 3] - v[i];
        r.inward[i] = glm::normalize(glm::cross(cross, edge));
        r.inwardOffset[i] = glm::dot(r.inward[i], v[i]);
    }
    return r;
}

/// Returns the point moved within the plane until it is at least c inside all three edges; the
/// incentre where the triangle is too narrow for that. Where an edge meets another room's wall, a
/// sample that rounding put behind the wall comes back.
glm::dvec3 moveInside(const Receiver& r, glm::dvec3 p, double c) {
    // Twice, because at a corner the second edge pushes back over the first; right and obtuse
    // corners are then done.
    for (int pass = 0; pass < 2; ++pass)
        for (int i = 0; i < 3; ++i)
            p += r.inward[i] * std::max(c - r.inside(i, p), 0.0);
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

/// Returns the float point that stands at least `height` above the plane, next to p, which is moved
/// along the normal only.
glm::vec3 liftToFloat(const Receiver& r, glm::dvec3 p, double height) {
    p += r.normal * std::max(height - (glm::dot(r.normal, p) - r.offset), 0.0);
    glm::vec3 rounded(p);
    // Rounding costs at most half an ulp an axis; one axis, the normal's largest, is stepped until
    // the height is kept.
    const int axis = std::fabs(r.normal.x) >= std::fabs(r.normal.y)
                         ? (std::fabs(r.normal.x) >= std::fabs(r.normal.z) ? 0 : 2)
                         : (std::fabs(r.normal.y) >= std::fabs(r.normal.z) ? 1 : 2);
    const float towards = r.normal[axis] > 0.0 ? INFINITY : -INFINITY;
    for (int step = 0; step < 8 && glm::dot(r.normal, glm::dvec3(rounded)) - r.offset < height;
         ++step)
        rounded[axis] = std::nextafter(rounded[axis], towards);
    return rounded;
}

TruthRay makeRay(const Receiver& r, const glm::vec3& start, glm::dvec3 lightLocal, double clearance,
                 uint32_t triangle) {
    // A light lower than c over the plane (a grazing pair, or one whose n.l > 0 is rounding) is
    // raised to c.
    lightLocal += r.normal * std::max(clearance - (glm::dot(r.normal, lightLocal) - r.offset), 0.0);
    TruthRay ray;
    ray.startLocal = start;
    ray.direction = glm::vec3(lightLocal - glm::dvec3(start));
    const double distance = glm::length(glm::dvec3(ray.direction));
    ray.tFar = distance > clearance ? float(1.0 - 16.0 * kUnit) : 0.0f;
    ray.receiver = triangle;
    return ray;
}

} // namespace

double Truth::State::clearance(const glm::dvec3& sampleLocal, uint32_t triangle) const {
    double largest = 0;
    for (int a = 0; a < 3; ++a) {
        largest = std::max(largest, std::fabs(sampleLocal[a] + origin[a]));
        if (triangle != kBackground)
            for (int i = 0; i < 3; ++i)
                largest = std::max(largest, std::fabs(vertex(triangle, i)[a] + origin[a]));
    }
    return 4.0 * kUnit * largest + 16.0 * kUnit * diagonal;
}

TruthRay Truth::pairRay(const glm::vec3& sampleWorld, const glm::vec3& normalWorld,
                        uint32_t receiverTriangle, const glm::vec3& lightWorld) const {
    glm::dvec3 p = glm::dvec3(sampleWorld) - state_->origin;
    const double c = state_->clearance(p, receiverTriangle);
    const Receiver r = makeReceiver(*state_, p, normalWorld, receiverTriangle);
    if (r.hasTriangle)
        p = moveInside(r, p, c);
    return makeRay(r, liftToFloat(r, p, c), glm::dvec3(lightWorld) - state_->origin, c,
                   receiverTriangle);
}

TruthRay Truth::shiftedPairRay(const glm::vec3& sampleWorld, const glm::vec3& normalWorld,
                               uint32_t receiverTriangle, const glm::vec3& lightWorld,
                               const glm::dvec3& shiftWorld) const {
    const glm::dvec3 p = glm::dvec3(sampleWorld) - state_->origin;
    const double c = state_->clearance(p, receiverTriangle);
    const Receiver r = makeReceiver(*state_, p, normalWorld, receiverTriangle);
    return makeRay(r, liftToFloat(r, p + shiftWorld, c),
                   glm::dvec3(lightWorld) + shiftWorld - state_->origin, c, receiverTriangle);
}

TruthRay Truth::segmentRay(const glm::vec3& fromWorld, const glm::vec3& toWorld) const {
    TruthRay ray;
    ray.startLocal = glm::vec3(glm::dvec3(fromWorld) - state_->origin);
    ray.direction = glm::vec3(glm::dvec3(toWorld) - state_->origin - glm::dvec3(ray.startLocal));
    return ray;
}

bool Truth::isBlocked(const glm::vec3& from, const glm::vec3& to) const {
    const TruthRay ray = segmentRay(from, to);
    uint8_t blocked = 0;
    traceBlocked(&ray, 1, &blocked);
    return blocked != 0;
}

TruthBlocker Truth::blocker(const glm::vec3& sampleWorld, const glm::vec3& normalWorld,
                            uint32_t receiverTriangle, const glm::vec3& lightWorld) const {
    const TruthRay ray = pairRay(sampleWorld, normalWorld, receiverTriangle, lightWorld);
    float t = 0;
    TruthBlocker found;
    found.triangle = traceFirst(ray, &t);
    if (found.triangle != kBackground)
        found.distanceWorld = t * glm::length(ray.direction);
    return found;
}

bool Truth::isCoplanar(uint32_t triangle, uint32_t other) const {
    if (triangle == other)
        return true;
    if (triangle == kBackground || other == kBackground)
        return false;
    const glm::dvec3 v0 = state_->vertex(triangle, 0);
    const glm::dvec3 cross =
        glm::cross(state_->vertex(triangle, 1) - v0, state_->vertex(triangle, 2) - v0);
    const double area = glm::length(cross);
    if (!(area > 0.0))
        return false;
    const double c = state_->clearance(v0, triangle);
    for (int i = 0; i < 3; ++i)
        if (std::fabs(glm::dot(cross, state_->vertex(other, i) - v0)) > c * area)
            return false;
    return true;
}

} // namespace shadowdag
