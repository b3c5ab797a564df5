// SPDX-License-Identifier: Apache-2.0
// Occlusion of a segment by the voxels of a DAG: the predicate, the traversal and the shadow segment.
//
// The predicate is defined box by box, not by an order of steps: a segment meets a box when the slab test
// of ray_slabs.h, in float, says so for the box grown by a margin on all sides. The test is monotone (the computed
// interval of a box encloses those of the boxes in it), so any traversal, in any order, on any processor, gives the bits that
// testing every occupied voxel would give; and because the margin bounds all rounding, no voxel that the exact
// segment touches is missed. There are no steps, hence no ray can stick or slip.
#pragma once

#include "voxel/dag.h"
#include "voxel/ray_slabs.h"

namespace shadowdag {

/// What stopped a segment.
struct DagHit {
    glm::uvec3 cell{0};  ///< least voxel of the cell hit
    uint32_t level = 0;  ///< side of the cell is 2^level voxels
};

namespace detail {

/// Returns the lowest bit of `bits` (not 0) when bit numbers are exchanged by `octant` (i for i ^ octant): the
/// first cell of a set of eight in the order in which a segment of that octant meets them.
SDAG_HD inline uint32_t firstInOctant(uint32_t bits, uint32_t octant) {
    bits = (octant & 1) ? (bits & 0x55u) << 1 | (bits >> 1 & 0x55u) : bits;
    bits = (octant & 2) ? (bits & 0x33u) << 2 | (bits >> 2 & 0x33u) : bits;
    bits = (octant & 4) ? (bits & 0x0fu) << 4 | (bits >> 4 & 0x0fu) : bits;
    return lowestBit32(bits) ^ octant;
}

/// Returns the bytes of a leaf that are not zero as bits: its occupied 2^3 octants.
SDAG_HD inline uint32_t octantsOf(uint64_t voxels) {
    uint32_t octants = 0;
    for (int o = 0; o < 8; ++o)
        octants |= uint32_t((voxels >> (8 * o) & 0xffu) != 0) << o;
    return octants;
}

SDAG_HD inline void reportHit(DagHit* hit, uint32_t x, uint32_t y, uint32_t z, uint32_t c, uint32_t level) {
    hit->cell = glm::uvec3(x + ((c & 1) << level), y + ((c >> 1 & 1) << level), z + ((c >> 2) << level));
    hit->level = level;
}

/// Returns whether a segment meets cells of `level` < kLeafLog2 + 1 in the leaf at x, y, z.
SDAG_HD inline bool occludedInLeaf(const RaySlabs& r, uint64_t voxels, uint32_t x, uint32_t y, uint32_t z,
                                   uint32_t level, DagHit* hit) {
    if (level == 1) {
        const uint32_t hits = slabs::childHits(r, float(x), float(y), float(z), 2.0f) & octantsOf(voxels);
        if (hits != 0 && hit)
            reportHit(hit, x, y, z, firstInOctant(hits, r.octant), 1);
        return hits != 0;
    }
    const uint64_t hits = slabs::leafHits(r, float(x), float(y), float(z)) & voxels;
    if (hits != 0 && hit) {
        const uint32_t o = firstInOctant(octantsOf(hits), r.octant);
        const uint32_t s = firstInOctant(uint32_t(hits >> (8 * o)) & 0xffu, r.octant);
        reportHit(hit, x + 2 * (o & 1), y + 2 * (o >> 1 & 1), z + 2 * (o >> 2), s, 0);
    }
    return hits != 0;
}

} // namespace detail

/// Returns whether the closed segment meets an occupied cell of side 2^level voxels (level 0: voxels; a level above the
/// root's means the root's). Ends may lie anywhere, also outside the grid; the margin grows with their distance (ray_slabs.h).
/// A segment of length zero tests its point. Ends that are NaN, infinite or beyond 1e30 give true (dark, never
/// silently lit), with `hit` as the grid's corner at the root's level. `hit`, when not null, receives the first cell
/// met in front-to-back order of octants.
/// Cost: no allocation; stack of kMaxResolutionLog2 entries. The same bits on both processors.
SDAG_HD inline bool occluded(const DagView& dag, const DagSegment& segment, uint32_t level = 0, DagHit* hit = nullptr) {
    const uint32_t rootLevel = dag.grid.resolutionLog2 > kLeafLog2 ? dag.grid.resolutionLog2 : kLeafLog2;
    const float scale = segmentScale(dag.grid, segment);
    if (!(scale < kLargestScale)) {
        if (hit)
            *hit = {glm::uvec3(0), rootLevel};
        return true;
    }
    if (dag.rootAddress == kNoNode)
        return false;
    const RaySlabs r = makeRaySlabs(segment, scale);
    if (level >= rootLevel) {
        const bool isMet = hitsCube(r, 0.0f, 0.0f, 0.0f, float(1u << rootLevel));
        if (isMet && hit)
            *hit = {glm::uvec3(0), rootLevel};
        return isMet;
    }
    const uint32_t* words = dag.words.data;
    uint32_t address = dag.rootAddress;
    uint32_t x = 0, y = 0, z = 0, cellLevel = rootLevel;
    if (rootLevel == kLeafLog2)
        return detail::occludedInLeaf(r, words[address] | uint64_t(words[address + 1]) << 32, 0, 0, 0, level, hit);

    // stack[l]: the node of level l on the path, and which of its children that the segment meets are still to visit.
    uint32_t stackAddress[kMaxResolutionLog2 + 1], stackPending[kMaxResolutionLog2 + 1];
    uint32_t mask = words[address];
    uint32_t pending = mask & slabs::childHits(r, 0.0f, 0.0f, 0.0f, float(1u << (rootLevel - 1)));
    while (true) {
        while (pending == 0) {
            if (++cellLevel > rootLevel)
                return false;
            pending = stackPending[cellLevel];
            address = stackAddress[cellLevel];
            const uint32_t keep = ~0u << cellLevel;
            x &= keep;
            y &= keep;
            z &= keep;
            mask = words[address];
        }
        const uint32_t childLevel = cellLevel - 1;
        const uint32_t c = detail::firstInOctant(pending, r.octant);
        if (childLevel == level) {
            if (hit)
                detail::reportHit(hit, x, y, z, c, level);
            return true;
        }
        pending &= ~(1u << c);
        const uint32_t childAddress = words[address + 1 + bitCount32(mask & ((1u << c) - 1))];
        const uint32_t childX = x + ((c & 1) << childLevel), childY = y + ((c >> 1 & 1) << childLevel),
                       childZ = z + ((c >> 2) << childLevel);
        if (childLevel == kLeafLog2) {
            const uint64_t voxels = words[childAddress] | uint64_t(words[childAddress + 1]) << 32;
            if (detail::occludedInLeaf(r, voxels, childX, childY, childZ, level, hit))
                return true;
            continue;
        }
        stackPending[cellLevel] = pending;
        stackAddress[cellLevel] = address;
        address = childAddress;
        x = childX;
        y = childY;
        z = childZ;
        cellLevel = childLevel;
        mask = words[address];
        pending = mask & slabs::childHits(r, float(x), float(y), float(z), float(1u << (cellLevel - 1)));
    }
}

/// Returns the segment, in voxel space, by which a view sample asks for a light: both ends kept out of the voxels
/// that the sample's surface and the light's fixture lie in.
/// Start: lifted along the normal by offset * (|nx| + |ny| + |nz|) * (cells of side 2^level + twice the predicate's margin + the
/// sample's own rounding): a plane's closed voxels reach exactly that far above it, so with offset = 1 a planar receiver never shadows
/// itself. End: drawn back towards the start by offset * sqrt(3) cells, never past the start, then lifted to the start's height
/// above the receiver's plane where it lies lower (a light nearer to the plane than the offset would otherwise
/// be reached through the receiver's own voxels). What it costs: blockers nearer than the offset are not seen (contact shadows).
/// @param sampleWorld,normalWorld position and unit geometric normal on the light's side
/// @param offset in units of the derived offset; 1 is the default, 0 none
SDAG_HD inline DagSegment shadowSegment(const VoxelGrid& grid, const glm::vec3& sampleWorld, const glm::vec3& normalWorld,
                                        const glm::vec3& lightWorld, float offset, uint32_t level) {
    const glm::dvec3 sample = grid.voxelFromWorld(glm::dvec3(sampleWorld));
    const glm::dvec3 light = grid.voxelFromWorld(glm::dvec3(lightWorld));
    const glm::dvec3 n(normalWorld);
    const double cell = double(1u << level);
    double scale = double(grid.resolution()), world = 0;
    for (int a = 0; a < 3; ++a) {
        scale = fabs(sample[a]) > scale ? fabs(sample[a]) : scale;
        scale = fabs(light[a]) > scale ? fabs(light[a]) : scale;
        world = fabs(double(sampleWorld[a])) > world ? fabs(double(sampleWorld[a])) : world;
    }
    // 2^-19 scale is twice the margin; a sample interpolated in float is off its plane by a few 2^-24 of its
    // coordinates.
    const double slack = scale * 1.9073486328125e-6 + world / grid.voxelSizeWorld * 4.76837158203125e-7;
    const double lift = double(offset) * (fabs(n.x) + fabs(n.y) + fabs(n.z)) * (cell + slack);
    const glm::dvec3 from = sample + n * lift;
    const glm::dvec3 way = light - from;
    const double length = sqrt(way.x * way.x + way.y * way.y + way.z * way.z);
    const double back = double(offset) * 1.7320508075688772 * cell;
    glm::dvec3 to = from;
    if (length > back)
        to = from + way * ((length - back) / length);
    const double height = (to.x - from.x) * n.x + (to.y - from.y) * n.y + (to.z - from.z) * n.z;
    if (height < 0)
        to = to - n * height;
    return {glm::vec3(from), glm::vec3(to)};
}

} // namespace shadowdag
