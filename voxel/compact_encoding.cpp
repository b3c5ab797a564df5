// SPDX-License-Identifier: Apache-2.0
#include "voxel/compact_encoding.h"

#include "cuda/error.h"
#include "voxel/voxel_model.h"

#include <algorithm>

namespace shadowdag {
namespace {

constexpr uint32_t kCubeLevel = 4;  ///< cells of 16^3, whose voxels are coded together
constexpr uint32_t kBlockLevel = 3; ///< cells of 8^3, written as voxels

/// The leaves of the up to eight blocks of a cube, 0 for a missing block.
struct CubeLeaves {
    uint64_t at[8][8] = {};
};

/// The place of leaf o of block b, in leaves.
struct LeafPlace {
    int x, y, z;
    LeafPlace(uint32_t b, uint32_t o)
        : x(int(2 * (b & 1) + (o & 1))), y(int(2 * (b >> 1 & 1) + (o >> 1 & 1))),
          z(int(2 * (b >> 2) + (o >> 2))) {}
};

/// Writes a cube's child mask and its earlier blocks (`old`) into the context. A child that repeats
/// a new one of the same cube is neither old nor new.
void beginCube(VoxelModel& model, uint32_t mask, uint32_t old, const CubeLeaves& leaves) {
    model.known.forget();
    for (uint32_t b = 0; b < 8; ++b) {
        if ((mask >> b & 1) == 0)
            model.known.setEmpty(3, int(b & 1), int(b >> 1 & 1), int(b >> 2));
        else if (old >> b & 1)
            for (uint32_t o = 0; o < 8; ++o) {
                const LeafPlace p(b, o);
                model.known.setLeaf(p.x, p.y, p.z, leaves.at[b][o]);
            }
    }
}

/// Codes the voxels of a cube's new blocks, coarse to fine. Returns false if a cell that must be
/// occupied is empty: the data are damaged.
template <class Coder>
bool codeBlocks(VoxelModel& model, Coder& coder, uint32_t newBlocks, CubeLeaves& leaves) {
    uint32_t leafMasks[8] = {}, octants[8][8] = {};
    const auto occupied = [](const auto& cells) {
        uint32_t mask = 0;
        for (uint32_t c = 0; c < 8; ++c)
            mask |= uint32_t(cells(c) != 0) << c;
        return mask;
    };
    for (uint32_t b = 0; b < 8; ++b)
        if (newBlocks >> b & 1) {
            leafMasks[b] = model.octant(coder, 2, int(b & 1), int(b >> 1 & 1), int(b >> 2),
                                        occupied([&](uint32_t o) { return leaves.at[b][o]; }));
            if (leafMasks[b] == 0)
                return false;
        }
    for (uint32_t b = 0; b < 8; ++b)
        for (uint32_t o = 0; o < 8; ++o)
            if (leafMasks[b] >> o & 1) {
                const LeafPlace p(b, o);
                const uint64_t voxels = leaves.at[b][o];
                octants[b][o] =
                    model.octant(coder, 1, p.x, p.y, p.z,
                                 occupied([&](uint32_t e) { return voxels >> (8 * e) & 0xffu; }));
                if (octants[b][o] == 0)
                    return false;
            }
    for (uint32_t b = 0; b < 8; ++b)
        for (uint32_t o = 0; o < 8; ++o) {
            const uint64_t truth = leaves.at[b][o];
            uint64_t voxels = 0;
            for (uint32_t e = 0; e < 8; ++e)
                if (octants[b][o] >> e & 1) {
                    const LeafPlace p(b, o);
                    const uint32_t mask =
                        model.octant(coder, 0, 2 * p.x + int(e & 1), 2 * p.y + int(e >> 1 & 1),
                                     2 * p.z + int(e >> 2), uint32_t(truth >> (8 * e)) & 0xffu);
                    if (mask == 0)
                        return false;
                    voxels |= uint64_t(mask) << (8 * e);
                }
            if (newBlocks >> b & 1)
                leaves.at[b][o] = voxels;
        }
    return true;
}

/// Returns a mask of the voxels that a leaf of this grid may hold: all, except for grids smaller
/// than a leaf.
uint64_t leafVoxels(const VoxelGrid& grid) {
    if (grid.resolutionLog2 >= kLeafLog2)
        return ~uint64_t(0);
    return grid.resolutionLog2 == 1 ? 0xffu : 0x1u;
}

uint64_t leafAt(const std::vector<uint32_t>& words, uint32_t address) {
    return words[address] | uint64_t(words[address + 1]) << 32;
}

/// The first words of the levels of a DAG; starts[kLeafLog2 - 1] is the end of the leaves. Each
/// level begins with the first child of the first node above it.
struct LevelStarts {
    uint32_t at[kMaxResolutionLog2 + 1] = {};
    uint32_t rootLevel;

