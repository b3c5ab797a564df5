// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "cuda/buffer.h"
#include "hybrid/gbuffer/gbuffer_raster.h"

namespace shadowdag {

/// Draws the batches that may be seen into the visibility buffer, on the CPU: the bits of
/// RasterizeBatches, sooner.
/// @param parts memory of this function, of any content
void rasterizeFrontToBack(const RasterizeBatches& work, Buffer<uint64_t>& parts);

} // namespace shadowdag
