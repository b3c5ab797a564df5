// SPDX-License-Identifier: Apache-2.0
#include "shadowmap/cull_pass.h"

#include "cuda/parallel_for.h"

namespace shadowdag::cuda {

void gatherBlocks(const GatherBlock& items) {
    parallelFor<CudaTag>(items.blocks.count, items, 1024);
}
void countReached(const CountReached& items) {
    parallelFor<CudaTag>(items.reachedCounts.count, items, 4);
}
void listReached(const ListReached& items) {
    parallelFor<CudaTag>(items.firstReached.count, items, 4);
}
void countDraws(const CountDraws& items) {
    parallelFor<CudaTag>(items.drawCounts.count, items, 4);
}
void listDraws(const ListDraws& items) {
    parallelFor<CudaTag>(items.firstDraw.count, items, 4);
}

} // namespace shadowdag::cuda
