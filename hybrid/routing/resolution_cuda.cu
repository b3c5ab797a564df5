// SPDX-License-Identifier: Apache-2.0
// The requests of clusters on CUDA: one warp per cluster, an entry of its list a lane.
#include "hybrid/routing/resolution.h"

#include "cuda/warp.h"

namespace shadowdag {

namespace {

template <class Work> __global__ void demandKernel(Work work) {
    const size_t cluster = warpOfGrid();
    if (cluster < work.clusters.count())
        work.demandPart(cluster, laneOfWarp(), kGroupLanes);
}

} // namespace

void launchPass(CudaTag, const DemandResolution& work) {
    launch(demandKernel<DemandResolution>, blocksOfWarps(work.itemCount()), work);
}

void launchPass(CudaTag, const DemandMaps& work) {
    launch(demandKernel<DemandMaps>, blocksOfWarps(work.itemCount()), work);
}

} // namespace shadowdag
