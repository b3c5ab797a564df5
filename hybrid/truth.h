// SPDX-License-Identifier: Apache-2.0
// The truth: Embree's answer for every pair. The only door to Embree besides embree_baseline.
#pragma once

#include "hybrid/pairs.h"
#include "scenes/world.h"

#include <memory>
#include <vector>

namespace shadowdag {

/// What blocks a pair according to the truth.
struct TruthBlocker {
    uint32_t triangle = kBackground; ///< world triangle, kBackground when lit
    float distanceWorld = 0;         ///< from the sample
};

/// Embree over the triangles of a world at its current time. Robust flag; both ends moved by a derived error bound so that
/// it does not hit the receiver itself; ends short of the light. The processor's float mode is saved and restored around Embree's calls.
class Truth {
public:
    /// Builds over all triangles (static and moving), two-sided.
    explicit Truth(const World& world);
    ~Truth();

    /// Rebuilds after World::setTime.
    void update(const World& world);

    /// Returns per pair 255 (lit) or 0 (dark). Deterministic.
    std::vector<uint8_t> visibility(const GBufferView& gbuffer, const std::vector<Light>& lights, const PairList& pairs) const;

    /// Returns whether the segment between two world points is blocked; the ends are used as they are.
    bool isBlocked(const glm::vec3& from, const glm::vec3& to) const;
    /// Returns the blocker nearest to the start of a pair's own truth ray.
    TruthBlocker blocker(const glm::vec3& sampleWorld, const glm::vec3& normalWorld, uint32_t receiverTriangle, const glm::vec3& lightWorld) const;

private:
    struct State;
    std::unique_ptr<State> state_;
};

} // namespace shadowdag
