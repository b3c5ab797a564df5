// SPDX-License-Identifier: Apache-2.0
// Listing and estimating pairs on the CPU.
#include "hybrid/clusters/pairs_pass.h"

#include "cuda/parallel_for.h"

namespace shadowdag::cpu {

void listPairs(const ListPairs& work) {
    parallelFor<CpuTag>(work.gbuffer.count(), work, 1024);
}

void estimatePairs(const EstimatePairs& work) {
    parallelFor<CpuTag>(work.clusters.count(), work, 16);
}

} // namespace shadowdag::cpu
