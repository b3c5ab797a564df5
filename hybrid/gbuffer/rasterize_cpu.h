// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hybrid/gbuffer/gbuffer_raster.h"

namespace shadowdag {

/// Draws the batches that may be seen into the visibility buffer, on the CPU: the bits of drawing
/// by slot. A poll for a cancelled frame comes after every 4096 batches.
/// @param vertices of the same batches
void rasterizeFrontToBack(const BatchesInView& work, const BatchVerticesView& vertices);

} // namespace shadowdag
