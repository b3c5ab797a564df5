// SPDX-License-Identifier: Apache-2.0
// Leaves to a DAG as passes: the unique nodes level by level, then the canonical order of dag.h.
// Nodes are compared word by word after sorting, never by a hash, so that they are the same in any
// run on any processor.
#pragma once

#include "cuda/atomics.h"
#include "cuda/pass.h"
#include "cuda/runs.h"
#include "voxel/bits.h"
#include "voxel/dag.h"

namespace shadowdag {

/// The words of a node of an inner level here: the numbers of its eight children among the unique
/// nodes of the level below, kNoNode for a missing child.
constexpr uint32_t kChildCount = 8;
constexpr uint32_t kNodeKeyCount = kChildCount / 2; ///< 64-bit keys a node is sorted by

/// order[i] = i.
struct CountUp {
    View<uint32_t> order;

    size_t itemCount() const { return order.count; }
    size_t grain() const { return 4096; }
    SDAG_HD void operator()(size_t i) const { order[i] = uint32_t(i); }
};

/// Copies the first word of each run of sorted words.
struct ListRunValues {
    View<const uint64_t> words; ///< sorted
    View<const uint32_t> runStart;
    View<uint64_t> values; ///< a run each

    size_t itemCount() const { return values.count; }
    size_t grain() const { return 4096; }
    SDAG_HD void operator()(size_t run) const { values[run] = words[runStart[run]]; }
};

/// Writes for every cell its unique node: the run that contains it after sorting.
struct NumberByRun {
    View<const uint32_t> order; ///< sorted place to cell
    View<const uint32_t> next;  ///< Runs::next
    View<uint32_t> nodeOfCell;

    size_t itemCount() const { return order.count; }
    size_t grain() const { return 4096; }
    SDAG_HD void operator()(size_t i) const { nodeOfCell[order[i]] = runOf(next, i); }
};

/// Makes the cells of a level from those of the level below, whose Morton keys ascend: a run of
/// keys that share all but the low 3 bits is a cell. children: kChildCount a cell.
struct GatherChildren {
    View<const uint64_t> keysBelow;
    View<const uint32_t> nodesBelow;
    View<const uint32_t> runStart;
    View<uint64_t> keys;
    View<uint32_t> children;

    size_t itemCount() const { return keys.count; }
    size_t grain() const { return 1024; }
    SDAG_HD void operator()(size_t cell) const {
        uint32_t* const of = children.data + cell * kChildCount;
        for (uint32_t c = 0; c < kChildCount; ++c)
            of[c] = kNoNode;
        for (uint32_t i = runStart[cell]; i < runStart[cell + 1]; ++i)
            of[keysBelow[i] & 7u] = nodesBelow[i];
        keys[cell] = keysBelow[runStart[cell]] >> 3;
    }
};

/// Writes key k (0..kNodeKeyCount - 1) of the nodes in their present order. Sorting by keys 0, 1,
/// ... in turn, stably, sorts the nodes.
struct PackNodeKeys {
    View<const uint32_t> children;
    View<const uint32_t> order;
    uint32_t key;
    View<uint64_t> keys;

    size_t itemCount() const { return keys.count; }
    size_t grain() const { return 4096; }
    SDAG_HD void operator()(size_t i) const {
        const uint32_t* const of = children.data + size_t(order[i]) * kChildCount + 2 * key;
        keys[i] = of[0] | uint64_t(of[1]) << 32;
    }
};

/// Marks the nodes that differ from the one before in sorted order. marks: count + 1.
struct MarkDistinctNodes {
    View<const uint32_t> children;
    View<const uint32_t> order;
    View<uint32_t> marks;

    size_t itemCount() const { return order.count; }
    size_t grain() const { return 4096; }
    SDAG_HD void operator()(size_t i) const {
        bool differs = i == 0;
        for (uint32_t c = 0; c < kChildCount && !differs; ++c)
            differs = children[size_t(order[i]) * kChildCount + c] !=
                      children[size_t(order[i - 1]) * kChildCount + c];
        marks[i] = differs;
    }
};

/// Copies the children of the first node of each run.
struct ListDistinctNodes {
    View<const uint32_t> children;
    View<const uint32_t> order;
    View<const uint32_t> runStart;
    View<uint32_t> distinct; ///< kChildCount a run

