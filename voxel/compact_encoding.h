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

/// Writes the nodes level by level in the order of dag.h, through one arithmetic coder
/// (range_coder.h) with the contexts of voxel_model.h. Down to cells of 16^3 it writes the child
/// mask, then for each child whether it is the next new node or which earlier one. New cells of 8^3
/// are written as their voxels, directly behind the 16^3 node that contains them: given the
/// surrounding 16^3 voxels they take fewer bits than pointers to leaves. The reader finds equal
/// leaves by content. Cost: one thread; besides the result one word per word of the largest level,
/// and 8 MiB.
/// @param dag in canonical order
/// @param counts receives what decodeCompact needs; referenceCount stays 0
std::vector<uint8_t> encodeCompact(const Dag& dag, EncodedCounts& counts);

/// Returns the DAG of these bytes, in canonical order if encodeCompact wrote them. Verifies
/// everything that a traversal relies on; damaged bytes give an Error or a valid DAG of other
/// voxels. Allocates at most compactWordLimit words for it. Throws Error kInput; messages begin
/// with `name`.
Dag decodeCompact(const std::vector<uint8_t>& bytes, const EncodedCounts& counts,
                  const VoxelGrid& grid, const std::string& name);

} // namespace shadowdag
