// SPDX-License-Identifier: Apache-2.0
#include "voxel/nanovdb_baseline.h"

#include "cuda/error.h"
#include "cuda/thread_clock.h"
#include "voxel/nano_grid.h"

#include <nanovdb/util/HDDA.h>
#include <nanovdb/util/Ray.h>

namespace shadowdag {
namespace {

using Grid = nanovdb::NanoGrid<nanovdb::ValueMask>;
using Accessor = nanovdb::ReadAccessor<nanovdb::ValueMask, 0, 1, 2>;
using Ray = nanovdb::Ray<float>;

/// How far past a boundary the next cell is looked up, in voxels: four units in the last place of a
/// coordinate at 4096.
constexpr float kPastBoundary = 1.0f / 512;

bool isBlocked(const DagSegment& segment, const Accessor& accessor,
               const nanovdb::CoordBBox& bounds) {
    using nanovdb::Coord;
    const glm::vec3 way = segment.to - segment.from;
    const float length = std::sqrt(glm::dot(way, way));
    const nanovdb::Vec3f from(segment.from.x, segment.from.y, segment.from.z);
    if (!(length > 0.0f))
        return accessor.isActive(nanovdb::RoundDown<Coord>(from));
    const glm::vec3 d = way / length;
    Ray ray(from, nanovdb::Vec3f(d.x, d.y, d.z), 0.0f, length);
    if (!ray.clip(bounds))
        return false;
    Coord cell = nanovdb::RoundDown<Coord>(ray.start());
    nanovdb::HDDA<Ray, Coord> hdda{}; // zeros: init() leaves the steps of unused axes as they are
    hdda.init(ray, int(accessor.getDim(cell, ray)));
    while (!accessor.isActive(cell)) {
        if (!hdda.step())
            return false;
        cell = nanovdb::RoundDown<Coord>(ray(hdda.time() + kPastBoundary));
        hdda.update(ray, int(accessor.getDim(cell, ray)));
    }
    return true;
}

} // namespace

struct NanoVdbBaseline::State {
    nanovdb::GridHandle<> handle;
    const Grid* grid = nullptr;
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
    const Accessor accessor(state_->grid->tree().root());
    const nanovdb::CoordBBox bounds = accessor.root().bbox();
    const double start = threadSeconds();
    for (size_t i = 0; i < segments.size(); ++i)
        blocked[i] = isBlocked(segments[i], accessor, bounds);
    if (seconds)
        *seconds = threadSeconds() - start;
    return blocked;
}

uint64_t NanoVdbBaseline::voxelCount() const {
    return state_->grid->activeVoxelCount();
}

uint64_t NanoVdbBaseline::bytes() const {
    return state_->handle.size();
}

} // namespace shadowdag
