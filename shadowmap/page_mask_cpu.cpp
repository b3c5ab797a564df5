// SPDX-License-Identifier: Apache-2.0
#include "shadowmap/page_mask_pass.h"

#include "cuda/parallel_for.h"

namespace shadowdag::cpu {

void markReceivers(const MarkReceiver& items) {
    parallelFor<CpuTag>(items.receivers.count, items);
}
void countPages(const CountPages& items) {
    parallelFor<CpuTag>(items.pages.count, items, 4096);
}
void countPagesOfMaps(const CountPagesOfMaps& items) {
    parallelFor<CpuTag>(items.maps.count, items, 4);
}

} // namespace shadowdag::cpu
