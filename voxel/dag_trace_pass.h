// SPDX-License-Identifier: Apache-2.0
// Pass: tests a list of segments against one DAG.
#pragma once

#include "cuda/pass.h"
#include "voxel/dag_trace.h"

namespace shadowdag {

/// For item i: sets bit i % 32 of bits[i / 32] to occluded(dag, segments[i], level). One item per
/// word, so that no two items write the same word.
struct TraceSegments {
    DagView dag;
    View<const DagSegment> segments;
    uint32_t level;
    View<uint32_t> bits;

    size_t itemCount() const { return (segments.count + 31) / 32; }
    SDAG_HD void operator()(size_t word) const {
        uint32_t result = 0;
        const size_t first = word * 32;
        const size_t end = first + 32 < segments.count ? first + 32 : segments.count;
        for (size_t i = first; i < end; ++i)
            result |= uint32_t(occluded(dag, segments[i], level)) << (i - first);
        bits[word] = result;
    }
};

/// On the CPU, level 0 is traced by streams: dag_trace_cpu.cpp. On CUDA a lane takes a segment:
/// dag_trace_cuda.cu.
void launchPass(CpuTag, const TraceSegments& work);
void launchPass(CudaTag, const TraceSegments& work);

/// Tests every segment: bit i % 32 of bits[i / 32] is set where occluded() is true; bits past the
/// last segment are zero.
/// @param dag,segments,bits live on `backend`; bits: (segments.count + 31) / 32 words
/// Deterministic: the same bits on both backends, for any thread count.
inline void traceSegments(Backend backend, const DagView& dag, View<const DagSegment> segments,
                          uint32_t level, View<uint32_t> bits) {
    SDAG_ASSERT(bits.count >= (segments.count + 31) / 32);
    runPass(backend, TraceSegments{dag, segments, level, bits});
}

} // namespace shadowdag
