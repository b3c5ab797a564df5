// SPDX-License-Identifier: Apache-2.0
// Pruning on CUDA.
#include "hybrid/prune_pass.h"

#include "cuda/parallel_for.h"

namespace shadowdag::cuda {

void pruneFacing(const PruneFacing& work) {
    parallelFor<CudaTag>(work.clusters.count(), work);
}

} // namespace shadowdag::cuda
