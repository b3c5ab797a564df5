// SPDX-License-Identifier: Apache-2.0
// Lists the lights of every cluster.
#pragma once

#include "cuda/buffer.h"
#include "cuda/fill_pass.h"
#include "cuda/pass.h"
#include "cuda/scan_sort.h"
#include "hybrid/clusters/cluster_lights.h"

#include <algorithm>

namespace shadowdag {

/// The lists on one backend.
struct ClusterLights {
    explicit ClusterLights(Backend backend)
        : start(backend, "cluster light start"), lights(backend, "cluster lights"),
          record(backend, "cluster light maps"), length(backend, "cluster light count", 1) {}

    Buffer<uint32_t> start;
    Buffer<uint32_t> lights;
    Buffer<uint32_t> record; ///< 0; kProvenLit where pruned; then by gatherDemand
    Buffer<uint32_t> length; ///< of guessed lists: how many entries there are

    ClusterLightsView view() const { return {start.view(), lights.view(), record.view()}; }
};

/// Replaces the lists by those of these clusters. Deterministic. Throws Error kResource when there
/// are 2^32 (cluster, light) pairs or more. All views live on the backend.
/// @param normals drops lights that a cluster faces away from; empty: none
/// @param guess number of entries to allocate without waiting for the actual number: lists.length
/// then gives that, and if it is larger, the lists are unusable; 0: waits. It also waits if there
/// may be 2^32 entries
/// @returns whether it guessed
inline bool assignLights(Backend backend, View<const Box> clusterBoxes, const WideBvhView& lightBvh,
                         View<const Light> lights, ClusterLights& lists,
                         const ClusterNormalsView& normals = {}, size_t guess = 0) {
    const size_t count = clusterBoxes.count;
    const uint64_t most = uint64_t(count) * lights.count;
    const bool isGuessed = guess > 0 && most > 0 && most <= 0xffffffffull;
    uint64_t total = std::min(uint64_t(guess), most);
    lists.start.resize(count + 1);
    if (isGuessed) {
        lists.record.resize(total);
        fillAll(backend, {lists.start, lists.record});
    } else {
        lists.start.fill(0);
    }
    runPass(backend,
            CountClusterLights{clusterBoxes, lightBvh, lights, normals, lists.start.view()});
    if (isGuessed)
        prefixSums(backend, lists.start.view(), lists.start.view());
    else
        total = exclusiveScan(backend, lists.start.view(), lists.start.view());
    if (total > 0xffffffffull)
        throw Error(ErrorKind::kResource, std::to_string(total) +
                                              " (cluster, light) pairs; at most 2^32 - 1 are "
                                              "supported: use fewer lights or a smaller image");
    lists.lights.resize(total);
    if (!isGuessed) {
        lists.record.resize(total);
        lists.record.fill(0);
    }
    runPass(backend, FillClusterLights{clusterBoxes, lightBvh, lights, normals, lists.start.view(),
                                       lists.lights.view()});
    if (isGuessed)
        runPass(backend, ClampStarts{lists.start.view(), uint32_t(total), lists.length.view()});
    return isGuessed;
}

/// Removes unused entries of lists that were guessed.
/// @param clusterCount,entryCount the actual numbers
inline void trimLights(size_t clusterCount, size_t entryCount, ClusterLights& lists) {
    lists.start.resize(clusterCount + 1);
    lists.lights.resize(entryCount);
    lists.record.resize(entryCount);
}

/// The lists of a frame in the order of RankLights.
struct OrderedLights {
    explicit OrderedLights(Backend backend)
        : rank(backend, "light ranks"), lights(backend, "ordered cluster lights"),
          record(backend, "ordered cluster light maps") {}

    Buffer<uint32_t> rank, lights, record;
};

/// Returns `lists`, records and all, ordered for coherence (OrderClusterLights), in the memory of
/// `ordered`. Sums over a list then round in another order than over an ascending one, always the
/// same for the same lights. All views live on the backend.
inline ClusterLightsView orderLights(Backend backend, const ClusterLightsView& lists,
                                     const WideBvhView& lightBvh, size_t lightCount,
                                     OrderedLights& ordered) {
    ordered.rank.resize(lightCount);
    ordered.lights.resize(lists.lights.count);
    ordered.record.resize(lists.lights.count);
    runPass(backend, RankLights{lightBvh.items, ordered.rank.view()});
    runPass(backend, OrderClusterLights{lists, ordered.rank.view(), ordered.lights.view(),
                                        ordered.record.view()});
    return {lists.start, ordered.lights.view(), ordered.record.view()};
}

} // namespace shadowdag
