// SPDX-License-Identifier: Apache-2.0
#include "voxel/vdb_topology.h"

#include "cuda/error.h"
#include "scenes/morton.h"

#include <algorithm>
#include <bit>
#include <unordered_map>

namespace shadowdag {
namespace {

/// The position of the bits of an 8^3 leaf in the eight 4^3 leaves of a DAG: leaf, then bit.
struct LeafPlaces {
    uint8_t leaf[512], bit[512];
    LeafPlaces() {
        for (uint32_t i = 0; i < 512; ++i) {
            const uint32_t x = i >> 6, y = i >> 3 & 7, z = i & 7;
            const auto octant = [&](uint32_t shift) {
                return (x >> shift & 1) | (y >> shift & 1) << 1 | (z >> shift & 1) << 2;
            };
            leaf[i] = uint8_t(octant(2));
            bit[i] = uint8_t(8 * octant(1) + octant(0));
        }
    }
};

const LeafPlaces& leafPlaces() {
    static const LeafPlaces places;
    return places;
}

bool isVdbLevel(uint32_t level) {
    return level == kVdbLeafLevel || level == kVdbLowerLevel || level == kVdbUpperLevel;
}

/// Walks a DAG as a VDB tree.
class CellWalker {
public:
    explicit CellWalker(const Dag& dag) : dag_(dag) {}

    /// Returns whether every voxel of the node is occupied.
    bool isFull(uint32_t address, uint32_t level) {
        if (level == kLeafLog2)
            return (dag_.words[address] & dag_.words[address + 1]) == ~0u;
        if (dag_.words[address] != 0xffu)
            return false;
        const auto [known, isNew] = full_.try_emplace(address, false);
        if (!isNew)
            return known->second;
        bool all = true;
        for (uint32_t c = 0; c < 8 && all; ++c)
            all = isFull(dag_.words[address + 1 + c], level - 1);
        return full_[address] = all;
    }

    VdbCellCounts count(uint32_t address, uint32_t level) {
        if (isVdbLevel(level) && isFull(address, level))
            return {.tileCount = 1};
        if (level <= kVdbLeafLevel)
            return {.leafCount = 1};
        if (const auto known = counts_.find(address); known != counts_.end())
            return known->second;
        VdbCellCounts sum;
        sum.lowerCount = level == kVdbLowerLevel;
        sum.upperCount = level == kVdbUpperLevel;
        const uint32_t children = bitCount32(dag_.words[address]);
        for (uint32_t i = 1; i <= children; ++i) {
            const VdbCellCounts part = count(dag_.words[address + i], level - 1);
            sum.leafCount += part.leafCount;
            sum.lowerCount += part.lowerCount;
            sum.upperCount += part.upperCount;
            sum.tileCount += part.tileCount;
        }
        return counts_[address] = sum;
    }

    template <class Leaf, class Tile>
    void walk(uint32_t address, uint32_t level, const glm::uvec3& corner, const Leaf& leaf,
              const Tile& tile) {
        if (isVdbLevel(level) && isFull(address, level)) {
            tile(corner, level);
        } else if (level <= kVdbLeafLevel) {
            leaf(corner, maskOf(address, level));
        } else {
            const uint32_t mask = dag_.words[address];
            uint32_t next = address + 1;
            for (uint32_t c = 0; c < 8; ++c)
                if (mask >> c & 1)
                    walk(dag_.words[next++], level - 1,
                         corner + (glm::uvec3(c & 1, c >> 1 & 1, c >> 2) << (level - 1)), leaf,
                         tile);
        }
    }

private:
    const VdbLeafMask& maskOf(uint32_t address, uint32_t level) {
        const auto [known, isNew] = masks_.try_emplace(address, VdbLeafMask{});
        VdbLeafMask& mask = known->second;
        if (!isNew)
            return mask;
        uint64_t leaves[8] = {};
        const auto read = [&](uint32_t at) {
            return dag_.words[at] | uint64_t(dag_.words[at + 1]) << 32;
        };
        if (level == kLeafLog2) {
            leaves[0] = read(address);
        } else {
            uint32_t next = address + 1;
            for (uint32_t c = 0; c < 8; ++c)
                if (dag_.words[address] >> c & 1)
                    leaves[c] = read(dag_.words[next++]);
        }
        const LeafPlaces& places = leafPlaces();
        for (uint32_t i = 0; i < 512; ++i)
            mask[i >> 6] |= (leaves[places.leaf[i]] >> places.bit[i] & 1) << (i & 63);
        return mask;
    }

