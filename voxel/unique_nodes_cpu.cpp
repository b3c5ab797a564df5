// SPDX-License-Identifier: Apache-2.0
// Leaves to a DAG on the CPU.
#include "voxel/unique_nodes_pass.h"

#include "cuda/parallel_for.h"

namespace shadowdag::cpu {

void countUp(const CountUp& work) {
    parallelFor<CpuTag>(work.order.count, work, 4096);
}
void listRunValues(const ListRunValues& work) {
    parallelFor<CpuTag>(work.values.count, work, 4096);
}
void numberByRun(const NumberByRun& work) {
    parallelFor<CpuTag>(work.order.count, work, 4096);
}
void gatherChildren(const GatherChildren& work) {
    parallelFor<CpuTag>(work.keys.count, work, 1024);
}
void packNodeKeys(const PackNodeKeys& work) {
    parallelFor<CpuTag>(work.keys.count, work, 4096);
}
void markDistinctNodes(const MarkDistinctNodes& work) {
    parallelFor<CpuTag>(work.order.count, work, 4096);
}
void listDistinctNodes(const ListDistinctNodes& work) {
    parallelFor<CpuTag>(work.distinct.count / kChildCount, work, 1024);
}
void countEdges(const CountEdges& work) {
    parallelFor<CpuTag>(work.order.count, work, 4096);
}
void visitEdges(const VisitEdges& work) {
    parallelFor<CpuTag>(work.order.count, work, 4096);
}
void rankNodes(const RankNodes& work) {
    parallelFor<CpuTag>(work.order.count, work, 4096);
}
void writeInnerNodes(const WriteInnerNodes& work) {
    parallelFor<CpuTag>(work.order.count, work, 1024);
}
void writeLeaves(const WriteLeaves& work) {
    parallelFor<CpuTag>(work.order.count, work, 4096);
}

} // namespace shadowdag::cpu
