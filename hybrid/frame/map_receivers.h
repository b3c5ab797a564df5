// SPDX-License-Identifier: Apache-2.0
// The clusters that read each shadow map: the (cluster, light) pairs whose map is drawn.
#pragma once

#include "hybrid/clusters/cluster_lights.h"
#include "hybrid/routing/pair_server.h"
#include "shadowmap/page_mask.h"

namespace shadowdag {

/// The source of each record. servers: by record; empty: a map of the record's own number.
struct ServerOfRecord {
    View<const PairServer> servers;

    SDAG_HD PairServer operator()(uint32_t record) const {
        return record == kProvenLit ? PairServer::proof()
               : servers.empty()    ? PairServer::drawnMap(record)
                                    : servers[record];
    }
};

/// Counts the maps that every cluster reads. counts: clusterCount + 1; the last is not written.
struct CountMapReceivers {
    ClusterLightsView lists;
    ServerOfRecord servers;
    View<uint32_t> counts;

    size_t itemCount() const { return lists.start.count - 1; }
    size_t grain() const { return 64; }
    SDAG_HD void operator()(size_t cluster) const {
        uint32_t count = 0;
        for (uint32_t i = lists.start[cluster]; i < lists.start[cluster + 1]; ++i)
            count += servers(lists.record[i]).isMap();
        counts[cluster] = count;
    }
};

/// Writes them, by cluster, in the order of its lights. A list may have unused entries at its end:
/// they have no map (kNoMap, as the list was before).
struct ListMapReceivers {
    ClusterLightsView lists;
    ServerOfRecord servers;
    View<const uint32_t> first; ///< the exclusive scan of the counts
    View<MapReceiver> receivers;

    size_t itemCount() const { return lists.start.count - 1; }
    size_t grain() const { return 64; }
    SDAG_HD void operator()(size_t cluster) const {
        uint32_t next = first[cluster];
        for (uint32_t i = lists.start[cluster]; i < lists.start[cluster + 1]; ++i) {
            const PairServer server = servers(lists.record[i]);
            if (server.isMap())
                receivers[next++] = {uint32_t(cluster), server.map()};
        }
    }
};

} // namespace shadowdag
