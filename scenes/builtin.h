// SPDX-License-Identifier: Apache-2.0
// Scenes that the program generates itself: the three after Olsson et al. 2015 and the failure
// scenes.
#pragma once

#include "scenes/scene.h"

#include <string>
#include <vector>

namespace shadowdag {

struct BuiltinInfo {
    std::string name;
    std::string description; ///< one line of description, with a source for failure scenes
};

/// Returns every built-in scene: `atrium`, `houses`, `necropolis`, then every `fail-*`.
std::vector<BuiltinInfo> builtinScenes();

/// Generates one of them; the same bits on every machine and run. Each has lights, a camera node
/// named "camera" and, for the three big ones, a camera path as an animation. Throws Error kUsage
/// for an unknown name, listing the known ones.
Scene makeBuiltin(const std::string& name);

/// Returns the scene of the command line's SCENE: `builtin:NAME`, or a scene's file. Throws as
/// makeBuiltin and readSceneFile do.
Scene loadScene(const std::string& sceneArgument);

/// Throws as loadScene does for a SCENE that cannot be a scene: an unknown built-in one, a missing
/// file, an asset. Reads no file.
void requireScene(const std::string& sceneArgument);

} // namespace shadowdag
