// SPDX-License-Identifier: Apache-2.0
// Voxel assets (.svdag) of both packings, with checksums that fit.
#include "scenes/content_hash.h"
#include "tests/fuzz/fuzz_files.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/voxel/voxel_sets.h"
#include "voxel/asset.h"

#include <cstring>

namespace shadowdag::fuzz::asset {

namespace {

/// Offsets of a header's fields, and where its texts begin (asset.cpp).
constexpr size_t kPayloadBytesAt = 84, kPayloadSumAt = 92, kTextsAt = 108;

void fuzzOne(const uint8_t* data, size_t size) {
    const Asset asset = parseAsset({data, data + size}, "asset");
    const DagStats stats = computeDagStats(asset.dag);
    fuzzCheck(asset.dag.empty() == (stats.voxelCount == 0), "an empty DAG has no voxel");
}

std::vector<std::string> seeds() {
    std::vector<std::string> files;
    std::mt19937 random(7);
    for (const AssetPacking packing : {AssetPacking::kCompact, AssetPacking::kFast})
        for (const auto& [log2, density] :
             {std::pair<uint32_t, double>{0, 1}, {2, 0.3}, {4, 0.1}}) {
            Asset asset;
            asset.dag = dagOf(randomGrid(log2, density, random));
            asset.provenance = {"scene", "0123", "0.1", ""};
            const std::string path = fuzzFolder().path() + "/seed.svdag";
            writeAsset(asset, path, packing);
            std::ifstream in(path, std::ios::binary);
            files.emplace_back(std::istreambuf_iterator<char>(in),
                               std::istreambuf_iterator<char>());
        }
    return files;
}

std::string pack(const std::string& content) {
    std::string file = content;
    size_t at = kTextsAt;
    for (int text = 0; text < 4; ++text) {
        uint32_t length = 0;
        if (at + 4 > file.size())
            return file;
        std::memcpy(&length, file.data() + at, 4);
        at += size_t(4) + length;
    }
    if (at + 16 > file.size())
        return file;
    const uint64_t payloadBytes = file.size() - at - 16;
    std::memcpy(file.data() + kPayloadBytesAt, &payloadBytes, 8);
    const auto payloadSum = contentHash(file.data() + at + 16, payloadBytes);
    std::memcpy(file.data() + kPayloadSumAt, payloadSum.data(), 16);
    const auto headerSum = contentHash(file.data(), at);
    std::memcpy(file.data() + at, headerSum.data(), 16);
    return file;
}

[[maybe_unused]] const bool isAdded = addFuzzTarget(
    {.name = "asset", .maxBytes = 4096, .fuzzOne = fuzzOne, .seeds = seeds, .pack = pack});

} // namespace

} // namespace shadowdag::fuzz::asset
