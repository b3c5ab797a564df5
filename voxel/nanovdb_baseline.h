// SPDX-License-Identifier: Apache-2.0
// NanoVDB's shadow rays through the voxels of a DAG, for comparison with our tracer.
// Source: Museth, NanoVDB: A GPU-Friendly and Portable VDB Data Structure, SIGGRAPH 2021 Talks;
// Museth, Hierarchical Digital Differential Analyzer, SIGGRAPH 2014 Talks.
#pragma once

#include "voxel/dag.h"
#include "voxel/ray_slabs.h"

#include <memory>
#include <vector>

namespace shadowdag {

/// A NanoVDB mask grid (nodes of 32^3, 16^3 and 8^3 children) with the same voxels as a DAG. Voxel
/// space is its index space.
class NanoVdbBaseline {
public:
    /// Cost: about 20 ns a voxel; memory about three times bytes() while building. Throws Error
    /// kResource when memory is short.
    explicit NanoVdbBaseline(const Dag& dag);
    ~NanoVdbBaseline();

    /// Returns 1 (blocked) or 0 per segment, on the calling thread: NanoVDB's HDDA from node to
    /// node, down to the voxel. It steps 1/512 voxel past each boundary to choose the next cell;
    /// NanoVDB's own firstActive steps 1.0001 voxels and so skips corners. It has no margin and
    /// steps in float, so corners grazed by less than that may still be missed, and cells as far
    /// beside the segment may be hit.
    /// @param seconds receives the processor time of the tracing; may be null
    std::vector<uint8_t> occluded(const std::vector<DagSegment>& segments,
                                  double* seconds = nullptr) const;

    /// Sets blocked[i] to 1 or 0 as occluded() does, by one item of a pass a segment: on the CPU's
    /// threads, or queued on CUDA, where the first call copies the grid. Not thread safe. Throws
    /// Error kResource when there is no memory for the copy.
    /// @param segments,blocked live on `backend`; blocked: one byte a segment
    void trace(Backend backend, View<const DagSegment> segments, View<uint8_t> blocked) const;

    uint64_t voxelCount() const;
    /// Returns the bytes of the grid, as NanoVDB lays it out.
    uint64_t bytes() const;

private:
    struct State;
    std::unique_ptr<State> state_;
};

} // namespace shadowdag
