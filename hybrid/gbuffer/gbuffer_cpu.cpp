// SPDX-License-Identifier: Apache-2.0
// The G-buffer passes on the CPU: a thread takes a few batches at a time; or as a GPU
// draws.
#include "hybrid/gbuffer/gbuffer_pass.h"

#include "cuda/parallel_for.h"

namespace shadowdag::cpu {

void rasterizeBatches(const RasterizeBatches& work) {
    parallelFor<CpuTag>(work.batches.count, work, 8);
}

void rasterizeSlots(const RasterizeSlots& work) {
    parallelFor<CpuTag>(work.batches.batches.count * work.slotsPerBatch, work);
}

void rasterizeLarge(const SplitWorkView& large, const RasterizeLarge& work) {
    parallelForParts<CpuTag>(large, work);
}

void resolveSamples(const ResolveSamples& work) {
    parallelFor<CpuTag>(work.visibility.count, work, 4096);
}

} // namespace shadowdag::cpu
