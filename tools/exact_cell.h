// SPDX-License-Identifier: Apache-2.0
// Which texel of a cube's face a coordinate falls into, by integers: what float lookups are held
// against.
#pragma once

#include <algorithm>
#include <cstdint>

namespace shadowdag {

/// A column or row by integers: which holds coordinate c / depth of a face of n texels, floor((c /
/// depth + 1) n / 2), and the one across a border that is nearer than n 2^-22 texels, which is what
/// float rounds (both centres, their quotient, the sum and the product: a unit of 2^-24 each).
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

} // namespace shadowdag
