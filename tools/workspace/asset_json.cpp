// SPDX-License-Identifier: Apache-2.0
#include "tools/workspace/asset_json.h"

#include "cuda/error.h"
#include "tools/settings/parse.h"

#include <nlohmann/json.hpp>

#include <cstdio>
#include <numeric>
#include <ostream>

namespace shadowdag {

Json assetJson(const Asset& asset, uint64_t fileBytes) {
    return assetJson(computeDagStats(asset.dag), asset.dag.grid, asset.provenance, fileBytes);
}

Json assetJson(const DagStats& stats, const VoxelGrid& grid, const AssetProvenance& provenance,
               uint64_t fileBytes) {
    const auto sum = [](const std::vector<uint64_t>& counts) {
        return std::accumulate(counts.begin(), counts.end(), uint64_t(0));
    };
    const uint64_t nodes = sum(stats.nodeCounts), svoNodes = sum(stats.svoNodeCounts);
    const double voxels = double(stats.voxelCount);
    const glm::dvec3 origin = grid.originWorld;
    return {{"resolution", grid.resolution()},
            {"voxel_count", stats.voxelCount},
            {"node_counts", stats.nodeCounts},
            {"svo_node_counts", stats.svoNodeCounts},
            {"leaf_count", stats.leafCount},
            {"asset_bytes", fileBytes},
            {"traced_bytes", stats.tracedBytes},
            {"asset_bits_per_voxel", voxels > 0 ? 8.0 * double(fileBytes) / voxels : 0.0},
            {"traced_bits_per_voxel", voxels > 0 ? 8.0 * double(stats.tracedBytes) / voxels : 0.0},
            {"merge_ratio", nodes > 0 ? double(svoNodes) / double(nodes) : 0.0},
            {"voxel_size_world", grid.voxelSizeWorld},
            {"origin_world", {origin.x, origin.y, origin.z}},
            {"provenance",
             {{"scene", provenance.sceneName},
              {"scene_hash", provenance.sceneHash},
              {"program_version", provenance.programVersion},
              {"options", provenance.options}}}};
}

AssetPacking parsePacking(const std::string& text) {
    if (text == "fast")
        return AssetPacking::kFast;
    if (text == "compact")
        return AssetPacking::kCompact;
    throw Error(ErrorKind::kUsage, "--packing '" + text + "': must be fast or compact");
}

void printAsset(std::ostream& out, const Json& json) {
    char line[160];
    const auto row = [&](const char* name, const std::string& text) {
        std::snprintf(line, sizeof line, "  %-15s %s\n", name, text.c_str());
        out << line;
    };
    const auto fixed = [](double value) {
        char buffer[32];
        std::snprintf(buffer, sizeof buffer, "%.3f", value);
        return std::string(buffer);
    };
    const std::string resolution = std::to_string(json["resolution"].get<uint64_t>());
    row("resolution",
        resolution + "^3, voxel " + numberText(json["voxel_size_world"].get<double>()) + " m");
    row("voxels", std::to_string(json["voxel_count"].get<uint64_t>()));
    row("file", bytesText(json["asset_bytes"].get<double>()) + ", " +
                    fixed(json["asset_bits_per_voxel"].get<double>()) + " bits per voxel");
    row("traced", bytesText(json["traced_bytes"].get<double>()) + ", " +
                      fixed(json["traced_bits_per_voxel"].get<double>()) + " bits per voxel");
    row("4^3 leaves", std::to_string(json["leaf_count"].get<uint64_t>()));
    row("merging", "1 node for " + fixed(json["merge_ratio"].get<double>()) + " of the octree");
    std::snprintf(line, sizeof line, "  %-15s %14s %14s\n", "level", "nodes", "octree nodes");
    out << line;
    const Json &nodes = json["node_counts"], &svo = json["svo_node_counts"];
    for (size_t level = 0; level < nodes.size(); ++level) {
        std::snprintf(
            line, sizeof line, "  %-15zu %14llu %14llu\n", level,
            static_cast<unsigned long long>(nodes[level].get<uint64_t>()),
            static_cast<unsigned long long>(level < svo.size() ? svo[level].get<uint64_t>() : 0));
        out << line;
    }
    const Json& provenance = json["provenance"];
    row("scene", provenance["scene"].get<std::string>() + " (hash " +
                     provenance["scene_hash"].get<std::string>() + ")");
    row("program", provenance["program_version"].get<std::string>());
}

} // namespace shadowdag
