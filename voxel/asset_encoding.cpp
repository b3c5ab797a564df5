// SPDX-License-Identifier: Apache-2.0
#include "voxel/asset_encoding.h"

#include "cuda/error.h"
#include "cuda/large_pages.h"
#include "cuda/parallel_for.h"
#include "cuda/uninitialized.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <utility>

namespace shadowdag {
namespace {

/// Returns a mask of the voxels that a leaf of this grid may hold: all, except for grids smaller
/// than a leaf.
uint64_t leafVoxels(const VoxelGrid& grid) {
    if (grid.resolutionLog2 >= kLeafLog2)
        return ~uint64_t(0);
    return grid.resolutionLog2 == 1 ? 0xffu : 0x1u;
}

/// Offsets of the streams.
struct Streams {
    uint64_t masks = 0, flags, references, leaves;
    explicit Streams(const EncodedCounts& c)
        : flags(c.innerCount), references(flags + (c.pointerCount + 7) / 8),
          leaves(references + 4 * c.referenceCount) {}
};

/// The inner nodes of a DAG level by level. The writer reads them twice.
template <class Visit> void walkInner(const Dag& dag, const Visit& visit) {
    const uint32_t rootLevel = std::max(dag.grid.resolutionLog2, kLeafLog2);
    std::vector<uint32_t> nodes{dag.rootAddress}, below;
    std::vector<uint32_t> number; // of each address, in its level
    number.assign(dag.words.size(), kNoNode);
    for (uint32_t level = rootLevel; level > kLeafLog2; --level) {
        below.clear();
        for (const uint32_t address : nodes) {
            const uint32_t mask = dag.words[address];
            visit.node(mask);
            for (uint32_t i = 1; i <= bitCount32(mask); ++i) {
                const uint32_t child = dag.words[address + i];
                if (number[child] == kNoNode) {
                    number[child] = uint32_t(below.size());
                    below.push_back(child);
                    visit.pointer(0);
                } else {
                    visit.pointer(uint32_t(below.size()) - number[child]);
                }
            }
        }
        nodes.swap(below);
    }
    for (const uint32_t address : nodes)
        visit.leaf(dag.words[address] | uint64_t(dag.words[address + 1]) << 32);
}

struct CountingVisitor {
    EncodedCounts& counts;
    void node(uint32_t) const { ++counts.innerCount; }
    void pointer(uint32_t distance) const {
        ++counts.pointerCount;
        counts.referenceCount += distance != 0;
    }
    void leaf(uint64_t) const { ++counts.leafCount; }
};

struct WritingVisitor {
    uint8_t* out;
    Streams at;
    EncodedCounts counts;
    mutable EncodedCounts next{};

    void node(uint32_t mask) const { out[at.masks + next.innerCount++] = uint8_t(mask); }
    void pointer(uint32_t distance) const {
        const uint64_t i = next.pointerCount++;
        if (distance == 0) {
            out[at.flags + i / 8] |= uint8_t(1u << (i % 8));
            return;
        }
        const uint64_t r = next.referenceCount++;
        for (uint64_t plane = 0; plane < 4; ++plane)
            out[at.references + plane * counts.referenceCount + r] =
                uint8_t(distance >> (8 * plane));
    }
    void leaf(uint64_t voxels) const {
        const uint64_t l = next.leafCount++;
        for (uint64_t plane = 0; plane < 8; ++plane)
            out[at.leaves + plane * counts.leafCount + l] = uint8_t(voxels >> (8 * plane));
    }
};

/// Returns how many of the bits [begin, end) are set; bit i is bit i % 8 of byte i / 8.
uint64_t countBits(const uint8_t* bytes, uint64_t begin, uint64_t end) {
    uint64_t count = 0;
    for (; begin < end && begin % 8 != 0; ++begin)
        count += bytes[begin / 8] >> (begin % 8) & 1;
    for (; begin + 64 <= end; begin += 64) {
        uint64_t word;
        std::memcpy(&word, bytes + begin / 8, sizeof word);
        count += uint64_t(std::popcount(word));
    }
    for (; begin < end; ++begin)
        count += bytes[begin / 8] >> (begin % 8) & 1;
    return count;
}

/// Reads the streams of a DAG level by level, many nodes of a level at once. Fails by Error kInput,
/// at the same place for any number of threads.
class StreamDecoder {
public:
    StreamDecoder(View<const uint8_t> bytes, const EncodedCounts& counts, const VoxelGrid& grid,
                  const std::string& name)
        : in_(bytes.data), at_(counts), counts_(counts), name_(name),
          rootLevel_(std::max(grid.resolutionLog2, kLeafLog2)), leafVoxels_(leafVoxels(grid)) {
        dag_.grid = grid;
        dag_.rootAddress = 0;
    }

