// SPDX-License-Identifier: Apache-2.0
// `shadowdag bench`: measures the rates of this program, Embree and NanoVDB in one run, after
// verifying the results.
#include "tools/bench/bench_device.h"
#include "tools/bench/bench_raster.h"
#include "tools/bench/bench_shading.h"
#include "tools/bench/bench_voxel.h"
#include "tools/commands/commands.h"
#include "tools/settings/camera_text.h"
#include "tools/settings/common_options.h"
#include "tools/settings/parse.h"
#include "tools/settings/provenance.h"
#include "tools/workspace/scene_setup.h"
#include "tools/workspace/timing.h"

#include <nlohmann/json.hpp>

#include <iostream>
#include <memory>
#include <tuple>

namespace shadowdag {

namespace {

struct BenchOptions {
    GlobalOptions global;
    std::string name, scene = "builtin:atrium";
    std::string size = "320x180", camera, lights = "-1", seed = "1", repeats = "10";
    std::string resolution = "1024", nanoVdbLimit = "2048", frameSize;
    std::string maps = "40", faceTexels = "512",
                pageSize = std::to_string(ShadowMapOptions{}.pageTexels);
};

void runBench(const BenchOptions& options, const CommandLine& commandLine) {
    const Console console(options.global.json);
    const bool isVoxel = options.name == "voxel", isRaster = options.name == "raster";
    if (!isVoxel && !isRaster && options.name != "shading")
        throw Error(ErrorKind::kUsage,
                    "bench '" + options.name +
                        "': there is no such benchmark; use voxel, raster or shading");
    const bool isOnDevice = options.global.backend == "cuda";
    if (options.global.backend == "gl" || (isOnDevice && !isVoxel))
        throw Error(ErrorKind::kUsage, "bench '" + options.name + "' runs on the CPU" +
                                           (isVoxel ? " and on CUDA" : "") + ": drop --backend " +
                                           options.global.backend);
    if (isOnDevice && commandLine.given("--frame-size"))
        throw Error(ErrorKind::kUsage, "--frame-size is for the CPU's tracers; drop it");
    for (const char* option : {"--resolution", "--nanovdb-limit", "--frame-size"})
        if (!isVoxel && commandLine.given(option))
            throw Error(ErrorKind::kUsage, std::string(option) + " is for bench voxel; drop it");
    for (const char* option : {"--maps", "--face", "--page-size"})
        if (!isRaster && commandLine.given(option))
            throw Error(ErrorKind::kUsage, std::string(option) + " is for bench raster; drop it");
    options.global.apply(console, false, false);
    const Backend backend = isOnDevice ? Backend::kCuda : Backend::kCpu;

    VoxelBenchOptions voxel;
    RasterBenchOptions raster;
    ShadingBenchOptions shading;
    const auto [width, height] = parseSize("--size", options.size);
    voxel.width = raster.width = shading.width = width;
    voxel.height = raster.height = shading.height = height;
    voxel.frameWidth = width;
    voxel.frameHeight = height;
    if (!options.frameSize.empty())
        std::tie(voxel.frameWidth, voxel.frameHeight) =
            parseSize("--frame-size", options.frameSize);
    voxel.repeats = raster.repeats = shading.repeats =
        int(parseInteger("--repeats", options.repeats, 1, 1000));
    voxel.resolutionLog2 = parsePowerOfTwo("--resolution", options.resolution, 4, 131072);
    voxel.nanoVdbResolutionLog2 =
        parsePowerOfTwo("--nanovdb-limit", options.nanoVdbLimit, 1, 131072);
    raster.mapCount = uint32_t(parseInteger("--maps", options.maps, 1, 65536));
    raster.faceTexels = uint32_t(parseInteger("--face", options.faceTexels, 8, kMaxFaceTexels));
    raster.pageTexels = 1u << parsePowerOfTwo("--page-size", options.pageSize, 16, 256);
    const LoadedScene scene = loadSceneAndWorld(
        options.scene, int(parseInteger("--lights", options.lights, -1, kMaxPlacedLightCount)),
        uint64_t(parseInteger("--seed", options.seed, 0, INT64_MAX)), true, console);
    const Camera camera = chooseCamera(*scene.world, options.camera, &console);

    const CpuUse use;
    Json result = isOnDevice ? runDeviceBench(backend, *scene.world, camera, voxel, console)
                  : isVoxel  ? runVoxelBench(*scene.world, camera, voxel, console)
                  : isRaster ? runRasterBench(*scene.world, camera, raster, console)
                             : runShadingBench(*scene.world, camera, shading, console);
    if (isVoxel && !result.contains("nanovdb_bytes"))
        console.note("NanoVDB is omitted above --nanovdb-limit " + options.nanoVdbLimit);
    console.people() << scene.name << " at " << options.size << "\n";
    isOnDevice ? printDeviceBench(console.people(), result)
    : isVoxel  ? printVoxelBench(console.people(), result)
    : isRaster ? printRasterBench(console.people(), result)
               : printShadingBench(console.people(), result);
    result["scene"] = scene.name;
    result["scene_hash"] = scene.geometryHash;
    result["content_hash"] = scene.contentHash;
    result["camera"] = options.camera;
    result["camera_numbers"] = cameraText(camera);
    result["size"] = options.size;
    result["other_cpu_share"] = otherShareJson(use.otherShare());
    result["lights"] = options.lights;
    result["seed"] = options.seed;
    result["provenance"] = buildProvenance(backend);
    if (const std::string busy = busyRemark(use.otherShare()); !busy.empty())
        console.note("warning: " + busy);
    console.emit(result);
}

} // namespace

std::function<void()> declareBench(CommandLine& commandLine) {
    auto options = std::make_shared<BenchOptions>();
    commandLine.text(
        "NAME", options->name, "",
        "voxel: voxelization and shadow rays, compared with Embree and NanoVDB; raster: "
        "shadow maps stage by stage, compared with Embree; shading: G-buffer, marking, colour and "
        "lookups",
        true);
    commandLine.text("SCENE", options->scene, "", std::string(kSceneHelp) + " [builtin:atrium]");
    commandLine.heading("View");
    commandLine.text("--size", options->size, "WxH",
                     "Size of the view from which pairs are traced [320x180]");
    commandLine.text("--camera", options->camera, "auto|NAME|NUMBERS",
                     "As for render [the scene's first, else auto]");
    commandLine.text("--lights", options->lights, "N",
                     "Replace the scene's lights by N generated lights [-1: keep them]");
    commandLine.text("--seed", options->seed, "S", "Seed of the generated lights [1]");
    commandLine.text("--repeats", options->repeats, "N",
                     "Number of repetitions; the median is reported [10]");
    commandLine.heading("voxel");
    commandLine.text("--resolution", options->resolution, "N",
                     "Voxels per axis, a power of two [1024]");
    commandLine.text("--nanovdb-limit", options->nanoVdbLimit, "N",
                     "Omit NanoVDB above this resolution, because its grids become large [2048]");
    commandLine.text("--frame-size", options->frameSize, "WxH",
                     "Size of the frame for tracing all pairs [as --size]");
    commandLine.heading("raster");
    commandLine.text("--maps", options->maps, "N", "Draw the maps of this many lights [40]");
    commandLine.text("--face", options->faceTexels, "N",
                     "Texels per side of the largest map's faces [512]");
    commandLine.text("--page-size", options->pageSize, "N",
                     "Texels per side of a page, 16 to 256 [" + options->pageSize + "]");
    options->global.declare(commandLine);
    return [options, &commandLine] { runBench(*options, commandLine); };
}

} // namespace shadowdag
