// SPDX-License-Identifier: Apache-2.0
#include "hybrid/rays/mover_receivers.h"

#include <algorithm>
#include <limits>

namespace shadowdag {

void MoverReceivers::makeStarts(const MoverView& movers, const GBufferView& gbuffer,
                                View<const uint32_t> samples) {
    starts_.reserve(samples.count);
    TruthStarts starts(movers.geometry);
    for (const uint32_t s : samples)
        starts_.push_back(
            starts.make(gbuffer.positionWorld[s], gbuffer.normalWorld[s], gbuffer.triangle[s]));
}

void MoverReceivers::findCandidates(const MoverView& movers, const glm::dvec3& lightLocal) {
    constexpr double kMost = std::numeric_limits<double>::max();
    glm::dvec3 least(kMost), largest(-kMost);
    double lift = 0;
    for (const uint32_t i : asked_) {
        const glm::dvec3 start(starts_[i].startLocal);
        least = glm::min(least, start);
        largest = glm::max(largest, start);
        lift = std::max(lift, starts_[i].plane.lift(lightLocal));
    }
    // A ray ends where its direction, rounded to floats, leads: off by 2^-24 of itself at most.
    const glm::dvec3 reach = glm::max(glm::abs(lightLocal - least), glm::abs(largest - lightLocal));
    const double farthest = std::max({reach.x, reach.y, reach.z}) + lift;
    const glm::dvec3 light = lightLocal + movers.geometry.origin;
    const glm::dvec3 around(lift + farthest * 1.1920928955078125e-7); // 2^-23
    const BoxSegmentBundle bundle(least + movers.geometry.origin, largest + movers.geometry.origin,
                                  light - around, light + around);
    candidates_.clear();
    Box accepted; // hit follows the test that let it
    traverse(
        movers.bvh,
        [&](const Box& box) {
            if (!bundle.touches(box))
                return false;
            accepted = box;
            return true;
        },
        [&](uint32_t batch) {
            candidates_.push_back({batch, accepted});
        });
}

bool MoverReceivers::isBlocked(const MoverView& movers, const TruthRay& ray) {
    if (!(ray.tFar > 0.0f))
        return false;
    const BoxSegment segment = moverSegment(movers, ray);
    return std::any_of(candidates_.begin(), candidates_.end(), [&](const Candidate& candidate) {
        return segment.touches(candidate.boxWorld) &&
               isBlockedByBatch(movers, candidate.batch, segment, ray);
    });
}

uint32_t MoverReceivers::answer(const MoverView& movers, const GBufferView& gbuffer,
                                View<const uint32_t> samples, const glm::vec3& lightWorld,
                                View<const uint8_t> isAsked, View<uint8_t> isDark) {
    asked_.clear();
    for (uint32_t i = 0; i < samples.count; ++i)
        if (isAsked[i] && !isDark[i])
            asked_.push_back(i);
    if (asked_.empty())
        return 0;
    if (starts_.empty())
        makeStarts(movers, gbuffer, samples);
    const glm::dvec3 lightLocal = glm::dvec3(lightWorld) - movers.geometry.origin;
    findCandidates(movers, lightLocal);
    if (!candidates_.empty())
        for (const uint32_t i : asked_)
            isDark[i] =
                isBlocked(movers, truthRay(starts_[i].plane, starts_[i].startLocal, lightLocal));
    return uint32_t(asked_.size());
}

} // namespace shadowdag