    const Dag& dag_;
    std::unordered_map<uint32_t, bool> full_;            // by address, of inner nodes
    std::unordered_map<uint32_t, VdbCellCounts> counts_; // by address, above the leaves
    std::unordered_map<uint32_t, VdbLeafMask> masks_;    // by address, of 8^3 cells
};

} // namespace

uint32_t VdbDagBuilder::addLeaf(const VdbLeafMask& mask) {
    const LeafPlaces& places = leafPlaces();
    uint64_t leaves[8] = {};
    for (uint32_t x = 0; x < 8; ++x)
        for (uint64_t left = mask[x]; left != 0; left &= left - 1) {
            const uint32_t i = x << 6 | uint32_t(std::countr_zero(left));
            leaves[places.leaf[i]] |= uint64_t(1) << places.bit[i];
        }
    uint32_t children[8];
    for (int c = 0; c < 8; ++c)
        children[c] = builder_.addLeaf(leaves[c]);
    return builder_.addInner(kVdbLeafLevel, children);
}

uint32_t VdbDagBuilder::full(uint32_t level) {
    if (full_.empty())
        full_.push_back(builder_.addLeaf(~uint64_t(0)));
    while (full_.size() <= level - kLeafLog2) {
        uint32_t children[8];
        std::fill_n(children, 8, full_.back());
        full_.push_back(builder_.addInner(kLeafLog2 + uint32_t(full_.size()), children));
    }
    return full_[level - kLeafLog2];
}

uint32_t VdbDagBuilder::addNode(uint32_t level, uint32_t childLevel,
                                const std::vector<uint32_t>& children) {
    SDAG_ASSERT(children.size() == size_t(1) << (3 * (level - childLevel)));
    scratchBelow_ = children;
    for (uint32_t l = childLevel + 1; l <= level; ++l) {
        const uint32_t log2 = level - l, side = 1u << log2;
        scratch_.resize(size_t(1) << (3 * log2));
        for (uint32_t x = 0; x < side; ++x)
            for (uint32_t y = 0; y < side; ++y)
                for (uint32_t z = 0; z < side; ++z) {
                    uint32_t eight[8];
                    for (uint32_t c = 0; c < 8; ++c)
                        eight[c] = scratchBelow_[(((2 * x + (c & 1)) << (log2 + 1) |
                                                   (2 * y + (c >> 1 & 1)))
                                                  << (log2 + 1)) |
                                                 (2 * z + (c >> 2))];
                    scratch_[(x << log2 | y) << log2 | z] = builder_.addInner(l, eight);
                }
        scratch_.swap(scratchBelow_);
    }
    return scratchBelow_[0];
}

void VdbDagBuilder::addToRoot(const glm::ivec3& corner, uint32_t address) {
    if (address != kNoNode)
        roots_.push_back({corner, address});
}

glm::ivec3 VdbDagBuilder::rootCorner() const {
    SDAG_ASSERT(!roots_.empty());
    glm::ivec3 corner = roots_[0].corner;
    for (const Root& root : roots_)
        corner = glm::min(corner, root.corner);
    return corner;
}

uint64_t VdbDagBuilder::rootSpan() const {
    const glm::ivec3 first = rootCorner();
    int64_t span = 0;
    for (const Root& root : roots_)
        for (int axis = 0; axis < 3; ++axis)
            span = std::max(span, (int64_t(root.corner[axis]) - first[axis]) >> kVdbUpperLevel);
    return uint64_t(span) + 1;
}

Dag VdbDagBuilder::finish(const glm::ivec3& corner, uint32_t level, const std::string& name) {
    std::vector<std::pair<uint32_t, uint32_t>> cells; // Morton code, address
    for (const Root& root : roots_) {
        const glm::uvec3 at = glm::uvec3(root.corner - corner) >> kVdbUpperLevel;
        SDAG_ASSERT(glm::max(at.x, glm::max(at.y, at.z)) >> (level - kVdbUpperLevel) == 0);
        cells.emplace_back(uint32_t(mortonCode(at.x, at.y, at.z)), root.address);
    }
    std::sort(cells.begin(), cells.end());
    for (size_t i = 1; i < cells.size(); ++i)
        if (cells[i].first == cells[i - 1].first)
            throw Error(ErrorKind::kInput,
                        name + ": two nodes of its root cover the same place; the file is damaged");
    VoxelGrid grid;
    grid.resolutionLog2 = level;
    const uint32_t top = addRange(level, cells.data(), cells.data() + cells.size());
    return builder_.finish(level, top, grid);
}

uint32_t VdbDagBuilder::addRange(uint32_t level, const std::pair<uint32_t, uint32_t>* first,
                                 const std::pair<uint32_t, uint32_t>* last) {
    if (first == last)
        return kNoNode;
    if (level == kVdbUpperLevel)
        return first->second;
    const uint32_t shift = 3 * (level - 1 - kVdbUpperLevel);
    uint32_t children[8];
    for (uint32_t c = 0; c < 8; ++c) {
        const auto* end = std::find_if(first, last, [&](const std::pair<uint32_t, uint32_t>& cell) {
            return (cell.first >> shift & 7) != c;
        });
        children[c] = addRange(level - 1, first, end);
        first = end;
    }
    return builder_.addInner(level, children);
}

VdbCellCounts countVdbCells(const Dag& dag) {
    if (dag.empty())
        return {};
    return CellWalker(dag).count(dag.rootAddress, std::max(dag.grid.resolutionLog2, kLeafLog2));
}

void forEachVdbCell(const Dag& dag,
                    const std::function<void(const glm::uvec3&, const VdbLeafMask&)>& leaf,
                    const std::function<void(const glm::uvec3&, uint32_t level)>& tile) {
    if (!dag.empty())
        CellWalker(dag).walk(dag.rootAddress, std::max(dag.grid.resolutionLog2, kLeafLog2),
                             glm::uvec3(0), leaf, tile);
}

} // namespace shadowdag
