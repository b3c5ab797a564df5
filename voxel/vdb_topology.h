// SPDX-License-Identifier: Apache-2.0
// Conversion between a DAG and the tree that OpenVDB and NanoVDB share: leaves of 8^3 voxels, lower
// nodes of 16^3 leaves, upper nodes of 32^3 lower nodes, a root of upper nodes. Includes neither
// library. Source: Museth, VDB: High-Resolution Sparse Volumes with Dynamic Topology, ACM ToG 2013.
#pragma once

#include "voxel/dag_builder.h"

#include <array>
#include <functional>
#include <vector>

namespace shadowdag {

/// Levels of VDB's nodes: cells of side 2^level voxels.
constexpr uint32_t kVdbLeafLevel = 3, kVdbLowerLevel = 7, kVdbUpperLevel = 12;

/// The level of a cube of upper nodes that contains 2^kMaxResolutionLog2 voxels at any position.
constexpr uint32_t kVdbTopLevel = kMaxResolutionLog2 + 1;

/// The voxels of an 8^3 leaf: word x, bit y << 3 | z.
using VdbLeafMask = std::array<uint64_t, 8>;

/// Builds a DAG from the nodes of such a tree, bottom-up. Nothing is expanded: a tile is one node
/// per level.
class VdbDagBuilder {
public:
    VdbDagBuilder() : builder_(kVdbTopLevel) {}

    /// Returns the address of a leaf, kNoNode when it is empty.
    uint32_t addLeaf(const VdbLeafMask& mask);
    /// Returns the address of the wholly occupied cell of a level.
    uint32_t full(uint32_t level);
    /// Returns the address of a node of `level` from its children of childLevel, in VDB's order: x,
    /// then y, then z, each level - childLevel bits, z lowest.
    uint32_t addNode(uint32_t level, uint32_t childLevel, const std::vector<uint32_t>& children);
    /// Puts an upper node, or kNoNode, at its place in the root.
    /// @param corner of the node in index space, multiples of 2^kVdbUpperLevel
    void addToRoot(const glm::ivec3& corner, uint32_t address);

    /// Returns whether addToRoot was given no node.
    bool empty() const { return roots_.empty(); }
    /// Returns the least corner of the nodes in the root, and how many nodes they span along the
    /// longest axis.
    glm::ivec3 rootCorner() const;
    uint64_t rootSpan() const;
    /// Returns the DAG of 2^level voxels an axis, voxel 0 at `corner`, of the nodes in the root,
    /// all of which lie in it. Throws Error kInput naming `name` when one place is taken twice.
    /// @param corner multiples of 2^kVdbUpperLevel
    /// @param level kVdbUpperLevel to kVdbTopLevel
    Dag finish(const glm::ivec3& corner, uint32_t level, const std::string& name);

private:
    struct Root {
        glm::ivec3 corner;
        uint32_t address;
    };
    uint32_t addRange(uint32_t level, const std::pair<uint32_t, uint32_t>* first,
                      const std::pair<uint32_t, uint32_t>* last);

    DagBuilder builder_;
    std::vector<Root> roots_;
    std::vector<uint32_t> full_; // by level - kLeafLog2, as far as asked for
    std::vector<uint32_t> scratch_, scratchBelow_;
};

/// The number of nodes, and of tiles, that a DAG has as a VDB tree.
struct VdbCellCounts {
    uint64_t leafCount = 0, lowerCount = 0, upperCount = 0, tileCount = 0;
};

/// Returns the statistics of forEachVdbCell's calls. Cost: linear in nodes.
VdbCellCounts countVdbCells(const Dag& dag);

/// Calls leaf(corner, mask) for every 8^3 cell with some but not all voxels occupied, and
/// tile(corner, level) for the largest fully occupied cells of VDB's levels, in child order.
void forEachVdbCell(const Dag& dag,
                    const std::function<void(const glm::uvec3&, const VdbLeafMask&)>& leaf,
                    const std::function<void(const glm::uvec3&, uint32_t level)>& tile);

} // namespace shadowdag