    explicit LevelStarts(const Dag& dag) : rootLevel(std::max(dag.grid.resolutionLog2, kLeafLog2)) {
        at[rootLevel] = dag.rootAddress;
        for (uint32_t level = rootLevel; level > kLeafLog2; --level)
            at[level - 1] = dag.words[at[level] + 1];
        at[kLeafLog2 - 1] = uint32_t(dag.words.size());
    }
};

class Encoder {
public:
    Encoder(const Dag& dag, EncodedCounts& counts)
        : words_(dag.words), starts_(dag), model_(countNodes(dag, starts_, counts)) {}

    std::vector<uint8_t> run() {
        for (uint32_t level = starts_.rootLevel; level >= kCubeLevel; --level)
            writeLevel(level);
        if (starts_.rootLevel < kCubeLevel) { // a cube of its own, in whose corner the root is
            CubeLeaves leaves;
            if (starts_.rootLevel == kBlockLevel)
                readBlock(starts_.at[kBlockLevel], leaves.at[0]);
            else
                leaves.at[0][0] = leafAt(words_, starts_.at[kLeafLog2]);
            beginCube(model_, 1, 0, leaves);
            codeBlocks(model_, coder_, 1, leaves);
        }
        return coder_.finish();
    }

private:
    static uint64_t countNodes(const Dag& dag, const LevelStarts& starts, EncodedCounts& counts) {
        for (uint32_t level = starts.rootLevel; level > kLeafLog2; --level)
            for (uint32_t a = starts.at[level]; a < starts.at[level - 1];) {
                const uint32_t children = bitCount32(dag.words[a]);
                ++counts.innerCount;
                counts.pointerCount += children;
                a += 1 + children;
            }
        counts.leafCount = (starts.at[kLeafLog2 - 1] - starts.at[kLeafLog2]) / 2;
        SDAG_ASSERT(counts.wordCount() == dag.words.size());
        return counts.innerCount + counts.leafCount;
    }

    void readBlock(uint32_t address, uint64_t leaves[8]) const {
        uint32_t next = address + 1;
        for (uint32_t o = 0; o < 8; ++o)
            leaves[o] = words_[address] >> o & 1 ? leafAt(words_, words_[next++]) : 0;
    }

    void writeLevel(uint32_t level) {
        const uint32_t below = starts_.at[level - 1];
        std::vector<uint32_t> number(starts_.at[level - 2] - below); // of each address, when seen
        uint32_t unseen = below, seen = 0;                           // the next: address, number
        for (uint32_t a = starts_.at[level]; a < below;) {
            const uint32_t mask = model_.childMask(coder_, level, words_[a++]), seenBefore = seen;
            uint32_t path = 1, newBlocks = 0, oldBlocks = 0, before = kNoNode;
            CubeLeaves leaves;
            for (uint32_t c = 0; c < 8; ++c) {
                if ((mask >> c & 1) == 0)
                    continue;
                const uint32_t child = words_[a++];
                SDAG_ASSERT(child <= unseen);
                const uint64_t context = VoxelModel::childContext(level, c, before);
                if (model_.isNew(coder_, level, path, child == unseen)) {
                    number[child - below] = before = seen++;
                    unseen += 1 + bitCount32(words_[child]);
                    newBlocks |= 1u << c;
                } else {
                    before = number[child - below];
                    model_.reference(coder_, level, context, before, seen);
                    oldBlocks |= uint32_t(before < seenBefore) << c;
                }
                model_.follow(context, before);
                if (level == kCubeLevel)
                    readBlock(child, leaves.at[c]);
            }
            if (level == kCubeLevel && newBlocks != 0) {
                beginCube(model_, mask, oldBlocks, leaves);
                codeBlocks(model_, coder_, newBlocks, leaves);
            }
        }
    }

    const std::vector<uint32_t>& words_;
    LevelStarts starts_;
    VoxelModel model_;
    RangeEncoder coder_;
};

/// Numbers leaves by content, in order of first visit.
class LeafNumbers {
public:
    uint32_t of(uint64_t voxels) {
        if (2 * leaves_.size() >= slots_.size())
            grow();
        for (size_t i = slot(voxels);; i = (i + 1) & (slots_.size() - 1)) {
            if (slots_[i] == kNoNode) {
                slots_[i] = uint32_t(leaves_.size());
                leaves_.push_back(voxels);
                return slots_[i];
            }
            if (leaves_[slots_[i]] == voxels)
                return slots_[i];
        }
    }
    const std::vector<uint64_t>& leaves() const { return leaves_; }

private:
    size_t slot(uint64_t voxels) const {
        return size_t((voxels ^ voxels >> 32) * 0x9e3779b97f4a7c15u >> 32) & (slots_.size() - 1);
    }
    void grow() {
        slots_.assign(std::max<size_t>(64, 2 * slots_.size()), kNoNode);
        for (uint32_t l = 0; l < leaves_.size(); ++l) {
            size_t i = slot(leaves_[l]);
            while (slots_[i] != kNoNode)
                i = (i + 1) & (slots_.size() - 1);
            slots_[i] = l;
        }
    }

