// SPDX-License-Identifier: Apache-2.0
// The cluster passes whose items have many samples, on CUDA: one warp per item.
#include "hybrid/clusters/cluster_pass.h"
#include "hybrid/clusters/light_assign_pass.h"
#include "hybrid/clusters/pairs_pass.h"
#include "hybrid/clusters/prune_pass.h"

#include "scenes/wide_bvh_warp.h"

namespace shadowdag {

namespace {

// One warp per tile: the other lanes read what one lane counts after the barrier. The loads of
// several blocks are under way at once.
__global__ void fillTilesKernel(FillTile work) {
    constexpr uint32_t kAtOnce = 8;
    static_assert(FillTile::kBlockCount % kAtOnce == 0);
    const size_t tile = warpOfGrid();
    if (tile >= work.grid.tileCount())
        return;
    const uint32_t lane = laneOfWarp();
    for (uint32_t first = 0; first < FillTile::kBlockCount; first += kAtOnce) {
        uint32_t clusters[kAtOnce], same[kAtOnce];
        for (uint32_t k = 0; k < kAtOnce; ++k)
            clusters[k] = work.find(tile, first + k, lane);
        for (uint32_t k = 0; k < kAtOnce; ++k)
            same[k] = lanesWithSame(clusters[k]);
        for (uint32_t k = 0; k < kAtOnce; ++k) {
            const FillTile::Placed placed = work.place(tile, first + k, lane, clusters[k],
                                                       lanesBefore(same[k]), same[k] >> lane == 1);
            __syncwarp();
            work.advance(placed);
            __syncwarp();
        }
    }
}

// One warp per cluster.
__global__ void boundBySamplesKernel(BoundBySamples work) {
    const size_t cluster = warpOfGrid();
    if (cluster >= work.clusters.count())
        return;
    const uint32_t lane = threadIdx.x % kGroupLanes;
    Box box = work.part(cluster, lane, kGroupLanes);
    for (unsigned apart = kGroupLanes / 2; apart > 0; apart /= 2) {
        Box other;
        for (int axis = 0; axis < 3; ++axis) {
            other.min[axis] = __shfl_xor_sync(kAllLanes, box.min[axis], int(apart));
            other.max[axis] = __shfl_xor_sync(kAllLanes, box.max[axis], int(apart));
        }
        box.add(other);
    }
    if (lane == 0)
        work.store(cluster, box);
}

/// Returns the cluster of an entry of the lists, which is below the last start.
__device__ size_t clusterOfEntry(View<const uint32_t> start, size_t entry) {
    size_t first = 0, end = start.count - 1; // the last cluster that starts at it or before
    while (end - first > 1) {
        const size_t middle = first + (end - first) / 2;
        (start[middle] <= entry ? first : end) = middle;
    }
    return first;
}

// One block per cluster, whose samples its caches then hold: a warp takes an entry of its list, a
// sample a lane.
__global__ void pruneFacingKernel(PruneFacing work) {
    constexpr uint32_t kWarps = kBlockThreads / kGroupLanes;
    const size_t cluster = blockIdx.x;
    const uint32_t first = work.clusters.sampleStart[cluster],
                   end = work.clusters.sampleStart[cluster + 1],
                   entryEnd = work.lists.start[cluster + 1];
    for (uint32_t entry = work.lists.start[cluster] + threadIdx.x / kGroupLanes; entry < entryEnd;
         entry += kWarps) {
        const Light light = work.lights[work.lists.lights[entry]];
        uint32_t pairs = 0;
        for (uint32_t i = first; i < end && pairs == 0; i += kGroupLanes) {
            const uint32_t at = i + laneOfWarp();
            const uint32_t sample = at < end ? work.clusters.samples[at] : 0;
            pairs = __ballot_sync(kAllLanes,
                                  at < end && isPair(light, work.gbuffer.positionWorld[sample],
                                                     work.gbuffer.normalWorld[sample]));
        }
        if (laneOfWarp() == 0)
            work.record[entry] = pairs != 0 ? 0 : kProvenLit;
    }
}

// One warp per entry of a cluster's list, one of the samples from which pairs are estimated a lane.
__global__ void estimatePairsKernel(EstimatePairs work) {
    const View<const uint32_t> start = work.lists.start;
    const size_t entry = warpOfGrid();
    if (entry >= start[start.count - 1] || work.lists.record[entry] == kProvenLit)
        return;
    const size_t cluster = clusterOfEntry(start, entry);
    const Light light = work.lights[work.lists.lights[entry]];
    const uint32_t first = work.clusters.sampleStart[cluster],
                   end = work.clusters.sampleStart[cluster + 1];
    uint32_t facing = 0;
    for (uint32_t i = first; i < end; i += kPairStride * kGroupLanes) {
        const uint32_t at = i + kPairStride * laneOfWarp();
        const uint32_t sample = at < end ? work.clusters.samples[at] : 0;
        facing += __popc(
            __ballot_sync(kAllLanes, at < end && isPair(light, work.gbuffer.positionWorld[sample],
                                                        work.gbuffer.normalWorld[sample])));
    }
    if (laneOfWarp() == 0)
        work.add(entry, facing, end - first);
}

/// forLightsOfCluster, by all lanes of a warp: calls hit(light, whether this lane's light may reach
/// the cluster) by all of them.
template <class Work, class Hit>
__device__ void forLightsByWarp(const Work& work, size_t cluster, const Hit& hit) {
    const Box box = work.boxesWorld[cluster];
    traverseByWarp(
        work.lightBvh, work.lightBvh.levelCount - 1, 0, topBoxCount(work.lightBvh),
        [&](const Box& sphere) { return overlaps(sphere, box); },
        [&](uint32_t first, uint32_t bits) {
            const uint32_t light =
                bits >> laneOfWarp() & 1u ? work.lightBvh.items[first + laneOfWarp()] : kNoBvhItem;
            hit(light, light != kNoBvhItem &&
                           reachesCluster(work.lights, box, work.normals, cluster, light));
        });
}

// One warp per cluster.
__global__ void countClusterLightsKernel(CountClusterLights work) {
    const size_t cluster = warpOfGrid();
    if (cluster >= work.boxesWorld.count)
        return;
    uint32_t found = 0;
    if (!work.boxesWorld[cluster].empty())
        forLightsByWarp(work, cluster, [&](uint32_t, bool isReached) { found += isReached; });
    found = sumOfWarp(found);
    if (laneOfWarp() == 0)
        work.count[cluster] = found;
}

// One warp per cluster.
__global__ void fillClusterLightsKernel(FillClusterLights work) {
    const size_t cluster = warpOfGrid();
    if (cluster >= work.boxesWorld.count)
        return;
    const size_t begin = work.start[cluster], end = work.start[cluster + 1];
    if (end > work.clusterLights.count) {
        for (size_t i = begin + laneOfWarp(); i < work.clusterLights.count; i += kGroupLanes)
            work.clusterLights[i] = 0;
        return;
    }
    if (begin == end)
        return;
    uint32_t* const list = work.clusterLights.data + begin;
    uint32_t count = 0;
    forLightsByWarp(work, cluster, [&](uint32_t light, bool isReached) {
        const uint32_t reached = __ballot_sync(kAllLanes, isReached);
        if (isReached)
            list[count + lanesBefore(reached)] = light;
        count += __popc(reached);
    });
    sortByWarp(list, count);
}

} // namespace

void launchPass(CudaTag, const CountClusterLights& work) {
    launch(countClusterLightsKernel, blocksOfWarps(work.itemCount()), work);
}

void launchPass(CudaTag, const FillClusterLights& work) {
    launch(fillClusterLightsKernel, blocksOfWarps(work.itemCount()), work);
}

void launchPass(CudaTag, const FillTile& work) {
    launch(fillTilesKernel, blocksOfWarps(work.itemCount()), work);
}

void launchPass(CudaTag, const BoundBySamples& work) {
    launch(boundBySamplesKernel, blocksOfWarps(work.itemCount()), work);
}

void launchPass(CudaTag, const PruneFacing& work) {
    launch(pruneFacingKernel, work.itemCount(), work);
}

void launchPass(CudaTag, const EstimatePairs& work) {
    launch(estimatePairsKernel, blocksOfWarps(work.lists.lights.count), work);
}

} // namespace shadowdag
