// SPDX-License-Identifier: Apache-2.0
// Listing pairs on the CPU.
#include "hybrid/pairs_pass.h"

#include "cuda/parallel_for.h"

namespace shadowdag::cpu {

void listPairs(const ListPairs& work) {
    parallelFor<CpuTag>(work.gbuffer.count(), work, 1024);
}

} // namespace shadowdag::cpu
