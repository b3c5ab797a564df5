// SPDX-License-Identifier: Apache-2.0
// traceSegments on CUDA: a lane takes a segment, and the answers of a warp are one word.
#include "voxel/dag_trace_pass.h"

#include "cuda/warp.h"

namespace shadowdag {

namespace {

__global__ void traceSegmentsKernel(TraceSegments work) {
    const size_t i = blockIdx.x * size_t(blockDim.x) + threadIdx.x;
    const bool isDark = i < work.segments.count && occluded(work.dag, work.segments[i], work.level);
    const uint32_t answers = __ballot_sync(kAllLanes, isDark);
    if (laneOfWarp() == 0 && i < work.segments.count)
        work.bits[i / kGroupLanes] = answers;
}

} // namespace

void launchPass(CudaTag, const TraceSegments& work) {
    launch(traceSegmentsKernel, (work.segments.count + kBlockThreads - 1) / kBlockThreads, work);
}

} // namespace shadowdag
