// SPDX-License-Identifier: Apache-2.0
// Pruning on CUDA: a thread a (cluster, light) pair, for a cluster may have a thousand samples and
// as many lights.
#include "hybrid/clusters/prune_pass.h"

#include "cuda/parallel_for.h"

namespace shadowdag::cuda {

void pruneFacing(const PruneFacing& work) {
    parallelFor<CudaTag>(work.lists.lights.count, PruneEntry{work});
}

} // namespace shadowdag::cuda
