// SPDX-License-Identifier: Apache-2.0
// Listing pairs on CUDA.
#include "hybrid/pairs_pass.h"

#include "cuda/parallel_for.h"

namespace shadowdag::cuda {

void listPairs(const ListPairs& work) {
    parallelFor<CudaTag>(work.gbuffer.count(), work);
}

} // namespace shadowdag::cuda
