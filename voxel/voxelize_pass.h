// SPDX-License-Identifier: Apache-2.0
// Triangles to leaves as passes: cells down to bricks, leaves of every (triangle, brick), leaves of
// the scene. The tests are those of VoxelTasks (triangle_voxels.h, cut_voxels.h), so that voxels
// are the same bit for bit. Every list is counted, scanned and filled, so none overflows.
#pragma once

#include "cuda/atomics.h"
#include "cuda/pass.h"
#include "cuda/runs.h"
#include "scenes/morton.h"
#include "voxel/bits.h"
#include "voxel/cut_voxels.h"
#include "voxel/dag.h"

namespace shadowdag {

/// The input of voxelization, on one backend.
struct VoxelScene {
    TriangleView triangles;
    MaskPyramidsView masks; ///< of triangles.masks
    VoxelGrid grid;

    SDAG_HD TriangleSetup setup(uint32_t triangle) const {
        const glm::vec3 corners[3] = {triangles.vertex(triangle, 0), triangles.vertex(triangle, 1),
                                      triangles.vertex(triangle, 2)};
        return setupTriangle(grid, corners);
    }
};

/// A cell of side 2^level as one word: its number on each axis in 21 bits.
///
///     | 0..20 x | 21..41 y | 42..62 z | 63 zero |
using PackedCell = uint64_t;
constexpr uint32_t kPackedAxisBits = 21;
constexpr uint32_t kPackedAxisMask = (1u << kPackedAxisBits) - 1;
static_assert(kMaxResolutionLog2 <= kPackedAxisBits);

SDAG_HD inline PackedCell packCell(const glm::uvec3& cell) {
    return uint64_t(cell.x) | uint64_t(cell.y) << kPackedAxisBits |
           uint64_t(cell.z) << (2 * kPackedAxisBits);
}
SDAG_HD inline glm::uvec3 unpackCell(PackedCell cell) {
    return {uint32_t(cell) & kPackedAxisMask, uint32_t(cell >> kPackedAxisBits) & kPackedAxisMask,
            uint32_t(cell >> (2 * kPackedAxisBits)) & kPackedAxisMask};
}
/// Returns child c (x | y << 1 | z << 2) of a cell, a level below.
SDAG_HD inline glm::uvec3 childCell(const glm::uvec3& cell, uint32_t c) {
    return cell * 2u + glm::uvec3(c & 1, c >> 1 & 1, c >> 2);
}

/// Marks with 1 the listed triangles that meet the grid's cube, and finds the first whose position
/// is not finite. marks: which.count + 1; firstBad: one element, ~0 before.
struct MarkInside {
    VoxelScene scene;
    View<const uint32_t> which;
    View<uint32_t> marks;
    View<uint32_t> firstBad;

    size_t itemCount() const { return which.count; }
    size_t grain() const { return 64; }
    SDAG_HD void operator()(size_t i) const {
        const TriangleSetup s = scene.setup(which[i]);
        const double limit = double(scene.grid.resolution());
        bool meets = true;
        for (int a = 0; a < 3; ++a) {
            const double sum = s.p[a][0] + s.p[a][1] + s.p[a][2];
            if (!(fabs(sum) < INFINITY))
                atomicMinRelaxed(&firstBad[0], uint32_t(i));
            meets = meets && s.least[a] <= limit && s.most[a] >= 0;
        }
        marks[i] = meets;
    }
};

/// Writes the entries of a list that are marked. @param next the exclusive scan of the marks
struct ListMarked {
    View<const uint32_t> list;
    View<const uint32_t> next;
    View<uint32_t> marked;

    size_t itemCount() const { return list.count; }
    size_t grain() const { return 4096; }
    SDAG_HD void operator()(size_t i) const {
        if (next[i + 1] != next[i])
            marked[next[i]] = list[i];
    }
};

/// Marks entries whose child mask has bit `child`. marks: count + 1.
struct MarkChild {
    View<const uint32_t> childMask;
    uint32_t child;
    View<uint32_t> marks;

    size_t itemCount() const { return childMask.count; }
    size_t grain() const { return 4096; }
    SDAG_HD void operator()(size_t i) const { marks[i] = childMask[i] >> child & 1u; }
};

/// (triangle, cell) pairs: every listed triangle in one cell where `cells` is empty.
struct CellPairs {
    View<const uint32_t> triangles;
    View<const PackedCell> cells;
    PackedCell oneCell; ///< where cells is empty

