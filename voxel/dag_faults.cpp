// SPDX-License-Identifier: Apache-2.0
// Every fault is a change of the sorted Morton codes of the occupied voxels, from which the DAG is
// built again.
#include "voxel/dag_faults.h"

#if SDAG_HAS_MUTANTS

#include "voxel/dag_builder.h"

#include <algorithm>
#include <bit>
#include <iterator>
#include <utility>
#include <vector>

namespace shadowdag {

namespace {

/// The bits of an axis in a Morton code: x has bit 0 of each three.
constexpr uint64_t kAxisBits = 0x1249249249249249ull;

/// Calls visit(code) for every voxel under a node, ascending.
template <class Visit>
void forVoxels(const Dag& dag, uint32_t address, uint32_t level, uint64_t code,
               const Visit& visit) {
    if (level == kLeafLog2) {
        const uint64_t voxels = dag.words[address] | uint64_t(dag.words[address + 1]) << 32;
        for (uint64_t rest = voxels; rest != 0; rest &= rest - 1)
            visit(code << 6 | uint64_t(std::countr_zero(rest)));
        return;
    }
    uint32_t next = address + 1;
    for (uint64_t child = 0; child < 8; ++child)
        if (dag.words[address] >> child & 1u)
            forVoxels(dag, dag.words[next++], level - 1, code << 3 | child, visit);
}

Dag fromVoxels(const std::vector<uint64_t>& codes, const Dag& like) {
    const uint32_t rootLevel = std::max(like.grid.resolutionLog2, kLeafLog2);
    DagBuilder builder(rootLevel);
    std::vector<std::pair<uint64_t, uint32_t>> nodes, above; // cell and address
    for (size_t i = 0; i < codes.size();) {
        const uint64_t cell = codes[i] >> 6;
        uint64_t voxels = 0;
        for (; i < codes.size() && codes[i] >> 6 == cell; ++i)
            voxels |= uint64_t(1) << (codes[i] & 63);
        nodes.emplace_back(cell, builder.addLeaf(voxels));
    }
    for (uint32_t level = kLeafLog2 + 1; level <= rootLevel; ++level) {
        above.clear();
        for (size_t i = 0; i < nodes.size();) {
            const uint64_t cell = nodes[i].first >> 3;
            uint32_t children[8];
            std::fill(children, children + 8, kNoNode);
            for (; i < nodes.size() && nodes[i].first >> 3 == cell; ++i)
                children[nodes[i].first & 7] = nodes[i].second;
            above.emplace_back(cell, builder.addInner(level, children));
        }
        nodes.swap(above);
    }
    return builder.finish(rootLevel, nodes.empty() ? kNoNode : nodes[0].second, like.grid);
}

/// Sets `neighbour` to the next code along an axis, towards +1 or -1; false at the grid's side.
bool step(uint64_t code, int axis, bool isUp, uint64_t gridMask, uint64_t& neighbour) {
    const uint64_t mask = (kAxisBits << axis) & gridMask, along = code & mask;
    if (along == (isUp ? mask : 0))
        return false;
    const uint64_t moved = isUp ? (along | ~mask) + 1 : along - 1;
    neighbour = (code & ~mask) | (moved & mask);
    return true;
}

void sortUnique(std::vector<uint64_t>& codes) {
    std::sort(codes.begin(), codes.end());
    codes.erase(std::unique(codes.begin(), codes.end()), codes.end());
}

/// Adds the neighbours of all voxels axis by axis, so that corners are filled as well.
void dilate(std::vector<uint64_t>& codes, uint64_t gridMask) {
    for (int axis = 0; axis < 3; ++axis) {
        const size_t count = codes.size();
        for (size_t i = 0; i < count; ++i)
            for (const bool isUp : {false, true})
                if (uint64_t neighbour; step(codes[i], axis, isUp, gridMask, neighbour))
                    codes.push_back(neighbour);
        sortUnique(codes);
    }
}

/// Removes the voxels that lack a neighbour along an axis, all of them.
void erode(std::vector<uint64_t>& codes, uint64_t gridMask) {
    const std::vector<uint64_t> before = codes;
    std::erase_if(codes, [&](uint64_t code) {
        for (int axis = 0; axis < 3; ++axis)
            for (const bool isUp : {false, true})
                if (uint64_t neighbour;
                    step(code, axis, isUp, gridMask, neighbour) &&
                    !std::binary_search(before.begin(), before.end(), neighbour))
                    return true;
        return false;
    });
}

void shift(std::vector<uint64_t>& codes, uint64_t gridMask) {
    std::vector<uint64_t> moved;
    for (const uint64_t code : codes)
        if (uint64_t neighbour; step(code, 0, true, gridMask, neighbour))
            moved.push_back(neighbour);
    codes.swap(moved);
    sortUnique(codes);
}

/// Exchanges the octants of the first and of the last voxel, or, if there is one octant only, moves
/// it to the opposite one.
void swapOctants(std::vector<uint64_t>& codes, uint32_t rootLevel) {
    const uint32_t shift = 3 * (rootLevel - 1);
    const uint64_t a = codes.front() >> shift,
                   b = codes.back() >> shift != a ? codes.back() >> shift : 7 - a;
    for (uint64_t& code : codes) {
        const uint64_t octant = code >> shift;
        if (octant == a || octant == b)
            code ^= (a ^ b) << shift;
    }
    sortUnique(codes);
}

/// Empties the cell, an eighth of the edge wide, of the middle voxel in order of codes.
void loseSubtree(std::vector<uint64_t>& codes, uint32_t rootLevel) {
    const uint32_t shift = 3 * (rootLevel - 3);
    const uint64_t cell = codes[codes.size() / 2] >> shift;
    std::erase_if(codes, [&](uint64_t code) { return code >> shift == cell; });
}

/// Flips one bit, chosen by a hash, in a sixteenth of the leaves.
void flipBits(std::vector<uint64_t>& codes) {
    std::vector<uint64_t> flipped;
    for (const uint64_t code : codes) {
        const uint64_t hash = (code >> 6) * 0x9e3779b97f4a7c15ull;
        if (hash >> 60 == 0)
            flipped.push_back((code & ~uint64_t(63)) | (hash >> 50 & 63));
    }
    sortUnique(flipped);
    std::vector<uint64_t> result;
    std::set_symmetric_difference(codes.begin(), codes.end(), flipped.begin(), flipped.end(),
                                  std::back_inserter(result));
    codes.swap(result);
}

} // namespace

Dag withVoxelFault(Dag dag) {
    const uint32_t rootLevel = std::max(dag.grid.resolutionLog2, kLeafLog2);
    if (dag.empty() || rootLevel <= kLeafLog2 + 1)
        return dag;
    const uint64_t gridMask = (uint64_t(1) << (3 * rootLevel)) - 1;
    std::vector<uint64_t> codes;
    const auto rebuilt = [&](const auto& change) {
        forVoxels(dag, dag.rootAddress, rootLevel, 0, [&](uint64_t c) { codes.push_back(c); });
        change();
        return fromVoxels(codes, dag);
    };
    if (isMutant(Mutant::kDagDilated))
        return rebuilt([&] { dilate(codes, gridMask); });
    if (isMutant(Mutant::kDagEroded))
        return rebuilt([&] { erode(codes, gridMask); });
    if (isMutant(Mutant::kDagShifted))
        return rebuilt([&] { shift(codes, gridMask); });
    if (isMutant(Mutant::kDagSubtreesSwapped))
        return rebuilt([&] { swapOctants(codes, rootLevel); });
    if (isMutant(Mutant::kDagSubtreeLost))
        return rebuilt([&] { loseSubtree(codes, rootLevel); });
    if (isMutant(Mutant::kDagBitsFlipped))
        return rebuilt([&] { flipBits(codes); });
    return dag;
}

} // namespace shadowdag

#endif
