// SPDX-License-Identifier: Apache-2.0
// The encoding of a DAG in an asset file. It is smaller than the DAG in memory, and a decoded DAG
// is always valid.
#pragma once

#include "voxel/dag.h"

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace shadowdag {

/// The counts of an encoded DAG, which determine the sizes of its streams.
struct EncodedCounts {
    uint64_t innerCount = 0;     ///< inner nodes
    uint64_t pointerCount = 0;   ///< children of inner nodes
    uint64_t referenceCount = 0; ///< pointers to nodes seen before
    uint64_t leafCount = 0;

    /// Returns the bytes of all streams, in order: masks (1 an inner node), flags (1 bit a pointer,
    /// rounded up to bytes), references (4 each, as four planes, lowest byte first), leaves (8
    /// each, as eight planes, octant 0 first).
    uint64_t byteCount() const {
        return innerCount + (pointerCount + 7) / 8 + 4 * referenceCount + 8 * leafCount;
    }
    /// Returns the words of the DAG in memory.
    uint64_t wordCount() const { return innerCount + pointerCount + 2 * leafCount; }
};

/// Nodes are numbered level by level in breadth-first order of the first visit, as in dag.h. Most
/// pointers lead to the next unvisited node (flag 1, one bit). The others store how many nodes back
/// their target is in the level below (flag 0). Addresses are therefore not stored, and the only
/// possible error is a reference that is too large.
std::vector<uint8_t> encodeDag(const Dag& dag, EncodedCounts& counts);

/// Returns the DAG of these streams, in canonical order if encodeDag wrote them. Verifies
/// everything and allocates only the words that the counts state, and at most as much again. On the
/// CPU threads; the result, and what is wrong with the bytes, are the same for any number of them.
/// Throws Error kInput; messages begin with `name`.
/// @param bytes counts.byteCount() bytes
Dag decodeDag(View<const uint8_t> bytes, const EncodedCounts& counts, const VoxelGrid& grid,
              const std::string& name);
/// As above, of bytes that `fill` writes first, while memory is made ready for the DAG.
Dag decodeDag(View<const uint8_t> bytes, const EncodedCounts& counts, const VoxelGrid& grid,
              const std::string& name, const std::function<void()>& fill);

} // namespace shadowdag
