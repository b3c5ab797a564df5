// SPDX-License-Identifier: Apache-2.0
#include "voxel/dag.h"

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

} // namespace

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
