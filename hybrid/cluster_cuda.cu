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
void countNormalCells(const CountNormalCells& work) {
    parallelFor<CudaTag>(work.clusters.count(), work);
}
void splitByNormals(const SplitByNormals& work) {
    parallelFor<CudaTag>(work.clusters.count(), work);
}
void boundByCell(const BoundByCell& work) {
    parallelFor<CudaTag>(work.cell.count, work);
}
void boundBySamples(const BoundBySamples& work) {
    parallelFor<CudaTag>(work.clusters.count(), work);
}
void joinTenths(const JoinTenths& work) {
    parallelFor<CudaTag>(work.clusters.samples.count, work);
}
void shrinkBounds(const ShrinkBounds& work) {
    parallelFor<CudaTag>(work.boxesWorld.count, work);
}

} // namespace shadowdag::cuda
