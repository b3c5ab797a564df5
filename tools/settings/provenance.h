// SPDX-License-Identifier: Apache-2.0
// The provenance of every result line: the program, its build, and the machine.
#pragma once

#include "cuda/backend.h"
#include "tools/settings/json.h"

#include <string>

namespace shadowdag {

/// The key of provenance for the widest vector instructions in use; results before it lack it.
constexpr const char* kVectorInstructions = "vector_instructions";

/// Returns the program's version, as in "0.1.0".
std::string programVersion();
/// Returns the version of parts and of unfinished builds: that of the program with the hash of its
/// voxelizer's sources, because parts of two voxelizers make an asset of neither.
std::string partVersion();
/// Returns the commit that the program was built from, with "+dirty" when files differed from it,
/// or "unknown" outside a git checkout. Determined again by every build.
std::string programCommit();
/// Returns a hash of the sources that voxel assets depend on; part of the cache's key, so that a
/// changed voxelizer never uses an old asset.
std::string voxelSourceHash();

/// Returns commit, version, preset, build type, compiler, flags, processor and the widest vector
/// instructions that the program uses of it, device and its driver's CUDA version (null on the
/// CPU), backend and thread count as JSON. Throws as bestStreamIsa does.
Json buildProvenance(Backend backend);

/// Returns 16 hex digits of the 64-bit FNV-1a hash of a text.
/// Source: Fowler, Noll, Vo, draft-eastlake-fnv, sec. 2.
std::string textHash(const std::string& text);

} // namespace shadowdag
