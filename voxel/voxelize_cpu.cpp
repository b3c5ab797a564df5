// SPDX-License-Identifier: Apache-2.0
// Triangles to leaves on the CPU.
#include "voxel/voxelize_pass.h"

#include "cuda/parallel_for.h"

namespace shadowdag::cpu {

void markInside(const MarkInside& work) {
    parallelFor<CpuTag>(work.which.count, work, 64);
}
void listMarked(const ListMarked& work) {
    parallelFor<CpuTag>(work.list.count, work, 4096);
}
void markChild(const MarkChild& work) {
    parallelFor<CpuTag>(work.childMask.count, work, 4096);
}
void countChildren(const CountChildren& work) {
    parallelFor<CpuTag>(work.pairs.triangles.count, work, 64);
}
void listChildren(const ListChildren& work) {
    parallelFor<CpuTag>(work.pairs.triangles.count, work, 1024);
}
void listLeaves(const ListLeaves& work) {
    parallelFor<CpuTag>(work.bricks.triangles.count, work, 16);
}
void joinLeaves(const JoinLeaves& work) {
    parallelFor<CpuTag>(work.leafKeys.count, work, 1024);
}

} // namespace shadowdag::cpu
