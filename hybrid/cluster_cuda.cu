// SPDX-License-Identifier: Apache-2.0
// The cluster passes on CUDA.
#include "hybrid/cluster_pass.h"

#include "cuda/parallel_for.h"

namespace shadowdag::cuda {

void countCellSamples(const CountCellSamples& work) {
    parallelFor<CudaTag>(work.gbuffer.count(), work);
}
void markOccupiedCells(const MarkOccupiedCells& work) {
    parallelFor<CudaTag>(work.cellSamples.count, work);
}
void compactCells(const CompactCells& work) {
    parallelFor<CudaTag>(work.cellSamples.count, work);
}
void fillTiles(const FillTile& work) {
    parallelFor<CudaTag>(work.grid.tileCount(), work);
}
void boundClusters(const BoundClusters& work) {
    parallelFor<CudaTag>(work.clusters.count(), work);
}

} // namespace shadowdag::cuda
