// SPDX-License-Identifier: Apache-2.0
#include "voxel/dag.h"

#include "cuda/mutant.h"

#include <algorithm>
#include <bit>

namespace shadowdag {
namespace {

/// Marks which of the 255 non-empty 2^3 masks occur.
struct ByteSet {
    bool seen[256] = {};
    uint64_t count = 0;
    void add(uint32_t byte) {
        if (byte != 0 && !seen[byte]) {
            seen[byte] = true;
            ++count;
        }
    }
};

/// Writes the wide nodes of canonical ones, each once.
class WideBuilder {
public:
    WideBuilder(const Dag& dag, WideDag& wide)
        : dag_(dag), wide_(wide), wideOf_(dag.words.size(), kNoNode) {
        wide.words.reserve(dag.words.size()); // mostly enough: a level of two holds no pointers
    }

    /// Returns the wide address of the node of even level.
    uint32_t add(uint32_t address, uint32_t level) {
        if (wideOf_[address] != kNoNode)
            return wideOf_[address];
        if (level == kLeafLog2)
            return wideOf_[address] =
                       write(mutated(Mutant::kWideBitLost, dag_.words[address],
                                     dag_.words[address] & (dag_.words[address] - 1)),
                             dag_.words[address + 1], nullptr, 0);
        const uint32_t mask = dag_.words[address] & 0xffu;
        uint64_t cells = 0;
        uint32_t below[64], count = 0, next = address + 1;
        for (uint32_t c = 0; c < 8; ++c) {
            if ((mask >> c & 1) == 0)
                continue;
            const uint32_t child = dag_.words[next++];
            const uint32_t childMask = dag_.words[child] & 0xffu;
            cells |= uint64_t(childMask) << (8 * c);
            const uint32_t grandchildren = uint32_t(std::popcount(childMask));
            for (uint32_t g = 0; g < grandchildren; ++g)
                below[count++] = add(dag_.words[child + 1 + g], level - 2);
        }
        return wideOf_[address] = write(uint32_t(cells), uint32_t(cells >> 32), below, count);
    }

    uint32_t write(uint32_t low, uint32_t high, const uint32_t* below, uint32_t count) {
        const size_t address = wide_.words.size();
        wide_.words.push_back(low);
        wide_.words.push_back(high);
        wide_.words.insert(wide_.words.end(), below, below + count);
        isTooLarge_ = isTooLarge_ || wide_.words.size() >= kNoNode;
        return uint32_t(address);
    }
    bool isTooLarge() const { return isTooLarge_; }

private:
    const Dag& dag_;
    WideDag& wide_;
    std::vector<uint32_t> wideOf_; // by canonical address
    bool isTooLarge_ = false;
};

} // namespace

WideDag buildWideDag(const Dag& dag) {
    WideDag wide;
    const uint32_t rootLevel = dag.grid.resolutionLog2;
    if (dag.empty() || rootLevel <= kLeafLog2)
        return wide;
    WideBuilder builder(dag, wide);
    wide.rootLevel = (rootLevel + 1) & ~1u;
    if (rootLevel % 2 == 0) {
        wide.rootAddress = builder.add(dag.rootAddress, rootLevel);
    } else {
        // Child 0 of the node above is the root: its children are that node's first grandchildren.
        uint32_t below[8];
        const uint32_t mask = dag.words[dag.rootAddress] & 0xffu,
                       count = uint32_t(std::popcount(mask));
        for (uint32_t i = 0; i < count; ++i)
            below[i] = builder.add(dag.words[dag.rootAddress + 1 + i], rootLevel - 1);
        wide.rootAddress = builder.write(mask, 0, below, count);
    }
    return builder.isTooLarge() ? WideDag{} : wide;
}

DagStats computeDagStats(const Dag& dag) {
    DagStats stats;
    stats.tracedBytes = dag.words.size() * sizeof(uint32_t);
    const uint32_t rootLevel = std::max(dag.grid.resolutionLog2, kLeafLog2);
    // Index 0 is the root; the 2^3 cells are level 1, so a root of level L gives L entries.
    stats.nodeCounts.assign(rootLevel, 0);
    stats.svoNodeCounts.assign(rootLevel, 0);
    if (dag.empty())
        return stats;
    // Top-down: how often each node of a level occurs in the unmerged tree. Addresses grow from
    // level to level.
    std::vector<uint32_t> nodes{dag.rootAddress}, below;
    std::vector<uint64_t> times{1}, timesBelow;
    for (uint32_t level = rootLevel; level > kLeafLog2; --level) {
        const size_t index = rootLevel - level;
        std::vector<std::pair<uint32_t, uint64_t>> uses;
        for (size_t i = 0; i < nodes.size(); ++i) {
            stats.svoNodeCounts[index] += times[i];
            const uint32_t children = uint32_t(std::popcount(dag.words[nodes[i]] & 0xffu));
            for (uint32_t c = 1; c <= children; ++c)
                uses.emplace_back(dag.words[nodes[i] + c], times[i]);
        }
        stats.nodeCounts[index] = nodes.size();
        std::sort(uses.begin(), uses.end());
        below.clear();
        timesBelow.clear();
        for (const auto& [address, count] : uses) {
            if (below.empty() || below.back() != address) {
                below.push_back(address);
                timesBelow.push_back(0);
            }
            timesBelow.back() += count;
        }
        nodes.swap(below);
        times.swap(timesBelow);
    }
    ByteSet bytes;
    for (size_t i = 0; i < nodes.size(); ++i) {
        const uint64_t voxels = dag.words[nodes[i]] | uint64_t(dag.words[nodes[i] + 1]) << 32;
        stats.svoNodeCounts[rootLevel - kLeafLog2] += times[i];
        stats.voxelCount += times[i] * uint64_t(std::popcount(voxels));
        for (int o = 0; o < 8; ++o) {
            const uint32_t byte = uint32_t(voxels >> (8 * o)) & 0xffu;
            bytes.add(byte);
            stats.svoNodeCounts[rootLevel - 1] += byte != 0 ? times[i] : 0;
        }
    }
    stats.leafCount = nodes.size();
    stats.nodeCounts[rootLevel - kLeafLog2] = nodes.size();
    stats.nodeCounts[rootLevel - 1] = bytes.count;
    return stats;
}

} // namespace shadowdag
