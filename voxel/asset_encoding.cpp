// SPDX-License-Identifier: Apache-2.0
#include "voxel/asset_encoding.h"

#include "cuda/error.h"

#include <algorithm>
#include <bit>

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

Dag decodeDag(const std::vector<uint8_t>& bytes, const EncodedCounts& counts, const VoxelGrid& grid,
              const std::string& name) {
    const auto fail = [&](const std::string& what) {
        throw Error(ErrorKind::kInput,
                    name + ": " + what + "; the file is damaged, build it again");
    };
    SDAG_ASSERT(bytes.size() == counts.byteCount());
    Dag dag;
    dag.grid = grid;
    if (counts.wordCount() == 0 && counts.referenceCount == 0)
        return dag;
    const Streams at(counts);
    const uint8_t* in = bytes.data();
    dag.words.reserve(counts.wordCount());
    dag.rootAddress = 0;
    EncodedCounts next;
    // Addresses of the level being read: its nodes end where the level below begins, so the masks
    // of a level are summed first. nodeAddress: the nodes of the level below that have been read so
    // far.
    std::vector<uint32_t> nodeAddress;
    uint64_t nodeCount = 1;
    for (uint32_t level = std::max(grid.resolutionLog2, kLeafLog2); level > kLeafLog2; --level) {
        if (nodeCount > counts.innerCount - next.innerCount)
            fail("level " + std::to_string(level) + " has " + std::to_string(nodeCount) +
                 " nodes, the file holds " + std::to_string(counts.innerCount - next.innerCount) +
                 " more");
        const uint8_t* masks = in + at.masks + next.innerCount;
        uint64_t pointers = 0;
        for (uint64_t i = 0; i < nodeCount; ++i) {
            if (masks[i] == 0)
                fail("node " + std::to_string(i) + " of level " + std::to_string(level) +
                     " has no child");
            pointers += uint64_t(std::popcount(masks[i]));
        }
        if (pointers > counts.pointerCount - next.pointerCount)
            fail("level " + std::to_string(level) + " has " + std::to_string(pointers) +
                 " pointers, the file holds " +
                 std::to_string(counts.pointerCount - next.pointerCount) + " more");
        // The words per child node are the bits of its mask and one, or two for a leaf.
        const uint8_t* childMasks = masks + nodeCount;
        const uint64_t childLimit = level - 1 == kLeafLog2
                                        ? counts.leafCount
                                        : counts.innerCount - next.innerCount - nodeCount;
        uint64_t cursor = dag.words.size() + nodeCount + pointers;
        nodeAddress.clear();
        for (uint64_t i = 0; i < nodeCount; ++i) {
            dag.words.push_back(masks[i]);
            for (int c = std::popcount(masks[i]); c > 0; --c) {
                const uint64_t p = next.pointerCount++;
                if (in[at.flags + p / 8] >> (p % 8) & 1) {
                    if (nodeAddress.size() >= childLimit)
                        fail("level " + std::to_string(level - 1) +
                             " has more nodes than the file holds");
                    dag.words.push_back(uint32_t(cursor));
                    cursor += level - 1 == kLeafLog2
                                  ? 2
                                  : 1 + uint64_t(std::popcount(childMasks[nodeAddress.size()]));
                    nodeAddress.push_back(dag.words.back());
                    continue;
                }
                if (next.referenceCount >= counts.referenceCount)
                    fail("pointer " + std::to_string(p) +
                         " is a reference, but the file has no further references");
                const uint64_t r = next.referenceCount++;
                uint32_t distance = 0;
                for (uint64_t plane = 0; plane < 4; ++plane)
                    distance |= uint32_t(in[at.references + plane * counts.referenceCount + r])
                                << (8 * plane);
                if (distance == 0 || distance > nodeAddress.size())
                    fail("reference " + std::to_string(r) + " leads " + std::to_string(distance) +
                         " nodes back, but only " + std::to_string(nodeAddress.size()) + " exist");
                dag.words.push_back(nodeAddress[nodeAddress.size() - distance]);
            }
        }
        next.innerCount += nodeCount;
        nodeCount = nodeAddress.size();
    }
    for (uint64_t p = counts.pointerCount; p < (counts.pointerCount + 7) / 8 * 8; ++p)
        if (in[at.flags + p / 8] >> (p % 8) & 1)
            fail("a flag is set past the last pointer");
    if (next.innerCount != counts.innerCount || next.pointerCount != counts.pointerCount ||
        next.referenceCount != counts.referenceCount || nodeCount != counts.leafCount)
        fail("its counts of nodes, pointers, references or leaves exceed what the root reaches");
    for (uint64_t l = 0; l < counts.leafCount; ++l) {
        uint64_t voxels = 0;
        for (uint64_t plane = 0; plane < 8; ++plane)
            voxels |= uint64_t(in[at.leaves + plane * counts.leafCount + l]) << (8 * plane);
        if (voxels == 0 || (voxels & ~leafVoxels(grid)) != 0)
            fail("leaf " + std::to_string(l) +
                 (voxels == 0 ? " is empty" : " has voxels outside the grid"));
        dag.words.push_back(uint32_t(voxels));
        dag.words.push_back(uint32_t(voxels >> 32));
    }
    return dag;
}

} // namespace shadowdag
