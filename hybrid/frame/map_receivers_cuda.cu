// SPDX-License-Identifier: Apache-2.0
// Listing map receivers on CUDA.
#include "hybrid/frame/map_receivers_pass.h"

#include "cuda/parallel_for.h"

namespace shadowdag::cuda {

void countMapReceivers(const CountMapReceivers& work) {
    parallelFor<CudaTag>(work.lists.start.count - 1, work);
}
void listMapReceivers(const ListMapReceivers& work) {
    parallelFor<CudaTag>(work.lists.start.count - 1, work);
}

} // namespace shadowdag::cuda
