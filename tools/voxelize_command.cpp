// SPDX-License-Identifier: Apache-2.0
// `shadowdag voxelize`: builds the asset of a scene.
#include "tools/asset_json.h"
#include "tools/commands.h"
#include "tools/common_options.h"
#include "tools/parse.h"
#include "tools/scene_setup.h"
#include "voxel/voxelize.h"

#include <sys/resource.h>

#include <chrono>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <memory>

namespace shadowdag {

namespace {

struct VoxelizeOptions {
    GlobalOptions global;
    std::string scene, output, resolution = "1024";
};

/// Returns processor seconds of all threads so far.
double processorSeconds(const rusage& usage) {
    const auto seconds = [](const timeval& t) {
        return double(t.tv_sec) + 1e-6 * double(t.tv_usec);
    };
    return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

void runVoxelize(const VoxelizeOptions& options) {
    const Console console(options.global.json);
    options.global.apply(console, false);
    const uint32_t log2 = parsePowerOfTwo("--resolution", options.resolution, 4, 131072);
    if (std::filesystem::path(options.output).extension() != ".svdag")
        throw Error(ErrorKind::kUsage,
                    "-o '" + options.output + "': assets are .svdag files; end the name so");
    checkWritable(options.output);

    const LoadedScene scene = loadSceneAndWorld(options.scene, -1, 1, false, console);
    rusage before{};
    getrusage(RUSAGE_SELF, &before);
    const auto start = std::chrono::steady_clock::now();
    Asset asset;
    asset.provenance = assetProvenance(scene);
    asset.dag = voxelize(scene.world->triangles(), viewOf(scene.world->staticTriangles()),
                         sceneGrid(*scene.world, log2), console.progress("voxelize " + scene.name));
    const double wall =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    rusage after{};
    getrusage(RUSAGE_SELF, &after);
    checkInterrupted();
    const uint64_t bytes = writeAsset(asset, options.output);

    Json json = {{"output", options.output}};
    json.update(assetJson(asset, bytes));
    json["wall_s"] =
        wall; // of voxelizing and merging; reading the scene and writing the file are outside
    json["cpu_s"] = processorSeconds(after) - processorSeconds(before);
    json["peak_rss_bytes"] = uint64_t(after.ru_maxrss) * 1024;
    console.people() << options.output << "\n";
    printAsset(console.people(), json);
    console.people() << "  time            " << numberText(std::round(wall * 100) / 100) << " s, "
                     << numberText(std::round(json["cpu_s"].get<double>() * 100) / 100)
                     << " s of processor, peak " << bytesText(double(after.ru_maxrss) * 1024)
                     << "\n";
    console.emit(json);
}

} // namespace

std::function<void()> declareVoxelize(CommandLine& commandLine) {
    auto options = std::make_shared<VoxelizeOptions>();
    commandLine.text("SCENE", options->scene, "", "A .glb or .gltf file, or builtin:NAME", true);
    commandLine.text("-o,--output", options->output, "F.svdag", "The asset to write", true);
    commandLine.text(
        "--resolution", options->resolution, "N",
        "Voxels an axis, a power of two from 4 to 131072; the cube is centred on what never "
        "moves and as long as its longest side [1024]");
    options->global.declare(commandLine);
    return [options] { runVoxelize(*options); };
}

} // namespace shadowdag
