// SPDX-License-Identifier: Apache-2.0
// `shadowdag merge`: joins the parts of a build into its asset.
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

#include <algorithm>
#include <iostream>
#include <memory>

namespace shadowdag {

namespace {

struct MergeOptions {
    GlobalOptions global;
    std::vector<std::string> parts;
    std::string output, memoryLimit, packing = "compact";
};

void runMerge(const MergeOptions& options, const CommandLine& commandLine) {
    const Console console(options.global.json);
    options.global.apply(console, false, false);
    checkExtension(options.output, {".svdag"}, "assets are .svdag files; use that extension");
    refuseSameFile(options.output, options.parts);
    checkWritable(options.output);
    BuildLimits limits;
    limits.packing = parsePacking(options.packing);
    if (commandLine.given("--memory-limit"))
        limits.memoryBytes = parseMemoryLimit(options.memoryLimit);

    const Progress progress = console.progress("merge");
    BuildMeter meter;
    std::vector<PartReader> parts;
    for (const std::string& path : options.parts)
        parts.emplace_back(path);
    checkParts(parts, partVersion(), progress);
    std::sort(parts.begin(), parts.end(), [](const PartReader& a, const PartReader& b) {
        return a.header().part < b.header().part;
    });
    AssetProvenance provenance = parts.front().header().provenance;
    const VoxelGrid grid = parts.front().header().grid;
    const PartHeader own{grid, provenance, 1, 1, 0, 0, {}, {}}; // of a voxelize of the same asset
    provenance.programVersion = programVersion();
    std::unique_ptr<ScratchFolder> folder;
    CountedDag merged;
    if (limits.memoryBytes == 0) {
        if (const std::string why = removeAbandonedScratch(options.output, own); !why.empty())
            console.note("warning: " + why);
        merged.dag = mergeParts(parts, progress);
        merged.stats = computeDagStats(merged.dag);
    } else {
        folder = std::make_unique<ScratchFolder>(options.output, false, &own);
        merged = mergePartsLimited(parts, *folder, limits, progress);
    }
    meter.stop();
    checkInterrupted();
    const Asset asset{std::move(merged.dag), provenance};
    const uint64_t bytes = writeAsset(asset, options.output, limits.packing);

    Json json = {{"output", options.output}, {"part_count", parts.size()}};
    json.update(assetJson(merged.stats, grid, provenance, bytes));
    console.people() << options.output << "\n";
    printAsset(console.people(), json);
    meter.report(console, json);
    console.emit(json);
}

} // namespace

std::function<void()> declareMerge(CommandLine& commandLine) {
    auto options = std::make_shared<MergeOptions>();
    commandLine.texts("PART", options->parts, "",
                      "The .svpart files of one build, each part once, in any order", true);
    commandLine.text("-o,--output", options->output, "F.svdag", "The asset to write", true);
    commandLine.text("--packing", options->packing, "fast|compact", kPackingHelp);
    commandLine.text("--memory-limit", options->memoryLimit, "BYTES",
                     "Limit the memory of the process, as in 4G; uses scratch files in "
                     "F.svdag.scratch; slower [no limit]");
    options->global.declare(commandLine);
    return [options, &commandLine] { runMerge(*options, commandLine); };
}

} // namespace shadowdag
