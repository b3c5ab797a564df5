// SPDX-License-Identifier: Apache-2.0
#include "voxel/dag.h"

#include "cuda/mutant.h"
#include "cuda/parallel_for.h"

#include <algorithm>
#include <bit>
#include <utility>

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

/// Writes the wide nodes of canonical ones level by level, leaves first, each level in the order of
/// canonical addresses, so that memory is read and written almost in order; many nodes at once
/// (LAYOUT.md compares it with a walk from the root).
class WideBuilder {
public:
    explicit WideBuilder(const Dag& dag)
        : words_(dag.words.data()), wordCount_(dag.words.size()), root_(dag.rootAddress),
          rootLevel_(dag.grid.resolutionLog2), begins_(rootLevel_ + 1, 0) {
        // The first child of a level's first node is the first node of the level below (DagView).
        begins_[rootLevel_] = root_;
        for (uint32_t level = rootLevel_; level > kLeafLog2; --level) {
            begins_[level - 1] = words_[begins_[level] + 1];
            SDAG_ASSERT(begins_[level] < begins_[level - 1] && begins_[level - 1] < wordCount_);
        }
    }

    WideDag build() {
        const uint64_t leafWords = wordCount_ - begins_[kLeafLog2];
        uint64_t cursor = leafWords;
        for (uint32_t level = kFirstLevel; level <= rootLevel_; level += 2)
            cursor = split(level, cursor);
        const bool hasOddRoot = rootLevel_ % 2 != 0;
        const uint64_t size = cursor + (hasOddRoot ? 2 + bitCount32(words_[root_] & 0xffu) : 0);
        if (size >= kNoNode)
            return {};
        wide_.rootLevel = (rootLevel_ + 1) & ~1u;
        wide_.words.resize(size);
        cpuParallelRanges(leafWords, kNodesPerChunk * 8,
                          [&](size_t begin, size_t end) { addLeaves(begin, end); });
        for (uint32_t level = kFirstLevel; level <= rootLevel_; level += 2) {
            here_.clear(); // so that no old element is copied
            here_.resize(begins_[level - 1] - begins_[level]);
            const std::vector<Chunk>& chunks = chunks_[level];
            cpuParallelRanges(chunks.size() - 1, 1, [&](size_t begin, size_t end) {
                for (size_t c = begin; c < end; ++c)
                    addNodes(level, chunks[c], chunks[c + 1].begin);
            });
            below_.swap(here_);
        }
        if (hasOddRoot)
            addOddRoot(cursor);
        wide_.rootAddress = uint32_t(hasOddRoot ? cursor : below_[0]);
        return std::move(wide_);
    }

private:
    static constexpr uint32_t kFirstLevel = kLeafLog2 + 2;
    static constexpr size_t kNodesPerChunk = 1024;

    /// Nodes from one canonical address on, and where their wide ones begin.
    struct Chunk {
        uint32_t begin;
        uint64_t wide;
    };

    /// Parts a level into chunks, whose wide nodes begin at `cursor`; returns where they end.
    uint64_t split(uint32_t level, uint64_t cursor) {
        std::vector<Chunk>& chunks = chunks_[level];
        size_t count = 0;
        for (uint32_t address = begins_[level]; address < begins_[level - 1];
             address += 1 + bitCount32(words_[address] & 0xffu))
            if (count++ % kNodesPerChunk == 0)
                chunks.push_back({address, 0});
        chunks.push_back({begins_[level - 1], 0});
        cpuParallelRanges(chunks.size() - 1, 1, [&](size_t begin, size_t end) {
            for (size_t c = begin; c < end; ++c)
                chunks[c].wide = wideWords(chunks[c].begin, chunks[c + 1].begin);
        });
        for (Chunk& chunk : chunks)
            cursor += std::exchange(chunk.wide, cursor);
        return cursor;
    }

    /// Returns how many words the wide nodes of the canonical ones in [begin, end) take.
    uint64_t wideWords(uint32_t begin, uint32_t end) const {
        uint64_t count = 0;
        for (uint32_t address = begin; address < end;) {
            const uint32_t children = bitCount32(words_[address++] & 0xffu);
            count += 2;
            for (uint32_t i = 0; i < children; ++i)
                count += bitCount32(words_[words_[address++]] & 0xffu);
        }
        return count;
    }

    /// Copies words of leaves, which are the same in both forms.
    void addLeaves(size_t begin, size_t end) {
        const uint32_t* leaves = words_ + begins_[kLeafLog2];
        std::copy(leaves + begin, leaves + end, wide_.words.data() + begin);
        if constexpr (kHasMutants)
            for (size_t i = begin + begin % 2; i < end; i += 2)
                wide_.words[i] =
                    mutated(Mutant::kWideBitLost, leaves[i], leaves[i] & (leaves[i] - 1));
    }

    void addNodes(uint32_t level, const Chunk& chunk, uint32_t end) {
        const uint32_t levelBegin = begins_[level], lower = begins_[level - 2];
        const bool isAboveLeaves = level == kFirstLevel;
        uint32_t* const out = wide_.words.data();
        uint32_t* next = out + chunk.wide;
        for (uint32_t address = chunk.begin; address < end;) {
            uint32_t* const node = next;
            here_[address - levelBegin] = uint32_t(node - out);
            next += 2;
            uint64_t cells = 0;
            for (uint32_t mask = words_[address++] & 0xffu; mask != 0; mask &= mask - 1) {
                const uint32_t child = words_[address++], childMask = words_[child] & 0xffu;
                cells |= uint64_t(childMask) << (8 * std::countr_zero(mask));
                for (uint32_t i = 1, n = bitCount32(childMask); i <= n; ++i) {
                    const uint32_t offset = words_[child + i] - lower;
                    *next++ = isAboveLeaves ? offset : below_[offset];
                }
            }
            node[0] = uint32_t(cells);
            node[1] = uint32_t(cells >> 32);
        }
    }

    /// Adds a node above a root of odd level, whose child 0 is the root: its grandchildren are the
    /// root's children.
    void addOddRoot(uint64_t at) {
        uint32_t* const node = wide_.words.data() + at;
        const uint32_t mask = words_[root_] & 0xffu, lower = begins_[rootLevel_ - 1];
        node[0] = mask;
        node[1] = 0;
        for (uint32_t i = 1; i <= bitCount32(mask); ++i) {
            const uint32_t offset = words_[root_ + i] - lower;
            node[1 + i] = rootLevel_ - 1 == kLeafLog2 ? offset : below_[offset];
        }
    }

    const uint32_t* words_;
    const uint64_t wordCount_;
    const uint32_t root_, rootLevel_;
    std::vector<uint32_t> begins_; // canonical address of each level's first node, by level
    std::vector<Chunk> chunks_[kMaxResolutionLog2 + 1]; // by level, and its end
    WideDag wide_;
    /// Wide addresses of the level that was added last, and of the one that is being added, by the
    /// offset of the canonical address in its level. A leaf's is its offset.
    UninitializedVector<uint32_t> below_, here_;
};

} // namespace

WideDag buildWideDag(const Dag& dag) {
    if (dag.empty() || dag.grid.resolutionLog2 <= kLeafLog2)
        return {};
    return WideBuilder(dag).build();
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
