// SPDX-License-Identifier: Apache-2.0
// Leaves to unique nodes to the words of a DAG, on a backend: the second half of a build by passes.
// Internal to this folder.
#pragma once

#include "voxel/dag_builder.h"
#include "voxel/pass_memory.h"

#include <optional>
#include <vector>

namespace shadowdag {

/// The leaves of a cell, ascending by Morton number, each once.
struct PassLeaves {
    LongWords keys, voxels;
};

/// The unique nodes of a cell. inner[i]: of level kLeafLog2 + 1 + i, kChildCount words a node.
struct PassNodes {
    std::optional<LongWords> leaves; ///< null: the cell is empty
    std::vector<Words> inner;
};

/// Returns the unique nodes under a cell of `topLevel`, which has one node there. Throws
/// OverBudget.
/// @param leaves all of the cell, or null
PassNodes buildNodes(PassMemory& memory, std::optional<PassLeaves> leaves, uint32_t topLevel);

/// Adds the nodes of a cell to those of the whole DAG; returns the address of its root, or kNoNode.
uint32_t mergeNodes(const PassNodes& nodes, uint32_t topLevel, DagBuilder& merged);

/// Returns the words of the DAG of a cell in canonical order (dag.h); none of an empty one. Throws
/// OverBudget, and Error kResource over 2^32 - 2 words.
std::vector<uint32_t> canonicalWords(PassMemory& memory, const PassNodes& nodes);

} // namespace shadowdag
