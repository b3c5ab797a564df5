// SPDX-License-Identifier: Apache-2.0
// Runs on CUDA.
#include "cuda/parallel_for.h"
#include "cuda/runs_pass.h"

namespace shadowdag::cuda {

void markRunStarts(const MarkRunStarts& work) {
    parallelFor<CudaTag>(work.keys.count, work);
}
void listRunStarts(const ListRunStarts& work) {
    parallelFor<CudaTag>(work.next.count, work);
}

} // namespace shadowdag::cuda
