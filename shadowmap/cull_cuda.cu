// SPDX-License-Identifier: Apache-2.0
#include "shadowmap/cull_pass.h"

#include "cuda/parallel_for.h"

namespace shadowdag::cuda {

void gatherBlocks(const GatherBlock& items) {
    parallelFor<CudaTag>(items.blocks.count, items, 1024);
}
void countDraws(const CountDraws& items) {
    parallelFor<CudaTag>(items.drawCounts.count, items, 4);
}
void listDraws(const ListDraws& items) {
    parallelFor<CudaTag>(items.firstDraw.count, items, 4);
}

} // namespace shadowdag::cuda
