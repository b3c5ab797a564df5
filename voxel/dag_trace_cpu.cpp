// SPDX-License-Identifier: Apache-2.0
#include "cuda/parallel_for.h"
#include "voxel/dag_stream.h"
#include "voxel/dag_trace_pass.h"

#include <algorithm>

namespace shadowdag::cpu {

namespace {

constexpr size_t kBlock = 1024; // segments an item: enough that setting a stream up costs nothing

/// For item i: answers segments [i * kBlock, ...) as a stream. One item's words are its own.
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

void traceSegments(const DagView& dag, View<const DagSegment> segments, uint32_t level,
                   View<uint32_t> bits) {
    if (level == 0)
        parallelFor<CpuTag>((segments.count + kBlock - 1) / kBlock,
                            TraceSegmentStreams{dag, segments, bits}, 1);
    else
        parallelFor<CpuTag>((segments.count + 31) / 32, TraceSegments{dag, segments, level, bits},
                            32);
}

} // namespace shadowdag::cpu
