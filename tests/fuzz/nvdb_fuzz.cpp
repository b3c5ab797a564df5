// SPDX-License-Identifier: Apache-2.0
// NanoVDB's files, whose grids mutations change unpacked, without their checksum. Source:
// nanovdb/util/IO.h, NanoVDB 32.4.
#include "tests/fuzz/grid_files.h"
#include "voxel/nanovdb_file.h"

#include <zlib.h>

#include <cstring>

namespace shadowdag::fuzz::nvdb {

namespace {

/// A header (16 bytes), the description of one grid and its name; then a length and that many
/// packed bytes.
constexpr size_t kHeaderBytes = 16, kGridBytesAt = 16, kFileBytesAt = 24, kNameBytesAt = 152,
                 kMetaBytes = 176, kGridSumAt = 8, kGridSizeAt = 32, kMostGridBytes = 1u << 20;

size_t gridAt(const std::string& file) {
    uint32_t nameBytes = 0;
    if (file.size() < kHeaderBytes + kMetaBytes)
        return file.size();
    std::memcpy(&nameBytes, file.data() + kNameBytesAt, 4);
    return std::min<size_t>(file.size(), kHeaderBytes + kMetaBytes + nameBytes);
}

void fuzzOne(const uint8_t* data, size_t size) {
    readVdb(fuzzFolder().write("grid.nvdb", data, size), {"", true, "0.1"});
}

std::vector<std::string> seeds() {
    return exportedGrids(".nvdb");
}

/// Returns the bytes before the grid, their count, and the grid unpacked; the input itself if it
/// has another form.
std::string unpack(const std::string& input) {
    const size_t at = gridAt(input);
    uint64_t gridBytes = 0;
    if (at + 8 >= input.size())
        return input;
    std::memcpy(&gridBytes, input.data() + kGridBytesAt, 8);
    std::string content = input.substr(0, at);
    content.resize(at + std::min<uint64_t>(gridBytes, kMostGridBytes));
    uLongf count = content.size() - at;
    if (uncompress(reinterpret_cast<Bytef*>(content.data()) + at, &count,
                   reinterpret_cast<const Bytef*>(input.data()) + at + 8,
                   input.size() - at - 8) != Z_OK)
        return input;
    content.resize(at + count);
    return content;
}

std::string pack(const std::string& content) {
    const size_t at = gridAt(content);
    if (content.size() < at + kGridSizeAt + 8)
        return content;
    std::string grid = content.substr(at);
    const uint64_t gridBytes = grid.size(), noSum = ~uint64_t(0);
    std::memcpy(grid.data() + kGridSizeAt, &gridBytes, 8);
    std::memcpy(grid.data() + kGridSumAt, &noSum, 8);
    std::string file = content.substr(0, at);
    std::string packed(compressBound(grid.size()), '\0');
    uLongf count = packed.size();
    compress2(reinterpret_cast<Bytef*>(packed.data()), &count,
              reinterpret_cast<const Bytef*>(grid.data()), grid.size(), 1);
    const uint64_t packedBytes = count, fileBytes = count + 8;
    std::memcpy(file.data() + kGridBytesAt, &gridBytes, 8);
    std::memcpy(file.data() + kFileBytesAt, &fileBytes, 8);
    return file + std::string(reinterpret_cast<const char*>(&packedBytes), 8) +
           packed.substr(0, count);
}

// A packed byte may hold a thousand of the grid's; a grid of two nodes has 300 KiB.
[[maybe_unused]] const bool isAdded = addFuzzTarget({.name = "nvdb",
                                                     .maxBytes = 16384,
                                                     .fuzzOne = fuzzOne,
                                                     .seeds = seeds,
                                                     .unpack = unpack,
                                                     .pack = pack,
                                                     .replayCount = 500});

} // namespace

} // namespace shadowdag::fuzz::nvdb
