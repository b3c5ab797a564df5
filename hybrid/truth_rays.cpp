// SPDX-License-Identifier: Apache-2.0
// How a pair becomes a ray of the truth: off the receiver's plane, inside its outline, short of the
// light.
#include "hybrid/truth_state.h"

#include <algorithm>
#include <cmath>

namespace shadowdag {
namespace {

constexpr double kUnit = 5.9604644775390625e-8; // 2^-24, half an ulp of 1.0f

/// Returns the point moved within the plane until it is at least c inside all three edges; the
/// incentre where the triangle is too narrow for that. Where an edge meets another room's wall, a
/// sample that rounding put behind the wall comes back.
glm::dvec3 moveInside(const TruthReceiver& r, glm::dvec3 p) {
    const double c = r.clearance;
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

} // namespace

TruthReceiver Truth::State::receiver(const glm::vec3& sampleWorld, const glm::vec3& normalWorld,
                                     uint32_t triangle) const {
    TruthReceiver r;
    r.triangle = triangle;
    r.sample = glm::dvec3(sampleWorld) - origin;
    r.clearance = clearance(r.sample, triangle);
    r.normal = glm::normalize(glm::dvec3(normalWorld));
    r.offset = glm::dot(r.normal, r.sample);
    r.hasTriangle = false;
    if (triangle == kBackground)
        return r;
    for (int i = 0; i < 3; ++i)
        r.corner[i] = vertex(triangle, i);
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

glm::vec3 liftOffPlane(const TruthReceiver& r, glm::dvec3 p) {
    p += r.normal * std::max(r.clearance - r.height(p), 0.0);
    glm::vec3 rounded(p);
    // Rounding costs at most half an ulp an axis; one axis, the normal's largest, is stepped until
    // the height is kept.
    const glm::dvec3 size = glm::abs(r.normal);
    const int axis = size.x >= size.y ? (size.x >= size.z ? 0 : 2) : (size.y >= size.z ? 1 : 2);
    const float towards = r.normal[axis] > 0.0 ? INFINITY : -INFINITY;
    for (int step = 0; step < 8 && r.height(glm::dvec3(rounded)) < r.clearance; ++step)
        rounded[axis] = std::nextafter(rounded[axis], towards);
    return rounded;
}

glm::vec3 truthStart(const TruthReceiver& r) {
    return liftOffPlane(r, r.hasTriangle ? moveInside(r, r.sample) : r.sample);
}

TruthRay truthRay(const TruthReceiver& r, const glm::vec3& start, glm::dvec3 lightLocal) {
    // A light lower than c over the plane (a grazing pair, or one whose n.l > 0 is rounding).
    lightLocal += r.normal * std::max(r.clearance - r.height(lightLocal), 0.0);
    TruthRay ray;
    ray.startLocal = start;
    ray.direction = glm::vec3(lightLocal - glm::dvec3(start));
    const double distance = glm::length(glm::dvec3(ray.direction));
    ray.tFar = distance > r.clearance ? float(1.0 - 16.0 * kUnit) : 0.0f;
    ray.receiver = r.triangle;
    return ray;
}

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
    const TruthReceiver r = state_->receiver(sampleWorld, normalWorld, receiverTriangle);
    return truthRay(r, truthStart(r), glm::dvec3(lightWorld) - state_->origin);
}

void Truth::shiftedPairRays(const glm::vec3& sampleWorld, const glm::vec3& normalWorld,
                            uint32_t receiverTriangle, const glm::vec3& lightWorld,
                            const glm::dvec3* shiftsWorld, size_t count, TruthRay* rays) const {
    const TruthReceiver r = state_->receiver(sampleWorld, normalWorld, receiverTriangle);
    for (size_t i = 0; i < count; ++i)
        rays[i] = truthRay(r, liftOffPlane(r, r.sample + shiftsWorld[i]),
                           glm::dvec3(lightWorld) + shiftsWorld[i] - state_->origin);
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
