// SPDX-License-Identifier: Apache-2.0
#include "scenes/builtin.h"

#include "cuda/error.h"
#include "scenes/builtin_stage.h"
#include "scenes/fail_scenes.h"
#include "scenes/scene_file.h"

#include <cctype>
#include <filesystem>
#include <stdexcept>

namespace shadowdag {

namespace {

struct Generator {
    const char* name;
    const char* description;
    Scene (*make)();
};

/// The explicit table of everything but the failure scenes that `builtin:NAME` can mean.
const Generator kGenerators[] = {
    {"atrium", "a two-storey court with colonnades, similar to Crytek Sponza, with 65 lamps",
     makeAtrium},
    {"houses",
     "a village at night with 256 lamps of similar size; the camera moves from far to near",
     makeHouses},
    {"houses-by-day", "the same village lit by a directional light instead of its lamps",
     makeHousesByDay},
    {"necropolis", "tombs among trees, 275 static lights of very unequal range and 101 moving ones",
     makeNecropolis},
};

const std::string kBuiltinPrefix = "builtin:";

/// Returns the built-in scene whose name has the same letters, "fail-wires" of "Fail_wires"; "" if
/// there is none.
std::string nearestBuiltin(std::string name) {
    for (char& c : name)
        c = c == '_' || c == ' ' ? '-' : char(std::tolower(static_cast<unsigned char>(c)));
    for (const BuiltinInfo& info : builtinScenes())
        if (info.name == name)
            return name;
    return "";
}

/// Throws Error kUsage for an unknown name, listing the known ones.
void requireBuiltin(const std::string& name) {
    std::string known;
    for (const BuiltinInfo& info : builtinScenes()) {
        if (info.name == name)
            return;
        known += (known.empty() ? "" : ", ") + info.name;
    }
    const std::string nearest = nearestBuiltin(name);
    throw Error(ErrorKind::kUsage,
                "there is no built-in scene '" + name + "'; " +
                    (nearest.empty() ? "the built-in scenes are: " + known
                                     : "did you mean " + kBuiltinPrefix + nearest + "?"));
}

} // namespace

std::vector<BuiltinInfo> builtinScenes() {
    std::vector<BuiltinInfo> infos;
    for (const Generator& generator : kGenerators)
        infos.push_back({generator.name, generator.description});
    for (const FailScene& scene : failScenes())
        infos.push_back({scene.name, scene.description});
    return infos;
}

Scene makeBuiltin(const std::string& name) {
    requireBuiltin(name);
    for (const Generator& generator : kGenerators)
        if (name == generator.name)
            return generator.make();
    for (const FailScene& scene : failScenes())
        if (name == scene.name)
            return makeFailScene(scene);
    throw std::logic_error("a listed scene has no generator: " + name);
}

Scene loadScene(const std::string& sceneArgument) {
    requireScene(sceneArgument);
    return sceneArgument.starts_with(kBuiltinPrefix)
               ? makeBuiltin(sceneArgument.substr(kBuiltinPrefix.size()))
               : readSceneFile(sceneArgument);
}

void requireScene(const std::string& sceneArgument) {
    if (sceneArgument.starts_with(kBuiltinPrefix)) {
        requireBuiltin(sceneArgument.substr(kBuiltinPrefix.size()));
        return;
    }
    if (sceneArgument.empty())
        throw Error(ErrorKind::kUsage,
                    "SCENE is empty; name a scene's file, such as .glb, or builtin:NAME");
    if (sceneArgument.ends_with(".svdag"))
        throw Error(ErrorKind::kUsage, "SCENE '" + sceneArgument +
                                           "': is a voxel asset, not a scene; name the scene that "
                                           "it was built from, and pass the asset as --voxels " +
                                           sceneArgument);
    if (sceneArgument.ends_with(".svpart"))
        throw Error(ErrorKind::kUsage, "SCENE '" + sceneArgument +
                                           "': is a part of a voxel build, not a scene; join all "
                                           "parts: shadowdag merge PART... -o F.svdag");
    std::error_code error;
    if (!std::filesystem::exists(sceneArgument, error)) {
        if (const std::string nearest = nearestBuiltin(sceneArgument); !nearest.empty())
            throw Error(ErrorKind::kInput, sceneArgument + ": no such file; did you mean " +
                                               kBuiltinPrefix + nearest + "?");
        throw Error(ErrorKind::kInput, sceneArgument + ": " +
                                           (error ? error.message() : "no such file") +
                                           "; check the name");
    }
}

} // namespace shadowdag
