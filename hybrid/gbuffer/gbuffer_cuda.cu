// SPDX-License-Identifier: Apache-2.0
// The G-buffer passes on CUDA: a thread a triangle, a warp a tile of large ones, then a
// thread a pixel.
#include "hybrid/gbuffer/gbuffer_pass.h"

#include "cuda/parallel_for.h"

namespace shadowdag::cuda {

void rasterizeSlots(const RasterizeSlots& work) {
    parallelFor<CudaTag>(work.batches.batches.count * work.slotsPerBatch, work);
}

void rasterizeLarge(const SplitWorkView& large, const RasterizeLarge& work) {
    parallelForParts<CudaTag>(large, work);
}

void resolveSamples(const ResolveSamples& work) {
    parallelFor<CudaTag>(work.visibility.count, work);
}

} // namespace shadowdag::cuda
