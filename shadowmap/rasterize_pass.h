// SPDX-License-Identifier: Apache-2.0
// The rasterization passes; see rasterize.h for the fill rule and the depth convention.
#pragma once

#include "cuda/backend.h"
#include "shadowmap/rasterize.h"

#include <vector>

namespace shadowdag {

namespace cpu {
void rasterizeTriangles(const RasterizeTriangle& items);
} // namespace cpu

namespace cuda {
void rasterizeTriangles(const RasterizeTriangle& items);
} // namespace cuda

/// Draws every draw's batch, an item a triangle. All views live on the backend.
inline void rasterizeTriangles(Backend backend, const RasterizeTriangle& items) {
    SDAG_DISPATCH(backend, rasterizeTriangles, items);
}

/// Draws the same on the CPU, bit for bit, without atomics: an item a face of a map, which one
/// thread owns.
/// @param drawStart mapCount + 1; draws of map m are [drawStart[m], drawStart[m + 1])
void rasterizeByFace(const RasterView& view, const std::vector<uint32_t>& drawStart);

} // namespace shadowdag
