// SPDX-License-Identifier: Apache-2.0
// Level of detail that follows the footprint along a shadow ray: which level is read where, which
// cells count, and the traversal.
//
// Definition. A segment runs from its receiver (time 0) to its light (time 1). To each level L of
// LodTimes belongs a closed part of the segment, T(L) = [begin[L], end[L]]: coarse levels the part
// at the receiver, fine ones the part at the light. The segment is dark when some cell of some
// level L from `bottom` to `top`
//     1. holds an occupied voxel,
//     2. counts: its level is 0, or its coverage (withCoverage) is at least the threshold, and
//     3. is met during T(L) by the slab test of ray_slabs.h: the latest near time and begin[L] are
//        at most the earliest far time and end[L].
// Nothing else matters, so the result is a function of cells and segment, and any order of visits
// gives it. A traversal may skip a cell that the segment misses, because the slab test of a box
// encloses those of the boxes in it, also when both are cut to the same times.
//
// Where the parts T(L) abut (footprint), a point of the segment is dark when the cell of the level
// requested there is occupied.
//
// Source of the footprint: the pixel's cone narrows towards the light, as that of a shadow map's
// texel does (Olsson et al., More Efficient Virtual Shadow Maps for Many Lights, TVCG 2015, sec.
// IV-B). Cones that stop at a voxel of their own width: Laine, Karras, Efficient Sparse Voxel
// Octrees, I3D 2010, sec. 5. Ours narrows, and tests the line, not the cone.
#pragma once

#include "voxel/dag_lod_wide.h"
#include "voxel/dag_trace.h"
#include "voxel/lod_coverage.h"

namespace shadowdag {

/// How the level of the cells that stop a ray is chosen.
enum class LodRule : uint8_t {
    kFixed,     ///< one level everywhere
    kFootprint, ///< the footprint's level; every occupied cell stops the ray
    kCoverage,  ///< the footprint's level; a cell stops the ray if enough of it is covered
};

/// How wide a ray is, in voxels: min(start, slope * distance to the light).
struct Footprint {
    double start = 0; ///< of the pixel, at the receiver
    double slope = 0; ///< a voxel nearer to the light; at least start / the ray's length
};

/// Returns the footprint of a pixel's ray to a light, times `scale`: the pixel's size at the
/// receiver, narrowing to a point at the light, but nowhere narrower than the light's requested
/// texel there (2 s / R at distance s), as far as that is not wider than the pixel.
/// @param pixelVoxels side of the pixel at the receiver, in voxels
/// @param lengthVoxels distance of the two, > 0
/// @param resolution texels across a face of the light's map, R of resolution.h; 0: no limit
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
    return mutated(Mutant::kLevelTooCoarse, level, level + (level < kMaxResolutionLog2));
}

/// The part of a segment that is tested at each level; see the head of this file. begin, end: times
/// of the segment, 0 <= begin[L] <= end[L] <= 1, both not descending as L falls. Levels outside
/// [bottom, top] have no part.
struct LodTimes {
    uint32_t top = 0, bottom = 0;
    float begin[kMaxResolutionLog2 + 1], end[kMaxResolutionLog2 + 1];
};

/// Returns the times for one level over the whole segment, as in occluded(dag, segment, level). A
/// level above the root's means the root's.
SDAG_HD inline LodTimes fixedLodTimes(const VoxelGrid& grid, uint32_t level) {
    const uint32_t rootLevel = grid.resolutionLog2 > kLeafLog2 ? grid.resolutionLog2 : kLeafLog2;
    LodTimes times;
    times.top = times.bottom = level < rootLevel ? level : rootLevel;
    times.begin[times.top] = 0.0f;
    times.end[times.top] = 1.0f;
    return times;
}

/// Returns the times of the levels that a footprint requests: T(L) is where lodLevel(footprint) is
/// L. The distance to the light is measured from the segment's end (the light, or the point that
/// the offset moved it to: finer, never coarser). Degenerate segments and footprints that are not
/// finite get level 0.
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

/// Returns the coverage at and above which a cell counts, for a share of its columns in (0, 1].
SDAG_HD inline uint32_t coverageThreshold(float share) {
    return uint32_t(255.0f * share);
}

