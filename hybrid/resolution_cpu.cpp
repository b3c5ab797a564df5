// SPDX-License-Identifier: Apache-2.0
// Resolution demands on the CPU.
#include "hybrid/resolution_pass.h"

#include "cuda/parallel_for.h"

namespace shadowdag::cpu {

void demandResolution(const DemandResolution& work) {
    parallelFor<CpuTag>(work.clusters.count(), work, 64);
}

} // namespace shadowdag::cpu
