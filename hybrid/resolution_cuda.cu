// SPDX-License-Identifier: Apache-2.0
// Resolution demands on CUDA.
#include "hybrid/resolution_pass.h"

#include "cuda/parallel_for.h"

namespace shadowdag::cuda {

void demandResolution(const DemandResolution& work) {
    parallelFor<CudaTag>(work.clusters.count(), work);
}

} // namespace shadowdag::cuda
