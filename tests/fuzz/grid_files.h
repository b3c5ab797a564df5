// SPDX-License-Identifier: Apache-2.0
// Small exported grids, the seeds of the targets that import them.
#pragma once

#include "tests/fuzz/fuzz_files.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/voxel/voxel_sets.h"
#include "voxel/vdb_file.h"

#include <string>
#include <vector>

namespace shadowdag::fuzz {

/// Returns files of three small assets. @param ending of their format
inline std::vector<std::string> exportedGrids(const std::string& ending) {
    std::vector<std::string> files;
    std::mt19937 random(3);
    for (const auto& [log2, density] : {std::pair<uint32_t, double>{2, 1}, {3, 0.2}, {5, 0.01}}) {
        Asset asset;
        asset.dag = dagOf(randomGrid(log2, density, random));
        asset.provenance = {"scene", "0123", "0.1", ""};
        const std::string path = fuzzFolder().path() + "/seed" + ending;
        writeVdb(asset, path);
        std::ifstream in(path, std::ios::binary);
        files.emplace_back(std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>());
    }
    return files;
}

} // namespace shadowdag::fuzz
