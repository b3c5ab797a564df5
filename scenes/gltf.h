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
/// factor alone, with a warning. Skins and morph targets are read; World poses them. Throws Error
/// kInput naming the file, the place and the value for anything broken, and for every required
/// extension that is not supported (KHR_lights_punctual, KHR_mesh_quantization, KHR_node_visibility
/// and KHR_texture_transform are, and the compressions EXT_meshopt_compression and
/// KHR_draco_mesh_compression, which are undone). Memory is bounded by a multiple of the file's own
/// size, whatever the file claims, what decoding one image at a time takes, and kMaxSceneTexels;
/// not what Draco takes to unpack a damaged stream.
Scene readGltf(const std::string& path);

/// The image that cuts out a material of alphaMode MASK in place of its base colour texture, which
/// glTF does not have.
struct OpacityMap {
    int texture = kNone;     ///< of the document; kNone: none
    uint32_t texCoord = 0;   ///< its set of texture coordinates
    uint32_t mayBeGrey = 0;  ///< 1: where all of its alpha is 255, its luminance counts instead
    glm::vec2 uvScale{1.0f}; ///< of authored coordinates, before the offset
    glm::vec2 uvOffset{0.0f};
};

/// What a reader of other files made of one.
struct GltfSource {
    std::vector<uint8_t> bytes;          ///< binary glTF
    std::vector<OpacityMap> opacityMaps; ///< one a material
    std::vector<std::string> warnings;   ///< what was ignored, one sentence each
};

/// Reads a scene that another reader made of the file `path`, in whose folder the images lie.
/// Throws as readGltf does.
Scene readGltf(const std::string& path, GltfSource source);

/// Writes the scene as one binary .glb that other programs open, through a temporary file beside
/// `path`. Throws Error kResource when the disk refuses, and kUsage for a scene with base colour
/// textures, skins or morph targets, which are not written. Reading it back gives the same world
/// positions.
void writeGlb(const Scene& scene, const std::string& path);

} // namespace shadowdag
