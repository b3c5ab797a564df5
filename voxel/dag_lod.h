// SPDX-License-Identifier: Apache-2.0
// Level of detail that follows the footprint along a shadow ray: which level is read where, which
// cells count, and the traversal.
//
// Definition. A segment runs from its receiver (time 0) to its light (time 1). To each level L of
// LodTimes belongs a closed part of the segment, T(L) = [begin[L], end[L]]: coarse levels the part
// at the receiver, fine ones the part at the light. The segment is dark when some cell of some
// level L from `bottom` to `top`
//     1. holds an occupied voxel,
//     2. counts: coverage at least the threshold (levels above 0; lodCounts), and
//     3. is met during T(L) by the slab test of ray_slabs.h: the latest near time and begin[L] are
//        at most the earliest far time and end[L].
// Nothing else matters, so an answer is a function of cell and segment, and any order of visits
// gives it. A traversal may drop a cell that the segment misses, because the slab test of a box
// encloses those of the boxes in it, also when both are cut to the same times.
//
// Where the parts T(L) abut (footprint) this says of every point of the segment: it is dark when
// the cell of the level that is asked for there is occupied.
//
// Source of the footprint: the pixel's cone narrowing towards the light, as that of a shadow map's
// texel does (Olsson et al., More Efficient Virtual Shadow Maps for Many Lights, TVCG 2015, sec.
// IV-B); of cones that stop at the voxel as wide as they are: Laine, Karras, Efficient Sparse Voxel
// Octrees, I3D 2010, sec. 5. Ours narrows, and tests the line, not the cone.
#pragma once

#include "voxel/dag_trace.h"