namespace detail {

/// Returns whether a coverage is at least the threshold; 0 means that it is unknown.
SDAG_HD inline bool isEnough(uint32_t coverage, uint32_t threshold) {
    return coverage >= threshold || coverage == 0;
}

/// Returns those of the octants (bits) of a leaf that count.
SDAG_HD inline uint32_t countingOctants(uint32_t octants, uint64_t voxels, uint32_t threshold) {
    for (uint32_t left = threshold != 0 ? octants : 0; left != 0; left &= left - 1) {
        const uint32_t o = lowestBit32(left);
        if (!isEnough(octantCoverage(uint32_t(voxels >> (8 * o)) & 0xffu), threshold))
            octants &= ~(1u << o);
    }
    return octants;
}

/// Returns the coverage of the cell of a node or leaf.
SDAG_HD inline uint32_t cellCoverage(const uint32_t* words, uint32_t address, uint32_t level) {
    return level == kLeafLog2 ? leafCoverage(leafAt(words, address)) : words[address] >> 8;
}

/// Returns those of the children (bits), of level `childLevel`, of the node that count.
SDAG_HD inline uint32_t countingChildren(const uint32_t* words, uint32_t address,
                                         uint32_t childLevel, uint32_t children,
                                         uint32_t threshold) {
    const uint32_t mask = words[address];
    for (uint32_t left = threshold != 0 ? children : 0; left != 0; left &= left - 1) {
        const uint32_t c = lowestBit32(left);
        const uint32_t child = words[address + 1 + bitCount32(mask & ((1u << c) - 1))];
        if (!isEnough(cellCoverage(words, child, childLevel), threshold))
            children &= ~(1u << c);
    }
    return children;
}

/// Returns whether a segment meets, at its times, counting cells of the leaf at the corner.
template <class Tester, class Corner>
SDAG_HD inline bool stopsInLeaf(const Tester& tester, uint64_t voxels, const Corner& corner,
                                const LodTimes& times, uint32_t threshold, DagHit* hit) {
    if (times.top >= 1 && times.bottom <= 1) {
        const uint32_t met =
            tester.childHits(corner, 2, times.begin[1], times.end[1]) & octantsOf(voxels);
        const uint32_t hits = countingOctants(met, voxels, threshold);
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
/// that stops the segment, not always the nearest.
/// @param threshold coverageThreshold's; 0: every occupied cell counts. Above 0 the DAG's words
/// must hold coverages (withCoverage); cells that have none count Cost: no allocation; stack of
/// kMaxResolutionLog2 entries. The same bits on both processors.
SDAG_HD inline bool occludedByLevels(const DagView& dag, const DagSegment& segment,
                                     const LodTimes& times, uint32_t threshold,
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
#if defined(SDAG_RAY_SLABS_AVX2)
    if (!dag.wide.words.empty() && !hit && times.top == 0)
        return avx2::meetsWide(dag.wide, r);
    if (!dag.wide.words.empty() && !hit && (threshold == 0 || !dag.wide.coverage.empty()))
        return avx2::WideLodTrace<LodTimes>{dag.wide, times, threshold, avx2::WideLodTester(r)}
            .isDark(r, rootLevel);
#endif
    const uint32_t* words = dag.words.data;
    // From the light's end if no hit is requested, as in occluded().
    const slabs::Tester tester(r, hit == nullptr);
    slabs::Corner corner;
    uint32_t address = dag.rootAddress, cellLevel = rootLevel;
    if (times.top >= rootLevel) {
        // Child 0 of a cell twice as large.
        const bool isMet = (tester.childHits(corner, 1u << rootLevel, times.begin[rootLevel],
                                             times.end[rootLevel]) &
                            1) != 0;
        if (isMet &&
            (threshold == 0 ||
             detail::isEnough(detail::cellCoverage(words, address, rootLevel), threshold))) {
            if (hit)
                *hit = {glm::uvec3(0), rootLevel};
            return true;
        }
        if (times.bottom >= rootLevel)
            return false;
    }
    if (rootLevel == kLeafLog2)
        return detail::stopsInLeaf(tester, detail::leafAt(words, address), corner, times, threshold,
                                   hit);

    // As in occluded(); a node's children are first tested for stopping the segment, then those
    // that the segment meets at finer levels are kept.
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
                    detail::countingChildren(words, address, childLevel, met, threshold);
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
                                    threshold, hit))
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

/// Returns the DAG with the coverage of every node's cell in bits 8..15 of its first word: how many
/// of its 4^L columns along x, y or z, whichever are more, hold a voxel; 255 for all, rounded down,
/// at least 1. Exact for cells up to 16^3 voxels. Larger ones combine grids of 4 x 4 parts of their
/// halves by the greater value, which is never more than the true coverage; that is at most twice
/// as large per level. Leaves are unchanged; their coverage is counted from their voxels. Other
/// readers mask these bits. The greatest of the three is taken because a surface across the cell
/// stops rays from all directions: the coverage along the ray's longest axis alone, or weighted by
/// its direction, lets light through walls that rays graze (LAYOUT.md). It depends only on what is
/// under a node, so nodes stay merged; it is never written to a file. Cost: linear in nodes,
/// parallel by level; 96 temporary bytes per node of two levels.
Dag withCoverage(const Dag& dag);

/// Returns coverages for the wide form of a DAG, for WideDagView::coverage. By a node's address a:
/// the bytes of words a and a + 1 are the coverages of its eight children, word a + 2 its own. As
/// many words as the wide form has. @param covered withCoverage of the DAG that `wide` was built
/// from
/// Cost: linear in nodes.
std::vector<uint32_t> wideCoverage(const Dag& covered, const WideDag& wide);

} // namespace shadowdag
