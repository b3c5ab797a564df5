// SPDX-License-Identifier: Apache-2.0
// A scene's file of any kind that this program reads.
#pragma once

#include "scenes/scene.h"

#include <string>
#include <vector>

namespace shadowdag {

/// Returns whether this build reads other scenes than glTF, by Assimp.
bool readsOtherScenes();

/// Returns whether a file is by its extension a scene of a kind that readSceneFile reads.
bool isReadSceneName(const std::string& path);

/// Returns whether a file is a scene by its extension: one that is read, or whose refusal says how
/// to convert it.
bool isSceneName(const std::string& path);

/// Returns the paths of the files in a folder, not in those inside it, that are scenes by
/// isReadSceneName, sorted. Throws Error kInput where the folder cannot be read.
std::vector<std::string> scenesIn(const std::string& folder);

/// Reads a glTF file as readGltf does, and a file of another kind (OBJ, PLY, STL, FBX, COLLADA and
/// what else Assimp reads) as readByAssimp does where readsOtherScenes(). Throws Error kInput for
/// every other file, with how to convert it where other programs do.
Scene readSceneFile(const std::string& path);

} // namespace shadowdag