    std::vector<uint32_t> slots_; // 2^n entries, at least half of them free
    std::vector<uint64_t> leaves_;
};

class Decoder {
public:
    Decoder(const std::vector<uint8_t>& bytes, const EncodedCounts& counts, const VoxelGrid& grid,
            const std::string& name)
        : counts_(counts), name_(name), rootLevel_(std::max(grid.resolutionLog2, kLeafLog2)),
          allowed_(leafVoxels(grid)), model_(counts.innerCount + counts.leafCount),
          coder_(bytes.data(), bytes.size()) {
        dag_.grid = grid;
        dag_.rootAddress = 0;
        dag_.words.reserve(counts.wordCount());
    }

    Dag run() {
        uint64_t nodeCount = 1;
        size_t start = 0;
        std::vector<uint32_t> addresses;
        for (uint32_t level = rootLevel_; level >= kCubeLevel; --level) {
            const size_t above = start;
            start = dag_.words.size();
            nodeCount = readLevel(level, nodeCount, addresses);
            replaceNumbers(above, start, addresses);
        }
        if (rootLevel_ < kCubeLevel)
            readRootCube();
        // Blocks follow their cubes, and leaves follow the blocks.
        const size_t blocks = dag_.words.size();
        for (uint32_t& address : blockAddresses_)
            address += uint32_t(blocks);
        replaceNumbers(start, blocks, blockAddresses_);
        const uint32_t leavesAt = uint32_t(blocks + blockWords_.size());
        for (size_t i = 0; i < blockWords_.size();) {
            const uint32_t mask = blockWords_[i++];
            dag_.words.push_back(mask);
            for (uint32_t n = bitCount32(mask); n > 0; --n)
                dag_.words.push_back(leavesAt + 2 * blockWords_[i++]);
        }
        for (const uint64_t voxels : leaves_.leaves()) {
            dag_.words.push_back(uint32_t(voxels));
            dag_.words.push_back(uint32_t(voxels >> 32));
        }
        if (innerCount_ != counts_.innerCount || pointerCount_ != counts_.pointerCount ||
            leaves_.leaves().size() != counts_.leafCount)
            fail("its counts of nodes, pointers or leaves exceed what the root reaches");
        return std::move(dag_);
    }

private:
    [[noreturn]] void fail(const std::string& what) const {
        throw Error(ErrorKind::kInput,
                    name_ + ": " + what + "; the file is damaged, build it again");
    }
    void count(uint32_t level, uint32_t mask) {
        if (coder_.isPastEnd())
            fail("its nodes continue past its end in level " + std::to_string(level));
        if (mask == 0)
            fail("a node of level " + std::to_string(level) + " has no child");
        ++innerCount_;
        pointerCount_ += bitCount32(mask);
        if (innerCount_ > counts_.innerCount || pointerCount_ > counts_.pointerCount)
            fail("level " + std::to_string(level) + " has more nodes or pointers than the file's " +
                 std::to_string(counts_.innerCount) + " and " +
                 std::to_string(counts_.pointerCount));
    }

    /// Appends a level's nodes, children by number; returns how many the level below has.
    uint64_t readLevel(uint32_t level, uint64_t nodeCount, std::vector<uint32_t>& addresses) {
        addresses.clear();
        uint32_t seen = 0;
        for (uint64_t i = 0; i < nodeCount; ++i) {
            const uint32_t mask = model_.childMask(coder_, level, 0);
            count(level, mask);
            addresses.push_back(uint32_t(dag_.words.size()));
            dag_.words.push_back(mask);
            uint32_t path = 1, newBlocks = 0, before = kNoNode;
            for (uint32_t c = 0; c < 8; ++c) {
                if ((mask >> c & 1) == 0)
                    continue;
                const uint64_t context = VoxelModel::childContext(level, c, before);
                if (model_.isNew(coder_, level, path, false)) {
                    newBlocks |= 1u << c;
                    before = seen++;
                } else {
                    before = model_.reference(coder_, level, context, 0, seen);
                    if (before >= seen)
                        fail("a pointer of level " + std::to_string(level) +
                             " leads further back than the " + std::to_string(seen) +
                             " nodes read so far");
                }
                model_.follow(context, before);
                dag_.words.push_back(before);
            }
            if (level == kCubeLevel && newBlocks != 0)
                readCube(mask, newBlocks);
        }
        return seen;
    }

