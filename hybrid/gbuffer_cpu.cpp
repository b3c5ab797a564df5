// SPDX-License-Identifier: Apache-2.0
// The G-buffer passes on the CPU: a thread takes a few batches at a time.
#include "hybrid/gbuffer_pass.h"

#include "cuda/parallel_for.h"

namespace shadowdag::cpu {

void rasterizeBatches(const RasterizeBatches& work) {
    parallelFor<CpuTag>(
        work.batches.count, [&work](size_t b) { work.drawBatch(b); }, 8);
}

void resolveSamples(const ResolveSamples& work) {
    parallelFor<CpuTag>(work.visibility.count, work, 4096);
}

} // namespace shadowdag::cpu
