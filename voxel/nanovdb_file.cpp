// SPDX-License-Identifier: Apache-2.0
// A .nvdb file: segments of a header, a table of grids with their names, then the grids in their
// memory layout, compressed or not. Source: nanovdb/util/IO.h, NanoVDB 32.4.
#include "voxel/nanovdb_file.h"

#include "cuda/error.h"

// The reader below decompresses by itself, because NanoVDB's ignores the results of zlib and Blosc.
#define NANOVDB_USE_BLOSC
#define NANOVDB_USE_ZIP
#include <nanovdb/util/GridChecksum.h>
#include <nanovdb/util/IO.h>

#include <cstring>

namespace shadowdag {
namespace {

/// The largest accepted ratio of unpacked to packed bytes: deflate reaches 1032.
constexpr uint64_t kMaxUnpackRatio = 1100;

/// Memory of whole blocks as NanoVDB's nodes are aligned.
struct alignas(NANOVDB_DATA_ALIGNMENT) Block {
    uint8_t bytes[NANOVDB_DATA_ALIGNMENT];
};

[[noreturn]] void fail(const std::string& name, const std::string& what) {
    throw Error(ErrorKind::kInput, name + ": " + what + "; the file is damaged");
}

/// A grid in a file, not yet unpacked.
struct PackedGrid {
    std::string name;
    nanovdb::io::Codec codec{};
    uint64_t offset = 0, fileBytes = 0, gridBytes = 0;
};

/// Returns the grids of all segments. Throws if they do not fit the file.
std::vector<PackedGrid> listGrids(const std::vector<uint8_t>& bytes, const std::string& name) {
    uint64_t at = 0;
    const auto take = [&](void* to, uint64_t count, const char* what) {
        if (count > bytes.size() - at)
            fail(name, "ends at byte " + std::to_string(bytes.size()) + " inside " + what);
        std::memcpy(to, bytes.data() + at, count);
        at += count;
    };
    std::vector<PackedGrid> grids;
    while (at < bytes.size() || grids.empty()) {
        nanovdb::io::Header header;
        take(&header, sizeof header, "a header");
        if (header.magic != NANOVDB_MAGIC_NUMBER)
            throw Error(ErrorKind::kInput, name + ": is not a .nvdb file or is damaged at byte " +
                                               std::to_string(at - sizeof header) +
                                               "; an OpenVDB file must be named .vdb");
        if (header.version.getMajor() != NANOVDB_MAJOR_VERSION_NUMBER)
            throw Error(ErrorKind::kInput, name + ": has NanoVDB version " +
                                               std::to_string(header.version.getMajor()) +
                                               ", this program reads " +
                                               std::to_string(NANOVDB_MAJOR_VERSION_NUMBER) +
                                               "; convert it through .vdb");
        if (header.codec >= nanovdb::io::Codec::END)
            fail(name, "its packing " + std::to_string(int(header.codec)) + " is unknown");
        if (header.gridCount == 0)
            fail(name, "it has a segment without grids");
        const size_t first = grids.size();
        for (uint32_t i = 0; i < header.gridCount; ++i) {
            nanovdb::io::MetaData meta;
            take(&meta, sizeof meta, "its table of grids");
            std::string gridName(std::min<uint64_t>(meta.nameSize, bytes.size() - at), '\0');
            take(gridName.data(), meta.nameSize, "a grid's name");
            gridName.resize(std::strlen(gridName.c_str()));
            grids.push_back({gridName, header.codec, 0, meta.fileSize, meta.gridSize});
        }
        for (size_t i = first; i < grids.size(); ++i) {
            grids[i].offset = at;
            if (grids[i].fileBytes > bytes.size() - at)
                fail(name, "ends at byte " + std::to_string(bytes.size()) + " inside grid '" +
                               grids[i].name + "'");
            at += grids[i].fileBytes;
        }
    }
    return grids;
}

/// Returns the bytes of a grid as in memory.
std::vector<Block> unpack(const std::vector<uint8_t>& bytes, const PackedGrid& grid,
                          const std::string& name) {
    using nanovdb::io::Codec;
    const uint64_t limit =
        grid.codec == Codec::NONE ? grid.fileBytes : grid.fileBytes * kMaxUnpackRatio;
    if (grid.gridBytes > limit || grid.gridBytes < sizeof(nanovdb::GridData) ||
        (grid.codec == Codec::NONE && grid.gridBytes != grid.fileBytes))
        fail(name, "claims " + std::to_string(grid.gridBytes) + " bytes in " +
                       std::to_string(grid.fileBytes));
    std::vector<Block> blocks((grid.gridBytes + sizeof(Block) - 1) / sizeof(Block));
    uint8_t* to = blocks[0].bytes;
    const uint8_t* from = bytes.data() + grid.offset;
    if (grid.codec == Codec::NONE) {
        std::memcpy(to, from, grid.gridBytes);
        return blocks;
    }
    // Parts, each a length and that many bytes; Blosc's hold a GiB of the grid each, zip's all of
    // it.
    uint64_t left = grid.fileBytes, missing = grid.gridBytes;
    while (missing > 0) {
        uint64_t part = 0;
        if (left >= sizeof part)
            std::memcpy(&part, from, sizeof part);
        if (left < sizeof part || part > left - sizeof part || part > INT32_MAX * 64ull)
            fail(name, "its packed bytes end too early");
        from += sizeof part;
        left -= sizeof part;
        uint64_t got = 0, wanted = missing;
        if (grid.codec == Codec::ZIP) {
            uLongf count = missing;
            if (uncompress(to, &count, from, part) == Z_OK)
                got = count;
        } else {
            wanted = std::min(missing, nanovdb::io::Internal::MAX_SIZE);
            size_t claimed = 0;
            if (blosc_cbuffer_validate(from, part, &claimed) == 0 && claimed == wanted)
                got = uint64_t(std::max(0, blosc_decompress_ctx(from, to, wanted, 1)));
        }
        if (got != wanted)
            fail(name, "its packed bytes do not unpack to " + std::to_string(wanted));
        to += got;
        missing -= got;
        from += part;
        left -= part;
    }
    if (left != 0)
        fail(name, std::to_string(left) + " bytes follow its packed ones");
    return blocks;
}

/// Follows the nodes of a grid and checks each offset first.
template <class BuildT> class NanoWalker {
public:
    using Grid = nanovdb::NanoGrid<BuildT>;
    using Tree = typename Grid::TreeType;
    using Root = typename Tree::RootType;
    using Upper = typename Root::ChildNodeType;
    using Lower = typename Upper::ChildNodeType;
    using Leaf = typename Lower::ChildNodeType;
    using RootData = typename Root::DataType;

    NanoWalker(const uint8_t* data, uint64_t size, const std::string& name)
        : data_(data), size_(size), name_(name) {}

    void addTo(VdbDagBuilder& topology) {
        constexpr uint64_t kTreeAt = sizeof(nanovdb::GridData);
        const auto& tree = *at<nanovdb::TreeData<3>>(kTreeAt, "its tree");
        // The checksum covers grid, tree and root in one piece.
        const uint64_t rootAt = kTreeAt + sizeof tree;
        if (tree.mNodeOffset[3] != sizeof tree)
            fail(name_, "its root does not follow its tree");
        const auto& root = *at<RootData>(rootAt, "its root");
        const uint64_t tilesAt = rootAt + sizeof root;
        if (root.mTableSize > (size_ - tilesAt) / sizeof(typename RootData::Tile))
            fail(name_, "its root claims " + std::to_string(root.mTableSize) + " nodes");
        for (int level = 0; level < 3; ++level) {
            const uint64_t nodeBytes[] = {sizeof(Leaf), sizeof(Lower), sizeof(Upper)};
            left_[level] = tree.mNodeCount[level];
            const uint64_t nodesAt = tree.mNodeOffset[level]; // from the tree, 0: none
            if (left_[level] != 0 &&
                (nodesAt > size_ - kTreeAt || nodesAt % sizeof(Block) != 0 ||
                 left_[level] > (size_ - kTreeAt - nodesAt) / nodeBytes[level]))
                fail(name_, "its tree claims " + std::to_string(left_[level]) + " nodes of level " +
                                std::to_string(level));
        }
        std::vector<uint32_t> uppers(Upper::SIZE), lowers(Lower::SIZE);
        uint64_t voxelCount = 0;
        for (uint32_t i = 0; i < root.mTableSize; ++i) {
            const auto& tile = *root.tile(i);
            const nanovdb::Coord origin = tile.origin();
            // Keys have 21 bits of 2^12 per axis; their sign is lost above bit 32 - 1.
            const glm::ivec3 corner(origin.x(), origin.y(), origin.z());
            if (tile.isChild())
                topology.addToRoot(
                    corner, addUpper(topology, rootAt, tile.child, uppers, lowers, voxelCount));
            else if (tile.isActive()) {
                topology.addToRoot(corner, topology.full(kVdbUpperLevel));
                voxelCount += uint64_t(1) << (3 * kVdbUpperLevel);
            }
        }
        if (left_[0] != 0 || left_[1] != 0 || left_[2] != 0)
            fail(name_, "its tree counts nodes that do not exist");
        if (voxelCount != tree.mVoxelCount)
            fail(name_, "holds " + std::to_string(voxelCount) + " active voxels, its tree states " +
                            std::to_string(tree.mVoxelCount));
        // All nodes were reached, so NanoVDB's own traversal for the checksum is safe as well.
        if (!nanovdb::validateChecksum(*reinterpret_cast<const Grid*>(data_),
                                       nanovdb::ChecksumMode::Full))
            fail(name_, "does not match its checksum");
    }

private:
    template <class T> const T* at(uint64_t offset, const char* what) const {
        if (offset % sizeof(Block) != 0 || offset > size_ || sizeof(T) > size_ - offset)
            fail(name_,
                 std::string("its bytes end before ") + what + " at " + std::to_string(offset));
        return reinterpret_cast<const T*>(data_ + offset);
    }
    /// Returns the offset of the child of a node, counted.
    uint64_t follow(uint64_t node, int64_t child, int level) {
        if (left_[level]-- == 0)
            fail(name_, "holds more nodes than its tree counts");
        return node + uint64_t(child); // a negative offset wraps, and at() checks the sum
    }

    uint32_t addUpper(VdbDagBuilder& topology, uint64_t rootAt, int64_t child,
                      std::vector<uint32_t>& uppers, std::vector<uint32_t>& lowers,
                      uint64_t& voxelCount) {
        const uint64_t upperAt = follow(rootAt, child, 2);
        const auto& upper = *at<typename Upper::DataType>(upperAt, "an upper node");
        for (uint32_t i = 0; i < Upper::SIZE; ++i) {
            uppers[i] = kNoNode;
            if (upper.mChildMask.isOn(i)) {
                uppers[i] = addLower(topology, follow(upperAt, upper.mTable[i].child, 1), lowers,
                                     voxelCount);
            } else if (upper.mValueMask.isOn(i)) {
                uppers[i] = topology.full(kVdbLowerLevel);
                voxelCount += uint64_t(1) << (3 * kVdbLowerLevel);
            }
        }
        return topology.addNode(kVdbUpperLevel, kVdbLowerLevel, uppers);
    }

    uint32_t addLower(VdbDagBuilder& topology, uint64_t lowerAt, std::vector<uint32_t>& lowers,
                      uint64_t& voxelCount) {
        const auto& lower = *at<typename Lower::DataType>(lowerAt, "a lower node");
        for (uint32_t i = 0; i < Lower::SIZE; ++i) {
            lowers[i] = kNoNode;
            if (lower.mChildMask.isOn(i)) {
                const uint64_t leafAt = follow(lowerAt, lower.mTable[i].child, 0);
                const auto& leaf = *at<typename Leaf::DataType>(leafAt, "a leaf");
                VdbLeafMask mask;
                static_assert(sizeof leaf.mValueMask == sizeof mask);
                std::memcpy(mask.data(), &leaf.mValueMask, sizeof mask);
                voxelCount += leaf.mValueMask.countOn();
                lowers[i] = topology.addLeaf(mask);
            } else if (lower.mValueMask.isOn(i)) {
                lowers[i] = topology.full(kVdbLeafLevel);
                voxelCount += uint64_t(1) << (3 * kVdbLeafLevel);
            }
        }
        return topology.addNode(kVdbLowerLevel, kVdbLeafLevel, lowers);
    }

    const uint8_t* data_;
    const uint64_t size_;
    const std::string& name_;
    uint64_t left_[3] = {}; // nodes that may still be met, by level
};

/// Calls walk with the build type of a grid; returns whether the type is supported.
template <class F> bool withBuildType(nanovdb::GridType type, const F& walk) {
    using nanovdb::GridType;
    switch (type) {
    case GridType::Float:
        walk(float());
        return true;
    case GridType::Double:
        walk(double());
        return true;
    case GridType::Int16:
        walk(int16_t());
        return true;
    case GridType::Int32:
        walk(int32_t());
        return true;
    case GridType::Int64:
        walk(int64_t());
        return true;
    case GridType::UInt32:
        walk(uint32_t());
        return true;
    case GridType::Vec3f:
        walk(nanovdb::Vec3f());
        return true;
    case GridType::Vec3d:
        walk(nanovdb::Vec3d());
        return true;
    case GridType::Mask:
        walk(nanovdb::ValueMask());
        return true;
    case GridType::Boolean:
        walk(bool());
        return true;
    case GridType::Fp4:
        walk(nanovdb::Fp4());
        return true;
    case GridType::Fp8:
        walk(nanovdb::Fp8());
        return true;
    case GridType::Fp16:
        walk(nanovdb::Fp16());
        return true;
    default:
        return false;
    }
}

} // namespace

VdbSource readNanoVdb(const std::vector<uint8_t>& bytes, const std::string& name,
                      const std::string& gridName) {
    const std::vector<PackedGrid> grids = listGrids(bytes, name);
    std::vector<std::string> names;
    for (const PackedGrid& grid : grids)
        names.push_back(grid.name);
    const PackedGrid& packed = grids[chooseGrid(names, gridName, name)];
    VdbSource source;
    source.gridName = packed.name;
    const std::string place = name + ": grid '" + packed.name + "'";
    const std::vector<Block> blocks = unpack(bytes, packed, place);
    const uint8_t* data = blocks[0].bytes;
    const auto& grid = *reinterpret_cast<const nanovdb::GridData*>(data);
    if (grid.mMagic != NANOVDB_MAGIC_NUMBER || grid.mGridSize != packed.gridBytes ||
        grid.mVersion.getMajor() != NANOVDB_MAJOR_VERSION_NUMBER || grid.mGridCount != 1 ||
        std::memchr(grid.mGridName, 0, sizeof grid.mGridName) == nullptr)
        fail(place, "its header is not that of a NanoVDB grid of " +
                        std::to_string(packed.gridBytes) + " bytes");
    // The checksum covers the name in the grid, not the one in the table, where long names are cut.
    if (packed.name.size() < sizeof grid.mGridName && packed.name != grid.mGridName)
        fail(place, "its name in the table of grids differs from the grid's own");
    if (grid.mGridType < nanovdb::GridType::End)
        source.gridType = nanovdb::toStr(grid.mGridType);
    if (!withBuildType(grid.mGridType, [&](auto build) {
            NanoWalker<decltype(build)>(data, packed.gridBytes, place).addTo(source.topology);
        }))
        throw Error(ErrorKind::kInput,
                    place + ": is of type " + source.gridType +
                        ", which cannot be imported; a mask, bool, float, double, int, vector, "
                        "Fp4, Fp8 or Fp16 grid can");
    for (int row = 0; row < 3; ++row) {
        source.worldFromIndexOffset[row] = grid.mMap.mVecD[row];
        for (int column = 0; column < 3; ++column)
            source.worldFromIndexLinear[column][row] = grid.mMap.mMatD[3 * row + column];
    }
    // Blind data of this program; other data are ignored.
    const uint64_t metaAt = uint64_t(grid.mBlindMetadataOffset);
    for (uint64_t i = 0; i < grid.mBlindMetadataCount; ++i) {
        using Meta = nanovdb::GridBlindMetaData;
        const uint64_t offset = metaAt + i * sizeof(Meta);
        if (metaAt > packed.gridBytes || metaAt % sizeof(Block) != 0 ||
            (i + 1) * sizeof(Meta) > packed.gridBytes - metaAt)
            fail(place, "its blind data lie outside of it");
        const auto& meta = *reinterpret_cast<const Meta*>(data + offset);
        if (std::strncmp(meta.mName, kNanoTagsName, sizeof meta.mName) != 0)
            continue;
        const uint64_t textAt = offset + uint64_t(meta.mByteOffset);
        if (textAt > packed.gridBytes ||
            meta.mElementCount > (packed.gridBytes - textAt) / sizeof(uint32_t))
            fail(place, "its blind data lie outside of it");
        source.isOurs = true;
        const std::string text(reinterpret_cast<const char*>(data + textAt),
                               meta.mElementCount * sizeof(uint32_t));
        source.tags = unpackTags(text.substr(0, text.find_last_not_of('\0') + 1), place);
    }
    return source;
}

} // namespace shadowdag
