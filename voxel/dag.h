// SPDX-License-Identifier: Apache-2.0
// The sparse voxel DAG in memory: layout, view, owner.
// Source: Kaempe, Sintorn, Assarsson, High Resolution Sparse Voxel DAGs, SIGGRAPH 2013, sec. 4.
#pragma once

#include "cuda/buffer.h"
#include "cuda/uninitialized.h"
#include "voxel/bits.h"
#include "voxel/voxel_grid.h"

#include <cstdint>
#include <vector>

namespace shadowdag {

/// A leaf holds 4 x 4 x 4 voxels.
constexpr uint32_t kLeafLog2 = 2;

/// A second form of the DAG for tracing on the CPU, built from the canonical one: a node covers two
/// levels. Its words are stored after the words of the nodes below it:
///
///     node of level L = 4, 6, ...: 64-bit mask of its 4^3 cells of level L - 2, bit 8 * c + g for
///     grandchild g of child c; then the addresses of the occupied ones, ascending
///     leaf: as in DagView
///
/// The root's level is even. An odd root becomes child 0 of a node above it.
struct WideDagView {
    View<const uint32_t> words; ///< empty: there is none
    uint32_t rootAddress = 0;
    uint32_t rootLevel = 0;
    View<const uint32_t> coverage = {}; ///< by word, or empty: wideCoverage (dag_lod.h)
};

/// Layout, in 32-bit words; a node's address is the index of its first word:
///
///     inner node, cells of side 2^L, L > kLeafLog2        leaf, cell of side 4
///     +----------------------+                            +--------------------------+
///     | 0..7   child mask    |  bit c: child c is there   | low 32 voxels (byte a)   |
///     | 8..31  zero          |                            | high 32 voxels           |
///     +----------------------+                            +--------------------------+
///     | address of 1st child |  in ascending c            bit 8 * o + s: octant o (2^3 block),
///     | ... popcount(mask)   |                            voxel s inside it
///     +----------------------+
///     child, octant and voxel numbers are x | y << 1 | z << 2
///
/// Nodes are unique by content, children are addressed before use is possible only downwards (a
/// DAG), and stand in a canonical order: level by level from the root, in each level by first visit
/// in child order. Empty scene: rootAddress = kNoNode. A grid of 2^2 or smaller has a leaf as root.
struct DagView {
    View<const uint32_t> words;
    uint32_t rootAddress = 0xffffffffu;
    VoxelGrid grid;
    WideDagView wide = {}; ///< the same voxels in wide form, or empty; does not change results
};

constexpr uint32_t kNoNode = 0xffffffffu;

/// Statistics of a DAG by level. In `nodeCounts` index 0 is the root, and every cell down to the
/// 2^3 voxel cells is a node, so that the counts can be compared with other programs, although this
/// layout stores 4^3 leaves.
struct DagStats {
    uint64_t voxelCount = 0;             ///< occupied voxels (at most 2^51, so it cannot overflow)
    std::vector<uint64_t> nodeCounts;    ///< unique nodes per level, root first, 2^3 cells last
    std::vector<uint64_t> svoNodeCounts; ///< the same before merging
    uint64_t leafCount = 0;              ///< unique 4^3 leaves
    uint64_t tracedBytes = 0;            ///< words held for tracing
};

/// Owns a DAG on the host. Immutable once built; deterministic: the same scene and grid give the
/// same words.
struct Dag {
    std::vector<uint32_t> words;
    uint32_t rootAddress = kNoNode;
    VoxelGrid grid;

    DagView view() const { return {viewOf(words), rootAddress, grid}; }
    /// Returns whether no voxel is occupied.
    bool empty() const { return rootAddress == kNoNode; }
    /// Returns whether a scene was voxelized into it, even one of moving triangles only, which
    /// produce no voxels. False if default-constructed: then it is empty over a grid of one voxel.
    bool isBuilt() const { return !empty() || grid.resolutionLog2 > 0; }
};

/// Owns the wide form of a DAG.
struct WideDag {
    UninitializedVector<uint32_t> words;
    uint32_t rootAddress = 0;
    uint32_t rootLevel = 0;

    WideDagView view() const { return {viewOf(words), rootAddress, rootLevel}; }
};

/// Returns the wide form of a DAG in canonical order. It has no words if the DAG has no voxel or a
/// leaf as root, or if it would need more words than addresses reach. On the CPU threads; the same
/// words for any number of them. Cost: linear in nodes; besides, up to one word per word of `dag`.
WideDag buildWideDag(const Dag& dag);

/// Returns the statistics of a DAG by walking it once. Cost: linear in nodes.
DagStats computeDagStats(const Dag& dag);

/// Returns whether voxel (x, y, z) is occupied; coordinates out of the grid are empty.
SDAG_HD inline bool isOccupied(const DagView& dag, uint32_t x, uint32_t y, uint32_t z) {
    const uint32_t resolution = dag.grid.resolution();
    if (dag.rootAddress == kNoNode || x >= resolution || y >= resolution || z >= resolution)
        return false;
    uint32_t address = dag.rootAddress;
    for (uint32_t level = dag.grid.resolutionLog2; level > kLeafLog2; --level) {
        const uint32_t shift = level - 1;
        const uint32_t child = (x >> shift & 1) | (y >> shift & 1) << 1 | (z >> shift & 1) << 2;
        const uint32_t mask = dag.words[address];
        if ((mask >> child & 1) == 0)
            return false;
        address = dag.words[address + 1 + bitCount32(mask & ((1u << child) - 1))];
    }
    const uint32_t octant = (x >> 1 & 1) | (y >> 1 & 1) << 1 | (z >> 1 & 1) << 2;
    const uint32_t bit = 8 * octant + ((x & 1) | (y & 1) << 1 | (z & 1) << 2);
    return (dag.words[address + bit / 32] >> (bit % 32) & 1) != 0;
}

} // namespace shadowdag
