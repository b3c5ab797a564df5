// SPDX-License-Identifier: Apache-2.0
// Which triangles are near an occupied voxel: an octree over the DAG's own cells whose leaves list
// triangles, and the traversal of both at once that answers rays exactly.
//
// Where the segment of a pair's own ray (truth_ray.h: no offset) meets no voxel, nothing that
// stands still is in its way. Where it meets one in a cell that lists triangles, these are held
// against the ray, the whole cell at once; when none blocks, the traversal goes on behind the cell.
// A crossing of segment and triangle lies in a closed voxel that both touch: the DAG has it, the
// predicate of dag_trace.h meets it, and the cell around it lists the triangle (triangle_voxels.h
// misses no touching pair). So no blocker is lost, and what is reported was confirmed.
#pragma once

#include "hybrid/rays/directional_rays.h"
#include "hybrid/rays/truth_ray.h"
#include "voxel/dag_trace.h"

#include <vector>

namespace shadowdag {

/// Layout, in 32-bit words:
///
// clang-format off
///     entry: kTriangleListTag | address of a list, or the address of a node
///
///     node, a cell of side 2^L, L > kLeafLog2     list
///     +----------------------+                    +----------------------+
///     | 0..7   child mask    |                    | count                |
///     +----------------------+                    +----------------------+
///     | entry of 1st child   |  in ascending c    | triangle             |  ascending world
///     | ... popcount(mask)   |                    | ... count            |  indices
///     +----------------------+                    +----------------------+
///
// clang-format on
/// Children as in DagView. rootEntry: kNoNode when nothing stands still.
struct TriangleTreeView {
    View<const uint32_t> words;
    uint32_t rootEntry = kNoNode;
};

constexpr uint32_t kTriangleListTag = 1u << 31;

/// What exact rays are held against besides the DAG. Without words: exact rays cannot be asked.
struct ExactView {
    TruthGeometry geometry;
    TriangleTreeView tree;
};

/// Owns a tree on the host.
struct TriangleTree {
    std::vector<uint32_t> words;
    uint32_t rootEntry = kNoNode;

    TriangleTreeView view() const { return {viewOf(words), rootEntry}; }
    uint64_t bytes() const { return words.size() * sizeof(uint32_t); }
};

/// A cell is divided while it lists more triangles than this. 24 to 2 differ by 1.15 in time and by
/// 2.3 in bytes (atrium: 765 ns a ray and 4.5 MiB, 692 ns and 10.3 MiB); here 696 ns and 7.1 MiB.
constexpr uint32_t kMaxListLength = 8;

/// Returns the tree of the listed triangles over the grid's cells; parts of triangles outside of
/// the grid are ignored, as the voxelizer does. Deterministic. Throws Error kResource when it
/// outgrows 2^31 words.
TriangleTree buildTriangleTree(const TriangleView& triangles, View<const uint32_t> which,
                               const VoxelGrid& grid);

namespace detail {

/// Returns whether a triangle of the list blocks the ray; it is then kept in `blocker`.
SDAG_HD inline bool blockedByList(const ExactView& exact, uint32_t list, const TruthRay& ray,
                                  uint32_t* blocker) {
    const uint32_t* words = exact.tree.words.data + list;
    for (uint32_t i = 1; i <= words[0]; ++i)
        if (blocksTruthRay(exact.geometry, ray, words[i])) {
            if (blocker)
                *blocker = words[i];
            return true;
        }
    return false;
}

} // namespace detail

/// Returns whether a triangle of the tree blocks the ray. Ends beyond 1e30 voxels: true, never
/// silently lit.
/// @param dag of the same triangles over the same grid
/// @param blocker receives the triangle that blocks, unchanged when none does; may be null
SDAG_HD inline bool isBlockedExactly(const DagView& dag, const ExactView& exact,
                                     const TruthRay& ray, uint32_t* blocker = nullptr) {
    if (!(ray.tFar > 0.0f) || dag.rootAddress == kNoNode)
        return false;
    const glm::dvec3 from = glm::dvec3(ray.startLocal) + exact.geometry.origin;
    // Far beyond the grid lies the end of a directional light's ray only.
    const glm::dvec3 start = dag.grid.voxelFromWorld(from);
    const glm::dvec3 end =
        endWithinGrid(dag.grid, start, dag.grid.voxelFromWorld(from + glm::dvec3(ray.direction)),
                      double(dag.grid.resolution()));
    const DagSegment segment{glm::vec3(start), glm::vec3(end)};
    const float scale = segmentScale(dag.grid, segment);
    if (!(scale < kLargestScale))
        return true;
    if (exact.tree.rootEntry == kNoNode)
        return true; // voxels without triangles are not this tree's: dark, never silently lit
    const uint32_t rootLevel =
        dag.grid.resolutionLog2 > kLeafLog2 ? dag.grid.resolutionLog2 : kLeafLog2;
    const uint32_t* words = dag.words.data;
    const uint32_t* tree = exact.tree.words.data;
    const slabs::Tester tester(makeRaySlabs(segment, scale), true);

    // Within a cell that lists triangles: its list and level; in the tree above: none.
    uint32_t list = kNoNode, listLevel = rootLevel;
    slabs::Corner corner;
    uint32_t address = dag.rootAddress, node = exact.tree.rootEntry, level = rootLevel;
    if (node & kTriangleListTag)
        list = node & ~kTriangleListTag;
    if (rootLevel == kLeafLog2)
        return (tester.leafHits(corner) & detail::leafAt(words, address)) != 0 &&
               detail::blockedByList(exact, list, ray, blocker);

    uint32_t stackAddress[kMaxResolutionLog2 + 1], stackNode[kMaxResolutionLog2 + 1],
        stackPending[kMaxResolutionLog2 + 1];
    uint32_t mask = words[address];
    uint32_t pending = mask & tester.childHits(corner, 1u << (level - 1));
    if (list == kNoNode)
        pending &= tree[node];
    while (true) {
        while (pending == 0) {
            if (++level > rootLevel)
                return false;
            if (level > listLevel)
                list = kNoNode;
            pending = stackPending[level];
            address = stackAddress[level];
            node = stackNode[level];
            corner = corner.ancestor(level);
            mask = words[address];
        }
        const uint32_t childLevel = level - 1;
        const uint32_t c = tester.first(pending);
        const uint32_t below = (1u << c) - 1;
        pending &= ~(1u << c);
        const slabs::Corner child = corner.child(c, 1u << childLevel);
        const uint32_t childAddress = words[address + 1 + bitCount32(mask & below)];
        uint32_t childList = list, childNode = kNoNode;
        if (list == kNoNode) {
            childNode = tree[node + 1 + bitCount32(tree[node] & below)];
            if (childNode & kTriangleListTag)
                childList = childNode & ~kTriangleListTag;
        }
        if (childLevel == kLeafLog2) {
            if ((tester.leafHits(child) & detail::leafAt(words, childAddress)) == 0)
                continue;
            if (detail::blockedByList(exact, childList, ray, blocker))
                return true;
            if (list != kNoNode) { // the rest of the cell has the same list
                level = listLevel;
                pending = 0;
            }
            continue;
        }
        stackPending[level] = pending;
        stackAddress[level] = address;
        stackNode[level] = node;
        if (list == kNoNode && childList != kNoNode) {
            list = childList;
            listLevel = childLevel;
        }
        address = childAddress;
        node = childNode;
        corner = child;
        level = childLevel;
        mask = words[address];
        pending = mask & tester.childHits(corner, 1u << (level - 1));
        if (list == kNoNode)
            pending &= tree[node];
    }
}

} // namespace shadowdag
