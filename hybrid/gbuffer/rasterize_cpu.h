// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hybrid/gbuffer/gbuffer_raster.h"

namespace shadowdag {

constexpr size_t kBatchesBetweenPolls = 32768;

/// Draws the batches that may be seen into the visibility buffer, on the CPU: the bits of drawing
/// by slot. A poll for a cancelled frame comes after every kBatchesBetweenPolls batches.
/// @param vertices of the same batches
void rasterizeFrontToBack(const BatchesInView& work, const BatchVerticesView& vertices);

} // namespace shadowdag
