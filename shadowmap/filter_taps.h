// SPDX-License-Identifier: Apache-2.0
// What the filters of cube maps and of directional lights' windows share: how a receiver is
// compared, and the result of a tap.
#pragma once

#include "shadowmap/filter_leaf.h"

#include <cstdint>

namespace shadowdag {

/// How a receiver is compared with what the map holds. In texels, never in world units.
struct ShadowMapBias {
    float constantTexels = 0.5f; ///< how many texels before the receiver a blocker is forgiven; 0
                                 ///< leaves what rounding needs
    uint32_t taps = 4;           ///< 1, 4 or 9: see lookupVisibility

    bool operator==(const ShadowMapBias&) const = default;
};

/// The result of a tap.
enum class TapAnswer : uint8_t { kLit = kTapLit, kDark = kTapDark, kMissing = kTapMissing };

} // namespace shadowdag
