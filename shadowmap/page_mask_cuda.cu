// SPDX-License-Identifier: Apache-2.0
#include "shadowmap/page_mask_pass.h"

#include "cuda/parallel_for.h"

namespace shadowdag::cuda {

void markReceivers(const MarkReceiver& items) {
    parallelFor<CudaTag>(items.receivers.count, items);
}
void countPages(const CountPages& items) {
    parallelFor<CudaTag>(items.pages.count, items, 4096);
}
void countPagesOfMaps(const CountPagesOfMaps& items) {
    parallelFor<CudaTag>(items.maps.count, items);
}

} // namespace shadowdag::cuda