    /// Allocates the DAG's words and touches their memory, which takes as long as unpacking the
    /// streams. Before run().
    void allocateWords() {
        const uint64_t count = counts_.wordCount();
        dag_.words.reserve(count);
        useLargePages(dag_.words.data(), count * sizeof(uint32_t));
        dag_.words.resize(count);
    }

    Dag run() {
        readReferences();
        uint64_t nodeCount = 1;
        for (uint32_t level = rootLevel_; level > kLeafLog2; --level)
            nodeCount = readLevel(level, nodeCount);
        for (uint64_t p = counts_.pointerCount; p < (counts_.pointerCount + 7) / 8 * 8; ++p)
            if (isNewAt(p) != 0)
                fail("a flag is set past the last pointer");
        if (next_.innerCount != counts_.innerCount || next_.pointerCount != counts_.pointerCount ||
            next_.referenceCount != counts_.referenceCount || nodeCount != counts_.leafCount)
            fail(
                "its counts of nodes, pointers, references or leaves exceed what the root reaches");
        readLeaves();
        return std::move(dag_);
    }

private:
    static constexpr size_t kNodesPerChunk = 1024;
    static constexpr uint64_t kNone = ~uint64_t(0);

    /// Consecutive nodes of a level: first how many pointers, and new nodes among these, they have,
    /// then how many those before them have in the level.
    struct Chunk {
        uint64_t pointers = 0, newNodes = 0;
        uint64_t firstBad = kNone; // a node without a child, or a pointer that leads nowhere
    };

    [[noreturn]] void fail(const std::string& what) const {
        throw Error(ErrorKind::kInput,
                    name_ + ": " + what + "; the file is damaged, build it again");
    }
    uint32_t isNewAt(uint64_t pointer) const {
        return uint32_t(in_[at_.flags + pointer / 8]) >> (pointer % 8) & 1u;
    }

    static size_t chunkCount(uint64_t nodeCount) {
        return size_t((nodeCount + kNodesPerChunk - 1) / kNodesPerChunk);
    }
    /// Calls body(chunk number, first node, end) for the chunks of `nodeCount` nodes.
    template <class Body> static void forChunks(uint64_t nodeCount, const Body& body) {
        cpuParallelRanges(chunkCount(nodeCount), 1, [&](size_t begin, size_t end) {
            for (size_t c = begin; c < end; ++c)
                body(c, c * kNodesPerChunk,
                     std::min<uint64_t>((c + 1) * kNodesPerChunk, nodeCount));
        });
    }
    /// Returns the first bad node or pointer of all chunks.
    static uint64_t firstBad(const std::vector<Chunk>& chunks) {
        for (const Chunk& chunk : chunks)
            if (chunk.firstBad != kNone)
                return chunk.firstBad;
        return kNone;
    }

    /// Reads how many nodes back each reference leads; a 0 stands behind the last.
    void readReferences() {
        const uint8_t* planes = in_ + at_.references;
        const uint64_t count = counts_.referenceCount;
        distances_.resize(count + 1);
        distances_[count] = 0;
        cpuParallelRanges(count, 16 * kNodesPerChunk, [&](size_t begin, size_t end) {
            for (size_t r = begin; r < end; ++r)
                distances_[r] = uint32_t(planes[r]) | uint32_t(planes[count + r]) << 8 |
                                uint32_t(planes[2 * count + r]) << 16 |
                                uint32_t(planes[3 * count + r]) << 24;
        });
    }

