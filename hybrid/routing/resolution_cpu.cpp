// SPDX-License-Identifier: Apache-2.0
// Resolution demands on the CPU.
#include "hybrid/routing/resolution_pass.h"

#include "cuda/parallel_for.h"

namespace shadowdag::cpu {

void demandResolution(const DemandResolution& work) {
    parallelFor<CpuTag>(work.clusters.count(), work, 64);
}
void demandMaps(const DemandMaps& work) {
    parallelFor<CpuTag>(work.clusters.count(), work, 64);
}
void markOccupiedSlots(const MarkOccupiedSlots& work) {
    parallelFor<CpuTag>(work.recordOfSlot.count, work, 4096);
}
void numberPairs(const NumberPairs& work) {
    parallelFor<CpuTag>(work.record.count, work, 4096);
}
void noteLengths(const NoteLengths& work) {
    parallelFor<CpuTag>(1, work);
}

} // namespace shadowdag::cpu
