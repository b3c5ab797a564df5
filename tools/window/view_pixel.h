// SPDX-License-Identifier: Apache-2.0
// Everything about one pixel: its pairs, and what each method says of them at what cost.
#pragma once

#include "tools/window/view_request.h"

namespace shadowdag {

class Truth;

/// Returns the report of a sample of a renderer's last frame. Every method answers every pair that
/// it can: voxels and exact rays where there are voxels, the map where the light has one that is
/// drawn, Embree always; each is timed alone, on one thread, by the median of many.
/// @param frame of the same renderer, with the options that it was rendered by
PixelReport reportPixel(FrameRenderer& renderer, const World& world, const Truth& truth,
                        const FrameResult& frame, const FrameOptions& options, uint32_t x,
                        uint32_t y);

} // namespace shadowdag