    /// Reads the nodes of a level; returns how many the level below has.
    uint64_t readLevel(uint32_t level, uint64_t nodeCount) {
        if (nodeCount > counts_.innerCount - next_.innerCount)
            fail("level " + std::to_string(level) + " has " + std::to_string(nodeCount) +
                 " nodes, the file holds " + std::to_string(counts_.innerCount - next_.innerCount) +
                 " more");
        const uint8_t* masks = in_ + at_.masks + next_.innerCount;
        std::vector<Chunk> chunks(chunkCount(nodeCount));
        forChunks(nodeCount, [&](size_t c, uint64_t begin, uint64_t end) {
            for (uint64_t i = end; i-- > begin;)
                if (masks[i] == 0)
                    chunks[c].firstBad = i;
            chunks[c].pointers = countBits(masks, 8 * begin, 8 * end);
        });
        if (const uint64_t node = firstBad(chunks); node != kNone)
            fail("node " + std::to_string(node) + " of level " + std::to_string(level) +
                 " has no child");
        uint64_t pointers = 0;
        for (Chunk& chunk : chunks)
            pointers += std::exchange(chunk.pointers, pointers);
        if (pointers > counts_.pointerCount - next_.pointerCount)
            fail("level " + std::to_string(level) + " has " + std::to_string(pointers) +
                 " pointers, the file holds " +
                 std::to_string(counts_.pointerCount - next_.pointerCount) + " more");
        forChunks(nodeCount, [&](size_t c, uint64_t, uint64_t) {
            const uint64_t end = c + 1 < chunks.size() ? chunks[c + 1].pointers : pointers;
            chunks[c].newNodes = countBits(in_ + at_.flags, next_.pointerCount + chunks[c].pointers,
                                           next_.pointerCount + end);
        });
        uint64_t newNodes = 0;
        for (Chunk& chunk : chunks)
            newNodes += std::exchange(chunk.newNodes, newNodes);

        next_.innerCount += nodeCount;
        if (level - 1 == kLeafLog2)
            readPointers<true>(level, masks, nodeCount, pointers, newNodes, chunks);
        else
            readPointers<false>(level, masks, nodeCount, pointers, newNodes, chunks);
        next_.pointerCount += pointers;
        next_.referenceCount += pointers - newNodes;
        wordCount_ += nodeCount + pointers;
        return newNodes;
    }

    /// Writes the nodes of a level, whose masks and pointers were counted. The level below begins
    /// behind it; a node there takes as many words as its mask has bits and one, or two for a leaf.
    template <bool kIsAboveLeaves>
    void readPointers(uint32_t level, const uint8_t* masks, uint64_t nodeCount, uint64_t pointers,
                      uint64_t newNodes, std::vector<Chunk>& chunks) {
        const uint64_t limit =
            kIsAboveLeaves ? counts_.leafCount : counts_.innerCount - next_.innerCount;
        const uint64_t base = wordCount_ + nodeCount + pointers;
        if constexpr (!kIsAboveLeaves)
            addressNodes(masks + nodeCount, std::min(newNodes, limit), base);
        forChunks(nodeCount, [&](size_t c, uint64_t begin, uint64_t end) {
            if (chunks[c].newNodes > limit) // an earlier chunk has the first bad pointer
                return;
            uint32_t* out = dag_.words.data() + wordCount_ + begin + chunks[c].pointers;
            uint64_t p = next_.pointerCount + chunks[c].pointers, count = chunks[c].newNodes;
            uint64_t reference = next_.referenceCount + chunks[c].pointers - count;
            for (uint64_t i = begin; i < end; ++i) {
                *out++ = masks[i];
                // Which pointers are references is hard to predict, so both kinds take one path.
                for (uint32_t n = bitCount32(masks[i]); n > 0; --n, ++p) {
                    const uint32_t isNew = isNewAt(p), isReference = isNew ^ 1;
                    const uint64_t distance =
                        distances_[std::min(reference, counts_.referenceCount)] & (0 - isReference);
                    if ((isNew & uint32_t(count >= limit)) |
                        (isReference & uint32_t(distance - 1 >= count))) {
                        chunks[c].firstBad = p;
                        return;
                    }
                    const uint64_t child = count - distance;
                    *out++ = kIsAboveLeaves ? uint32_t(base + 2 * child) : addresses_[child];
                    count += isNew;
                    reference += isReference;
                }
            }
        });
        if (const uint64_t p = firstBad(chunks); p != kNone)
            failAtPointer(level, p);
    }
    /// Tells what is wrong with a pointer of this level, the first that is.
    [[noreturn]] void failAtPointer(uint32_t level, uint64_t pointer) const {
        if (isNewAt(pointer) != 0)
            fail("level " + std::to_string(level - 1) + " has more nodes than the file holds");
        const uint64_t newNodes = countBits(in_ + at_.flags, next_.pointerCount, pointer);
        const uint64_t reference = next_.referenceCount + pointer - next_.pointerCount - newNodes;
        if (reference >= counts_.referenceCount)
            fail("pointer " + std::to_string(pointer) +
                 " is a reference, but the file has no further references");
        fail("reference " + std::to_string(reference) + " leads " +
             std::to_string(distances_[reference]) + " nodes back, but only " +
             std::to_string(newNodes) + " exist");
    }

