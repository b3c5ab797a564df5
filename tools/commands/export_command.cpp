// SPDX-License-Identifier: Apache-2.0
// `shadowdag export`: writes an asset as an OpenVDB or NanoVDB grid.
#include "tools/commands/commands.h"
#include "tools/settings/common_options.h"
#include "tools/settings/parse.h"
#include "tools/workspace/scene_setup.h"
#include "voxel/vdb_file.h"

#include <nlohmann/json.hpp>

#include <chrono>
#include <filesystem>
#include <iostream>
#include <memory>

namespace shadowdag {

namespace {

struct ExportOptions {
    GlobalOptions global;
    std::string input, output;
};

void runExport(const ExportOptions& options) {
    const Console console(options.global.json);
    options.global.apply(console, false, false);
    checkExtension(options.output, {".vdb", ".nvdb"},
                   "grids are .vdb (OpenVDB) or .nvdb (NanoVDB) files; use one of these "
                   "extensions");
    if (std::filesystem::path(options.input).extension() != ".svdag")
        throw Error(ErrorKind::kUsage,
                    "'" + options.input +
                        "': assets are .svdag files; shadowdag voxelize builds one from a scene");
    refuseSameFile(options.output, {options.input});
    checkWritable(options.output);
    const Asset asset = readAsset(options.input);
    const auto start = std::chrono::steady_clock::now();
    const uint64_t bytes = writeVdb(asset, options.output);
    const double wall =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    const uint64_t voxelCount = computeDagStats(asset.dag).voxelCount;
    console.people() << options.output << ": grid '" << asset.provenance.sceneName << "', "
                     << voxelCount << " voxels, " << bytesText(double(bytes)) << "\n";
    console.emit({{"output", options.output},
                  {"grid", asset.provenance.sceneName},
                  {"resolution", asset.dag.grid.resolution()},
                  {"voxel_count", voxelCount},
                  {"file_bytes", bytes},
                  {"wall_s", wall}});
}

} // namespace

std::function<void()> declareExport(CommandLine& commandLine) {
    auto options = std::make_shared<ExportOptions>();
    commandLine.text("F.svdag", options->input, "", "The asset to export", true);
    commandLine.text(
        "-o,--output", options->output, "F.vdb|F.nvdb",
        "The file to write, OpenVDB or NanoVDB by its extension: a mask grid whose active "
        "voxels are the occupied ones; import restores the same asset",
        true);
    options->global.declare(commandLine);
    return [options] { runExport(*options); };
}

} // namespace shadowdag
