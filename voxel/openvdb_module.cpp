// SPDX-License-Identifier: Apache-2.0
// The only file with OpenVDB in it, and all of the module sdag_openvdb: what its headers
// instantiate costs 20 s to compile.
#include "voxel/openvdb_module.h"

#include "cuda/error.h"
#include "cuda/thread_refusal.h"
#include "voxel/nanovdb_file.h"

// NanoVDB compresses with these if they are defined.
#define NANOVDB_USE_ZIP
#include <nanovdb/util/GridChecksum.h>
#include <nanovdb/util/IO.h>
#include <nanovdb/util/OpenToNanoVDB.h>
#include <openvdb/openvdb.h>

#include <bit>
#include <cstdio>
#include <cstring>
#include <istream>
#include <ostream>

namespace shadowdag {
namespace {

using openvdb::MaskGrid;
using Leaf = MaskGrid::TreeType::LeafNodeType;
using LeafBits = Leaf::NodeMaskType;

constexpr const char* kCreator = "shadowdag";
/// The grid types whose content is their active voxels; a point grid's content is its points.
using ReadableGrids = openvdb::TypeList<openvdb::MaskGrid, openvdb::BoolGrid, openvdb::FloatGrid,
                                        openvdb::DoubleGrid, openvdb::Int32Grid, openvdb::Int64Grid,
                                        openvdb::Vec3SGrid, openvdb::Vec3DGrid, openvdb::Vec3IGrid>;

Error tooSmall(double voxelSizeWorld, const std::string& path) {
    char size[32];
    std::snprintf(size, sizeof size, "%g", voxelSizeWorld);
    return Error(ErrorKind::kInput, path + ": a grid's transform cannot hold voxels of " +
                                        std::string(size) + " m; scale the scene");
}

/// Throws Error kInput for voxels too small for OpenVDB's transforms.
MaskGrid::Ptr maskGridOf(const Asset& asset, const std::string& path) {
    MaskGrid::Ptr grid = MaskGrid::create();
    auto accessor = grid->getAccessor();
    const auto coord = [](const glm::uvec3& p) {
        return openvdb::Coord(int(p.x), int(p.y), int(p.z));
    };
    forEachVdbCell(
        asset.dag,
        [&](const glm::uvec3& corner, const VdbLeafMask& mask) {
            LeafBits bits;
            static_assert(std::is_same_v<LeafBits::Word, uint64_t> && LeafBits::WORD_COUNT == 8);
            for (openvdb::Index x = 0; x < 8; ++x)
                bits.getWord<uint64_t>(x) = mask[x];
            auto* leaf = new Leaf(coord(corner), false, false);
            leaf->setValueMask(bits);
            accessor.addLeaf(leaf); // which takes it over
        },
        [&](const glm::uvec3& corner, uint32_t level) {
            // OpenVDB counts levels of nodes: a tile of a lower node has the size of a leaf.
            const openvdb::Index treeLevel = level == kVdbLeafLevel    ? 1
                                             : level == kVdbLowerLevel ? 2
                                                                       : 3;
            accessor.addTile(treeLevel, coord(corner), true, true);
        });
    const VoxelGrid& voxels = asset.dag.grid;
    const glm::dvec3 centre = voxels.worldFromVoxel(glm::dvec3(0.5));
    // Of a map with an offset, Transform's own constructor rounds the scale.
    try {
        grid->setTransform(openvdb::math::Transform::createLinearTransform(voxels.voxelSizeWorld));
        grid->transform().postTranslate(openvdb::Vec3d(centre.x, centre.y, centre.z));
    } catch (const openvdb::ArithmeticError&) {
        throw tooSmall(voxels.voxelSizeWorld, path);
    }
    grid->setName(asset.provenance.sceneName);
    grid->setCreator(kCreator);
    return grid;
}

/// The writer of an archive to our own stream, which throws when the disk is full.
class Writer : public openvdb::io::Archive {
public:
    /// @param tag 32 hex digits that stand for the content, in place of OpenVDB's random ones
    void write(std::ostream& out, const openvdb::GridBase::Ptr& grid, const std::string& tag) {
        Archive::write(out, openvdb::GridCPtrVec{grid}, true);
        // 8 bytes of magic, three versions of 4, a flag, then 36 characters.
        constexpr std::streamoff kUuidOffset = 8 + 3 * 4 + 1;
        out.seekp(kUuidOffset);
        out << tag.substr(0, 8) << '-' << tag.substr(8, 4) << '-' << tag.substr(12, 4) << '-'
            << tag.substr(16, 4) << '-' << tag.substr(20, 12);
    }
};

/// Adds the nodes of an OpenVDB tree.
template <class Tree> void addTree(const Tree& tree, VdbDagBuilder& topology) {
    using Upper = typename Tree::RootNodeType::ChildNodeType;
    using Lower = typename Upper::ChildNodeType;
    const auto cornerOf = [](const openvdb::Coord& c) { return glm::ivec3(c.x(), c.y(), c.z()); };
    std::vector<uint32_t> uppers(Upper::NUM_VALUES), lowers(Lower::NUM_VALUES);
    const auto addLower = [&](const Lower& node) {
        for (openvdb::Index i = 0; i < Lower::NUM_VALUES; ++i)
            lowers[i] = node.isValueMaskOn(i) ? topology.full(kVdbLeafLevel) : kNoNode;
        for (auto child = node.cbeginChildOn(); child; ++child) {
            VdbLeafMask mask;
            for (openvdb::Index x = 0; x < 8; ++x)
                mask[x] = child->getValueMask().template getWord<uint64_t>(x);
            lowers[child.pos()] = topology.addLeaf(mask);
        }
        return topology.addNode(kVdbLowerLevel, kVdbLeafLevel, lowers);
    };
    for (auto tile = tree.root().cbeginValueOn(); tile; ++tile)
        topology.addToRoot(cornerOf(tile.getCoord()), topology.full(kVdbUpperLevel));
    for (auto node = tree.root().cbeginChildOn(); node; ++node) {
        for (openvdb::Index i = 0; i < Upper::NUM_VALUES; ++i)
            uppers[i] = node->isValueMaskOn(i) ? topology.full(kVdbLowerLevel) : kNoNode;
        for (auto child = node->cbeginChildOn(); child; ++child)
            uppers[child.pos()] = addLower(*child);
        topology.addToRoot(cornerOf(node.getCoord()),
                           topology.addNode(kVdbUpperLevel, kVdbLowerLevel, uppers));
    }
}

/// The reader of an archive from our own stream, which throws at the end of the file. OpenVDB's own
/// stream continues with stale buffers.
class Reader : public openvdb::io::Archive {
public:
    openvdb::GridBase::Ptr read(std::istream& in, uint64_t byteCount, const std::string& name,
                                const std::string& gridName) {
        readHeader(in);
        openvdb::io::setStreamMetadataPtr(in, metadata_, /*transfer=*/false);
        setFormatVersion(in);
        setLibraryVersion(in);
        setDataCompression(in);
        openvdb::MetaMap().readMeta(in);
        const int32_t count = readGridCount(in);
        std::vector<std::string> names;
        std::vector<openvdb::io::GridDescriptor> descriptors;
        std::vector<openvdb::GridBase::Ptr> grids;
        for (int32_t i = 0; i < count; ++i) {
            openvdb::io::GridDescriptor descriptor;
            grids.push_back(descriptor.read(in));
            // Grids without offsets follow each other and must be read to be skipped.
            if (!inputHasGridOffsets()) {
                Archive::readGrid(grids.back(), descriptor, in);
            } else {
                const int64_t next = descriptor.getEndPos();
                if (next <= in.tellg() || uint64_t(next) > byteCount)
                    throw Error(ErrorKind::kInput, name + ": its grid " + std::to_string(i) +
                                                       " ends at byte " + std::to_string(next) +
                                                       " of " + std::to_string(byteCount) +
                                                       "; the file is damaged");
                in.seekg(next);
            }
            names.push_back(openvdb::io::GridDescriptor::nameAsString(descriptor.uniqueName()));
            descriptors.push_back(descriptor);
        }
        const size_t chosen = chooseGrid(names, gridName, name);
        if (inputHasGridOffsets())
            readAt(in, descriptors[chosen], grids[chosen]);
        if (descriptors[chosen].isInstance())
            for (size_t i = 0; i < grids.size(); ++i)
                if (descriptors[i].uniqueName() == descriptors[chosen].instanceParentName()) {
                    if (grids[i]->type() != grids[chosen]->type())
                        throw Error(ErrorKind::kInput, name + ": its grid '" + names[chosen] +
                                                           "' shares a tree of another type");
                    if (inputHasGridOffsets())
                        readAt(in, descriptors[i], grids[i]);
                    grids[chosen]->setTree(grids[i]->baseTreePtr());
                }
        name_ = names[chosen];
        return grids[chosen];
    }

