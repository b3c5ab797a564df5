// SPDX-License-Identifier: Apache-2.0
// Merges equal subtrees while a DAG is built bottom-up: one table of unique nodes per level, which
// is then put into the canonical order.
#pragma once

#include "voxel/dag.h"
#include "voxel/node_stream.h"

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

namespace shadowdag {

/// The unique nodes of one level. A node is one or more words whose count its first word
/// determines: equal first words mean equal counts (dag.h's layouts are). Equality is that of the
/// words; hashes only find candidates.
class NodeTable {
public:
    using Hash = uint32_t (*)(const uint32_t* node, uint32_t wordCount);

    /// The default hash.
    static uint32_t hashWords(const uint32_t* node, uint32_t wordCount);
    /// @param maxWordCount a test may set a lower limit than addresses have
    explicit NodeTable(Hash hash = hashWords, uint64_t maxWordCount = kNoNode - 1)
        : maxWordCount_(maxWordCount), hash_(hash) {}

    /// Returns the node's address (index of its first word in words()) and adds the node if it is
    /// new. Throws Error kResource over 2^32 - 2 words (or maxWordCount).
    uint32_t findOrAdd(const uint32_t* node, uint32_t wordCount);

    const std::vector<uint32_t>& words() const { return words_; }
    size_t nodeCount() const { return nodeCount_; }
    /// Reserves address space for so many words; memory is committed as it is used.
    void reserveWords(size_t count) { words_.reserve(count); }
    /// Returns the bytes held, and the bytes that the next growth may take temporarily.
    uint64_t byteCount() const { return 4 * words_.capacity() + 8 * slots_.size(); }
    uint64_t growthByteCount() const {
        return 8 * words_.capacity() + 16 * std::max<uint64_t>(slots_.size(), 64);
    }
    /// Whether the next node may make the index grow, and the bytes that this takes.
    bool isIndexFull() const { return nodeCount_ * 2 >= slots_.size(); }
    uint64_t indexGrowthByteCount() const { return 16 * slots_.size(); }
    /// Frees the index. Nodes can still be read, but none can be added.
    void dropIndex() { std::vector<uint64_t>().swap(slots_); }
    /// Removes all nodes and keeps the memory.
    void clear();

private:
    void grow();

    // slots_: 2^n * (hash << 32 | address), probed linearly; kFree is free. At most half of them
    // are taken.
    static constexpr uint64_t kFree = ~uint64_t(0);
    std::vector<uint32_t> words_;
    std::vector<uint64_t> slots_;
    size_t nodeCount_ = 0;
    uint64_t maxWordCount_;
    Hash hash_; // a parameter so that a test can make all nodes collide
};

/// Builds a DAG bottom-up. Level L holds cells of side 2^L voxels. Node addresses are local to
/// builder and level.
class DagBuilder {
public:
    /// @param topLevel level of the root, kLeafLog2 or more
    /// @param maxWordCount of each level and of the whole; a test may set a lower limit than
    /// addresses have
    explicit DagBuilder(uint32_t topLevel, uint64_t maxWordCount = kNoNode - 1)
        : maxWordCount_(maxWordCount),
          tables_(topLevel - kLeafLog2 + 1, NodeTable(NodeTable::hashWords, maxWordCount)) {}

    /// Returns the address of the leaf with these voxels (bits as dag.h says), kNoNode when none is
    /// set.
    uint32_t addLeaf(uint64_t voxels);
    /// Returns the address of the node of level `level` with these eight children (addresses of
    /// level - 1, kNoNode where there is none), kNoNode when there are none at all.
    uint32_t addInner(uint32_t level, const uint32_t children[8]);
    /// Returns the address of the node of level `level` as its table holds it: children are
    /// addresses of level - 1. At least one child or voxel.
    uint32_t addNode(uint32_t level, const NodeWords& node) {
        return table(level).findOrAdd(node.words, node.count);
    }
    /// Adds the subtree of another builder whose root is at `address` of its level `level`; every
    /// node of `other` must belong to it. Returns its address here.
    uint32_t addSubtree(const DagBuilder& other, uint32_t level, uint32_t address);
    /// Removes all nodes and keeps the memory.
    void clear();
    /// Returns the bytes held and those that the growth of one level may take temporarily.
    uint64_t byteCount() const;

    /// Returns the DAG under the node at `address` of level `level`, in canonical order (dag.h):
    /// the result depends on its voxels alone, not on the order of additions. Throws Error
    /// kResource over 2^32 - 2 words (or maxWordCount).
    Dag finish(uint32_t level, uint32_t address, const VoxelGrid& grid) const;

    /// Returns the nodes of level `level`, one after another; a node's address is where it begins.
    const std::vector<uint32_t>& words(uint32_t level) const { return table(level).words(); }
    /// Returns how many nodes and children level `level` has.
    LevelCounts counts(uint32_t level) const;
    /// Hands the nodes under some roots of level `level` to `sink`, in canonical order and in the
    /// order of the roots. Roots are addresses; kNoNode is skipped, and an address may occur
    /// several times. Returns the numbers of the roots, kNoNode for kNoNode.
    std::vector<uint32_t> visit(uint32_t level, const std::vector<uint32_t>& roots,
                                NodeSink& sink) const;

private:
    NodeTable& table(uint32_t level) { return tables_[level - kLeafLog2]; }
    const NodeTable& table(uint32_t level) const { return tables_[level - kLeafLog2]; }

    uint64_t maxWordCount_;
    std::vector<NodeTable> tables_;
};

/// Throws the Error kResource for a DAG with more words than 32-bit addresses reach.
[[noreturn]] void throwTooManyWords();
/// Throws Error kResource: "out of memory while DOING at N^3".
[[noreturn]] void throwOutOfMemory(const std::string& doing, const VoxelGrid& grid);

} // namespace shadowdag
