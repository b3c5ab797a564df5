// SPDX-License-Identifier: Apache-2.0
// The G-buffer passes on CUDA: a thread a triangle, then a thread a pixel.
#include "hybrid/gbuffer_pass.h"

#include "cuda/parallel_for.h"

namespace shadowdag::cuda {

namespace {

struct DrawSlot {
    RasterizeBatches work;
    SDAG_HD void operator()(size_t slot) const { work.drawSlot(slot); }
};

} // namespace

void rasterizeBatches(const RasterizeBatches& work) {
    parallelFor<CudaTag>(work.batches.count * work.slotsPerBatch, DrawSlot{work});
}

void resolveSamples(const ResolveSamples& work) {
    parallelFor<CudaTag>(work.visibility.count, work);
}

} // namespace shadowdag::cuda
