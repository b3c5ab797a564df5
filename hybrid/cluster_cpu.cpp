// SPDX-License-Identifier: Apache-2.0
// The cluster passes on the CPU.
#include "hybrid/cluster_pass.h"

#include "cuda/parallel_for.h"

namespace shadowdag::cpu {

void countCellSamples(const CountCellSamples& work) {
    parallelFor<CpuTag>(work.gbuffer.count(), work, 4096);
}
void markOccupiedCells(const MarkOccupiedCells& work) {
    parallelFor<CpuTag>(work.cellSamples.count, work, 16384);
}
void compactCells(const CompactCells& work) {
    parallelFor<CpuTag>(work.cellSamples.count, work, 16384);
}
void fillTiles(const FillTile& work) {
    parallelFor<CpuTag>(work.grid.tileCount(), work, 8);
}
void boundClusters(const BoundClusters& work) {
    parallelFor<CpuTag>(work.clusters.count(), work, 64);
}

} // namespace shadowdag::cpu
