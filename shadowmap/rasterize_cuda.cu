// SPDX-License-Identifier: Apache-2.0
#include "shadowmap/rasterize_pass.h"

#include "cuda/parallel_for.h"

namespace shadowdag::cuda {

void rasterizeTriangles(const RasterizeTriangle& items) {
    parallelFor<CudaTag>(items.view.draws.count * items.view.slotsPerDraw, items,
                         4 * items.view.slotsPerDraw);
}

void rasterizeLargeTriangles(const SplitWorkView& large, const RasterizeLargeTriangle& items) {
    parallelForParts<CudaTag>(large, items);
}

} // namespace shadowdag::cuda
