// SPDX-License-Identifier: Apache-2.0
// Lists the clusters that read each shadow map.
#pragma once

#include "cuda/buffer.h"
#include "cuda/fill_pass.h"
#include "cuda/pass.h"
#include "cuda/scan_sort.h"
#include "hybrid/frame/map_receivers.h"

namespace shadowdag {

/// The list on one backend.
struct MapReceivers {
    explicit MapReceivers(Backend backend)
        : first(backend, "first map receiver"), list(backend, "map receivers") {}

    Buffer<uint32_t> first; ///< clusterCount + 1
    Buffer<MapReceiver> list;
};

/// Replaces the list by the receivers of these lists of lights, by cluster. Deterministic. All
/// views live on the backend.
/// @param isPadded allocates every (cluster, light) pair instead of waiting for the actual number
inline void listReceivers(Backend backend, const ClusterLightsView& lists,
                          const ServerOfRecord& servers, MapReceivers& receivers,
                          bool isPadded = false) {
    receivers.first.resize(lists.start.count);
    receivers.list.resize(isPadded ? lists.lights.count : 0);
    fillAll(backend, {receivers.first, {receivers.list, 0xff}}); // kNoMap
    runPass(backend, CountMapReceivers{lists, servers, receivers.first.view()});
    if (isPadded) {
        prefixSums(backend, receivers.first.view(), receivers.first.view());
    } else {
        receivers.list.resize(
            exclusiveScan(backend, receivers.first.view(), receivers.first.view()));
    }
    runPass(backend,
            ListMapReceivers{lists, servers, receivers.first.view(), receivers.list.view()});
}

} // namespace shadowdag