    SDAG_HD PackedCell cell(size_t i) const { return cells.empty() ? oneCell : cells[i]; }
};

/// Finds and counts the children of every pair's cell of `level` that its triangle touches.
/// childMask: count; counts: count + 1.
struct CountChildren {
    VoxelScene scene;
    CellPairs pairs;
    uint32_t level;
    View<uint32_t> childMask;
    View<uint32_t> counts;

    size_t itemCount() const { return pairs.triangles.count; }
    size_t grain() const { return 64; }
    SDAG_HD void operator()(size_t i) const {
        const TriangleSetup s = scene.setup(pairs.triangles[i]);
        const glm::uvec3 cell = unpackCell(pairs.cell(i));
        const int half = 1 << (level - 1);
        const int limit = int(scene.grid.resolution());
        uint32_t mask = 0;
        for (uint32_t c = 0; c < 8; ++c) {
            const glm::ivec3 corner = glm::ivec3(childCell(cell, c)) * half;
            if (corner.x < limit && corner.y < limit && corner.z < limit &&
                touchesCube(s, corner, half))
                mask |= 1u << c;
        }
        childMask[i] = mask;
        counts[i] = bitCount32(mask);
    }
};

/// Writes the pairs that CountChildren counted. @param first the exclusive scan of the counts
struct ListChildren {
    CellPairs pairs;
    View<const uint32_t> childMask;
    View<const uint32_t> first;
    View<uint32_t> triangles;
    View<PackedCell> cells;

    size_t itemCount() const { return pairs.triangles.count; }
    size_t grain() const { return 1024; }
    SDAG_HD void operator()(size_t i) const {
        const glm::uvec3 cell = unpackCell(pairs.cell(i));
        uint32_t next = first[i];
        for (uint32_t mask = childMask[i]; mask != 0; mask &= mask - 1) {
            triangles[next] = pairs.triangles[i];
            cells[next++] = packCell(childCell(cell, lowestBit32(mask)));
        }
    }
};

/// Returns the share of a voxel's coordinate in its bit of a leaf (dag.h).
SDAG_HD inline uint32_t leafBitOf(uint32_t coordinate, int axis) {
    return ((coordinate & 1u) + ((coordinate & 2u) << 2)) << axis;
}

/// Returns the voxels of a column's run in which the mask is opaque. @param run bit d: voxel d of
/// the column
SDAG_HD inline uint64_t keptOfRun(const TriangleSetup& s, const CutSetup& cut,
                                  const glm::ivec3& corner, int u, int v, uint64_t run) {
    if (cut.mask.empty())
        return run;
    const double atU = corner[s.axis[0]] + u, atV = corner[s.axis[1]] + v;
    const MaskCover cover = coverOfColumn(s, cut, atU, atV);
    if (cover != MaskCover::kSome)
        return cover == MaskCover::kAll ? run : 0;
    uint64_t kept = 0;
    for (int d = 0; d < 64; ++d)
        if ((run >> d & 1u) != 0 && isOpaqueInVoxel(s, cut, atU, atV, corner[s.axis[2]] + d))
            kept |= uint64_t(1) << d;
    return kept;
}

/// Calls emit(leaf, voxels) for every leaf of the cube of side `size` <= kBrickSize at `corner` in
/// which the triangle, or its opaque part, touches voxels; leaves are numbered from the grid's
/// corner.
/// @param cut of the triangle; an empty one for those that no mask cuts
template <class Emit>
SDAG_HD inline void forEachLeaf(const TriangleSetup& s, const CutSetup& cut,
                                const glm::ivec3& corner, int size, const Emit& emit) {
    int first[2], last[2];
    for (int a = 0; a < 2; ++a) {
        const double base = corner[s.axis[a]];
        if (s.least[a] > base + size || s.most[a] < base)
            return;
        first[a] = int(greater(floor(s.least[a]) - base, 0.0)) >> kLeafLog2;
        last[a] = int(lesser(floor(s.most[a]) - base, double(size - 1)));
        last[a] = last[a] < 0 ? -1 : last[a] >> kLeafLog2;
    }
    for (int u4 = first[0]; u4 <= last[0]; ++u4)
        for (int v4 = first[1]; v4 <= last[1]; ++v4) {
            uint64_t columns[16] = {}; // bit d: voxel d of the column
            uint64_t any = 0;
            const int u0 = u4 << kLeafLog2, v0 = v4 << kLeafLog2;
            const int u1 = u0 + 3 < size ? u0 + 3 : size - 1,
                      v1 = v0 + 3 < size ? v0 + 3 : size - 1;
            forEachColumnIn<4>(s, corner, size, {{u0, v0, 0}, {u1, v1, size - 1}},
                               [&](int u, int v, int from, int to) {
                                   const uint64_t run =
                                       ~uint64_t(0) << from & ~uint64_t(0) >> (63 - to);
                                   const uint64_t kept = keptOfRun(s, cut, corner, u, v, run);
                                   columns[(u & 3) * 4 + (v & 3)] = kept;
                                   any |= kept;
                               });
            for (int d4 = 0; d4 < 16 && any >> (4 * d4) != 0; ++d4) {
                if ((any >> (4 * d4) & 15u) == 0)
                    continue;
                uint64_t voxels = 0;
                for (uint32_t c = 0; c < 16; ++c) {
                    const uint32_t shift =
                        leafBitOf(c >> 2, s.axis[0]) + leafBitOf(c & 3, s.axis[1]);
                    for (uint32_t bits = uint32_t(columns[c] >> (4 * d4) & 15u); bits != 0;
                         bits &= bits - 1)
                        voxels |= uint64_t(1) << (shift + leafBitOf(lowestBit32(bits), s.axis[2]));
                }
                glm::uvec3 leaf = glm::uvec3(corner) >> kLeafLog2;
                leaf[s.axis[0]] += uint32_t(u4);
                leaf[s.axis[1]] += uint32_t(v4);
                leaf[s.axis[2]] += uint32_t(d4);
                emit(leaf, voxels);
            }
        }
}

/// Finds the leaves of every (triangle, brick) pair. Without `keys` it counts them (first: count +
/// 1); with, it writes them where the scan of the counts says: Morton number of the leaf, and
/// voxels.
struct ListLeaves {
    VoxelScene scene;
    CellPairs bricks;
    uint32_t brickLevel; ///< at most kBrickLog2
    View<uint32_t> first;
    View<uint64_t> keys;
    View<uint64_t> voxels;

