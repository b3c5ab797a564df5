// SPDX-License-Identifier: Apache-2.0
#include "tools/workspace/scene_setup.h"

#include "cuda/error.h"
#include "scenes/builtin.h"
#include "scenes/camera_placement.h"
#include "scenes/output_file.h"
#include "scenes/output_target.h"
#include "scenes/write_remedy.h"
#include "tools/settings/camera_text.h"
#include "tools/settings/parse.h"
#include "tools/settings/provenance.h"
#include "tools/settings/words.h"
#include "tools/workspace/report_directory.h"
#include "voxel/voxelize.h"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <optional>

namespace shadowdag {

namespace fs = std::filesystem;

namespace {

/// Returns the node indices whose cameras World::cameras() lists, in its order: those reachable
/// from the roots, ascending.
std::vector<uint32_t> cameraNodes(const Scene& scene) {
    std::vector<char> reachable(scene.nodes.size(), 0);
    std::vector<int> open = scene.roots;
    while (!open.empty()) {
        const int node = open.back();
        open.pop_back();
        reachable[size_t(node)] = 1;
        for (const int child : scene.nodes[size_t(node)].children)
            open.push_back(child);
    }
    std::vector<uint32_t> nodes;
    for (size_t node = 0; node < scene.nodes.size(); ++node)
        if (reachable[node] && scene.nodes[node].camera != kNone)
            nodes.push_back(uint32_t(node));
    return nodes;
}

/// Returns whether nodes have lights and each of these is of intensity 0 or black.
bool hasDarkLights(const Scene& scene) {
    bool hasLights = false;
    for (const Node& node : scene.nodes)
        if (node.light != kNone) {
            const LightSource& light = scene.lights[size_t(node.light)];
            if (light.color * light.intensity != glm::vec3(0.0f))
                return false;
            hasLights = true;
        }
    return hasLights;
}

/// Returns which automatic camera a text of --camera names: 1 for auto, K for auto-K, 0 for none.
/// Throws Error kUsage for an auto-K that there cannot be.
uint32_t automaticView(const std::string& text) {
    if (text == "auto")
        return 1;
    if (!text.starts_with("auto-"))
        return 0;
    try {
        return uint32_t(parseInteger("--camera", text.substr(5), 1, kMaxViewCount));
    } catch (const Error&) {
        throw Error(ErrorKind::kUsage, "--camera '" + text + "': the automatic cameras are auto, " +
                                           "auto-2 and so on, up to auto-" +
                                           std::to_string(kMaxViewCount));
    }
}

/// Returns the same of a world's camera: "" is its first, else auto.
uint32_t automaticView(const World& world, const std::string& text) {
    return text.empty() ? uint32_t(world.cameras().empty()) : automaticView(text);
}

/// Returns which of World::cameras() a text names, the first for ""; nothing if it names none.
std::optional<size_t> namedCamera(const World& world, const std::string& text) {
    const Scene& scene = world.scene();
    const std::vector<uint32_t> nodes = cameraNodes(scene);
    const std::vector<std::string> names = cameraNames(world);
    for (size_t i = 0; i < nodes.size() && i < world.cameras().size(); ++i)
        if (text.empty() || names[i] == text ||
            scene.cameras[size_t(scene.nodes[nodes[i]].camera)].name == text)
            return i;
    return std::nullopt;
}

/// Returns the first automatic cameras of a world. Throws Error kUsage if there are fewer.
std::vector<Camera> placeViews(const World& world, uint32_t count, const Console* console) {
    checkInterrupted();
    const Progress progress =
        console != nullptr
            ? console->progress((count == 1 ? "place the view in " : "place the views in ") +
                                world.scene().name)
            : Progress{};
    std::vector<Camera> placed = placeCameras(world, count, nullptr, progress);
    checkInterrupted();
    if (placed.size() < count)
        throw Error(ErrorKind::kUsage, world.scene().name + ": has only " +
                                           countText(placed.size(), "automatic view") +
                                           " with light and shadow; ask for fewer with --views, "
                                           "or give cameras with --camera");
    return placed;
}

} // namespace

std::vector<std::string> sceneNames(const std::vector<std::string>& arguments) {
    std::vector<std::string> paths, names;
    for (const std::string& argument : arguments) {
        const fs::path path = fs::path(argument).lexically_normal();
        const bool isBuiltin = argument.starts_with("builtin:");
        paths.push_back(isBuiltin ? argument : path.string());
        names.push_back(isBuiltin ? argument : path.filename().string());
        if (std::count(paths.begin(), paths.end(), paths.back()) > 1)
            throw Error(ErrorKind::kUsage,
                        "SCENE '" + argument + "' is given twice; give each scene once");
    }
    std::vector<std::string> unique;
    for (size_t i = 0; i < names.size(); ++i)
        unique.push_back(std::count(names.begin(), names.end(), names[i]) > 1 ? paths[i]
                                                                              : names[i]);
    return unique;
}

LoadedScene loadSceneAndWorld(const std::string& sceneArgument, int lightCount, uint64_t lightSeed,
                              bool needsLights, const Console& console) {
    LoadedScene loaded;
    loaded.argument = sceneArgument;
    loaded.name = sceneNames({sceneArgument}).front();
    const auto step = console.step("read " + loaded.name);
    loaded.scene = std::make_unique<Scene>(loadScene(sceneArgument));
    checkInterrupted();
    for (const std::string& warning : loaded.scene->warnings)
        console.note(loaded.name + ": warning: " + warning);
    WorldOptions options;
    options.placedLightCount = lightCount;
    options.seed = lightSeed;
    loaded.world = std::make_unique<World>(*loaded.scene, options);
    checkInterrupted();
    loaded.geometryHash = loaded.world->geometryHash();
    loaded.contentHash = loaded.world->contentHash();
    checkInterrupted();
    if (needsLights && lightCount == 0)
        throw Error(ErrorKind::kUsage, "--lights '0': leaves " + sceneArgument +
                                           " without a light; use 1 or more, or -1 for the "
                                           "scene's own");
    if (needsLights && loaded.world->lights().empty())
        throw Error(ErrorKind::kInput,
                    sceneArgument +
                        (hasDarkLights(*loaded.scene)
                             ? ": all its lights are dark, of intensity 0 or black; give one more, "
                               "or place some with --lights 32 if the command has that option"
                             : ": has no supported light; place some with --lights 32 if the "
                               "command has that option"));
    return loaded;
}

LoadedScene openScene(const Experiment& experiment, size_t scene, const Console& console) {
    LoadedScene loaded = loadSceneAndWorld(experiment.scenes[scene], experiment.lightCount,
                                           experiment.lightSeed, true, console);
    loaded.name = sceneNames(experiment.scenes)[scene];
    checkCamera(*loaded.world, experiment.camera);
    return loaded;
}

LoadedScene loadedScene(Scene scene, const WorldOptions& options) {
    LoadedScene loaded;
    loaded.argument = loaded.name = scene.name;
    loaded.scene = std::make_unique<Scene>(std::move(scene));
    loaded.world = std::make_unique<World>(*loaded.scene, options);
    loaded.geometryHash = loaded.world->geometryHash();
    loaded.contentHash = loaded.world->contentHash();
    return loaded;
}

Camera chooseCamera(const World& world, const std::string& text, const Console* console) {
    const std::vector<Camera>& cameras = world.cameras();
    if (text.empty() && !cameras.empty())
        return cameras.front();
    if (const uint32_t view = text.empty() ? 1 : automaticView(text); view > 0)
        return placeViews(world, view, console).back();

    if (text.find(',') != std::string::npos)
        return cameraFromText(text);

    if (const std::optional<size_t> named = namedCamera(world, text))
        return cameras[*named];
    std::string known = "auto";
    for (const std::string& name : cameraNames(world))
        known += ", " + name;
    throw Error(ErrorKind::kUsage,
                "--camera '" + text + "': there is no camera of that name; the cameras are: " +
                    known + ", or give px,py,pz,tx,ty,tz[,fovDegrees[,near,far[,rollDegrees]]]");
}

bool isCameraAnimated(const World& world, const std::string& text) {
    if ((!text.empty() && automaticView(text) > 0) || text.find(',') != std::string::npos)
        return false;
    const std::optional<size_t> camera = namedCamera(world, text);
    if (!camera)
        return false;
    const Scene& scene = world.scene();
    for (int node = int(cameraNodes(scene)[*camera]); node != kNone;
         node = scene.nodes[size_t(node)].parent)
        for (const Animation& animation : scene.animations)
            for (const AnimationChannel& channel : animation.channels)
                if (channel.node == node && channel.times.size() > 1)
                    return true;
    return false;
}

void checkCamera(const World& world, const std::string& text) {
    if (!text.empty() && automaticView(text) == 0)
        (void)chooseCamera(world, text);
}

std::vector<std::string> cameraNames(const World& world) {
    const Scene& scene = world.scene();
    std::vector<std::string> names;
    for (const uint32_t index : cameraNodes(scene)) {
        const Node& node = scene.nodes[index];
        names.push_back(node.name.empty() ? scene.cameras[size_t(node.camera)].name : node.name);
    }
    return names;
}

bool FrameCamera::isAutomatic(const World& world) const {
    return automaticView(world, text_) > 0;
}

Camera FrameCamera::at(const World& world, const Console* console) {
    const uint32_t view = automaticView(world, text_);
    if (view == 0)
        return chooseCamera(world, text_);
    if (placed_.size() < view)
        placed_ = placeViews(world, std::max(view, viewCount_), console);
    return placed_[view - 1];
}

VoxelGrid sceneGrid(const World& world, uint32_t resolutionLog2) {
    return gridAround(world.staticBoundsWorld(), resolutionLog2);
}

std::string cacheDirectory(const std::string& asked) {
    if (!asked.empty())
        return asked;
    if (const char* cache = std::getenv("XDG_CACHE_HOME"); cache != nullptr && *cache == '/')
        return std::string(cache) + "/shadowdag";
    if (const char* home = std::getenv("HOME"); home != nullptr && *home != 0)
        return std::string(home) + "/.cache/shadowdag";
    return "";
}

AssetProvenance assetProvenance(const LoadedScene& scene) {
    return {scene.name, scene.geometryHash, programVersion(), ""};
}

Dag cachedDag(const LoadedScene& scene, uint32_t resolutionLog2, const VoxelSource& source,
              const Console& console) {
    const std::string directory = cacheDirectory(source.cacheDirectory);
    const std::string path = directory + "/" + scene.geometryHash + "-" +
                             std::to_string(1u << resolutionLog2) + "-" + voxelSourceHash() +
                             ".svdag";
    std::error_code ignored;
    if (!directory.empty() && fs::exists(path, ignored)) {
        try {
            Asset asset = readAsset(path);
            if (asset.provenance.sceneHash == scene.geometryHash &&
                asset.dag.grid == sceneGrid(*scene.world, resolutionLog2))
                return std::move(asset.dag);
            console.note("cache: " + path + " contains another scene or grid; building it again");
        } catch (const Error& error) {
            console.note(std::string("cache: ") + error.what() + "; building it again");
        }
    }

    Asset asset;
    asset.provenance = assetProvenance(scene);
    const std::string what =
        "voxelize " + scene.name + " " + std::to_string(1u << resolutionLog2) + "^3";
    asset.dag = voxelize(scene.world->triangles(), viewOf(scene.world->staticTriangles()),
                         sceneGrid(*scene.world, resolutionLog2), console.progress(what));
    if (!directory.empty()) {
        try {
            createDirectory(directory);
            writeAsset(asset, path, AssetPacking::kFast);
        } catch (const Error& error) {
            console.note(std::string("cache: ") + error.what() + "; the asset is not stored");
        }
    }
    return std::move(asset.dag);
}

Dag readDagFor(const LoadedScene& scene, const std::string& path, bool allowStale,
               const Console& console) {
    Asset asset = readAsset(path);
    std::string text;
    if (asset.provenance.sceneHash != scene.geometryHash)
        text = path + ": was built from " + asset.provenance.sceneName + " (hash " +
               asset.provenance.sceneHash + "), not from " + scene.name + " as it is now (hash " +
               scene.geometryHash + ")";
    else if (!(asset.dag.grid == sceneGrid(*scene.world, asset.dag.grid.resolutionLog2)))
        text = path + ": its grid is not that of the static geometry of " + scene.name;
    if (!text.empty()) {
        if (!allowStale)
            throw Error(ErrorKind::kInput,
                        text + "; build it again with shadowdag voxelize, or pass --allow-stale");
        console.note("warning: " + text + "; used nevertheless");
    }
    return std::move(asset.dag);
}

std::vector<Dag> obtainDags(const LoadedScene& scene, const std::vector<uint32_t>& resolutionLog2,
                            const VoxelSource& source, const Console& console) {
    std::vector<Dag> dags;
    if (!source.assetPaths.empty()) {
        for (const std::string& path : source.assetPaths) {
            dags.push_back(readDagFor(scene, path, source.allowStale, console));
            for (size_t i = 0; i + 1 < dags.size(); ++i)
                if (dags[i].grid.resolutionLog2 == dags.back().grid.resolutionLog2)
                    throw Error(ErrorKind::kUsage,
                                "--voxels '" + path + "': has the resolution of '" +
                                    source.assetPaths[i] + "', " +
                                    std::to_string(dags[i].grid.resolution()) +
                                    ", which distinguishes runs; give only one of them");
        }
        return dags;
    }
    for (const uint32_t log2 : resolutionLog2)
        dags.push_back(cachedDag(scene, log2, source, console));
    return dags;
}

void checkWritable(const std::string& path) {
    std::error_code error;
    if (fs::is_directory(path, error))
        throw Error(ErrorKind::kResource, path + ": is a directory; give a file");
    const fs::path parent = fs::path(outputTarget(path)).parent_path();
    const std::string directory = parent.empty() ? "." : parent.string();
    const fs::file_status status = fs::status(directory, error);
    if (status.type() == fs::file_type::not_found)
        throw Error(ErrorKind::kResource,
                    path + ": there is no directory " + directory + "; create it first");
    if (const std::string why = whyNotWritable(directory); !why.empty())
        throw Error(ErrorKind::kResource,
                    path + ": cannot be written into " + directory + ": " + why);
    OutputFile{path}; // where the rights allow it, the file system may not; removed again
}

void refuseSameFile(const std::string& output, const std::vector<std::string>& others,
                    const std::string& option) {
    const auto placeOf = [](const std::string& path) {
        std::error_code error;
        const fs::path place = fs::weakly_canonical(path, error);
        return error ? fs::absolute(path) : place; // a pipe of the shell has none
    };
    for (const std::string& other : others)
        if (!other.empty() && placeOf(other) == placeOf(output))
            throw Error(ErrorKind::kUsage,
                        option + " '" + output + "': is also the file of another argument" +
                            (other == output ? "" : ", '" + other + "'") + "; choose another name");
}

void checkExtension(const std::string& path, const std::vector<std::string>& extensions,
                    const std::string& kinds) {
    static_cast<void>(outputTarget(path));
    const std::string extension = fs::path(path).extension();
    if (std::find(extensions.begin(), extensions.end(), extension) == extensions.end())
        throw Error(ErrorKind::kUsage, "-o '" + path + "': " + kinds);
}

} // namespace shadowdag
