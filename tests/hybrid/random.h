// SPDX-License-Identifier: Apache-2.0
// Seeded uniform numbers and points for property tests.
#pragma once

#include "scenes/split_mix.h"

#include <glm/glm.hpp>

#include <cstddef>
#include <cstdint>

namespace shadowdag::test {

/// The same numbers for the same seed on every system.
class Random {
public:
    explicit Random(uint64_t seed) : state_(seed) {}

    /// Returns the next number in [0, 1).
    double operator()() { return double(splitMix64(state_ += kSplitMixGamma) >> 11) * 0x1p-53; }
    uint32_t below(size_t count) { return uint32_t((*this)() * double(count)); }
    /// Returns a point whose coordinates are in [-half, half).
    glm::vec3 inCube(double half) {
        const double x = (*this)(), y = (*this)(), z = (*this)();
        return glm::vec3((glm::dvec3(x, y, z) * 2.0 - 1.0) * half);
    }

private:
    uint64_t state_;
};

} // namespace shadowdag::test
