// SPDX-License-Identifier: Apache-2.0
// Listing and estimating pairs on CUDA.
#include "hybrid/clusters/pairs_pass.h"

#include "cuda/parallel_for.h"

namespace shadowdag::cuda {

void listPairs(const ListPairs& work) {
    parallelFor<CudaTag>(work.gbuffer.count(), work);
}

void estimatePairs(const EstimatePairs& work) {
    parallelFor<CudaTag>(work.clusters.count(), work);
}

} // namespace shadowdag::cuda
