// SPDX-License-Identifier: Apache-2.0
// Light assignment on the CPU.
#include "hybrid/light_assign_pass.h"

#include "cuda/parallel_for.h"

namespace shadowdag::cpu {

void countClusterLights(const CountClusterLights& work) {
    parallelFor<CpuTag>(work.boxesWorld.count, work, 64);
}
void fillClusterLights(const FillClusterLights& work) {
    parallelFor<CpuTag>(work.boxesWorld.count, work, 64);
}

} // namespace shadowdag::cpu
