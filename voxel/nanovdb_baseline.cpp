// SPDX-License-Identifier: Apache-2.0
#include "voxel/nanovdb_baseline.h"

#include "cuda/buffer.h"
#include "cuda/error.h"
#include "cuda/thread_clock.h"
#include "voxel/nano_grid.h"
#include "voxel/nano_trace_pass.h"

#include <optional>
#include <utility>

namespace shadowdag {

struct NanoVdbBaseline::State {
    nanovdb::GridHandle<> handle;
    const TraceNano::Grid* grid = nullptr;
    std::optional<Buffer<uint8_t>> onDevice; ///< the grid, once it was asked for there
};

NanoVdbBaseline::NanoVdbBaseline(const Dag& dag) : state_(std::make_unique<State>()) {
    try {
        state_->handle = nanoGridOf(dag);
    } catch (const std::bad_alloc&) {
        throw Error(ErrorKind::kResource,
                    "NanoVDB's grid of " + std::to_string(dag.grid.resolution()) +
                        "^3 voxels: out of memory; compare at a lower resolution");
    }
    state_->grid = state_->handle.grid<nanovdb::ValueMask>();
    SDAG_ASSERT(state_->grid != nullptr);
}

NanoVdbBaseline::~NanoVdbBaseline() = default;

std::vector<uint8_t> NanoVdbBaseline::occluded(const std::vector<DagSegment>& segments,
                                               double* seconds) const {
    std::vector<uint8_t> blocked(segments.size());
    const TraceNano::Accessor accessor(state_->grid->tree().root());
    const nanovdb::CoordBBox bounds = accessor.root().bbox();
    const double start = threadSeconds();
    for (size_t i = 0; i < segments.size(); ++i)
        blocked[i] = TraceNano::isBlocked(segments[i], accessor, bounds);
    if (seconds)
        *seconds = threadSeconds() - start;
    return blocked;
}

void NanoVdbBaseline::trace(Backend backend, View<const DagSegment> segments,
                            View<uint8_t> blocked) const {
    SDAG_ASSERT(blocked.count >= segments.count);
    const TraceNano::Grid* grid = state_->grid;
    if (backend == Backend::kCuda) {
        if (!state_->onDevice) {
            const uint8_t* data = static_cast<const uint8_t*>(state_->handle.data());
            Buffer<uint8_t> copy(backend, "NanoVDB grid");
            copy.upload({data, data + state_->handle.size()});
            state_->onDevice = std::move(copy);
        }
        grid = reinterpret_cast<const TraceNano::Grid*>(state_->onDevice->view().data);
    }
    runPass(backend, TraceNano{grid, segments, blocked});
}

uint64_t NanoVdbBaseline::voxelCount() const {
    return state_->grid->activeVoxelCount();
}

uint64_t NanoVdbBaseline::bytes() const {
    return state_->handle.size();
}

} // namespace shadowdag
