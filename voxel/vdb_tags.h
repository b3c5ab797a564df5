// SPDX-License-Identifier: Apache-2.0
// The metadata of an exported grid besides its voxels, from which importing restores the asset:
// named texts, which .vdb keeps as metadata and .nvdb as blind data.
#pragma once

#include "voxel/asset.h"

#include <map>
#include <string>

namespace shadowdag {

/// By name; every name begins with kVdbTagPrefix.
using VdbTags = std::map<std::string, std::string>;
constexpr const char* kVdbTagPrefix = "shadowdag_";

/// Returns the tags of an asset: resolution, origin_world, voxel_size_world, scene, scene_hash,
/// program_version, options, and a checksum over them and the voxels.
VdbTags tagsOf(const Asset& asset);

/// Returns the asset of these tags without its voxels. Throws Error kInput, message beginning with
/// `name`, for a tag that is missing, unreadable or out of range.
Asset assetOf(const VdbTags& tags, const std::string& name);

/// The tags as bytes: pairs of length-prefixed texts.
std::string packTags(const VdbTags& tags);
/// Throws Error kInput, message beginning with `name`, for bytes that packTags cannot produce.
VdbTags unpackTags(const std::string& bytes, const std::string& name);

} // namespace shadowdag