    /// Sets the addresses of the nodes of a level, which begins at `base`.
    void addressNodes(const uint8_t* masks, uint64_t nodeCount, uint64_t base) {
        addresses_.clear(); // so that no old element is copied
        addresses_.resize(nodeCount);
        std::vector<uint64_t> begins(chunkCount(nodeCount));
        forChunks(nodeCount, [&](size_t c, uint64_t begin, uint64_t end) {
            begins[c] = end - begin + countBits(masks, 8 * begin, 8 * end);
        });
        for (uint64_t& begin : begins)
            base += std::exchange(begin, base);
        forChunks(nodeCount, [&](size_t c, uint64_t begin, uint64_t end) {
            uint64_t address = begins[c];
            for (uint64_t i = begin; i < end; ++i) {
                addresses_[i] = uint32_t(address);
                address += 1 + bitCount32(masks[i]);
            }
        });
    }

    void readLeaves() {
        std::vector<Chunk> chunks(chunkCount(counts_.leafCount));
        forChunks(counts_.leafCount, [&](size_t c, uint64_t begin, uint64_t end) {
            uint32_t* out = dag_.words.data() + wordCount_;
            for (uint64_t l = begin; l < end; ++l) {
                const uint64_t voxels = leafAt(l);
                if (voxels == 0 || (voxels & ~leafVoxels_) != 0)
                    chunks[c].firstBad = std::min(chunks[c].firstBad, l);
                out[2 * l] = uint32_t(voxels);
                out[2 * l + 1] = uint32_t(voxels >> 32);
            }
        });
        if (const uint64_t l = firstBad(chunks); l != kNone)
            fail("leaf " + std::to_string(l) +
                 (leafAt(l) == 0 ? " is empty" : " has voxels outside the grid"));
    }
    uint64_t leafAt(uint64_t number) const {
        const uint8_t* planes = in_ + at_.leaves;
        uint64_t voxels = 0;
        for (uint64_t plane = 0; plane < 8; ++plane)
            voxels |= uint64_t(planes[plane * counts_.leafCount + number]) << (8 * plane);
        return voxels;
    }

    const uint8_t* in_;
    const Streams at_;
    const EncodedCounts counts_;
    const std::string& name_;
    const uint32_t rootLevel_;
    const uint64_t leafVoxels_; // that a leaf of this grid may hold
    Dag dag_;
    EncodedCounts next_;                      // of the levels that were read; not its leaves
    uint64_t wordCount_ = 0;                  // of these levels
    UninitializedVector<uint32_t> distances_; // of references
    UninitializedVector<uint32_t> addresses_; // of the nodes of the level below, by number
};

} // namespace

std::vector<uint8_t> encodeDag(const Dag& dag, EncodedCounts& counts) {
    counts = {};
    if (dag.empty())
        return {};
    walkInner(dag, CountingVisitor{counts});
    std::vector<uint8_t> bytes(counts.byteCount(), 0);
    walkInner(dag, WritingVisitor{bytes.data(), Streams(counts), counts});
    return bytes;
}

Dag decodeDag(View<const uint8_t> bytes, const EncodedCounts& counts, const VoxelGrid& grid,
              const std::string& name) {
    return decodeDag(bytes, counts, grid, name, [] {});
}

Dag decodeDag(View<const uint8_t> bytes, const EncodedCounts& counts, const VoxelGrid& grid,
              const std::string& name, const std::function<void()>& fill) {
    SDAG_ASSERT(bytes.count == counts.byteCount());
    if (counts.wordCount() == 0 && counts.referenceCount == 0) {
        fill();
        Dag dag;
        dag.grid = grid;
        return dag;
    }
    StreamDecoder decoder(bytes, counts, grid, name);
    cpuParallelInvoke(fill, [&] { decoder.allocateWords(); });
    return decoder.run();
}

} // namespace shadowdag
