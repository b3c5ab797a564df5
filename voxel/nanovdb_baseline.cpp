// SPDX-License-Identifier: Apache-2.0
// The only file of ours with OpenVDB and NanoVDB in it: their headers cost half a minute.
#include "voxel/nanovdb_baseline.h"

#include "cuda/error.h"
#include "cuda/thread_clock.h"

#include <nanovdb/util/HDDA.h>
#include <nanovdb/util/OpenToNanoVDB.h>
#include <nanovdb/util/Ray.h>
#include <openvdb/openvdb.h>

#include <bit>

namespace shadowdag {
namespace {

using Grid = nanovdb::NanoGrid<nanovdb::ValueMask>;
using Accessor = nanovdb::ReadAccessor<nanovdb::ValueMask, 0, 1, 2>;
using Ray = nanovdb::Ray<float>;

/// How far past a boundary the next cell is looked up, in voxels: four units in the last place of a
/// coordinate at 4096.
constexpr float kPastBoundary = 1.0f / 512;

/// Calls leaf(x, y, z, voxels) for every 4^3 leaf under a cell.
template <class F>
void forEachLeaf(const DagView& dag, uint32_t address, uint32_t level, glm::uvec3 corner,
                 const F& leaf) {
    if (level == kLeafLog2) {
        leaf(corner, dag.words[address] | uint64_t(dag.words[address + 1]) << 32);
        return;
    }
    const uint32_t mask = dag.words[address], half = 1u << (level - 1);
    uint32_t child = address + 1;
    for (uint32_t c = 0; c < 8; ++c)
        if (mask >> c & 1)
            forEachLeaf(dag, dag.words[child++], level - 1,
                        corner + half * glm::uvec3(c & 1, c >> 1 & 1, c >> 2), leaf);
}

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
        openvdb::MaskGrid open;
        auto accessor = open.getAccessor();
        const auto addLeaf = [&](glm::uvec3 corner, uint64_t voxels) {
            const openvdb::Coord origin(int(corner.x), int(corner.y), int(corner.z));
            auto* leaf = accessor.touchLeaf(origin);
            for (; voxels != 0; voxels &= voxels - 1) {
                const int bit = std::countr_zero(voxels), o = bit >> 3, s = bit & 7;
                leaf->setValueOn(origin.offsetBy(2 * (o & 1) + (s & 1),
                                                 2 * (o >> 1 & 1) + (s >> 1 & 1),
                                                 2 * (o >> 2) + (s >> 2)));
            }
        };
        if (!dag.empty())
            forEachLeaf(dag.view(), dag.rootAddress, std::max(dag.grid.resolutionLog2, kLeafLog2),
                        glm::uvec3(0), addLeaf);
        state_->handle =
            nanovdb::openToNanoVDB(open, nanovdb::StatsMode::BBox, nanovdb::ChecksumMode::Disable);
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
