// SPDX-License-Identifier: Apache-2.0
// What the process runs that reads a file by Assimp: parsing, and the glTF file of what was found.
// Included by assimp_*.cpp only; of these, assimp_parser*.cpp are the files that use Assimp.
#pragma once

#include "scenes/glb_parts.h"
#include "scenes/gltf.h"
#include "scenes/scene_folder.h"

#include <cstdint>
#include <string>
#include <vector>

struct aiScene;
struct aiString;

namespace shadowdag::assimp {

/// Returns whether Assimp has a reader for an extension with its dot.
bool hasReader(const std::string& extension);

/// Parses a file's content. Files that it names are read from its folder alone. Throws Error kInput
/// for what Assimp refuses and for what glTF cannot hold, and std::bad_alloc. May crash.
GltfSource parse(const std::string& path, const std::vector<uint8_t>& bytes,
                 const std::string& extension);

/// A glTF file that is being made of Assimp's scene.
struct Conversion {
    explicit Conversion(const std::string& scenePath) : path(scenePath), folder(scenePath) {}

    std::string path;
    SceneFolder folder;
    bool isFbx = false;
    bool hasFullAngles = false; ///< of the cones of spots; else half ones
    float fovScale = 1.0f;      ///< from a camera's angle to the full one
    glb::Parts parts;
    GltfSource source; ///< all but its bytes

    /// Adds a warning if there is something to warn of.
    void warn(uint64_t count, const std::string& what);
};

/// Throws Error kInput: "FILE: place: problem".
[[noreturn]] void fail(const Conversion& conversion, const std::string& place,
                       const std::string& problem);

/// Returns a text of Assimp's as UTF-8.
std::string textOf(const aiString& text);

/// Returns "mesh 3 ('name')".
std::string placeOf(const char* kind, size_t index, const aiString& name);

/// The sets of texture coordinates that a material needs, at most one for its colour and one for
/// its opacity.
using UvSets = std::vector<uint32_t>;

/// Writes all materials, their textures and images; returns what each needs.
std::vector<UvSets> writeMaterials(const aiScene& scene, Conversion& conversion);

/// Writes meshes, nodes, lights and cameras. Returns the scene's root nodes, as Parts::head takes
/// them.
std::string writeNodes(const aiScene& scene, const std::vector<UvSets>& uvSets,
                       Conversion& conversion);

} // namespace shadowdag::assimp
