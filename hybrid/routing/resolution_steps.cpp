// SPDX-License-Identifier: Apache-2.0
// The table of resolutions and the choice of one with hysteresis.
#include "hybrid/routing/resolution_steps.h"

#include <algorithm>

namespace shadowdag {

namespace {

// Returns the fourth root of 2^k rounded to nearest: the largest n with (n - 1/2)^4 <= 2^k, that is
// (2n - 1)^4 <= 2^(k + 4). k <= 52: 2n - 1 < 2^15, its fourth power fits 64 bits.
uint32_t fourthRootOfPower(uint32_t k) {
    uint32_t n = 0;
    for (uint32_t bit = 1u << (k / 4 + 1); bit != 0; bit >>= 1) {
        const uint64_t odd = 2 * uint64_t(n + bit) - 1;
        if (odd * odd * odd * odd <= uint64_t(1) << (k + 4))
            n += bit;
    }
    return n;
}

double squared(double v) {
    return v * v;
}

} // namespace

std::vector<uint32_t> makeResolutionSteps(uint32_t maxFaceTexels) {
    std::vector<uint32_t> steps;
    for (uint32_t k = 0; k <= 52; ++k) {
        const uint32_t texels = fourthRootOfPower(k);
        if (texels >= maxFaceTexels)
            break;
        if (steps.empty() || texels > steps.back())
            steps.push_back(texels);
    }
    steps.push_back(maxFaceTexels);
    return steps;
}

std::vector<uint32_t> makeDirectionalResolutionSteps() {
    std::vector<uint32_t> steps = makeResolutionSteps(1u << 13);
    while (steps.back() < 1u << 18)
        steps.push_back(2 * steps[steps.size() - kStepsPerOctave]);
    return steps;
}

uint32_t allocateResolution(const std::vector<uint32_t>& steps, double resolutionSquared,
                            uint32_t minFaceTexels, uint32_t previousFaceTexels) {
    const auto least = [&](double wantedSquared) {
        const auto step = std::find_if(steps.begin(), steps.end(), [&](uint32_t texels) {
            return texels >= minFaceTexels && squared(texels) >= wantedSquared;
        });
        return step == steps.end() ? steps.back() : *step;
    };
    const uint32_t enough = least(resolutionSquared);
    // The resolution kept against shrinking: at most the step of a request 1 / kShrinkBelow times
    // as large.
    const uint32_t kept = least(resolutionSquared / squared(kShrinkBelow));
    return std::clamp(previousFaceTexels, enough, kept);
}

} // namespace shadowdag
