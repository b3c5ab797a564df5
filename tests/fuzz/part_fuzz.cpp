// SPDX-License-Identifier: Apache-2.0
// Parts of a voxelization (.svpart), with checksums that fit: checked and merged as `merge` does.
#include "scenes/content_hash.h"
#include "tests/fuzz/fuzz_files.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/voxel/soup.h"
#include "voxel/part_file.h"
#include "voxel/voxelize.h"

#include <cstring>

namespace shadowdag::fuzz::part {

namespace {

constexpr size_t kHeaderBytesAt = 12, kSumBytes = 16;

void fuzzOne(const uint8_t* data, size_t size) {
    const PartReader part(fuzzFolder().write("part.svpart", data, size));
    part.verify({});
    for (const Subtree& subtree : part.subtrees())
        fuzzCheck(subtree.address == kNoNode ||
                      subtree.address <
                          part.header().levels[taskLevelOf(part.header().grid)].nodeCount,
                  "subtrees have roots in the level of tasks");
    checkParts({part}, "0.1", {});
    const Dag dag = mergeParts({part});
    fuzzCheck(dag.empty() == (computeDagStats(dag).voxelCount == 0), "an empty DAG has no voxel");
}

std::vector<std::string> seeds() {
    std::vector<std::string> files;
    std::mt19937 random(5);
    for (const auto& [log2, part, count] :
         {std::tuple<uint32_t, uint32_t, uint32_t>{5, 1, 1}, {8, 1, 1}, {9, 2, 3}}) {
        const Soup soup = randomSoup(4, 6, random);
        VoxelGrid grid;
        grid.resolutionLog2 = log2;
        const std::string path = fuzzFolder().path() + "/seed.svpart";
        voxelizePart(soup.view(), soup.all(), grid, {"soup", "0123", "0.1", ""}, part, count, path);
        std::ifstream in(path, std::ios::binary);
        files.emplace_back(std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>());
    }
    return files;
}

std::string pack(const std::string& content) {
    std::string file = content;
    uint32_t headerBytes = 0;
    if (file.size() < kHeaderBytesAt + 4)
        return file;
    std::memcpy(&headerBytes, file.data() + kHeaderBytesAt, 4);
    if (headerBytes < kSumBytes || headerBytes + kSumBytes > file.size())
        return file;
    const auto put = [&](size_t begin, size_t end) {
        const auto sum = contentHash(file.data() + begin, end - begin);
        std::memcpy(file.data() + end, sum.data(), kSumBytes);
    };
    put(0, headerBytes - kSumBytes);
    put(headerBytes, file.size() - kSumBytes);
    return file;
}

[[maybe_unused]] const bool isAdded = addFuzzTarget(
    {.name = "part", .maxBytes = 8192, .fuzzOne = fuzzOne, .seeds = seeds, .pack = pack});

} // namespace

} // namespace shadowdag::fuzz::part