    /// Returns the name of the grid that was read, in the user's spelling.
    const std::string& gridName() const { return name_; }

private:
    static void readAt(std::istream& in, const openvdb::io::GridDescriptor& descriptor,
                       const openvdb::GridBase::Ptr& grid) {
        if (!grid->apply<ReadableGrids>([](auto&) {}))
            return; // readOpenVdb reports it; points are a separate format
        descriptor.seekToGrid(in);
        Archive::readGrid(grid, descriptor, in);
    }
    std::string name_;
    /// The part of the stream's interface that OpenVDB's nodes use while they are read.
    openvdb::SharedPtr<openvdb::io::StreamMetadata> metadata_{new openvdb::io::StreamMetadata};
};

/// Returns the image of index 0 and of the axes, without the rounding of a matrix if there is none.
void takeTransform(const openvdb::math::MapBase& map, VdbSource& source) {
    using namespace openvdb::math;
    const auto toGlm = [](const openvdb::Vec3d& v) { return glm::dvec3(v.x(), v.y(), v.z()); };
    glm::dmat3& linear = source.worldFromIndexLinear;
    source.isLinear = map.isLinear();
    if (const auto* placed = dynamic_cast<const ScaleTranslateMap*>(&map)) {
        for (int axis = 0; axis < 3; ++axis)
            linear[axis][axis] = placed->getScale()[axis];
        source.worldFromIndexOffset = toGlm(placed->getTranslation());
    } else if (const auto* scaled = dynamic_cast<const ScaleMap*>(&map)) {
        for (int axis = 0; axis < 3; ++axis)
            linear[axis][axis] = scaled->getScale()[axis];
    } else if (source.isLinear) {
        const Mat4d m = map.getAffineMap()->getMat4();
        for (int row = 0; row < 3; ++row) // of OpenVDB's row vectors: our columns
            linear[row] = {m[row][0], m[row][1], m[row][2]};
        source.worldFromIndexOffset = {m[3][0], m[3][1], m[3][2]};
    }
}

/// Returns the data of a grid that readVdb needs.
VdbSource sourceOf(const openvdb::GridBase& grid, const std::string& gridName,
                   const std::string& name) {
    VdbSource source;
    source.gridName = gridName;
    source.gridType = grid.type();
    const std::string place = name + ": grid '" + gridName + "'";
    if (!grid.apply<ReadableGrids>(
            [&](const auto& typed) { addTree(typed.tree(), source.topology); }))
        throw Error(ErrorKind::kInput, place + ": is of type " + source.gridType +
                                           ", whose voxels are not its content; import a mask, "
                                           "bool, float, double, int or vector grid");
    // Every OpenVDB writes this count by default; it detects a flipped bit of a mask.
    if (const auto count =
            grid.getMetadata<openvdb::Int64Metadata>(openvdb::GridBase::META_FILE_VOXEL_COUNT);
        count && uint64_t(count->value()) != grid.activeVoxelCount())
        throw Error(ErrorKind::kInput,
                    place + ": holds " + std::to_string(grid.activeVoxelCount()) +
                        " active voxels, its metadata state " + std::to_string(count->value()) +
                        "; the file is damaged");
    source.isOurs = grid.getCreator() == kCreator;
    for (auto meta = grid.beginMeta(); meta != grid.endMeta(); ++meta)
        if (meta->first.starts_with(kVdbTagPrefix)) {
            source.isOurs = true;
            source.tags[meta->first] = meta->second->str();
        }
    takeTransform(*grid.transform().baseMap(), source);
    return source;
}

/// Returns the bytes of a grid followed by the tags as its only blind data.
nanovdb::GridHandle<> withTags(const nanovdb::GridHandle<>& grid, const VdbTags& tags) {
    const std::string text = packTags(tags);
    constexpr uint64_t kAlign = NANOVDB_DATA_ALIGNMENT;
    const uint64_t metaAt = grid.size(), textAt = metaAt + sizeof(nanovdb::GridBlindMetaData);
    const uint64_t size = textAt + (text.size() + kAlign - 1) / kAlign * kAlign;
    nanovdb::GridHandle<> result(nanovdb::HostBuffer::create(size));
    std::memset(result.data(), 0, size);
    std::memcpy(result.data(), grid.data(), grid.size());
    auto* meta = reinterpret_cast<nanovdb::GridBlindMetaData*>(result.data() + metaAt);
    // NanoVDB has no byte type, so whole words are used, the last filled with zeros.
    meta->mElementCount = (size - textAt) / sizeof(uint32_t);
    meta->mSemantic = nanovdb::GridBlindDataSemantic::Unknown;
    meta->mDataClass = nanovdb::GridBlindDataClass::Unknown;
    meta->mDataType = nanovdb::GridType::UInt32;
    std::strcpy(meta->mName, kNanoTagsName);
    meta->mByteOffset = int64_t(sizeof(nanovdb::GridBlindMetaData));
    std::memcpy(result.data() + textAt, text.data(), text.size());
    auto* data = reinterpret_cast<nanovdb::GridData*>(result.data());
    data->mGridSize = size;
    data->mBlindMetadataOffset = int64_t(metaAt);
    data->mBlindMetadataCount = 1;
    nanovdb::updateChecksum(*result.grid<nanovdb::ValueMask>(), nanovdb::ChecksumMode::Full);
    return result;
}

/// Calls leaf(x, y, z, voxels) for every 4^3 leaf under a cell.
template <class F>
void forEachLeaf(const DagView& dag, uint32_t address, uint32_t level, glm::uvec3 corner,
                 const F& leaf) {
    if (level == kLeafLog2) {
        leaf(corner, dag.words[address] | uint64_t(dag.words[address + 1]) << 32);
        return;
    }
    const uint32_t mask = dag.words[address], half = 1u << (level - 1);
    uint32_t child = address + 1;
    for (uint32_t c = 0; c < 8; ++c)
        if (mask >> c & 1)
            forEachLeaf(dag, dag.words[child++], level - 1,
                        corner + half * glm::uvec3(c & 1, c >> 1 & 1, c >> 2), leaf);
}

void writeOpenVdbTo(const Asset& asset, const std::string& path, const VdbSink& sink) {
    openvdb::initialize();
    const MaskGrid::Ptr grid = maskGridOf(asset, path);
    const VdbTags tags = tagsOf(asset);
    for (const auto& [name, text] : tags)
        grid->insertMeta(name, openvdb::StringMetadata(text));
    sink([&](std::ostream& out) {
        Writer().write(out, grid, tags.at(kVdbTagPrefix + std::string("checksum")));
    });
}

void writeNanoVdbTo(const Asset& asset, const std::string& path, const VdbSink& sink) {
    nanovdb::GridHandle<> handle;
    try {
        const MaskGrid::Ptr grid = maskGridOf(asset, path);
        // A longer name would need its own blind data; the tags contain it completely.
        grid->setName(asset.provenance.sceneName.substr(0, nanovdb::GridData::MaxNameSize - 1));
        handle =
            nanovdb::openToNanoVDB(*grid, nanovdb::StatsMode::BBox, nanovdb::ChecksumMode::Disable);
    } catch (const openvdb::ArithmeticError&) { // of the matrix that NanoVDB's transform is
        throw tooSmall(asset.dag.grid.voxelSizeWorld, path);
    }
    handle = withTags(handle, tagsOf(asset));
    sink([&](std::ostream& out) { nanovdb::io::writeGrid(out, handle, nanovdb::io::Codec::ZIP); });
}

nanovdb::GridHandle<> nanoGridOfDag(const Dag& dag) {
    MaskGrid open;
    auto accessor = open.getAccessor();
    const auto addLeaf = [&](glm::uvec3 corner, uint64_t voxels) {
        const openvdb::Coord origin(int(corner.x), int(corner.y), int(corner.z));
        auto* leaf = accessor.touchLeaf(origin);
        for (; voxels != 0; voxels &= voxels - 1) {
            const int bit = std::countr_zero(voxels), o = bit >> 3, s = bit & 7;
            leaf->setValueOn(origin.offsetBy(2 * (o & 1) + (s & 1), 2 * (o >> 1 & 1) + (s >> 1 & 1),
                                             2 * (o >> 2) + (s >> 2)));
        }
    };
    if (!dag.empty())
        forEachLeaf(dag.view(), dag.rootAddress, std::max(dag.grid.resolutionLog2, kLeafLog2),
                    glm::uvec3(0), addLeaf);
    return nanovdb::openToNanoVDB(open, nanovdb::StatsMode::BBox, nanovdb::ChecksumMode::Disable);
}

VdbSource readOpenVdbFrom(std::istream& in, uint64_t byteCount, const std::string& name,
                          const std::string& gridName) {
    openvdb::initialize();
    const auto damaged = [&](const std::string& what) {
        return Error(ErrorKind::kInput, name + ": OpenVDB cannot read it: " + what +
                                            "; it is not a .vdb file, or is truncated or damaged");
    };
    try {
        in.exceptions(std::ios::eofbit | std::ios::failbit | std::ios::badbit);
        Reader reader;
        const openvdb::GridBase::Ptr grid = reader.read(in, byteCount, name, gridName);
        return sourceOf(*grid, reader.gridName(), name);
    } catch (const Error&) {
        throw;
    } catch (const std::bad_alloc&) {
        throw;
    } catch (const std::ios_base::failure&) {
        throw damaged("it ends too early");
    } catch (const std::exception& error) {
        if (saysNoThread(error))
            throw;
        throw damaged(error.what());
    }
}

} // namespace

} // namespace shadowdag

extern "C" const shadowdag::OpenVdbModule* sdagOpenVdbModule() {
    using namespace shadowdag;
    static constexpr OpenVdbModule kModule = {
        {}, writeOpenVdbTo, writeNanoVdbTo, nanoGridOfDag, readOpenVdbFrom};
    return &kModule;
}
