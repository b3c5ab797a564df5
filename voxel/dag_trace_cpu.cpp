// SPDX-License-Identifier: Apache-2.0
#include "cuda/parallel_for.h"
#include "voxel/dag_stream.h"
#include "voxel/dag_trace_pass.h"

#include <algorithm>

namespace shadowdag {

namespace {

constexpr size_t kBlock =
    1024; // segments per item: enough to make the setup of a stream negligible

/// For item i: traces segments [i * kBlock, ...) as a stream. No other item writes the same words.
struct TraceSegmentStreams {
    DagView dag;
    View<const DagSegment> segments;
    View<uint32_t> bits;

    void operator()(size_t item) const {
        const size_t first = item * kBlock, count = std::min(kBlock, segments.count - first);
        uint8_t blocked[kBlock];
        traceStream(dag, View<const DagSegment>{segments.data + first, count},
                    View<uint8_t>{blocked, count});
        for (size_t i = 0; i < count; i += 32) {
            uint32_t word = 0;
            for (size_t b = i; b < std::min(i + 32, count); ++b)
                word |= uint32_t(blocked[b]) << (b - i);
            bits[(first + i) / 32] = word;
        }
    }
};

} // namespace

void launchPass(CpuTag, const TraceSegments& work) {
    if (work.level == 0)
        parallelFor<CpuTag>((work.segments.count + kBlock - 1) / kBlock,
                            TraceSegmentStreams{work.dag, work.segments, work.bits}, 1);
    else
        parallelFor<CpuTag>(work.itemCount(), work, 32);
}

} // namespace shadowdag
