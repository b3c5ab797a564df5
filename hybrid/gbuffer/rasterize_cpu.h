// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "cuda/buffer.h"
#include "hybrid/gbuffer/gbuffer_raster.h"

namespace shadowdag {

/// Draws the batches that may be seen into the visibility buffer, on the CPU: the bits of drawing
/// by slot. Up to four threads draw into buffers of their own, if these take at most 256 MiB
/// together. A poll for a cancelled frame comes after every 512 batches.
/// @param parts memory of this function, of any content
void rasterizeFrontToBack(const BatchesInView& work, Buffer<uint64_t>& parts);

} // namespace shadowdag
