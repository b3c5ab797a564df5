// SPDX-License-Identifier: Apache-2.0
#include "voxel/dag_window.h"

#include "voxel/dag_builder.h"

#include <algorithm>
#include <array>
#include <bit>
#include <unordered_map>

namespace shadowdag {
namespace {

/// Returns the number of a child or voxel of a 2^3 cell.
uint32_t octantOf(const glm::uvec3& p) {
    return (p.x & 1) | (p.y & 1) << 1 | (p.z & 1) << 2;
}

glm::uvec3 octantCorner(uint32_t octant) {
    return {octant & 1, octant >> 1 & 1, octant >> 2};
}

/// Returns the bit of a voxel of a leaf.
uint32_t leafBit(const glm::uvec3& p) {
    return 8 * octantOf(p >> 1u) + octantOf(p);
}

uint64_t leafVoxels(const Dag& dag, uint32_t address) {
    return dag.words[address] | uint64_t(dag.words[address + 1]) << 32;
}

/// Returns the child of an inner node, kNoNode where there is none.
uint32_t childOf(const Dag& dag, uint32_t address, uint32_t child) {
    if (address == kNoNode)
        return kNoNode;
    const uint32_t mask = dag.words[address];
    if ((mask >> child & 1) == 0)
        return kNoNode;
    return dag.words[address + 1 + bitCount32(mask & ((1u << child) - 1))];
}

/// The bounds of nodes relative to their corners, each found once.
class BoundsFinder {
public:
    explicit BoundsFinder(const Dag& dag) : dag_(dag) {}

    VoxelBounds find(uint32_t address, uint32_t level) {
        if (const auto known = known_.find(address); known != known_.end())
            return known->second;
        VoxelBounds bounds{glm::uvec3(~0u), glm::uvec3(0)};
        const auto add = [&](const VoxelBounds& part, const glm::uvec3& corner) {
            bounds.min = glm::min(bounds.min, corner + part.min);
            bounds.max = glm::max(bounds.max, corner + part.max);
        };
        if (level == kLeafLog2) {
            for (uint64_t left = leafVoxels(dag_, address); left != 0; left &= left - 1) {
                const uint32_t bit = uint32_t(std::countr_zero(left));
                add({}, octantCorner(bit >> 3) * 2u + octantCorner(bit & 7));
            }
        } else {
            for (uint32_t c = 0; c < 8; ++c)
                if (const uint32_t child = childOf(dag_, address, c); child != kNoNode)
                    add(find(child, level - 1), octantCorner(c) << (level - 1));
        }
        return known_[address] = bounds;
    }

private:
    const Dag& dag_;
    std::unordered_map<uint32_t, VoxelBounds> known_; // by address
};

using Neighbours = std::array<uint32_t, 8>; // nodes of a 2^3 lattice, kNoNode: empty

struct NeighboursHash {
    size_t operator()(const Neighbours& nodes) const {
        return NodeTable::hashWords(nodes.data(), 8);
    }
};

/// A node of the result at level L covers 2^3 nodes of the source, displaced by the corner modulo
/// 2^L. The displacement is the same for all nodes of a level, so the eight nodes alone determine
/// the result.
class WindowCutter {
public:
    WindowCutter(const Dag& dag, const glm::uvec3& corner, uint32_t topLevel)
        : dag_(dag), corner_(corner), builder_(topLevel), known_(topLevel + 1) {}

    /// Returns the address, in the builder, of the node that covers these.
    uint32_t cut(uint32_t level, Neighbours nodes) {
        // The farther nodes are not met along an axis without displacement.
        const glm::uvec3 shift = corner_ & ((1u << level) - 1);
        bool isEmpty = true;
        for (uint32_t i = 0; i < 8; ++i) {
            const glm::uvec3 far = octantCorner(i);
            if ((far.x && !shift.x) || (far.y && !shift.y) || (far.z && !shift.z))
                nodes[i] = kNoNode;
            isEmpty = isEmpty && nodes[i] == kNoNode;
        }
        if (isEmpty)
            return kNoNode;
        if (const auto known = known_[level].find(nodes); known != known_[level].end())
            return known->second;
        return known_[level][nodes] =
                   level == kLeafLog2 ? cutLeaf(nodes, shift) : cutInner(level, nodes, shift);
    }

    /// Returns the source's node of a level at a lattice position, kNoNode outside or empty.
    uint32_t nodeAt(uint32_t level, const glm::uvec3& position) const {
        const uint32_t rootLevel = std::max(dag_.grid.resolutionLog2, kLeafLog2);
        const glm::uvec3 outside = position >> (rootLevel - level);
        if (outside.x != 0 || outside.y != 0 || outside.z != 0)
            return kNoNode;
        uint32_t address = dag_.rootAddress;
        for (uint32_t l = rootLevel; l > level; --l)
            address = childOf(dag_, address, octantOf(position >> (l - 1 - level)));
        return address;
    }

    const DagBuilder& builder() const { return builder_; }

private:
    uint32_t cutLeaf(const Neighbours& nodes, const glm::uvec3& shift) {
        uint64_t voxels = 0;
        for (uint32_t bit = 0; bit < 64; ++bit) {
            const glm::uvec3 p = shift + octantCorner(bit >> 3) * 2u + octantCorner(bit & 7);
            const uint32_t node = nodes[octantOf(p >> kLeafLog2)];
            if (node != kNoNode)
                voxels |= (leafVoxels(dag_, node) >> leafBit(p) & 1) << bit;
        }
        return builder_.addLeaf(voxels);
    }

    uint32_t cutInner(uint32_t level, const Neighbours& nodes, const glm::uvec3& shift) {
        const glm::uvec3 first = shift >> (level - 1); // 0 or 1 an axis
        uint32_t children[8];
        for (uint32_t c = 0; c < 8; ++c) {
            Neighbours below;
            for (uint32_t i = 0; i < 8; ++i) {
                const glm::uvec3 at = first + octantCorner(c) + octantCorner(i); // 0 to 3
                below[i] = childOf(dag_, nodes[octantOf(at >> 1u)], octantOf(at));
            }
            children[c] = cut(level - 1, below);
        }
        return builder_.addInner(level, children);
    }

    const Dag& dag_;
    const glm::uvec3 corner_;
    DagBuilder builder_;
    std::vector<std::unordered_map<Neighbours, uint32_t, NeighboursHash>> known_; // by level
};

} // namespace

VoxelBounds occupiedBounds(const Dag& dag) {
    SDAG_ASSERT(!dag.empty());
    return BoundsFinder(dag).find(dag.rootAddress, std::max(dag.grid.resolutionLog2, kLeafLog2));
}

Dag cutWindow(const Dag& dag, glm::uvec3 corner, const VoxelGrid& grid) {
    const uint32_t level = std::max(grid.resolutionLog2, kLeafLog2);
    SDAG_ASSERT(level <= std::max(dag.grid.resolutionLog2, kLeafLog2));
    WindowCutter cutter(dag, corner, level);
    Neighbours nodes;
    for (uint32_t i = 0; i < 8; ++i)
        nodes[i] =
            dag.empty() ? kNoNode : cutter.nodeAt(level, (corner >> level) + octantCorner(i));
    const uint32_t address = cutter.cut(level, nodes);
    return cutter.builder().finish(level, address, grid);
}

} // namespace shadowdag
