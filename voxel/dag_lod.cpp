// SPDX-License-Identifier: Apache-2.0
// Projected coverages of a DAG's cells, from the leaves up.
#include "voxel/dag_lod.h"

#include "cuda/parallel_for.h"

#include <algorithm>
#include <bit>
#include <vector>

namespace shadowdag {
namespace {

/// The three projections of a cell. Level 2: 4 x 4 columns as bits (part[0]). Level 3: 8 x 8
/// columns, as four of those by quadrant (part[0..3]). Above: 4 x 4 parts, by quadrant, then by
/// quadrant of it, their covered share in units of 2^-12.
struct Projections {
    uint16_t part[3][16] = {};
};

constexpr uint32_t kUnit = 1u << 12;

/// Returns the quadrant, seen along the axis, that child c lies in.
constexpr uint32_t quadrantOf(uint32_t c, uint32_t axis) {
    return axis == 0 ? c >> 1 : axis == 1 ? (c & 1) | (c >> 1 & 2) : c & 3;
}

Projections projectLeaf(uint64_t voxels) {
    Projections p;
    for (uint32_t axis = 0; axis < 3; ++axis) {
        const uint64_t columns = detail::coveredColumns(voxels, axis);
        uint64_t places = detail::leafColumns(axis);
        for (uint32_t i = 0; i < 16; ++i, places &= places - 1)
            p.part[axis][0] |= uint16_t((columns >> std::countr_zero(places) & 1) << i);
    }
    return p;
}

/// Adds child c, of level `childLevel`, to the projections of its parent.
void addChild(const Projections& child, uint32_t c, uint32_t childLevel, Projections& p) {
    for (uint32_t axis = 0; axis < 3; ++axis) {
        const uint32_t q = quadrantOf(c, axis);
        if (childLevel == kLeafLog2) {
            p.part[axis][q] |= child.part[axis][0];
        } else if (childLevel == kLeafLog2 + 1) {
            for (uint32_t i = 0; i < 4; ++i) // still bits: both children before they are counted
                p.part[axis][4 * q + i] |= child.part[axis][i];
        } else {
            for (uint32_t i = 0; i < 4; ++i) {
                uint32_t sum = 0;
                for (uint32_t j = 0; j < 4; ++j)
                    sum += child.part[axis][4 * i + j];
                p.part[axis][4 * q + i] = std::max(p.part[axis][4 * q + i], uint16_t(sum / 4));
            }
        }
    }
}

/// Ends the projections of a node whose children are all added; returns its coverage.
uint32_t finish(uint32_t level, Projections& p) {
    uint32_t most = 0;
    for (uint32_t axis = 0; axis < 3; ++axis) {
        uint32_t sum = 0;
        for (uint16_t& part : p.part[axis]) {
            if (level == kLeafLog2 + 2)
                part = uint16_t(uint32_t(std::popcount(part)) * (kUnit / 16));
            sum += level == kLeafLog2 + 1 ? uint32_t(std::popcount(part)) : part;
        }
        most = std::max(most, sum);
    }
    return detail::coverageByte(most, level == kLeafLog2 + 1 ? 64 : 16 * kUnit);
}

/// Writes the coverages beside the wide nodes, each once.
struct WideCoverage {
    const Dag& covered;
    const WideDag& wide;
    std::vector<uint32_t> words;

    uint32_t ofCell(uint32_t address, uint32_t level) const {
        return detail::cellCoverage(covered.words.data(), address, level);
    }
    /// @param address,wideAddress the same node of a level above the leaves', in both forms
    void add(uint32_t address, uint32_t wideAddress, uint32_t level) {
        if (words[wideAddress + 2] != 0) // coverage is at least 1, so this node was visited before
            return;
        words[wideAddress + 2] = ofCell(address, level);
        const uint32_t mask = covered.words[address] & 0xffu;
        uint32_t next = address + 1, nextBelow = wideAddress + 2;
        for (uint32_t c = 0; c < 8; ++c)
            if (mask >> c & 1) {
                const uint32_t child = covered.words[next++];
                addChild(child, c, wideAddress, level, nextBelow);
            }
    }
    /// Adds child c; nextBelow: its first word among the wide node's addresses, its end after.
    void addChild(uint32_t child, uint32_t c, uint32_t wideAddress, uint32_t level,
                  uint32_t& nextBelow) {
        words[wideAddress + c / 4] |= ofCell(child, level - 1) << (8 * (c % 4));
        const uint32_t count = uint32_t(std::popcount(covered.words[child] & 0xffu));
        for (uint32_t g = 0; g < count; ++g) {
            const uint32_t below = wide.words[nextBelow++];
            if (level - 2 > kLeafLog2)
                add(covered.words[child + 1 + g], below, level - 2);
        }
    }
};

} // namespace

Dag withCoverage(const Dag& dag) {
    Dag covered = dag;
    const uint32_t rootLevel = std::max(dag.grid.resolutionLog2, kLeafLog2);
    if (dag.empty() || rootLevel == kLeafLog2)
        return covered;
    // Nodes by level, each once, and the position of each in its level.
    std::vector<std::vector<uint32_t>> nodes(rootLevel + 1);
    std::vector<uint32_t> place(dag.words.size(), kNoNode);
    nodes[rootLevel] = {dag.rootAddress};
    for (uint32_t level = rootLevel; level > kLeafLog2; --level)
        for (const uint32_t address : nodes[level]) {
            const uint32_t count = uint32_t(std::popcount(dag.words[address] & 0xffu));
            for (uint32_t i = 1; i <= count; ++i) {
                const uint32_t child = dag.words[address + i];
                if (place[child] != kNoNode)
                    continue;
                place[child] = uint32_t(nodes[level - 1].size());
                nodes[level - 1].push_back(child);
            }
        }
    std::vector<Projections> below(nodes[kLeafLog2].size()), here;
    cpuParallelRanges(below.size(), 1024, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; ++i)
            below[i] = projectLeaf(detail::leafAt(dag.words.data(), nodes[kLeafLog2][i]));
    });
    for (uint32_t level = kLeafLog2 + 1; level <= rootLevel; ++level) {
        here.assign(nodes[level].size(), {});
        cpuParallelRanges(here.size(), 256, [&](size_t begin, size_t end) {
            for (size_t i = begin; i < end; ++i) {
                const uint32_t address = nodes[level][i];
                const uint32_t mask = dag.words[address] & 0xffu;
                uint32_t next = address + 1;
                for (uint32_t c = 0; c < 8; ++c)
                    if (mask >> c & 1)
                        addChild(below[place[dag.words[next++]]], c, level - 1, here[i]);
                covered.words[address] = mask | finish(level, here[i]) << 8;
            }
        });
        below.swap(here);
    }
    return covered;
}

std::vector<uint32_t> wideCoverage(const Dag& covered, const WideDag& wide) {
    WideCoverage coverage{covered, wide, std::vector<uint32_t>(wide.words.size(), 0)};
    if (wide.words.empty())
        return {};
    const uint32_t rootLevel = covered.grid.resolutionLog2;
    if (rootLevel == wide.rootLevel) {
        coverage.add(covered.rootAddress, wide.rootAddress, rootLevel);
    } else { // the root is child 0 of the node above
        uint32_t nextBelow = wide.rootAddress + 2;
        coverage.addChild(covered.rootAddress, 0, wide.rootAddress, wide.rootLevel, nextBelow);
    }
    return coverage.words;
}

} // namespace shadowdag
