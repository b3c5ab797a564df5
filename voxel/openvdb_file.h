// SPDX-License-Identifier: Apache-2.0
// The parts of vdb_file.h that need OpenVDB. The first call loads it (openvdb_module.h); where that
// fails, all throw Error kResource, or what the libraries throw without memory or threads.
#pragma once

#include "voxel/vdb_source.h"

#include <iosfwd>

namespace shadowdag {

/// Loads OpenVDB, unless a call has.
void loadOpenVdb();

/// writeVdb for .vdb and for .nvdb, which is converted from OpenVDB's grid.
uint64_t writeOpenVdb(const Asset& asset, const std::string& path);
uint64_t writeNanoVdb(const Asset& asset, const std::string& path);

/// Returns one grid of a .vdb file.
/// @param byteCount of the file
/// @param name of it, for messages
/// Throws as readVdb. OpenVDB's reader does not verify sizes. Its stream throws at the end of the
/// file, which catches most wrong sizes; but lengths of compressed values are not compared with the
/// buffers they are read into (OpenVDB 10).
VdbSource readOpenVdb(std::istream& in, uint64_t byteCount, const std::string& name,
                      const std::string& gridName);

} // namespace shadowdag
