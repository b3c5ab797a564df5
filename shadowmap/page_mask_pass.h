// SPDX-License-Identifier: Apache-2.0
// The passes from receivers to page masks; see page_mask.h for what an item does.
#pragma once

#include "cuda/backend.h"
#include "shadowmap/page_mask.h"

namespace shadowdag {

namespace cpu {
void markReceivers(const MarkReceiver& items);
void countPages(const CountPages& items);
void countPagesOfMaps(const CountPagesOfMaps& items);
} // namespace cpu

namespace cuda {
void markReceivers(const MarkReceiver& items);
void countPages(const CountPages& items);
void countPagesOfMaps(const CountPagesOfMaps& items);
} // namespace cuda

/// Marks the pages, faces, cells and depths that every receiver needs. All views live on the
/// backend.
inline void markReceivers(Backend backend, const MarkReceiver& items) {
    SDAG_DISPATCH(backend, markReceivers, items);
}
/// Counts the marked pages of every mask word.
inline void countPages(Backend backend, const CountPages& items) {
    SDAG_DISPATCH(backend, countPages, items);
}
/// Counts the marked pages of every map.
inline void countPagesOfMaps(Backend backend, const CountPagesOfMaps& items) {
    SDAG_DISPATCH(backend, countPagesOfMaps, items);
}

} // namespace shadowdag
