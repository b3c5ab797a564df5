// SPDX-License-Identifier: Apache-2.0
// The cluster passes on the CPU.
#include "hybrid/clusters/cluster_pass.h"

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
void countNormalCells(const CountNormalCells& work) {
    parallelFor<CpuTag>(work.clusters.count(), work, 64);
}
void splitByNormals(const SplitByNormals& work) {
    parallelFor<CpuTag>(work.clusters.count(), work, 64);
}
void boundByCell(const BoundByCell& work) {
    parallelFor<CpuTag>(work.cell.count, work, 256);
}
void boundBySamples(const BoundBySamples& work) {
    parallelFor<CpuTag>(work.clusters.count(), work, 64);
}
void joinTenths(const JoinTenths& work) {
    parallelFor<CpuTag>(work.clusters.samples.count, work, 4096);
}
void shrinkBounds(const ShrinkBounds& work) {
    parallelFor<CpuTag>(work.boxesWorld.count, work, 1024);
}

} // namespace shadowdag::cpu
