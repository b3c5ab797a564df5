// SPDX-License-Identifier: Apache-2.0
// What an alpha mask does to a family of segments: opaque, open, or both. Part of the adjudicator;
// its texels are found from the documented rule (scenes/alpha_mask.h), not by its code.
#pragma once

#include "hybrid/judge/segment_family.h"

namespace shadowdag {

/// The texels of a triangle that a family may cross.
enum class MaskPatch : uint8_t { kOpaque, kOpen, kMixed };

/// Returns what the mask of a triangle has where the segments cross its plane; kOpaque for a
/// triangle without mask, kMixed where the crossings cannot be bounded or are too many to look at.
MaskPatch maskPatch(const TriangleView& triangles, uint32_t triangle, const SegmentFamily& family);

} // namespace shadowdag
