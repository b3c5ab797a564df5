// SPDX-License-Identifier: Apache-2.0
// Which clusters read which shadow maps: the (cluster, light) pairs whose map is drawn.
#pragma once

#include "hybrid/gbuffer/lights.h"
#include "shadowmap/page_mask.h"

namespace shadowdag {

/// Which map serves a record: an index >= 0, or none. mapOfRecord: by record; empty: its own
/// number.
struct MapOfRecord {
    View<const int> mapOfRecord;

    SDAG_HD int operator()(uint32_t record) const {
        return record == kProvenLit ? -1 : mapOfRecord.empty() ? int(record) : mapOfRecord[record];
    }
};

/// Counts the maps that every cluster reads. counts: clusterCount + 1; the last is not written.
struct CountMapReceivers {
    ClusterLightsView lists;
    MapOfRecord maps;
    View<uint32_t> counts;

    size_t itemCount() const { return lists.start.count - 1; }
    size_t grain() const { return 64; }
    SDAG_HD void operator()(size_t cluster) const {
        uint32_t count = 0;
        for (uint32_t i = lists.start[cluster]; i < lists.start[cluster + 1]; ++i)
            count += maps(lists.record[i]) >= 0;
        counts[cluster] = count;
    }
};

/// Writes them, by cluster, in the order of its lights. A list may have room to spare: entries
/// beyond the last are of no map (kNoMap, as the list was before).
struct ListMapReceivers {
    ClusterLightsView lists;
    MapOfRecord maps;
    View<const uint32_t> first; ///< the exclusive scan of the counts
    View<MapReceiver> receivers;

    size_t itemCount() const { return lists.start.count - 1; }
    size_t grain() const { return 64; }
    SDAG_HD void operator()(size_t cluster) const {
        uint32_t next = first[cluster];
        for (uint32_t i = lists.start[cluster]; i < lists.start[cluster + 1]; ++i) {
            const int map = maps(lists.record[i]);
            if (map >= 0)
                receivers[next++] = {uint32_t(cluster), uint32_t(map)};
        }
    }
};

} // namespace shadowdag
