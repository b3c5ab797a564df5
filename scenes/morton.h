// SPDX-License-Identifier: Apache-2.0
// Morton (Z-order) codes of points in a box, by which boxes and triangles are sorted.
#pragma once

#include "scenes/box.h"

#include <cstdint>

namespace shadowdag {

constexpr uint32_t kMortonAxisBits = 21; ///< 3 * 21 <= 63 bits a code

/// Returns the low 21 bits of x, two zero bits between neighbours.
SDAG_HD inline uint64_t spreadBits3(uint64_t x) {
    x &= 0x1fffff;
    x = (x | x << 32) & 0x001f00000000ffffull;
    x = (x | x << 16) & 0x001f0000ff0000ffull;
    x = (x | x << 8) & 0x100f00f00f00f00full;
    x = (x | x << 4) & 0x10c30c30c30c30c3ull;
    x = (x | x << 2) & 0x1249249249249249ull;
    return x;
}

/// Returns the Morton code of a cell, x in the lowest bit of each triple.
SDAG_HD inline uint64_t mortonCode(uint32_t x, uint32_t y, uint32_t z) {
    return spreadBits3(x) | spreadBits3(y) << 1 | spreadBits3(z) << 2;
}

/// Returns the Morton code of a point on a grid of 2^21 cells an axis over a cube at the box's
/// minimum with the box's longest side. Points outside go to the nearest cell; an empty or flat box
/// gives 0.
SDAG_HD inline uint64_t mortonCode(const glm::vec3& p, const Box& bounds) {
    const glm::vec3 e = bounds.extent();
    const float side = glm::max(e.x, glm::max(e.y, e.z));
    if (!(side > 0.0f))
        return 0;
    constexpr float kLast = float((1u << kMortonAxisBits) - 1);
    const glm::vec3 q = (p - bounds.min) / side * kLast;
    // Written so that a NaN becomes 0.
    const auto cell = [](float c) { return c > 0.0f ? uint32_t(c < kLast ? c : kLast) : 0u; };
    return mortonCode(cell(q.x), cell(q.y), cell(q.z));
}

} // namespace shadowdag
