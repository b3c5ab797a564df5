// SPDX-License-Identifier: Apache-2.0
// glTF 2.0 in and out.
#pragma once

#include "scenes/scene.h"

#include <string>

namespace shadowdag {

/// Reads a .glb or .gltf file and returns its default scene (or the first) with everything checked:
/// indices in range, nodes a forest, positions finite. What is ignored is counted in
/// Scene::warnings. Materials of alphaMode MASK are cut out by the alpha of their base colour
/// texture (PNG, embedded or beside; JPEG has no alpha), its factor and the cutoff; those of BLEND
/// are opaque. Base colour textures are read from PNG and JPEG, embedded or beside; one that is all
/// of one colour becomes a part of its material's factor, and one that cannot be shown leaves the
/// factor alone, with a warning. Throws Error kInput naming the file, the place and the value for
/// anything broken, and for every required extension that is not supported (KHR_lights_punctual,
/// KHR_mesh_quantization and KHR_texture_transform are, and the compressions
/// EXT_meshopt_compression and KHR_draco_mesh_compression, which are undone). Memory is bounded by
/// a multiple of the file's own size, whatever the file claims, what decoding one image at a time
/// takes, and kMaxSceneTexels; not what Draco takes to unpack a damaged stream.
Scene readGltf(const std::string& path);

/// Sets whether files that a scene names (buffers, images) may lie outside of its own folder, by
/// ".." or an absolute name or behind a symbolic link. For the whole process; false at first,
/// because a scene of unknown origin could then name any file of the user.
void allowOutsideFiles(bool isAllowed);

/// Writes the scene as one binary .glb that other programs open, through a temporary file beside
/// `path`. Throws Error kResource when the disk refuses, and kUsage for a scene with base colour
/// textures, which are not written. Reading it back gives the same world
/// positions.
void writeGlb(const Scene& scene, const std::string& path);

} // namespace shadowdag
