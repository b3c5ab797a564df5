// SPDX-License-Identifier: Apache-2.0
// The (view sample, light) pairs of a frame, in a defined order: the pairs whose visibility every
// method and the truth compute.
#pragma once

#include "hybrid/gbuffer/gbuffer.h"
#include "scenes/light.h"

#include <algorithm>
#include <vector>

namespace shadowdag {

/// A pair is a view sample and a light that reaches it (scenes/light.h) and that its geometric
/// normal, flipped to the camera, faces.
SDAG_HD inline bool isPair(const Light& light, const glm::vec3& positionWorld,
                           const glm::vec3& normalWorld) {
    return lightsSample(light, positionWorld, normalWorld);
}

/// All pairs of a frame on the host, by sample, lights ascending within a sample.
/// sampleStart: sampleCount + 1, first pair of each sample; light: pairCount, index into the
/// world's lights.
struct PairList {
    std::vector<uint64_t> sampleStart;
    std::vector<uint32_t> light;

    size_t count() const { return light.size(); }
};

/// Returns the pair of a light among those of a sample, or the count of pairs when it has none.
inline uint64_t pairOf(const PairList& pairs, uint32_t sample, uint32_t light) {
    const auto begin = pairs.light.begin() + ptrdiff_t(pairs.sampleStart[sample]),
               end = pairs.light.begin() + ptrdiff_t(pairs.sampleStart[sample + 1]);
    const auto found = std::lower_bound(begin, end, light);
    return found != end && *found == light ? uint64_t(found - pairs.light.begin()) : pairs.count();
}

/// Returns the sample of a pair, which the list stores only in the other direction.
inline uint32_t sampleOfPair(const PairList& pairs, uint64_t pair) {
    const auto after = std::upper_bound(pairs.sampleStart.begin(), pairs.sampleStart.end(), pair);
    return uint32_t(after - pairs.sampleStart.begin() - 1);
}

/// Visibility: 255 lit .. 0 dark; a pair is dark when it is under kHalfLit.
constexpr uint8_t kLit = 255;
constexpr uint8_t kHalfLit = 128;

} // namespace shadowdag
