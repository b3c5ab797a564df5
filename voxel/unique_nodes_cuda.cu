// SPDX-License-Identifier: Apache-2.0
// Leaves to a DAG on CUDA.
#include "voxel/unique_nodes_pass.h"

#include "cuda/parallel_for.h"

namespace shadowdag::cuda {

void countUp(const CountUp& work) {
    parallelFor<CudaTag>(work.order.count, work);
}
void listRunValues(const ListRunValues& work) {
    parallelFor<CudaTag>(work.values.count, work);
}
void numberByRun(const NumberByRun& work) {
    parallelFor<CudaTag>(work.order.count, work);
}
void gatherChildren(const GatherChildren& work) {
    parallelFor<CudaTag>(work.keys.count, work);
}
void packNodeKeys(const PackNodeKeys& work) {
    parallelFor<CudaTag>(work.keys.count, work);
}
void markDistinctNodes(const MarkDistinctNodes& work) {
    parallelFor<CudaTag>(work.order.count, work);
}
void listDistinctNodes(const ListDistinctNodes& work) {
    parallelFor<CudaTag>(work.distinct.count / kChildCount, work);
}
void countEdges(const CountEdges& work) {
    parallelFor<CudaTag>(work.order.count, work);
}
void visitEdges(const VisitEdges& work) {
    parallelFor<CudaTag>(work.order.count, work);
}
void rankNodes(const RankNodes& work) {
    parallelFor<CudaTag>(work.order.count, work);
}
void writeInnerNodes(const WriteInnerNodes& work) {
    parallelFor<CudaTag>(work.order.count, work);
}
void writeLeaves(const WriteLeaves& work) {
    parallelFor<CudaTag>(work.order.count, work);
}

} // namespace shadowdag::cuda
