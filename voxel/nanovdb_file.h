// SPDX-License-Identifier: Apache-2.0
// The .nvdb container and the grids in it, every offset checked before it is followed: NanoVDB's
// own reader trusts the file.
#pragma once

#include "voxel/vdb_source.h"

namespace shadowdag {

/// The name of the blind data that holds packTags()' bytes.
constexpr const char* kNanoTagsName = "shadowdag";

/// Returns the grid of a .nvdb file's bytes, uncompressed or packed by zip or Blosc.
/// @param name stands for the file in messages
/// Throws as readVdb.
VdbSource readNanoVdb(const std::vector<uint8_t>& bytes, const std::string& name,
                      const std::string& gridName);

} // namespace shadowdag
