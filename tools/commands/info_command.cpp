// SPDX-License-Identifier: Apache-2.0
// `shadowdag info`: describes an asset or a scene.
#include "tools/commands/commands.h"
#include "tools/settings/common_options.h"
#include "tools/settings/parse.h"
#include "tools/workspace/asset_json.h"
#include "tools/workspace/scene_setup.h"

#include <nlohmann/json.hpp>

#include <filesystem>
#include <iostream>
#include <memory>

namespace shadowdag {

namespace {

struct InfoOptions {
    GlobalOptions global;
    std::string what, lights = "-1", seed = "1";
    bool verify = false;
};

void infoAsset(const InfoOptions& options, const Console& console) {
    // readAsset checks everything before use, so reading is verifying.
    const Asset asset = readAsset(options.what);
    const uint64_t bytes = std::filesystem::file_size(options.what);
    const Json json = assetJson(asset, bytes);
    console.people() << options.what << "\n";
    printAsset(console.people(), json);
    if (options.verify)
        console.people() << "  verified        checksums, sizes, addresses, levels\n";
    console.emit(json);
}

Json vectorJson(const glm::vec3& v) {
    return {v.x, v.y, v.z};
}

void infoScene(const InfoOptions& options, const Console& console) {
    const int lightCount = int(parseInteger("--lights", options.lights, -1, kMaxPlacedLightCount));
    const uint64_t seed = uint64_t(parseInteger("--seed", options.seed, 0, 9'000'000'000'000'000));
    const LoadedScene loaded = loadSceneAndWorld(options.what, lightCount, seed, false, console);
    const World& world = *loaded.world;
    const Scene& scene = *loaded.scene;
    size_t storedCount = 0;
    for (const Mesh& mesh : scene.meshes)
        storedCount += mesh.triangles.size();
    size_t movingInstances = 0, movingLights = 0, directionalLights = 0;
    for (const Instance& instance : world.instances())
        movingInstances += instance.isMoving ? 1 : 0;
    for (const Light& light : world.lights()) {
        movingLights += light.isMoving;
        directionalLights += light.kind == Light::kSun;
    }
    const Box& bounds = world.boundsWorld();

    std::ostream& out = console.people();
    out << loaded.name << "\n"
        << "  triangles       " << world.triangles().count() << " instanced, " << storedCount
        << " stored, " << world.staticTriangles().size() << " static\n"
        << "  instances       " << world.instances().size() << ", " << movingInstances
        << " moving\n"
        << "  bounds          (" << bounds.min.x << ", " << bounds.min.y << ", " << bounds.min.z
        << ") to (" << bounds.max.x << ", " << bounds.max.y << ", " << bounds.max.z << ") m\n"
        << "  lights          " << world.lights().size() << ", " << movingLights << " moving"
        << (directionalLights
                ? ", " + std::to_string(directionalLights) +
                      (directionalLights == 1 ? " directional light" : " directional lights")
                : std::string())
        << "\n"
        << "  cameras         " << world.cameras().size() << "\n"
        << "  animations      " << scene.animations.size() << ", " << scene.durationSeconds()
        << " s\n"
        << "  hash            " << loaded.geometryHash << "\n";
    for (const std::string& warning : scene.warnings)
        out << "  ignored         " << warning << "\n";
    console.emit({{"scene", loaded.name},
                  {"triangle_count", world.triangles().count()},
                  {"stored_triangle_count", storedCount},
                  {"static_triangle_count", world.staticTriangles().size()},
                  {"instance_count", world.instances().size()},
                  {"moving_instance_count", movingInstances},
                  {"bounds_min", vectorJson(bounds.min)},
                  {"bounds_max", vectorJson(bounds.max)},
                  {"light_count", world.lights().size()},
                  {"moving_light_count", movingLights},
                  {"sun_count", directionalLights},
                  {"camera_count", world.cameras().size()},
                  {"animation_count", scene.animations.size()},
                  {"duration_s", scene.durationSeconds()},
                  {"geometry_hash", loaded.geometryHash},
                  {"warnings", scene.warnings}});
}

} // namespace

std::function<void()> declareInfo(CommandLine& commandLine) {
    auto options = std::make_shared<InfoOptions>();
    commandLine.text("FILE", options->what, "", "An asset (.svdag) or a SCENE", true);
    commandLine.flag(
        "--verify", options->verify,
        "Report that all checksums and addresses of an asset are valid (reading an asset "
        "always checks them)");
    commandLine.text("--lights", options->lights, "N",
                     "For a scene: replace its lights by N generated lights [-1]");
    commandLine.text("--seed", options->seed, "S", "Seed of the generated lights [1]");
    options->global.declare(commandLine);
    return [options, &commandLine] {
        const Console console(options->global.json);
        options->global.apply(console, false, false);
        const bool isAsset = std::filesystem::path(options->what).extension() == ".svdag";
        if (isAsset && (commandLine.given("--lights") || commandLine.given("--seed")))
            throw Error(ErrorKind::kUsage,
                        "--lights and --seed are for scenes; '" + options->what + "' is an asset");
        if (commandLine.given("--seed") && !commandLine.given("--lights"))
            throw Error(ErrorKind::kUsage,
                        "--seed has no effect without --lights N; add it, or drop "
                        "--seed");
        if (!isAsset && options->verify)
            throw Error(ErrorKind::kUsage, "--verify is for assets (.svdag), not for '" +
                                               options->what + "'; drop it");
        isAsset ? infoAsset(*options, console) : infoScene(*options, console);
    };
}

} // namespace shadowdag
