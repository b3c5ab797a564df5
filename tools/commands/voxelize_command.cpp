// SPDX-License-Identifier: Apache-2.0
// `shadowdag voxelize`: builds the asset of a scene, or a part of it.
#include "tools/commands/commands.h"
#include "tools/settings/common_options.h"
#include "tools/settings/parse.h"
#include "tools/settings/provenance.h"
#include "tools/workspace/asset_json.h"
#include "tools/workspace/build_meter.h"
#include "tools/workspace/scene_setup.h"
#include "voxel/limited_build.h"
#include "voxel/voxelize.h"

#include <nlohmann/json.hpp>

#include <filesystem>
#include <iostream>
#include <memory>

namespace shadowdag {

namespace {

struct VoxelizeOptions {
    GlobalOptions global;
    std::string scene, output, resolution = "1024", part, memoryLimit, checkpoint = "60",
                               packing = "compact";
    bool resume = false;
    bool isPart = false; ///< --part was given, even with an empty text
};

/// Builds in memory, or with a scratch folder if --memory-limit or --resume is given.
CountedDag buildDag(const TriangleView& triangles, View<const uint32_t> which,
                    const VoxelGrid& grid, const AssetProvenance& provenance,
                    const ScratchFolder* folder, const BuildLimits& limits,
                    const Progress& progress, Backend backend) {
    if (folder)
        return voxelizeLimited(triangles, which, grid, provenance, *folder, limits, progress);
    CountedDag result{voxelize(triangles, which, grid, progress, backend), {}};
    result.stats = computeDagStats(result.dag);
    return result;
}

Json partJson(const PartHeader& header, uint64_t fileBytes) {
    uint64_t nodes = 0, leaves = header.levels[kLeafLog2].nodeCount;
    for (const LevelCounts& level : header.levels)
        nodes += level.nodeCount;
    return {{"resolution", header.grid.resolution()},
            {"part", header.part},
            {"part_count", header.partCount},
            {"task_count", header.subtreeCount},
            {"task_count_of_all", header.taskCount},
            {"voxel_count", header.counts.voxelCount},
            {"unique_node_count", nodes},
            {"leaf_count", leaves},
            {"part_bytes", fileBytes},
            {"provenance",
             {{"scene", header.provenance.sceneName},
              {"scene_hash", header.provenance.sceneHash},
              {"program_version", header.provenance.programVersion},
              {"options", header.provenance.options}}}};
}

void runVoxelize(VoxelizeOptions options, const CommandLine& commandLine) {
    const Console console(options.global.json);
    for (const char* option : {"--part", "--memory-limit", "--resume"})
        if (options.global.backend == "cuda" && commandLine.given(option))
            throw Error(ErrorKind::kUsage, std::string(option) +
                                               " and --backend cuda contradict each other: the "
                                               "device builds whole assets, cell by cell where "
                                               "its memory is short; drop one of them");
    const Backend backend = options.global.apply(console, false, false);
    const uint32_t log2 = parsePowerOfTwo("--resolution", options.resolution, 4, 131072);
    options.isPart = commandLine.given("--part");
    const auto [part, partCount] =
        options.isPart ? parseShare("--part", options.part, kMaxPartCount) : std::pair(1u, 1u);
    checkExtension(options.output, {options.isPart ? ".svpart" : ".svdag"},
                   options.isPart
                       ? "with --part, the output is an .svpart file, which merge joins to "
                         "an .svdag; use that extension"
                       : "assets are .svdag files; use that extension");
    refuseSameFile(options.output, {options.scene});
    checkWritable(options.output);

    BuildLimits limits;
    limits.checkpointSeconds = parseNumber("--checkpoint", options.checkpoint, 0, 1e6);
    limits.packing = parsePacking(options.packing);
    if (options.isPart && commandLine.given("--packing"))
        throw Error(ErrorKind::kUsage,
                    "--packing is for an asset, and --part writes none; use it with merge");
    if (commandLine.given("--memory-limit"))
        limits.memoryBytes = parseMemoryLimit(options.memoryLimit);
    const bool isOnDisk = limits.memoryBytes != 0 || options.resume;
    if (!isOnDisk && commandLine.given("--checkpoint"))
        throw Error(ErrorKind::kUsage, "--checkpoint is for --resume and --memory-limit, without "
                                       "which nothing is kept on disk; give one or drop it");

    const LoadedScene scene = loadSceneAndWorld(options.scene, -1, 1, false, console);
    const AssetProvenance provenance = assetProvenance(scene);
    AssetProvenance ofParts = provenance;
    ofParts.programVersion = partVersion();
    const VoxelGrid grid = sceneGrid(*scene.world, log2);
    // The folder is taken before the work, so that an earlier build's files are not overwritten
    // unless requested.
    const PartHeader own{grid, ofParts, part, partCount, 0, 0, {}, {}};
    std::unique_ptr<ScratchFolder> folder;
    if (isOnDisk)
        folder = std::make_unique<ScratchFolder>(options.output, options.resume, &own);
    else if (const std::string why = removeAbandonedScratch(options.output, own); !why.empty())
        console.note("warning: " + why);
    const TriangleView triangles = scene.world->triangles();
    const View<const uint32_t> which = viewOf(scene.world->staticTriangles());
    const Progress progress = console.progress("voxelize " + scene.name);
    BuildMeter meter;
    Json json = {{"output", options.output}};
    if (options.isPart) {
        const PartHeader header =
            folder ? voxelizePartLimited(triangles, which, grid, ofParts, part, partCount,
                                         options.output, *folder, limits, progress)
                   : voxelizePart(triangles, which, grid, ofParts, part, partCount, options.output,
                                  progress);
        meter.stop();
        json.update(partJson(header, std::filesystem::file_size(options.output)));
        console.people() << options.output << "\n  part " << part << " of " << partCount << ", "
                         << header.subtreeCount << " of " << header.taskCount << " tasks, "
                         << header.counts.voxelCount << " voxels\n";
    } else {
        CountedDag built =
            buildDag(triangles, which, grid, ofParts, folder.get(), limits, progress, backend);
        meter.stop();
        checkInterrupted();
        const Asset asset{std::move(built.dag), provenance};
        const uint64_t bytes = writeAsset(asset, options.output, limits.packing);
        json.update(assetJson(built.stats, grid, provenance, bytes));
        console.people() << options.output << "\n";
        printAsset(console.people(), json);
    }
    meter.report(console, json);
    console.emit(json);
}

} // namespace

std::function<void()> declareVoxelize(CommandLine& commandLine) {
    auto options = std::make_shared<VoxelizeOptions>();
    commandLine.text("SCENE", options->scene, "", kSceneHelp, true);
    commandLine.text("-o,--output", options->output, "F.svdag",
                     "The asset to write, or with --part the .svpart file", true);
    commandLine.text(
        "--resolution", options->resolution, "N",
        "Voxels per axis, a power of two from 4 to 131072; the grid is a cube around the static "
        "geometry, as long as its longest side [1024]");
    commandLine.text("--packing", options->packing, "fast|compact", kPackingHelp);
    commandLine.text(
        "--part", options->part, "K/N",
        "Build only part K of N; parts may be built on different machines. shadowdag merge "
        "joins all N into the same asset that a single build makes");
    commandLine.text("--memory-limit", options->memoryLimit, "BYTES",
                     "Limit the memory of the process, as in 4G: finished subtrees are written to "
                     "F.svdag.scratch, which is removed at the end; slower [no limit]");
    commandLine.flag(
        "--resume", options->resume,
        "Continue an interrupted build from F.svdag.scratch, and keep that folder if this "
        "build is interrupted");
    commandLine.text(
        "--checkpoint", options->checkpoint, "SECONDS",
        "With --resume or --memory-limit: how often finished work is written to disk [60]");
    options->global.declare(commandLine);
    return [options, &commandLine] { runVoxelize(*options, commandLine); };
}

} // namespace shadowdag
