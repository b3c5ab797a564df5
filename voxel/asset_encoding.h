// SPDX-License-Identifier: Apache-2.0
// The encoding of a DAG in an asset file: smaller than in memory, and valid by construction once it
// is decoded.
#pragma once

#include "voxel/dag.h"

#include <cstdint>
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

/// Nodes are numbered a level at a time by first visit, breadth first, as in dag.h. Most pointers
/// lead to the next node not yet seen (flag 1: costs a bit); the others name a node of the level
/// below by its distance back from there (flag 0). So addresses are not stored, and a decoded one
/// cannot be wrong, only a reference can be too far.
std::vector<uint8_t> encodeDag(const Dag& dag, EncodedCounts& counts);

/// Returns the DAG of these streams, in canonical order if encodeDag wrote them. Verifies
/// everything; nothing is allocated but the counts' words. Throws Error kInput; messages begin with
/// `name`.
/// @param bytes counts.byteCount() bytes
Dag decodeDag(const std::vector<uint8_t>& bytes, const EncodedCounts& counts, const VoxelGrid& grid,
              const std::string& name);

} // namespace shadowdag
