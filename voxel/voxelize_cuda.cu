// SPDX-License-Identifier: Apache-2.0
// Triangles to leaves on CUDA.
#include "voxel/voxelize_pass.h"

#include "cuda/parallel_for.h"

namespace shadowdag::cuda {

void markInside(const MarkInside& work) {
    parallelFor<CudaTag>(work.which.count, work);
}
void listMarked(const ListMarked& work) {
    parallelFor<CudaTag>(work.list.count, work);
}
void markChild(const MarkChild& work) {
    parallelFor<CudaTag>(work.childMask.count, work);
}
void countChildren(const CountChildren& work) {
    parallelFor<CudaTag>(work.pairs.triangles.count, work);
}
void listChildren(const ListChildren& work) {
    parallelFor<CudaTag>(work.pairs.triangles.count, work);
}
void listLeaves(const ListLeaves& work) {
    parallelFor<CudaTag>(work.bricks.triangles.count, work);
}
void joinLeaves(const JoinLeaves& work) {
    parallelFor<CudaTag>(work.leafKeys.count, work);
}

} // namespace shadowdag::cuda
