// SPDX-License-Identifier: Apache-2.0
// What the filters of cube maps and of directional lights' windows share: how a receiver is
// compared, and the result of a tap.
#pragma once

#include "cuda/macros.h"

#include <cstdint>

namespace shadowdag {

/// How a receiver is compared with what the map holds. In texels, never in world units.
struct ShadowMapBias {
    float constantTexels = 0.5f; ///< how many texels before the receiver a blocker is forgiven; 0
                                 ///< leaves what rounding needs
    uint32_t taps = 4;           ///< 1, 4 or 9: see lookupVisibility

    bool operator==(const ShadowMapBias&) const = default;
};

/// A texel of a map.
struct CubeTexel {
    uint32_t face, x, y;
};

/// Returns how many texels a side of the filter has.
SDAG_HD inline uint32_t filterSide(uint32_t taps) {
    return taps >= 9 ? 3 : taps >= 4 ? 2 : 1;
}

/// A tap whose ray meets the receiver's plane more than this many texels before the receiver tests
/// another place and is omitted (see lookupVisibility). Measured in FILTERS.md.
constexpr float kLowTapTexels = 6.0f;

/// The result of a tap.
enum class TapAnswer : uint8_t { kLit, kDark, kMissing };

} // namespace shadowdag
