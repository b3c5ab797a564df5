// SPDX-License-Identifier: Apache-2.0
// Assets to and from OpenVDB's .vdb and NanoVDB's .nvdb files.
//
// Voxel (i, j, k) of a DAG is index (i, j, k) of the grid. The voxel is the cube from (i, j, k) to
// (i + 1, ...) in voxel space, while VDB puts an index at the centre of its cube: the grid's
// transform maps index (0, 0, 0) to the centre of voxel (0, 0, 0).
// Source: Museth, VDB: High-Resolution Sparse Volumes with Dynamic Topology, ACM ToG 2013.
#pragma once

#include "voxel/asset.h"

#include <cstdint>
#include <string>

namespace shadowdag {

/// Writes the asset as a mask grid (no values, the voxels are the active ones) with the scene's
/// name, and its grid and provenance as metadata (.vdb) or blind data (.nvdb): readVdb gives the
/// same asset back, bit for bit. The same asset gives the same file. Whole or not at all.
/// Returns the file's size in bytes.
/// @param path ends in .vdb, or in .nvdb (zip-compressed)
/// Cost: about 100 bytes of memory an occupied 8^3 cell, several times that for .nvdb. Throws Error
/// kUsage for another ending, kResource when that is more than the machine has, or the disk is
/// full.
uint64_t writeVdb(const Asset& asset, const std::string& path);

/// Loads the library that readVdb needs for a file, so that limits of a process are for the file
/// alone. Throws as readVdb for another ending, and Error kResource where it cannot be loaded.
void loadVdbReader(const std::string& path);

struct VdbReadOptions {
    std::string gridName{}; ///< "": the only one
    /// Imports a grid of this program whose voxels or transform were changed as a foreign grid.
    bool acceptEdited = false;
    std::string programVersion{}; ///< for the provenance of a foreign grid
};

/// What a process may take to read a file, in proportion to its size.
struct VdbLimits {
    uint64_t memoryBytes; ///< that it may write (RLIMIT_DATA)
    uint64_t cpuSeconds;  ///< of all its threads together
};

/// Returns limits that every sound file keeps by a wide margin. A damaged one may state a length of
/// 4 GB in 10 KB, or one that is never reached.
/// @param fileBytes its size; 0 if it is not known
/// @param isNano of a .nvdb file, whose nodes are compressed
VdbLimits vdbLimits(uint64_t fileBytes, bool isNano);

/// An asset and its origin.
struct VdbAsset {
    Asset asset;
    bool isForeign = false; ///< not exported by writeVdb (or edited since)
    std::string gridName;
    std::string gridType;      ///< as the library spells it
    glm::ivec3 cornerIndex{0}; ///< the grid's index that became voxel 0
};

/// Reads one grid of a file. A grid that writeVdb wrote gives its asset, checked against its
/// checksum. Of any other grid the active voxels are taken, whatever their values, with tiles
/// expanded, in the smallest power-of-two cube (4 voxels at least) whose voxel 0 is the corner of
/// their bounds; sceneHash is "none", and options describe the source.
/// Not safe against every damaged .vdb: OpenVDB's reader uses lengths of values from the file
/// unchecked and may write past its buffers. Read untrusted files in a separate process, as
/// `shadowdag import` does. A .nvdb is read by our own code, which checks every length and offset.
/// Not guaranteed: that damage inside a foreign .vdb is detected; the format has no checksums, only
/// a count of its active voxels, which is checked. .nvdb grids are checked against their own
/// checksum if they have one.
/// Throws Error kUsage for another ending, or when there are several grids and none or no existing
/// one is named; kInput for a file that is missing, damaged or empty, a grid type without topology
/// of its own (points), a transform that rotates, shears, mirrors or scales unevenly, voxels that
/// spread over more than 131072 indices, or a grid of ours that was edited; kResource when memory
/// is short.
VdbAsset readVdb(const std::string& path, const VdbReadOptions& options);

} // namespace shadowdag