    size_t itemCount() const { return distinct.count / kChildCount; }
    size_t grain() const { return 1024; }
    SDAG_HD void operator()(size_t run) const {
        const size_t from = size_t(order[runStart[run]]) * kChildCount;
        for (uint32_t c = 0; c < kChildCount; ++c)
            distinct[run * kChildCount + c] = children[from + c];
    }
};

/// Counts the children of the nodes of a level in canonical order. first: count + 1.
struct CountEdges {
    View<const uint32_t> children;
    View<const uint32_t> order;
    View<uint32_t> first;

    size_t itemCount() const { return order.count; }
    size_t grain() const { return 4096; }
    SDAG_HD void operator()(size_t i) const {
        uint32_t count = 0;
        for (uint32_t c = 0; c < kChildCount; ++c)
            count += children[size_t(order[i]) * kChildCount + c] != kNoNode;
        first[i] = count;
    }
};

/// Finds for every node of the level below the first edge that leads to it (~0 before).
struct VisitEdges {
    View<const uint32_t> children;
    View<const uint32_t> order;
    View<const uint32_t> first; ///< the exclusive scan of CountEdges
    View<uint32_t> firstEdge;

    size_t itemCount() const { return order.count; }
    size_t grain() const { return 4096; }
    SDAG_HD void operator()(size_t i) const {
        uint32_t edge = first[i];
        for (uint32_t c = 0; c < kChildCount; ++c) {
            const uint32_t child = children[size_t(order[i]) * kChildCount + c];
            if (child != kNoNode)
                atomicMinRelaxed(&firstEdge[child], edge++);
        }
    }
};

/// rank[order[i]] = i.
struct RankNodes {
    View<const uint32_t> order;
    View<uint32_t> rank;

    size_t itemCount() const { return order.count; }
    size_t grain() const { return 4096; }
    SDAG_HD void operator()(size_t i) const { rank[order[i]] = uint32_t(i); }
};

/// Addresses of the words of a level: node i of an inner level takes 1 word and one per edge, a
/// leaf two.
struct LevelWords {
    uint32_t base;              ///< address of the level's first node
    View<const uint32_t> first; ///< edges before each node; empty: leaves

    SDAG_HD uint32_t address(uint32_t i) const {
        return base + (first.empty() ? 2 * i : i + first[i]);
    }
};

/// Writes the words of the inner nodes of a level, in canonical order.
struct WriteInnerNodes {
    View<const uint32_t> children;
    View<const uint32_t> order;
    LevelWords here, below;
    View<const uint32_t> rankBelow;
    View<uint32_t> words;

    size_t itemCount() const { return order.count; }
    size_t grain() const { return 1024; }
    SDAG_HD void operator()(size_t i) const {
        uint32_t mask = 0, at = here.address(uint32_t(i));
        const uint32_t head = at++;
        for (uint32_t c = 0; c < kChildCount; ++c) {
            const uint32_t child = children[size_t(order[i]) * kChildCount + c];
            if (child == kNoNode)
                continue;
            mask |= 1u << c;
            words[at++] = below.address(rankBelow[child]);
        }
        words[head] = mask;
    }
};

/// Writes the words of the leaves, in canonical order.
struct WriteLeaves {
    View<const uint64_t> voxels;
    View<const uint32_t> order;
    LevelWords here;
    View<uint32_t> words;

    size_t itemCount() const { return order.count; }
    size_t grain() const { return 4096; }
    SDAG_HD void operator()(size_t i) const {
        const uint64_t bits = voxels[order[i]];
        const uint32_t at = here.address(uint32_t(i));
        words[at] = uint32_t(bits);
        words[at + 1] = uint32_t(bits >> 32);
    }
};

} // namespace shadowdag
