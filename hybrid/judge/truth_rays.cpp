// SPDX-License-Identifier: Apache-2.0
// The public rays of the truth; their setup is in truth_ray.h.
#include "hybrid/judge/truth_state.h"

#include <cmath>

namespace shadowdag {
TruthSpace truthSpaceOf(View<const glm::vec3> positionsWorld) {
    Box bounds;
    for (const glm::vec3& p : positionsWorld)
        bounds.add(p);
    return truthSpaceOf(bounds);
}

TruthSpace truthSpaceOf(const Box& bounds) {
    TruthSpace space;
    for (int a = 0; a < 3; ++a) {
        const float lo = bounds.min[a], hi = bounds.max[a];
        const float middle = lo + 0.5f * (hi - lo);
        const bool isExact = middle > 0.0f ? lo >= 0.5f * middle && hi <= 2.0f * middle
                                           : hi <= 0.5f * middle && lo >= 2.0f * middle;
        space.origin[a] = isExact ? double(middle) : 0.0;
    }
    space.diagonal = glm::length(glm::dvec3(bounds.extent()));
    return space;
}

TruthRay Truth::pairRay(const glm::vec3& sampleWorld, const glm::vec3& normalWorld,
                        uint32_t receiverTriangle, const glm::vec3& lightWorld) const {
    return truthPairRay(*state_, sampleWorld, normalWorld, receiverTriangle, lightWorld);
}

void Truth::shiftedPairRays(const glm::vec3& sampleWorld, const glm::vec3& normalWorld,
                            uint32_t receiverTriangle, const glm::vec3& lightWorld,
                            const glm::dvec3* shiftsWorld, size_t count, TruthRay* rays) const {
    const ReceiverPlane plane =
        makeTruthStart(*state_, makeTruthTriangle(*state_, receiverTriangle), sampleWorld,
                       normalWorld)
            .plane;
    const glm::dvec3 sample = glm::dvec3(sampleWorld) - state_->origin;
    for (size_t i = 0; i < count; ++i)
        rays[i] = truthRay(plane, liftOffPlane(plane, sample + shiftsWorld[i]),
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

double Truth::clearance(const glm::vec3& sampleWorld, uint32_t receiverTriangle) const {
    return truthClearance(*state_, glm::dvec3(sampleWorld) - state_->origin,
                          makeTruthTriangle(*state_, receiverTriangle));
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
    const double c = truthClearance(*state_, v0, makeTruthTriangle(*state_, triangle));
    for (int i = 0; i < 3; ++i)
        if (std::fabs(glm::dot(cross, state_->vertex(other, i) - v0)) > c * area)
            return false;
    return true;
}

} // namespace shadowdag
