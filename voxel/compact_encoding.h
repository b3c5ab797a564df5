// SPDX-License-Identifier: Apache-2.0
// The smallest encoding of a DAG, for asset files that are kept. Reading it takes sixty times as
// long as asset_encoding's streams, which are 1.9 times as large (LAYOUT.md).
#pragma once

#include "voxel/asset_encoding.h"

namespace shadowdag {

/// Returns the maximum number of words that so many bytes may decode to, which bounds the memory
/// that a damaged file can make the reader allocate. encodeCompact pads with zeros where needed.
constexpr uint64_t compactWordLimit(uint64_t byteCount) {
    return 16384 + 16 * byteCount;
}

/// Writes the nodes a level at a time in the order of dag.h, through one arithmetic coder
/// (range_coder.h) with the contexts of voxel_model.h. Down to cells of 16^3: the child mask, then
/// for each child whether it is the next one not yet seen, or which of those before it is. Unseen
/// cells of 8^3 are not pointers to leaves but their voxels, right behind the node of 16^3 that
/// holds them: beside what is known of its 16^3 voxels they take fewer bits than the pointers
/// alone. Leaves are found equal by content when they are read.
/// Cost: one thread; besides the result one word a word of the largest level, and 8 MiB.
/// @param dag in canonical order
/// @param counts receives what decodeCompact needs; referenceCount stays 0
std::vector<uint8_t> encodeCompact(const Dag& dag, EncodedCounts& counts);

/// Returns the DAG of these bytes, in canonical order if encodeCompact wrote them. Verifies
/// everything that would make a DAG unfit to walk; damaged bytes give an Error or the DAG of other
/// voxels. Allocates compactWordLimit words at most for it. Throws Error kInput; messages begin
/// with `name`.
Dag decodeCompact(const std::vector<uint8_t>& bytes, const EncodedCounts& counts,
                  const VoxelGrid& grid, const std::string& name);

} // namespace shadowdag
