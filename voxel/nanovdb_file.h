// SPDX-License-Identifier: Apache-2.0
// The .nvdb container and the grids in it. Every offset is checked before it is followed, unlike in
// NanoVDB's own reader.
#pragma once

#include "voxel/vdb_source.h"

namespace shadowdag {

/// The name of the blind data that holds packTags()' bytes.
constexpr const char* kNanoTagsName = "shadowdag";

/// Returns the grid of a .nvdb file's bytes, uncompressed or packed by zip or Blosc.
/// @param name of the file, for messages
/// Throws as readVdb.
VdbSource readNanoVdb(const std::vector<uint8_t>& bytes, const std::string& name,
                      const std::string& gridName);

} // namespace shadowdag
