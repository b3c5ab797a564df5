// SPDX-License-Identifier: Apache-2.0
// Listing map receivers on the CPU.
#include "hybrid/frame/map_receivers_pass.h"

#include "cuda/parallel_for.h"

namespace shadowdag::cpu {

void countMapReceivers(const CountMapReceivers& work) {
    parallelFor<CpuTag>(work.lists.start.count - 1, work, 64);
}
void listMapReceivers(const ListMapReceivers& work) {
    parallelFor<CpuTag>(work.lists.start.count - 1, work, 64);
}

} // namespace shadowdag::cpu
