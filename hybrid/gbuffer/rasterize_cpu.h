// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hybrid/gbuffer/gbuffer_raster.h"

namespace shadowdag {

/// Draws the batches that may be seen into the visibility buffer, on the CPU: the bits of drawing
/// by slot. A frame that is cancelled ends before the next band of the picture.
/// @param vertices of the same batches
/// @param batchesPerRound every band draws so many before the first draws more: cancelling waits
/// for these
void rasterizeFrontToBack(const BatchesInView& work, const BatchVerticesView& vertices,
                          size_t batchesPerRound = 32768);

} // namespace shadowdag
