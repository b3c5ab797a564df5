// SPDX-License-Identifier: Apache-2.0
// A DAG as NanoVDB's grid in memory. Apart from openvdb_file.h, whose users need no header of
// NanoVDB.
#pragma once

#include "voxel/dag.h"

#include <nanovdb/util/GridHandle.h>

namespace shadowdag {

/// Returns NanoVDB's mask grid of a DAG's voxels, all of them in leaves of 8^3; its index space is
/// voxel space. Memory while building is three times the grid's. Throws std::bad_alloc, and Error
/// kResource where OpenVDB, which makes the grid, cannot be loaded.
nanovdb::GridHandle<> nanoGridOf(const Dag& dag);

} // namespace shadowdag
