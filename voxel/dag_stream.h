// SPDX-License-Identifier: Apache-2.0
// Streams of rays through a DAG on the CPU: the predicate of dag_trace.h for many segments at a
// time, with the widest vector instructions of the processor. Gives the same bits as single rays.
#pragma once

#include "voxel/dag.h"
#include "voxel/ray_slabs.h"

namespace shadowdag {

/// The instruction sets that streams are compiled for. One is chosen at run time; the rest of the
/// program may be compiled for an older processor.
enum class StreamIsa : uint8_t { kPortable, kAvx2, kAvx512 };

/// Returns the widest set that this processor and this build have.
StreamIsa bestStreamIsa();

/// Returns whether this processor and this build have it.
bool hasStreamIsa(StreamIsa isa);

const char* streamIsaName(StreamIsa isa);

/// A cell of the wide form of a DAG by which rays may enter it: a node of even level, or a leaf
/// (level kLeafLog2).
struct WideCell {
    uint32_t address; ///< into WideDagView::words
    uint32_t level;   ///< side of 2^level voxels
    float corner[3];  ///< least corner, voxel space
};

/// Sets blocked[i] to occluded(dag, segments[i]), level 0: 1 or 0. Neighbours in the list should be
/// coherent (one light, starts close together): they are traced together. Works on the calling
/// thread; no allocation. `dag` should have its wide form, else rays are traced one by one.
/// @param blocked segments.count
void traceStream(const DagView& dag, View<const DagSegment> segments, View<uint8_t> blocked,
                 StreamIsa isa = bestStreamIsa());

/// The same for segments that can meet only the voxels of `cells` (a shaft's cut): traversal starts
/// there. Cells that a segment does not meet are allowed; their order does not change the result.
/// `dag` must have its wide form.
void traceStream(const DagView& dag, View<const WideCell> cells, View<const DagSegment> segments,
                 View<uint8_t> blocked, StreamIsa isa = bestStreamIsa());

} // namespace shadowdag
