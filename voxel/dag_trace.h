// SPDX-License-Identifier: Apache-2.0
// Occlusion of a segment by the voxels of a DAG: the predicate, the traversal and the shadow
// segment.
//
// The predicate is defined box by box, not by an order of steps: a segment meets a box when the
// slab test of ray_slabs.h, in float, says so for the box grown by a margin on all sides. The test
// is monotone (the computed interval of a box encloses those of the boxes in it), so any traversal,
// in any order, on any processor, gives the bits that testing every occupied voxel would give; and
// because the margin bounds all rounding, no voxel that the exact segment touches is missed. There
// are no steps, hence no ray can stick or slip.
#pragma once

#include "cuda/mutant.h"
#include "voxel/dag.h"
#include "voxel/dag_trace_flat.h"
#include "voxel/ray_slabs.h"
#include "voxel/shadow_segment_leaf.h"
#include "voxel/wide_dag_trace.h"

namespace shadowdag {

/// What stopped a segment.
struct DagHit {
    glm::uvec3 cell{0}; ///< least voxel of the cell hit
    uint32_t level = 0; ///< side of the cell is 2^level voxels
};

namespace detail {

/// Returns the bytes of a leaf that are not zero as bits: its occupied 2^3 octants.
SDAG_HD inline uint32_t octantsOf(uint64_t voxels) {
    uint32_t octants = 0;
    for (int o = 0; o < 8; ++o)
        octants |= uint32_t((voxels >> (8 * o) & 0xffu) != 0) << o;
    return octants;
}

SDAG_HD inline uint64_t leafAt(const uint32_t* words, uint32_t address) {
    return words[address] | uint64_t(words[address + 1]) << 32;
}

/// Returns whether a segment meets cells of `level` < kLeafLog2 in the leaf at the corner.
template <class Tester, class Corner>
SDAG_HD inline bool occludedInLeaf(const Tester& tester, uint64_t voxels, const Corner& corner,
                                   uint32_t level, DagHit* hit) {
    if (level == 1) {
        const uint32_t hits = tester.childHits(corner, 2) & octantsOf(voxels);
        if (hits != 0 && hit)
            *hit = {corner.child(tester.first(hits), 2).cell(), 1};
        return hits != 0;
    }
    const uint64_t hits = tester.leafHits(corner) & voxels;
    if (hits != 0 && hit) {
        const uint32_t o = tester.first(octantsOf(hits));
        const uint32_t s = tester.first(uint32_t(hits >> (8 * o)) & 0xffu);
        *hit = {corner.child(o, 2).child(s, 1).cell(), 0};
    }
    return hits != 0;
}

/// A counter that counts nothing, for traversals that need the result alone.
struct NoDagVisits {
    SDAG_HD void add() {}
};

/// The nodes and leaves that a traversal read.
struct DagVisits {
    uint32_t count = 0;
    SDAG_HD void add() { ++count; }
};

/// The traversal of occluded() and countDagVisits(), below the root's own level.
/// @param isFromBack whether octants are visited from the segment's end; any order gives the same
/// answer
template <class Visits>
SDAG_HD inline bool meetsCell(const DagView& dag, const RaySlabs& r, uint32_t rootLevel,
                              uint32_t level, bool isFromBack, DagHit* hit, Visits& visits) {
    const uint32_t* words = dag.words.data;
    const slabs::Tester tester(r, isFromBack);
    slabs::Corner corner;
    uint32_t address = dag.rootAddress, cellLevel = rootLevel;
    visits.add();
    if (rootLevel == kLeafLog2)
        return occludedInLeaf(tester, leafAt(words, address), corner, level, hit);

    // stack[l]: the node of level l on the path, and which of its children that the segment meets
    // are still to visit.
    uint32_t stackAddress[kMaxResolutionLog2 + 1], stackPending[kMaxResolutionLog2 + 1];
    uint32_t mask = words[address];
    uint32_t pending = mask & tester.childHits(corner, 1u << (rootLevel - 1));
    while (true) {
        while (pending == 0) {
            if (++cellLevel > rootLevel)
                return false;
            pending = stackPending[cellLevel];
            address = stackAddress[cellLevel];
            corner = corner.ancestor(cellLevel);
            mask = words[address];
        }
        const uint32_t childLevel = cellLevel - 1;
        const uint32_t c = tester.first(pending);
        const slabs::Corner child = corner.child(c, 1u << childLevel);
        if (childLevel == level) {
            if (hit)
                *hit = {child.cell(), level};
            return true;
        }
        pending &= ~(1u << c);
        const uint32_t childAddress = words[address + 1 + bitCount32(mask & ((1u << c) - 1))];
        visits.add();
        if (childLevel == kLeafLog2) {
            if (occludedInLeaf(tester, leafAt(words, childAddress), child, level, hit))
                return true;
            continue;
        }
        stackPending[cellLevel] = pending;
        stackAddress[cellLevel] = address;
        address = childAddress;
        corner = child;
        cellLevel = childLevel;
        mask = words[address];
        pending = mask & tester.childHits(corner, 1u << (cellLevel - 1));
    }
}

} // namespace detail

/// Returns whether the closed segment meets an occupied cell of side 2^level voxels (level 0:
/// voxels; a level above the root's means the root's). Ends may lie anywhere, also outside the
/// grid; the margin grows with their distance (ray_slabs.h). A segment of length zero tests its
/// point. Ends that are NaN, infinite or beyond 1e30 give true (dark, never silently lit), with
/// `hit` as the grid's corner at the root's level. `hit`, when not null, receives the first cell
/// met in front-to-back order of octants.
/// Cost: no allocation; stack of kMaxResolutionLog2 entries. The same bits on both processors.
SDAG_HD inline bool occluded(const DagView& dag, const DagSegment& segment, uint32_t level = 0,
                             DagHit* hit = nullptr) {
    const uint32_t rootLevel =
        dag.grid.resolutionLog2 > kLeafLog2 ? dag.grid.resolutionLog2 : kLeafLog2;
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
#if defined(SDAG_RAY_SLABS_AVX2)
    // 1.65 times the rays from the same voxels: LAYOUT.md.
    if (!dag.wide.words.empty() && level == 0 && !hit)
        return avx2::meetsWide(dag.wide, r);
#else
    if (level == 0 && !hit)
        return detail::meetsVoxel(dag.words.data, dag.rootAddress, rootLevel, r);
#endif
    // Any order gives the same result. Fewer cells are visited from the far end (the light),
    // because the near end skims the surface that it left: 1.11 to 1.50 and 0.95 to 2.15 M rays/s
    // on two sets of lights in Sponza at 4096^3.
    detail::NoDagVisits none;
    return detail::meetsCell(dag, r, rootLevel, level, hit == nullptr, hit, none);
}

/// Returns how many nodes and leaves the traversal of `dag.words` reads for a segment, from its far
/// end: a measure of the memory cost of a ray. Traversals of the wide form, which read two levels
/// at a time, and of levels of detail read other numbers. 0 for ends that are not finite, for an
/// empty DAG, and at the root's level or above.
SDAG_HD inline uint32_t countDagVisits(const DagView& dag, const DagSegment& segment,
                                       uint32_t level = 0) {
    const uint32_t rootLevel =
        dag.grid.resolutionLog2 > kLeafLog2 ? dag.grid.resolutionLog2 : kLeafLog2;
    const float scale = segmentScale(dag.grid, segment);
    if (!(scale < kLargestScale) || dag.rootAddress == kNoNode || level >= rootLevel)
        return 0;
    detail::DagVisits visits;
    detail::meetsCell(dag, makeRaySlabs(segment, scale), rootLevel, level, true, nullptr, visits);
    return visits.count;
}

/// Returns by how many voxels shadowSegment lifts the start along the normal: offset * (|nx| +
/// |ny| + |nz|) * (cells of side 2^level + twice the predicate's margin + the sample's own
/// rounding). A plane's closed voxels reach exactly that far above it, so with offset = 1 a planar
/// receiver never shadows itself. Arguments as shadowSegment's.
SDAG_HD inline double shadowLift(const VoxelGrid& grid, const glm::vec3& sampleWorld,
                                 const glm::vec3& normalWorld, const glm::vec3& lightWorld,
                                 float offset, uint32_t level) {
    const glm::dvec3 sample = grid.voxelFromWorld(glm::dvec3(sampleWorld));
    const glm::dvec3 light = grid.voxelFromWorld(glm::dvec3(lightWorld));
    const glm::dvec3 n(normalWorld);
    return shadowLiftVoxels(grid.resolution(), grid.voxelSizeWorld, sampleWorld, n, sample, light,
                            mutated(Mutant::kLiftEightfold, offset, 8.0f * offset),
                            double(1u << level));
}

/// Returns the segment, in voxel space, that is tested for a view sample and a light. Both ends are
/// kept out of the voxels of the sample's surface and of the light's fixture. Start: lifted along
/// the normal by shadowLift, then moved towards the light by offset cells, halfway at most: out of
/// the cells of a wall behind the sample, which no exact ray to the light meets (one cell was
/// measured against none and sqrt(3), LAYOUT.md). End: moved back towards the start by offset *
/// sqrt(3) cells, never past the start, then lifted to the start's height above the receiver's
/// plane if it lies lower (a light nearer to the plane than the offset would otherwise be reached
/// through the receiver's own voxels; such a start is only lifted). Consequence: blockers nearer
/// than the offset are missed (contact shadows). Not guaranteed: for a light on a face, that face's
/// voxels may still block rays at grazing angles.
/// @param sampleWorld,normalWorld position and unit geometric normal on the light's side
/// @param offset in units of the derived offset; 1 is the default, 0 none
SDAG_HD inline DagSegment shadowSegment(const VoxelGrid& grid, const glm::vec3& sampleWorld,
                                        const glm::vec3& normalWorld, const glm::vec3& lightWorld,
                                        float offset, uint32_t level) {
    const glm::dvec3 n(mutated(Mutant::kRayNormalFlipped, normalWorld, -normalWorld));
    glm::dvec3 light = grid.voxelFromWorld(glm::dvec3(lightWorld));
    light.x = mutated(Mutant::kRayLightMoved, light.x, light.x + 2.0);
    const glm::dvec3 from =
        grid.voxelFromWorld(glm::dvec3(sampleWorld)) +
        n * shadowLift(grid, sampleWorld, normalWorld, lightWorld, offset, level);
    return segmentFromLifted(from, n, light, double(offset), double(1u << level));
}

} // namespace shadowdag
