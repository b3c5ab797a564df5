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
/// are opaque. Throws Error kInput naming the file, the place and the value for anything broken,
/// and for every required extension that is not supported (KHR_lights_punctual and
/// KHR_mesh_quantization are). Memory is bounded by a small multiple of the file's own size,
/// whatever the file claims, and what decoding one masked image at a time takes.
Scene readGltf(const std::string& path);

/// Writes the scene as one binary .glb that other programs open, through a temporary file beside
/// `path`. Throws Error kResource when the disk refuses. Reading it back gives the same world
/// positions.
void writeGlb(const Scene& scene, const std::string& path);

} // namespace shadowdag