namespace shadowdag {

/// How rays choose the level of the cells that stop them.
enum class LodRule : uint8_t {
    kFixed,     ///< one level everywhere
    kFootprint, ///< the footprint's; every occupied cell stops
    kCoverage,  ///< the footprint's; a cell stops when enough of it is covered, else it lets pass
};

/// How wide a ray is, in voxels: min(start, slope * distance to the light).
struct Footprint {
    double start = 0; ///< of the pixel, at the receiver
    double slope = 0; ///< a voxel nearer to the light; at least start / the ray's length
};

/// Returns the footprint of a pixel's ray to a light: the pixel's at the receiver, narrowing to a
/// point at the light, nowhere narrower than the light's requested texel there (2 s / R at
/// distance s) as far as that is not wider than the pixel, all times `scale`.
/// @param pixelVoxels side of the pixel at the receiver, in voxels
/// @param lengthVoxels distance of the two, > 0
/// @param resolution texels across a face of the light's map, R of resolution.h; 0: not asked
SDAG_HD inline Footprint makeFootprint(double pixelVoxels, double lengthVoxels, double resolution,
                                       double scale) {
    const double cone = pixelVoxels / lengthVoxels;
    const double texel = resolution > 0.0 ? 2.0 / resolution : 0.0;
    return {scale * pixelVoxels, scale * (texel > cone ? texel : cone)};
}

/// Returns the level of the cells that are no wider than `voxels`: floor(log2), 0 under 2 voxels,
/// kMaxResolutionLog2 at most. NaN gives 0.
SDAG_HD inline uint32_t lodLevel(double voxels) {
    uint32_t level = 0;
    for (double side = 2.0; level < kMaxResolutionLog2 && voxels >= side; side *= 2.0)
        ++level;
    return level;
}

/// Which part of a segment is answered by which level; see the head of this file.
/// begin, end: times of the segment, 0 <= begin[L] <= end[L] <= 1, both not descending as L falls.
/// Levels outside [bottom, top] have no part.
struct LodTimes {
    uint32_t top = 0, bottom = 0;
    float begin[kMaxResolutionLog2 + 1], end[kMaxResolutionLog2 + 1];
};

/// Returns the times of one level for the whole segment: what occluded(dag, segment, level) reads.
/// A level above the root's means the root's.
SDAG_HD inline LodTimes fixedLodTimes(const VoxelGrid& grid, uint32_t level) {
    const uint32_t rootLevel = grid.resolutionLog2 > kLeafLog2 ? grid.resolutionLog2 : kLeafLog2;
    LodTimes times;
    times.top = times.bottom = level < rootLevel ? level : rootLevel;
    times.begin[times.top] = 0.0f;
    times.end[times.top] = 1.0f;
    return times;
}

/// Returns the times of the levels that a footprint asks for: T(L) is where lodLevel(footprint) is
/// L. The distance to the light is counted from the segment's end (the light, or where the offset
/// drew it back to: finer, never coarser). Degenerate segments and footprints that are not finite
/// get level 0.
SDAG_HD inline LodTimes footprintLodTimes(const VoxelGrid& grid, const DagSegment& segment,
                                          const Footprint& footprint) {
    const uint32_t rootLevel = grid.resolutionLog2 > kLeafLog2 ? grid.resolutionLog2 : kLeafLog2;
    const double x = double(segment.to.x) - segment.from.x,
                 y = double(segment.to.y) - segment.from.y,
                 z = double(segment.to.z) - segment.from.z;
    const double widest = footprint.slope * sqrt(x * x + y * y + z * z);
    const uint32_t ofStart = lodLevel(footprint.start), ofWidest = lodLevel(widest);
    LodTimes times;
    times.top = ofStart < ofWidest ? ofStart : ofWidest;
    times.top = times.top < rootLevel ? times.top : rootLevel;
    float begin = 0.0f;
    for (uint32_t level = times.top; level > 0; --level) {
        times.begin[level] = begin;
        // 2^level <= footprint.slope * (1 - t) * length; at least 0, for level <= ofWidest.
        begin = times.end[level] = float(1.0 - double(1u << level) / widest);
    }
    times.begin[0] = begin;
    times.end[0] = 1.0f;
    return times;
}

/// Which cells count, and seen from where: the threshold, and the weights of the three projections,
/// which sum up to 256.
struct LodCoverage {
    uint32_t threshold = 0; ///< of 255; 0: every occupied cell counts
    uint32_t weight[3] = {256, 0, 0};
};

namespace detail {

/// The voxels of a leaf (bit number x0 y0 z0 x1 y1 z1) whose two bits of the axis are 0.
SDAG_HD inline uint64_t leafColumns(uint32_t axis) {
    return axis == 0 ? 0x0055005500550055u : axis == 1 ? 0x0000333300003333u : 0x000000000f0f0f0fu;
}

/// Returns the columns of a leaf along an axis that hold a voxel, at their first voxel's bit.
SDAG_HD inline uint64_t coveredColumns(uint64_t voxels, uint32_t axis) {
    voxels |= voxels >> (1u << axis);
    voxels |= voxels >> (8u << axis);
    return voxels & leafColumns(axis);
}

SDAG_HD inline uint32_t bitCount64(uint64_t bits) {
    return bitCount32(uint32_t(bits)) + bitCount32(uint32_t(bits >> 32));
}

/// Returns a share of columns as a coverage: 255 when all are covered, rounded down, never 0 (which
/// stands for none known) where a voxel is.
SDAG_HD inline uint32_t coverageByte(uint32_t covered, uint32_t columns) {
    const uint32_t byte = 255u * covered / columns;
    return byte != 0 ? byte : 1;
}

/// Returns whether the coverages (x in the lowest byte, then y, z) are enough.
SDAG_HD inline bool isEnough(const LodCoverage& coverage, uint32_t bytes) {
    if (bytes == 0)
        return true;
    const uint32_t sum = coverage.weight[0] * (bytes & 0xffu) +
                         coverage.weight[1] * (bytes >> 8 & 0xffu) +
                         coverage.weight[2] * (bytes >> 16);
    return sum >= coverage.threshold * 256u;
}

/// Returns the coverages of a leaf's 4^3 cell.
SDAG_HD inline uint32_t leafCoverage(uint64_t voxels) {
    uint32_t bytes = 0;
    for (uint32_t axis = 0; axis < 3; ++axis)
        bytes |= coverageByte(bitCount64(coveredColumns(voxels, axis)), 16) << (8 * axis);
    return bytes;
}

/// Returns the coverages of a 2^3 octant.
SDAG_HD inline uint32_t octantCoverage(uint32_t voxels) {
    const uint32_t x = (voxels | voxels >> 1) & 0x55u, y = (voxels | voxels >> 2) & 0x33u,
                   z = (voxels | voxels >> 4) & 0x0fu;
    return coverageByte(bitCount32(x), 4) | coverageByte(bitCount32(y), 4) << 8 |
           coverageByte(bitCount32(z), 4) << 16;
}

/// Returns those of the octants (bits) of a leaf that count.
SDAG_HD inline uint32_t countingOctants(uint32_t octants, uint64_t voxels,
                                        const LodCoverage& coverage) {
    for (uint32_t left = coverage.threshold != 0 ? octants : 0; left != 0; left &= left - 1) {
        const uint32_t o = lowestBit32(left);
        if (!isEnough(coverage, octantCoverage(uint32_t(voxels >> (8 * o)) & 0xffu)))
            octants &= ~(1u << o);
    }
    return octants;
}

/// Returns the coverages of the cell of a node or leaf.
SDAG_HD inline uint32_t cellCoverage(const uint32_t* words, uint32_t address, uint32_t level) {
    return level == kLeafLog2 ? leafCoverage(leafAt(words, address)) : words[address] >> 8;
}

/// Returns those of the children (bits), of level `childLevel`, of the node that count.
SDAG_HD inline uint32_t countingChildren(const uint32_t* words, uint32_t address,
                                         uint32_t childLevel, uint32_t children,
                                         const LodCoverage& coverage) {
    const uint32_t mask = words[address];
    for (uint32_t left = coverage.threshold != 0 ? children : 0; left != 0; left &= left - 1) {
        const uint32_t c = lowestBit32(left);
        const uint32_t child = words[address + 1 + bitCount32(mask & ((1u << c) - 1))];
        if (!isEnough(coverage, cellCoverage(words, child, childLevel)))
            children &= ~(1u << c);
    }
    return children;
}

/// Returns whether a segment meets, at its times, counting cells of the leaf at the corner.
template <class Tester, class Corner>
SDAG_HD inline bool stopsInLeaf(const Tester& tester, uint64_t voxels, const Corner& corner,
                                const LodTimes& times, const LodCoverage& coverage, DagHit* hit) {
    if (times.top >= 1 && times.bottom <= 1) {
        const uint32_t met =
            tester.childHits(corner, 2, times.begin[1], times.end[1]) & octantsOf(voxels);
        const uint32_t hits = countingOctants(met, voxels, coverage);
        if (hits != 0) {
            if (hit)
                *hit = {corner.child(tester.first(hits), 2).cell(), 1};
            return true;
        }
    }
    if (times.bottom > 0)
        return false;
    const uint64_t hits = tester.leafHits(corner, times.begin[0], times.end[0]) & voxels;
    if (hits != 0 && hit) {
        const uint32_t o = tester.first(octantsOf(hits));
        const uint32_t s = tester.first(uint32_t(hits >> (8 * o)) & 0xffu);
        *hit = {corner.child(o, 2).child(s, 1).cell(), 0};
    }
    return hits != 0;
}

} // namespace detail

/// Returns whether the closed segment is dark by the definition at the head of this file. With
/// fixedLodTimes and no threshold: the bits of occluded() at that level; with a footprint under two
/// voxels: those of level 0. Ends: as occluded() takes them. `hit`, when not null, receives a cell
/// that stops the segment, of those nearest to its start not guaranteed the nearest.
/// @param dag with a threshold its words must hold coverages (withCoverage); cells that have none
/// count
/// Cost: no allocation; stack of kMaxResolutionLog2 entries. The same bits on both processors.
SDAG_HD inline bool occludedByLevels(const DagView& dag, const DagSegment& segment,
                                     const LodTimes& times, const LodCoverage& coverage,
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
    const uint32_t* words = dag.words.data;
    // From the light's end when nobody asks where: as occluded().
    const slabs::Tester tester(r, hit == nullptr);
    slabs::Corner corner;
    uint32_t address = dag.rootAddress, cellLevel = rootLevel;
    if (times.top >= rootLevel) {
        // Child 0 of a cell twice as large.
        const bool isMet = (tester.childHits(corner, 1u << rootLevel, times.begin[rootLevel],
                                             times.end[rootLevel]) &
                            1) != 0;
        if (isMet &&
            (coverage.threshold == 0 ||
             detail::isEnough(coverage, detail::cellCoverage(words, address, rootLevel)))) {
            if (hit)
                *hit = {glm::uvec3(0), rootLevel};
            return true;
        }
        if (times.bottom >= rootLevel)
            return false;
    }
    if (rootLevel == kLeafLog2)
        return detail::stopsInLeaf(tester, detail::leafAt(words, address), corner, times, coverage,
                                   hit);

    // As in occluded(); a node's children are first asked whether they stop the segment, then those
    // are kept that the segment meets while finer levels are read.
    uint32_t stackAddress[kMaxResolutionLog2 + 1], stackPending[kMaxResolutionLog2 + 1];
    bool isEntered = true;
    uint32_t mask = 0, pending = 0;
    while (true) {
        const uint32_t childLevel = cellLevel - 1;
        if (isEntered) {
            isEntered = false;
            mask = words[address] & 0xffu;
            pending = 0;
            float begin = 0.0f;
            if (childLevel <= times.top) {
                const uint32_t met =
                    mask & tester.childHits(corner, 1u << childLevel, times.begin[childLevel],
                                            times.end[childLevel]);
                const uint32_t stops =
                    detail::countingChildren(words, address, childLevel, met, coverage);
                if (stops != 0) {
                    if (hit)
                        *hit = {corner.child(tester.first(stops), 1u << childLevel).cell(),
                                childLevel};
                    return true;
                }
                begin = childLevel > times.bottom ? times.begin[childLevel - 1] : 0.0f;
            }
            if (childLevel > times.bottom)
                pending = mask & tester.childHits(corner, 1u << childLevel, begin, 1.0f);
        }
        if (pending == 0) {
            if (++cellLevel > rootLevel)
                return false;
            pending = stackPending[cellLevel];
            address = stackAddress[cellLevel];
            corner = corner.ancestor(cellLevel);
            mask = words[address];
            continue;
        }
        const uint32_t c = tester.first(pending);
        const slabs::Corner child = corner.child(c, 1u << childLevel);
        pending &= ~(1u << c);
        const uint32_t childAddress = words[address + 1 + bitCount32(mask & ((1u << c) - 1))];
        if (childLevel == kLeafLog2) {
            if (detail::stopsInLeaf(tester, detail::leafAt(words, childAddress), child, times,
                                    coverage, hit))
                return true;
            continue;
        }
        stackPending[cellLevel] = pending;
        stackAddress[cellLevel] = address;
        address = childAddress;
        corner = child;
        cellLevel = childLevel;
        isEntered = true;
    }
}

/// Returns the DAG with the coverages of every node's cell in bits 8..31 of its first word: of its
/// 4^L columns along x, y, z (8 bits each, x lowest), how many hold a voxel, 255 for all, rounded
/// down, at least 1. Exact to cells of 16^3 voxels; larger ones combine grids of 4 x 4 parts of
/// their halves by the greater value: never more than the truth, which is at most twice that a
/// level. Leaves stay; theirs is counted from their voxels. Other readers of the words mask them.
/// A function of what is under a node, so nodes stay merged; never written to a file.
/// Cost: linear in nodes, parallel by level; 96 bytes a node of two levels for the time of it.
Dag withCoverage(const Dag& dag);

} // namespace shadowdag