    size_t itemCount() const { return bricks.triangles.count; }
    size_t grain() const { return 16; }
    SDAG_HD void operator()(size_t i) const {
        const uint32_t triangle = bricks.triangles[i];
        const TriangleSetup s = scene.setup(triangle);
        CutSetup cut;
        if (scene.triangles.masks.isCut(triangle)) {
            const CutTriangle& of =
                scene.triangles.masks.cuts[scene.triangles.masks.triangleCut[triangle]];
            cut = setupCut(s, of.uv, scene.masks[of.mask]);
        }
        const int brickSize = 1 << brickLevel;
        const int resolution = int(scene.grid.resolution());
        // A grid smaller than a leaf fills only its own corner of it.
        const int size = brickSize < resolution ? brickSize : resolution;
        const glm::ivec3 corner = glm::ivec3(unpackCell(bricks.cell(i))) * brickSize;
        if (keys.empty()) {
            uint32_t count = 0;
            forEachLeaf(s, cut, corner, size, [&](const glm::uvec3&, uint64_t) { ++count; });
            first[i] = count;
            return;
        }
        uint32_t next = first[i];
        forEachLeaf(s, cut, corner, size, [&](const glm::uvec3& leaf, uint64_t bits) {
            keys[next] = mortonCode(leaf.x, leaf.y, leaf.z);
            voxels[next++] = bits;
        });
    }
};

/// Joins the leaves of triangles to the leaves of the scene: those of one run are one.
/// order: what sorting by key did to the places of `voxels`; leafKeys, leafVoxels: a run each.
struct JoinLeaves {
    View<const uint64_t> keys; ///< sorted
    View<const uint32_t> order;
    View<const uint64_t> voxels;
    View<const uint32_t> runStart; ///< Runs::start
    View<uint64_t> leafKeys;
    View<uint64_t> leafVoxels;

    size_t itemCount() const { return leafKeys.count; }
    size_t grain() const { return 1024; }
    SDAG_HD void operator()(size_t run) const {
        uint64_t joined = 0;
        for (uint32_t i = runStart[run]; i < runStart[run + 1]; ++i)
            joined |= voxels[order[i]];
        leafKeys[run] = keys[runStart[run]];
        leafVoxels[run] = joined;
    }
};

} // namespace shadowdag
