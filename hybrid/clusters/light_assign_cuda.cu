// SPDX-License-Identifier: Apache-2.0
// Light assignment on CUDA.
#include "hybrid/clusters/light_assign_pass.h"

#include "cuda/parallel_for.h"

namespace shadowdag::cuda {

void countClusterLights(const CountClusterLights& work) {
    parallelFor<CudaTag>(work.boxesWorld.count, work);
}
void fillClusterLights(const FillClusterLights& work) {
    parallelFor<CudaTag>(work.boxesWorld.count, work);
}
void clampStarts(const ClampStarts& work) {
    parallelFor<CudaTag>(work.start.count, work);
}
void rankLights(const RankLights& work) {
    parallelFor<CudaTag>(work.items.count, work);
}
void orderClusterLights(const OrderClusterLights& work) {
    parallelFor<CudaTag>(work.lists.start.count - 1, work);
}

} // namespace shadowdag::cuda
