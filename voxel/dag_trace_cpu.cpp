// SPDX-License-Identifier: Apache-2.0
#include "cuda/parallel_for.h"
#include "voxel/dag_trace_pass.h"

namespace shadowdag::cpu {

void traceSegments(const DagView& dag, View<const DagSegment> segments, uint32_t level,
                   View<uint32_t> bits) {
    parallelFor<CpuTag>((segments.count + 31) / 32, TraceSegments{dag, segments, level, bits}, 32);
}

} // namespace shadowdag::cpu
