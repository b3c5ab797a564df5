// SPDX-License-Identifier: Apache-2.0
// The rasterization passes; see rasterize.h for the fill rule and the depth convention.
#pragma once

#include "cuda/pass.h"
#include "cuda/split_work.h"
#include "shadowmap/page_floors.h"
#include "shadowmap/rasterize.h"

#include <vector>

namespace shadowdag {

/// Draws every draw's batch: first the small triangles, then the large ones page by page. All views
/// are on the backend, and so are `large` and `setups`, which are overwritten.
inline void rasterizeTriangles(Backend backend, const RasterView& view, SplitWork& large,
                               Buffer<FaceTriangle>& setups) {
    const SplitWorkView list = large.begin();
    setups.resize(large.capacity());
    runPass(backend, RasterizeTriangle{view, list, setups.view()});
    runPass(backend, RasterizeLargeTriangle{view, list, setups.view()});
}

/// Pages that rasterizeByFace clears.
struct PagesToClear {
    View<const uint32_t> entries; ///< of the page table, ascending
    View<const uint32_t> pageTable;
};

/// Draws the same on the CPU, bit for bit, without atomics: an item a face of a map, which one
/// thread owns.
/// Batches are drawn front to back, and those that are hidden are skipped.
/// @param vertices of view.batches
/// @param drawStart mapCount + 1; draws of map m are [drawStart[m], drawStart[m + 1])
/// @param boxesWorld of the batches @param pageFloors one a page of the pool; {0,
/// PageFloors::kUnknownRows} where nothing is known; written
/// @param toClear cleared before their face is drawn, so that they are in the cache then
void rasterizeByFace(const RasterView& view, const BatchVerticesView& vertices,
                     const std::vector<uint32_t>& drawStart, View<const Box> boxesWorld,
                     View<PageFloor> pageFloors, const PagesToClear& toClear);

} // namespace shadowdag
