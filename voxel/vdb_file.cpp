// SPDX-License-Identifier: Apache-2.0
// The parts common to both formats: file endings, memory estimates, and the conversion of a grid to
// an asset.
#include "voxel/vdb_file.h"

#include "cuda/error.h"
#include "scenes/input_file.h"
#include "voxel/dag_window.h"
#include "voxel/nanovdb_file.h"
#include "voxel/openvdb_file.h"

#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <new>
#include <thread>

namespace shadowdag {
namespace {

/// Voxel sizes along the axes may differ by this relative amount (less than a hundredth of a voxel
/// at the far end), and by this share of the grid's offset, which other programs add and subtract.
constexpr double kUnevenTolerance = 1e-8, kOffsetTolerance = 4e-16;

constexpr uint64_t kStackBytes = uint64_t(8) << 20; ///< of a thread

bool isNano(const std::string& path) {
    const std::string ending = std::filesystem::path(path).extension();
    if (ending != ".vdb" && ending != ".nvdb")
        throw Error(ErrorKind::kUsage, "'" + path + "': ends in '" + ending +
                                           "'; name a .vdb (OpenVDB) or .nvdb (NanoVDB) file");
    return ending == ".nvdb";
}

/// Throws if a mask grid of the DAG's voxels needs more memory than there is, because the system
/// would kill the process without a message.
void checkMemory(const Dag& dag, const std::string& path, bool nano) {
    const VdbCellCounts counts = countVdbCells(dag);
    // Sizes of OpenVDB 10's nodes with their masks and tables. NanoVDB's grid and its compressed
    // bytes exist at the same time.
    const double bytes =
        (96.0 * double(counts.leafCount) + 33.5 * 1024 * double(counts.lowerCount) +
         265.0 * 1024 * double(counts.upperCount)) *
        (nano ? 3 : 1);
    const double machine = double(sysconf(_SC_PHYS_PAGES)) * double(sysconf(_SC_PAGESIZE));
    if (bytes > machine)
        throw Error(
            ErrorKind::kResource,
            path + ": a grid of " + std::to_string(counts.leafCount) + " leaves takes about " +
                std::to_string(uint64_t(bytes / (1 << 30))) + " GiB of memory, this machine has " +
                std::to_string(uint64_t(machine / (1 << 30))) + "; export a lower resolution");
}

/// Returns the voxel grid whose voxel 0 is the source's index `corner`. Throws for a transform that
/// no voxel grid can have.
VoxelGrid gridOf(const VdbSource& source, const glm::ivec3& corner, uint32_t resolutionLog2,
                 const std::string& name) {
    const glm::dmat3& m = source.worldFromIndexLinear;
    const double size = m[0][0];
    const glm::dvec3 offset = source.worldFromIndexOffset;
    const double tolerance =
        kUnevenTolerance * size +
        kOffsetTolerance * (std::abs(offset.x) + std::abs(offset.y) + std::abs(offset.z));
    bool isEven = source.isLinear && size > 0 && std::isfinite(size);
    for (int column = 0; column < 3; ++column)
        for (int row = 0; row < 3; ++row)
            isEven = isEven && std::abs(m[column][row] - (column == row ? size : 0.0)) <= tolerance;
    if (!isEven || !std::isfinite(offset.x + offset.y + offset.z))
        throw Error(ErrorKind::kInput,
                    name + ": its transform rotates, shears, mirrors or scales unevenly (voxel " +
                        std::to_string(m[0][0]) + " x " + std::to_string(m[1][1]) + " x " +
                        std::to_string(m[2][2]) +
                        "), and a voxel DAG has cubes along the axes; resample the grid");
    VoxelGrid grid;
    grid.resolutionLog2 = resolutionLog2;
    grid.voxelSizeWorld = size;
    grid.originWorld = offset + (glm::dvec3(corner) - 0.5) * size;
    return grid;
}

/// Returns the asset that writeVdb was given, or false if the grid was changed since.
bool takeOurs(VdbSource& source, const std::string& name, VdbAsset& result) {
    Asset asset = assetOf(source.tags, name);
    const VoxelGrid& grid = asset.dag.grid;
    if (!source.topology.empty()) {
        const uint32_t level = std::max(grid.resolutionLog2, kVdbUpperLevel);
        const glm::ivec3 first = source.topology.rootCorner();
        const int64_t last = int64_t(glm::max(first.x, glm::max(first.y, first.z))) +
                             int64_t(source.topology.rootSpan() << kVdbUpperLevel);
        if (first.x < 0 || first.y < 0 || first.z < 0 || last > int64_t(1) << level)
            return false;
        const Dag dag = source.topology.finish(glm::ivec3(0), level, name);
        const VoxelBounds bounds = occupiedBounds(dag);
        if (glm::max(bounds.max.x, glm::max(bounds.max.y, bounds.max.z)) >= grid.resolution())
            return false;
        asset.dag = cutWindow(dag, glm::uvec3(0), grid);
    }
    const VoxelGrid found = gridOf(source, glm::ivec3(0), grid.resolutionLog2, name);
    const glm::dvec3 moved = glm::abs(found.originWorld - grid.originWorld);
    // The rounding error of adding half a voxel and subtracting it again.
    const double slack = 1e-12 * (std::abs(grid.originWorld.x) + std::abs(grid.originWorld.y) +
                                  std::abs(grid.originWorld.z) + grid.voxelSizeWorld);
    if (found.voxelSizeWorld != grid.voxelSizeWorld || moved.x > slack || moved.y > slack ||
        moved.z > slack || tagsOf(asset) != source.tags)
        return false;
    result.asset = std::move(asset);
    return true;
}

void takeForeign(VdbSource& source, const std::string& path, const std::string& name,
                 const VdbReadOptions& options, VdbAsset& result) {
    if (source.topology.empty())
        throw Error(ErrorKind::kInput, name + ": has no active voxel; there is nothing to import");
    const auto tooLarge = [&](uint64_t span) {
        return Error(ErrorKind::kInput, name + ": its active voxels spread over " +
                                            std::to_string(span) +
                                            " indices, more than the 131072 of a voxel DAG; "
                                            "resample or crop the grid");
    };
    const uint64_t rootSpan = source.topology.rootSpan();
    if (rootSpan > uint64_t(1) << (kVdbTopLevel - kVdbUpperLevel))
        throw tooLarge((rootSpan - 1) << kVdbUpperLevel); // at least
    const uint32_t level = kVdbUpperLevel + uint32_t(std::bit_width(rootSpan - 1));
    const glm::ivec3 corner = source.topology.rootCorner();
    const Dag dag = source.topology.finish(corner, level, name);
    const VoxelBounds bounds = occupiedBounds(dag);
    const glm::uvec3 extent = bounds.max - bounds.min + 1u;
    const uint32_t longest = std::max(extent.x, std::max(extent.y, extent.z));
    if (longest > 1u << kMaxResolutionLog2)
        throw tooLarge(longest);
    const uint32_t log2 = std::max(uint32_t(std::bit_width(longest - 1)), kLeafLog2);
    result.isForeign = true;
    result.cornerIndex = corner + glm::ivec3(bounds.min);
    result.asset.dag = cutWindow(dag, bounds.min, gridOf(source, result.cornerIndex, log2, name));
    const auto text = [&](int axis) { return std::to_string(result.cornerIndex[axis]); };
    result.asset.provenance = {
        std::filesystem::path(path).filename().string(), "none", options.programVersion,
        "imported grid '" + source.gridName + "' (" + source.gridType + "); voxel 0 is index (" +
            text(0) + ", " + text(1) + ", " + text(2) + ")"};
}

VdbSource readSource(const std::string& path, const std::string& gridName, bool nano) {
    std::string why;
    if (nano) {
        if (const auto bytes = readInputBytes(path, {~uint64_t(0)}, why))
            return readNanoVdb(*bytes, path, gridName);
    } else if (why = whyNoInput(path, ~uint64_t(0)); why.empty()) {
        if (std::ifstream in = openInput(path))
            return readOpenVdb(in, std::filesystem::file_size(path), path, gridName);
        why = std::string("cannot be opened: ") + std::strerror(errno);
    }
    throw Error(ErrorKind::kInput, path + ": " + why + "; check the name and its permissions");
}

} // namespace

VdbLimits vdbLimits(uint64_t fileBytes, bool isNano) {
    // The program itself with its threads' stacks, and what nodes take that are allocated whole.
    const uint64_t base = (uint64_t(256) << 20) + std::thread::hardware_concurrency() * kStackBytes;
    // .vdb: the values of a node take 96 times its masks (vectors of doubles), which are never
    // compressed; then the DAG. .nvdb: a lower node with one leaf takes 33 KiB and about 100 bytes.
    const uint64_t perByte = isNano ? 600 : 160;
    return {base + perByte * fileBytes, 60 + (fileBytes >> 20) * 20};
}

size_t chooseGrid(const std::vector<std::string>& names, const std::string& asked,
                  const std::string& file) {
    std::string list;
    for (const std::string& name : names)
        list += (list.empty() ? "'" : ", '") + name + "'";
    if (names.empty())
        throw Error(ErrorKind::kInput, file + ": holds no grid");
    if (asked.empty() && names.size() > 1)
        throw Error(ErrorKind::kUsage, file + ": holds " + std::to_string(names.size()) +
                                           " grids; choose one with --grid NAME: " + list);
    const auto found = asked.empty() ? names.begin() : std::find(names.begin(), names.end(), asked);
    if (found == names.end())
        throw Error(ErrorKind::kUsage, file + ": has no grid '" + asked + "'; it has " + list);
    return size_t(found - names.begin());
}

uint64_t writeVdb(const Asset& asset, const std::string& path) {
    const bool nano = isNano(path);
    checkMemory(asset.dag, path, nano);
    try {
        return nano ? writeNanoVdb(asset, path) : writeOpenVdb(asset, path);
    } catch (const std::bad_alloc&) {
        throw Error(ErrorKind::kResource,
                    path + ": not enough memory for the grid; export a lower resolution");
    }
}

void loadVdbReader(const std::string& path) {
    if (!isNano(path))
        loadOpenVdb();
}

VdbAsset readVdb(const std::string& path, const VdbReadOptions& options) {
    const bool nano = isNano(path);
    try {
        VdbSource source = readSource(path, options.gridName, nano);
        const std::string name = path + ": grid '" + source.gridName + "'";
        VdbAsset result;
        result.gridName = source.gridName;
        result.gridType = source.gridType;
        if (!source.isOurs || !takeOurs(source, name, result)) {
            if (source.isOurs && !options.acceptEdited)
                throw Error(ErrorKind::kInput,
                            name + ": its voxels, transform or metadata are not those that were "
                                   "exported: it was damaged, or edited by another program; export "
                                   "it again, or pass --edited to import it as it is now");
            takeForeign(source, path, name, options, result);
        }
        return result;
    } catch (const std::bad_alloc&) {
        throw Error(ErrorKind::kResource, path + ": not enough memory to read it");
    }
}

} // namespace shadowdag
