// SPDX-License-Identifier: Apache-2.0
// Lists which clusters read which shadow maps.
#pragma once

#include "cuda/buffer.h"
#include "cuda/scan_sort.h"
#include "hybrid/map_receivers.h"

namespace shadowdag {

/// The list on one backend.
struct MapReceivers {
    explicit MapReceivers(Backend backend)
        : first(backend, "first map receiver"), list(backend, "map receivers") {}

    Buffer<uint32_t> first; ///< clusterCount + 1
    Buffer<MapReceiver> list;
};

namespace cpu {
void countMapReceivers(const CountMapReceivers& work);
void listMapReceivers(const ListMapReceivers& work);
} // namespace cpu
namespace cuda {
void countMapReceivers(const CountMapReceivers& work);
void listMapReceivers(const ListMapReceivers& work);
} // namespace cuda

/// Replaces the list by the receivers of these lists of lights, by cluster. Deterministic. All
/// views live on the backend.
inline void listReceivers(Backend backend, const ClusterLightsView& lists, const MapOfRecord& maps,
                          MapReceivers& receivers) {
    receivers.first.resize(lists.start.count);
    receivers.first.fill(0);
    SDAG_DISPATCH(backend, countMapReceivers, {lists, maps, receivers.first.view()});
    receivers.list.resize(exclusiveScan(backend, receivers.first.view(), receivers.first.view()));
    SDAG_DISPATCH(backend, listMapReceivers,
                  {lists, maps, receivers.first.view(), receivers.list.view()});
}

} // namespace shadowdag
