// SPDX-License-Identifier: Apache-2.0
// Resolution demands on CUDA.
#include "hybrid/routing/resolution_pass.h"

#include "cuda/parallel_for.h"

namespace shadowdag::cuda {

void demandResolution(const DemandResolution& work) {
    parallelFor<CudaTag>(work.clusters.count(), work);
}
void demandMaps(const DemandMaps& work) {
    parallelFor<CudaTag>(work.clusters.count(), work);
}
void markOccupiedSlots(const MarkOccupiedSlots& work) {
    parallelFor<CudaTag>(work.recordOfSlot.count, work);
}
void numberPairs(const NumberPairs& work) {
    parallelFor<CudaTag>(work.record.count, work);
}
void noteLengths(const NoteLengths& work) {
    parallelFor<CudaTag>(1, work);
}

} // namespace shadowdag::cuda
