// SPDX-License-Identifier: Apache-2.0
// The report of one pixel: its pairs, with the result and the cost of each method.
#pragma once

#include "tools/window/view_request.h"

namespace shadowdag {

class Truth;

/// Returns the report of a sample of a renderer's last frame. Each method computes the pairs that
/// it can: voxels and exact rays if there are voxels, the map if the light has a drawn one, Embree
/// always. Each is timed alone, on one thread, as the median of many repetitions.
/// @param frame of the same renderer, with the options that it was rendered by
PixelReport reportPixel(FrameRenderer& renderer, const World& world, const Truth& truth,
                        const FrameResult& frame, const FrameOptions& options, uint32_t x,
                        uint32_t y);

} // namespace shadowdag
