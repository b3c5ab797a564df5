// SPDX-License-Identifier: Apache-2.0
// Light assignment on the CPU.
#include "hybrid/clusters/light_assign_pass.h"

#include "cuda/parallel_for.h"

namespace shadowdag::cpu {

void countClusterLights(const CountClusterLights& work) {
    parallelFor<CpuTag>(work.boxesWorld.count, work, 64);
}
void fillClusterLights(const FillClusterLights& work) {
    parallelFor<CpuTag>(work.boxesWorld.count, work, 64);
}
void clampStarts(const ClampStarts& work) {
    parallelFor<CpuTag>(work.start.count, work, 4096);
}
void rankLights(const RankLights& work) {
    parallelFor<CpuTag>(work.items.count, work, 4096);
}
void orderClusterLights(const OrderClusterLights& work) {
    parallelFor<CpuTag>(work.lists.start.count - 1, work, 64);
}

} // namespace shadowdag::cpu
