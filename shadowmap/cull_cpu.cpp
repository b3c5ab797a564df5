// SPDX-License-Identifier: Apache-2.0
#include "shadowmap/cull_pass.h"

#include "cuda/parallel_for.h"

namespace shadowdag::cpu {

void gatherBlocks(const GatherBlock& items) {
    parallelFor<CpuTag>(items.blocks.count, items, 1024);
}
void countReached(const CountReached& items) {
    parallelFor<CpuTag>(items.reachedCounts.count, items, 4);
}
void listReached(const ListReached& items) {
    parallelFor<CpuTag>(items.firstReached.count - 1, items, 4);
}
void countDraws(const CountDraws& items) {
    parallelFor<CpuTag>(items.counts.count, items, 4);
}
void listDraws(const ListDraws& items) {
    parallelFor<CpuTag>(items.reached.count, items, 4096);
}
void noteCullLengths(const NoteCullLengths& items) {
    parallelFor<CpuTag>(1, items);
}

} // namespace shadowdag::cpu