    /// Reads the new blocks of the cube whose node was appended last.
    void readCube(uint32_t mask, uint32_t newBlocks) {
        CubeLeaves leaves;
        uint32_t old = 0;
        const uint32_t* number = dag_.words.data() + dag_.words.size() - bitCount32(mask);
        for (uint32_t b = 0; b < 8; ++b) {
            if ((mask >> b & 1) == 0)
                continue;
            if (*number < blockAddresses_.size()) {
                old |= 1u << b;
                leavesOf(*number, leaves.at[b]);
            }
            ++number;
        }
        readBlocks(mask, old, newBlocks, leaves);
    }

    void readBlocks(uint32_t mask, uint32_t old, uint32_t newBlocks, CubeLeaves& leaves) {
        beginCube(model_, mask, old, leaves);
        if (!codeBlocks(model_, coder_, newBlocks, leaves))
            fail("an occupied cell holds no voxel");
        for (uint32_t b = 0; b < 8; ++b)
            if (newBlocks >> b & 1)
                addBlock(leaves.at[b]);
    }

    void addBlock(const uint64_t leaves[8]) {
        blockAddresses_.push_back(uint32_t(blockWords_.size()));
        blockWords_.push_back(0);
        uint32_t mask = 0;
        for (uint32_t o = 0; o < 8; ++o)
            if (leaves[o] != 0) {
                mask |= 1u << o;
                blockWords_.push_back(leaves_.of(leaves[o]));
            }
        blockWords_[blockAddresses_.back()] = mask;
        count(kBlockLevel, mask);
        if (leaves_.leaves().size() > counts_.leafCount)
            fail("it has more leaves than its " + std::to_string(counts_.leafCount));
    }

    void leavesOf(uint32_t block, uint64_t leaves[8]) const {
        uint32_t next = blockAddresses_[block];
        const uint32_t mask = blockWords_[next++];
        for (uint32_t o = 0; o < 8; ++o)
            leaves[o] = mask >> o & 1 ? leaves_.leaves()[blockWords_[next++]] : 0;
    }

    void readRootCube() {
        CubeLeaves leaves;
        if (rootLevel_ == kBlockLevel)
            return readBlocks(1, 0, 1, leaves);
        beginCube(model_, 1, 0, leaves);
        if (!codeBlocks(model_, coder_, 1, leaves))
            fail("an occupied cell holds no voxel");
        for (uint32_t o = 0; o < 8; ++o)
            if ((leaves.at[0][o] & ~(o == 0 ? allowed_ : 0)) != 0)
                fail("the leaf has voxels outside the grid");
        leaves_.of(leaves.at[0][0]);
    }

    /// Replaces numbers by addresses in the nodes from word `begin` to `end`.
    void replaceNumbers(size_t begin, size_t end, const std::vector<uint32_t>& addresses) {
        for (size_t i = begin; i < end;)
            for (uint32_t n = bitCount32(dag_.words[i++]); n > 0; --n, ++i)
                dag_.words[i] = addresses[dag_.words[i]];
    }

    EncodedCounts counts_;
    const std::string& name_;
    uint32_t rootLevel_;
    uint64_t allowed_;
    VoxelModel model_;
    RangeDecoder coder_;
    Dag dag_;
    uint64_t innerCount_ = 0, pointerCount_ = 0;
    std::vector<uint32_t> blockWords_, blockAddresses_; // leaves by number
    LeafNumbers leaves_;
};

} // namespace

std::vector<uint8_t> encodeCompact(const Dag& dag, EncodedCounts& counts) {
    counts = {};
    if (dag.empty())
        return {};
    std::vector<uint8_t> bytes = Encoder(dag, counts).run();
    while (compactWordLimit(bytes.size()) < counts.wordCount())
        bytes.push_back(0);
    return bytes;
}

Dag decodeCompact(const std::vector<uint8_t>& bytes, const EncodedCounts& counts,
                  const VoxelGrid& grid, const std::string& name) {
    const uint64_t limit = compactWordLimit(bytes.size());
    // Check each count by itself first, so that their sum cannot wrap.
    if (counts.innerCount > limit || counts.pointerCount > 8 * counts.innerCount ||
        counts.referenceCount != 0 || counts.leafCount > limit || counts.wordCount() > limit ||
        counts.wordCount() >= kNoNode)
        throw Error(ErrorKind::kInput, name + ": its counts (" + std::to_string(counts.innerCount) +
                                           " inner nodes, " + std::to_string(counts.pointerCount) +
                                           " pointers, " + std::to_string(counts.leafCount) +
                                           " leaves) do not fit " + std::to_string(bytes.size()) +
                                           " bytes; the file is damaged, build it again");
    if (counts.wordCount() == 0) {
        Dag dag;
        dag.grid = grid;
        return dag;
    }
    return Decoder(bytes, counts, grid, name).run();
}

} // namespace shadowdag
