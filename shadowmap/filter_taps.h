// SPDX-License-Identifier: Apache-2.0
// Shared by the filters of cube maps and of directional lights' windows: the settings of the
// comparison, and the result of a tap.
#pragma once

#include "shadowmap/filter_leaf.h"

#include <cstdint>

namespace shadowdag {

/// How a receiver is compared with the depths of the map. In texels, never in world units.
struct ShadowMapBias {
    float constantTexels = 0.5f; ///< how far before the receiver a blocker is ignored, in texels; 0
                                 ///< covers rounding only
    uint32_t taps = 4;           ///< 1, 4 or 9: see lookupVisibility

    bool operator==(const ShadowMapBias&) const = default;
};

/// The result of a tap.
enum class TapResult : uint8_t { kLit = kTapLit, kDark = kTapDark, kMissing = kTapMissing };

} // namespace shadowdag
