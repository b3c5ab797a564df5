// SPDX-License-Identifier: Apache-2.0
// The asset file (.svdag): a DAG with checksums and provenance.
#pragma once

#include "voxel/dag.h"

#include <string>

namespace shadowdag {

/// Provenance of an asset. It contains no time and no thread count, so that the same input gives
/// the same file.
struct AssetProvenance {
    std::string sceneName; ///< as the user named it, without directories
    std::string sceneHash; ///< World::geometryHash()
    std::string programVersion;
    std::string options; ///< what changed the voxels, as text; "" for defaults
};

struct Asset {
    Dag dag;
    AssetProvenance provenance;
};

/// How a file encodes its nodes; both are read by the same function. LAYOUT.md compares their sizes
/// and times.
enum class AssetPacking {
    kFast,    ///< asset_encoding.h and zstd: read sixty times as fast
    kCompact, ///< compact_encoding.h: about half the bytes, for archiving and transfer
};

/// Writes the asset completely or not at all and returns the file's size in bytes. Throws Error
/// kResource.
uint64_t writeAsset(const Asset& asset, const std::string& path,
                    AssetPacking packing = AssetPacking::kCompact);

/// Returns an upper estimate of the memory in bytes that writeAsset needs besides the DAG.
/// @param wordCount of the DAG @param largestLevelWords of its largest level
uint64_t writingBytes(AssetPacking packing, uint64_t wordCount, uint64_t largestLevelWords);

/// Returns whether a regular file has the signature of an asset, whatever follows it.
bool beginsAsAsset(const std::string& path);

/// Reads an asset and verifies all of it before use: magic, version, sizes against the size of the
/// file, checksums, and every address (in range, downward, aligned to a node of the right level, no
/// empty child). Throws Error kInput naming file, place and value, and kResource for too many open
/// files and where memory is short.
Asset readAsset(const std::string& path);

/// As readAsset(path), from the bytes of a file. `name` replaces its path in messages.
Asset parseAsset(const std::vector<uint8_t>& bytes, const std::string& name);

} // namespace shadowdag
