// SPDX-License-Identifier: Apache-2.0
// Chooses the file of ray streams for the processor, and traces rays one by one in a DAG without
// wide form.
#include "voxel/dag_stream.h"

#include "cuda/error.h"
#include "voxel/dag_stream_work.h"
#include "voxel/dag_trace.h"
#include "voxel/stream_kernel.h"

#include <cstddef>
#include <cstdlib>
#include <string>

namespace shadowdag {

static_assert(sizeof(DagSegment) == 6 * sizeof(float));
static_assert(sizeof(WideCell) == sizeof(stream::Start) &&
              offsetof(WideCell, level) == offsetof(stream::Start, level) &&
              offsetof(WideCell, corner) == offsetof(stream::Start, corner));

namespace {

#if defined(SDAG_STREAM_X86)
bool processorHas(StreamIsa isa) {
    __builtin_cpu_init();
    const bool hasAvx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") &&
                         __builtin_cpu_supports("bmi") && __builtin_cpu_supports("bmi2") &&
                         __builtin_cpu_supports("lzcnt") && __builtin_cpu_supports("popcnt");
    const bool hasAvx512 = hasAvx2 && __builtin_cpu_supports("avx512f") &&
                           __builtin_cpu_supports("avx512bw") &&
                           __builtin_cpu_supports("avx512cd") &&
                           __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl");
    return isa == StreamIsa::kAvx512 ? hasAvx512 : isa == StreamIsa::kAvx2 ? hasAvx2 : true;
}
#else
bool processorHas(StreamIsa isa) {
    return isa == StreamIsa::kPortable;
}
#endif

/// Returns the best of the processor, or a lower one if the environment names it.
StreamIsa chosenIsa() {
    const StreamIsa best = hasStreamIsa(StreamIsa::kAvx512) ? StreamIsa::kAvx512
                           : hasStreamIsa(StreamIsa::kAvx2) ? StreamIsa::kAvx2
                                                            : StreamIsa::kPortable;
    const char* const wanted = std::getenv("SHADOWDAG_ISA");
    if (wanted == nullptr || *wanted == 0)
        return best;
    const std::string name = wanted;
    const StreamIsa isa = name == "avx512" ? StreamIsa::kAvx512
                          : name == "avx2" ? StreamIsa::kAvx2
                                           : StreamIsa::kPortable;
    if (isa == StreamIsa::kPortable && name != "portable")
        throw Error(ErrorKind::kUsage,
                    "environment: SHADOWDAG_ISA '" + name + "': use portable, avx2 or avx512");
    if (!hasStreamIsa(isa))
        throw Error(ErrorKind::kDevice, "environment: SHADOWDAG_ISA '" + name +
                                            "': this processor or program lacks it; use " +
                                            (best == StreamIsa::kAvx2 ? "avx2 or " : "") +
                                            "portable, or unset it");
    return isa;
}

} // namespace

bool hasStreamIsa(StreamIsa isa) {
    static const bool has[] = {true, processorHas(StreamIsa::kAvx2),
                               processorHas(StreamIsa::kAvx512)};
    return has[size_t(isa)];
}

StreamIsa bestStreamIsa() {
    static const StreamIsa chosen = chosenIsa();
    return chosen;
}

const char* streamIsaName(StreamIsa isa) {
    return isa == StreamIsa::kAvx512 ? "AVX-512" : isa == StreamIsa::kAvx2 ? "AVX2" : "portable";
}

void traceStream(const DagView& dag, View<const WideCell> cells, View<const DagSegment> segments,
                 View<uint8_t> blocked, StreamIsa isa) {
    SDAG_ASSERT(blocked.count >= segments.count);
    SDAG_ASSERT(!dag.wide.words.empty());
    SDAG_ASSERT(hasStreamIsa(isa));
    const stream::Work work{dag.wide.words.data,
                            reinterpret_cast<const stream::Start*>(cells.data),
                            cells.count,
                            float(dag.grid.resolution()),
                            reinterpret_cast<const float*>(segments.data),
                            segments.count,
                            blocked.data};
    SDAG_KERNEL_OF(isa, stream::trace)(work);
}

void traceStream(const DagView& dag, View<const DagSegment> segments, View<uint8_t> blocked,
                 StreamIsa isa) {
    SDAG_ASSERT(blocked.count >= segments.count);
    SDAG_ASSERT(hasStreamIsa(isa));
    if (dag.wide.words.empty()) {
        for (size_t i = 0; i < segments.count; ++i)
            blocked[i] = occluded(dag, segments[i]);
        return;
    }
    const WideCell root{dag.wide.rootAddress, dag.wide.rootLevel, {0, 0, 0}};
    traceStream(dag, View<const WideCell>{&root, 1}, segments, blocked, isa);
}

} // namespace shadowdag
