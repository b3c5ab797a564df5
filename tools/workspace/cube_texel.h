// SPDX-License-Identifier: Apache-2.0
// Computes with integers the face of a cube and the texel that a direction projects on: the
// reference for float lookups.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>

namespace shadowdag {

/// A column or row by integers: the one that contains coordinate c / depth of a face of n texels,
/// floor((c / depth + 1) n / 2), and the one across a border that is nearer than n 2^-22 texels,
/// which is the rounding of floats (both centres, their quotient, the sum and the product: a unit
/// of 2^-24 each).
struct ExactCell {
    int64_t cell, other;
    ExactCell(int64_t c, int64_t depth, int64_t n) {
        const int64_t numerator = (c + depth) * n, denominator = 2 * depth; // >= 0 on the face
        cell = numerator / denominator;
        const int64_t below = numerator - cell * denominator, above = denominator - below;
        const int64_t rounding = (denominator * n >> 22) + 1;
        other = below < rounding ? cell - 1 : above < rounding ? cell + 1 : cell;
        cell = std::min(cell, n - 1);
        other = std::clamp<int64_t>(other, 0, n - 1);
    }
    bool isTie() const { return cell != other; }
    bool holds(uint32_t texel) const { return texel == cell || texel == other; }
};

using Int3 = std::array<int64_t, 3>;

/// Returns the face of an integer direction: that of the first of its largest components; odd if it
/// is negative.
inline uint32_t exactFace(const Int3& direction) {
    size_t major = 0;
    for (size_t a = 1; a < 3; ++a)
        if (std::abs(direction[a]) > std::abs(direction[major]))
            major = a;
    return uint32_t(2 * major + (direction[major] < 0));
}

/// A texel by integers.
struct ExactTexel {
    uint32_t face;
    ExactCell x, y;
};

/// Returns the texel that holds the direction through column x, row y of a face of n texels; either
/// may lie beyond the border. That direction, times n, is (2 x + 1 - n, 2 y + 1 - n, n) in the
/// face's own frame, the last along the face's axis.
inline ExactTexel exactTexel(uint32_t face, int64_t x, int64_t y, int64_t n) {
    Int3 d{};
    const size_t axis = face / 2;
    d[axis] = face & 1 ? -n : n;
    d[(axis + 1) % 3] = 2 * x + 1 - n;
    d[(axis + 2) % 3] = 2 * y + 1 - n;
    const uint32_t to = exactFace(d);
    const int64_t depth = std::abs(d[to / 2]);
    return {to, ExactCell(d[(to / 2 + 1) % 3], depth, n), ExactCell(d[(to / 2 + 2) % 3], depth, n)};
}

} // namespace shadowdag
