// SPDX-License-Identifier: Apache-2.0
// The contents of an asset as JSON and as text.
#pragma once

#include "tools/settings/json.h"
#include "voxel/asset.h"

#include <iosfwd>

namespace shadowdag {

/// Returns resolution, voxel_count, node_counts, leaf_count, asset_bytes, traced_bytes, ratios and
/// provenance.
Json assetJson(const Asset& asset, uint64_t fileBytes);
/// The same for an asset that is not in memory.
Json assetJson(const DagStats& stats, const VoxelGrid& grid, const AssetProvenance& provenance,
               uint64_t fileBytes);
/// Returns the packing of that name, fast or compact. Throws Error kUsage for any other.
AssetPacking parsePacking(const std::string& text);
constexpr const char* kPackingHelp =
    "Encoding of the nodes: compact, or fast: about twice the bytes, read sixty times as "
    "fast [compact]";
/// Prints them as a table.
void printAsset(std::ostream& out, const Json& json);

} // namespace shadowdag
