// SPDX-License-Identifier: Apache-2.0
// Pass: NanoVDB's shadow rays through its mask grid, for comparison with our tracer.
// Source: nanovdb_baseline.h.
#pragma once

#include "cuda/pass.h"
#include "voxel/ray_slabs.h"

#include <nanovdb/NanoVDB.h>
#include <nanovdb/util/HDDA.h>
#include <nanovdb/util/Ray.h>

namespace shadowdag {

/// For item i: sets blocked[i] to 1 where segment i meets an active voxel by NanoVDB's HDDA, else
/// to 0, under the terms of NanoVdbBaseline::occluded.
/// grid: a grid of nanovdb::ValueMask where the pass runs
struct TraceNano {
    using Grid = nanovdb::NanoGrid<nanovdb::ValueMask>;
    using Accessor = nanovdb::ReadAccessor<nanovdb::ValueMask, 0, 1, 2>;
    using Ray = nanovdb::Ray<float>;

    /// How far past a boundary the next cell is looked up, in voxels: four units in the last place
    /// of a coordinate at 4096.
    static constexpr float kPastBoundary = 1.0f / 512;

    const Grid* grid;
    View<const DagSegment> segments;
    View<uint8_t> blocked;

    size_t itemCount() const { return segments.count; }
    SDAG_HD void operator()(size_t i) const {
        const Accessor accessor(grid->tree().root());
        blocked[i] = isBlocked(segments[i], accessor, accessor.root().bbox());
    }

    SDAG_HD static bool isBlocked(const DagSegment& segment, const Accessor& accessor,
                                  const nanovdb::CoordBBox& bounds) {
        using nanovdb::Coord;
        const glm::vec3 way = segment.to - segment.from;
        const float length = sqrtf(glm::dot(way, way));
        const nanovdb::Vec3f from(segment.from.x, segment.from.y, segment.from.z);
        if (!(length > 0.0f))
            return accessor.isActive(nanovdb::RoundDown<Coord>(from));
        const glm::vec3 d = way / length;
        Ray ray(from, nanovdb::Vec3f(d.x, d.y, d.z), 0.0f, length);
        if (!ray.clip(bounds))
            return false;
        Coord cell = nanovdb::RoundDown<Coord>(ray.start());
        nanovdb::HDDA<Ray, Coord>
            hdda{}; // zeros: init() leaves the steps of unused axes as they are
        hdda.init(ray, int(accessor.getDim(cell, ray)));
        while (!accessor.isActive(cell)) {
            if (!hdda.step())
                return false;
            cell = nanovdb::RoundDown<Coord>(ray(hdda.time() + kPastBoundary));
            hdda.update(ray, int(accessor.getDim(cell, ray)));
        }
        return true;
    }
};

} // namespace shadowdag
