// SPDX-License-Identifier: Apache-2.0
// Files in the scratch folder: level-L.nodes (streams as in node_stream.h; a node's number is its
// position), map-P-L (the new numbers of the nodes of part P's level L, 4 bytes each; removed once
// L + 1 is done).
#include "voxel/level_merge.h"

#include "cuda/error.h"

#include <algorithm>
#include <filesystem>

namespace shadowdag {
namespace {

constexpr size_t kFlushBytes = size_t(1) << 18;
/// Nodes between two checks of progress and memory.
constexpr uint64_t kNodesPerCheck = 1 << 14;

std::vector<uint32_t> readNumbers(const std::string& path, uint64_t count) {
    std::vector<uint32_t> numbers(count);
    ReadableFile(path, "scratch file").read(0, numbers.data(), 4 * count);
    return numbers;
}

void writeNumbers(const std::string& path, const std::vector<uint32_t>& numbers) {
    ScratchFile out(path);
    out.write(numbers.data(), 4 * numbers.size());
    out.close();
}

std::string mapPath(const ScratchFolder& folder, size_t part, uint32_t level) {
    return folder / ("map-" + std::to_string(part) + "-" + std::to_string(level));
}

} // namespace

LevelMerge::LevelMerge(const std::vector<PartReader>& parts, const ScratchFolder& folder,
                       const MemoryLimit& limit, const std::function<void()>& check)
    : grid_(parts.front().header().grid), folder_(folder), limit_(limit), check_(check) {
    const uint32_t taskLevel = taskLevelOf(grid_);
    for (uint32_t level = kLeafLog2; level <= taskLevel; ++level)
        mergeLevel(parts, level);
    for (size_t p = 0; p < parts.size(); ++p) {
        const std::vector<uint32_t> numbers = readNumbers(
            mapPath(folder, p, taskLevel), parts[p].header().levels[taskLevel].nodeCount);
        for (const Subtree& s : parts[p].subtrees())
            subtrees_.push_back({s.cell, s.address == kNoNode ? kNoNode : numbers[s.address]});
    }
    sortSubtrees(subtrees_);
}

std::string LevelMerge::levelPath(uint32_t level) const {
    return folder_ / ("level-" + std::to_string(level) + ".nodes");
}

void LevelMerge::mergeLevel(const std::vector<PartReader>& parts, uint32_t level) {
    LevelCounts most; // if no two parts had a node in common
    for (const PartReader& part : parts) {
        most.nodeCount += part.header().levels[level].nodeCount;
        most.pointerCount += part.header().levels[level].pointerCount;
    }
    NodeTable table;
    // Reserve address space for all of it: a growing table would briefly exist twice. No table has
    // more words than addresses, however many nodes the parts have in common.
    table.reserveWords(std::min<uint64_t>(
        level == kLeafLog2 ? 2 * most.nodeCount : most.nodeCount + most.pointerCount, kNoNode));
    for (size_t p = 0; p < parts.size(); ++p) {
        const PartHeader& header = parts[p].header();
        std::vector<uint32_t> below;
        limit_.require(4 * header.levels[level].nodeCount +
                       (level > kLeafLog2 ? 4 * header.levels[level - 1].nodeCount : 0));
        if (level > kLeafLog2)
            below = readNumbers(mapPath(folder_, p, level - 1), header.levels[level - 1].nodeCount);
        std::vector<uint32_t> here;
        here.reserve(header.levels[level].nodeCount);
        NodeReader reader = parts[p].level(level);
        for (NodeWords node; reader.next(node);) {
            for (uint32_t i = 1; level > kLeafLog2 && i < node.count; ++i)
                node.words[i] = below[node.words[i]];
            if (table.isIndexFull())
                limit_.require(table.indexGrowthByteCount());
            if (here.size() % kNodesPerCheck == 0) {
                check_();
                limit_.require(kNodesPerCheck * sizeof node.words);
            }
            here.push_back(table.findOrAdd(node.words, node.count));
        }
        writeNumbers(mapPath(folder_, p, level), here);
    }
    table.dropIndex();
    limit_.require(4 * table.words().size());
    const std::vector<uint32_t> number = writeLevel(level, table.words());
    table = NodeTable();
    for (size_t p = 0; p < parts.size(); ++p) {
        check_();
        std::vector<uint32_t> here =
            readNumbers(mapPath(folder_, p, level), parts[p].header().levels[level].nodeCount);
        for (uint32_t& address : here)
            address = number[address];
        writeNumbers(mapPath(folder_, p, level), here);
        if (level > kLeafLog2)
            std::filesystem::remove(mapPath(folder_, p, level - 1));
    }
}

std::vector<uint32_t> LevelMerge::writeLevel(uint32_t level, const std::vector<uint32_t>& words) {
    std::vector<uint32_t> number(words.size(), kNoNode);
    ScratchFile out(levelPath(level));
    std::vector<uint8_t> buffer;
    LevelCounts& counts = counts_[level];
    for (size_t a = 0; a < words.size();) {
        NodeWords node;
        node.count = level == kLeafLog2 ? 2 : 1 + bitCount32(words[a]);
        std::copy_n(&words[a], node.count, node.words);
        appendNode(level, node, buffer);
        number[a] = uint32_t(counts.nodeCount++);
        counts.pointerCount += level == kLeafLog2 ? 0 : node.count - 1;
        a += node.count;
        if (buffer.size() >= kFlushBytes) {
            check_();
            out.write(buffer.data(), buffer.size());
            buffer.clear();
        }
    }
    out.write(buffer.data(), buffer.size());
    out.close();
    return number;
}

uint32_t LevelMerge::joinAbove(OctreeCounts& counts) {
    const uint32_t rootLevel = rootLevelOf(grid_), taskLevel = taskLevelOf(grid_);
    DagBuilder above(rootLevel);
    uint32_t root = joinSubtrees(above, grid_, subtrees_, &counts);
    // Children of the lowest of these levels are numbers already; those of the others are
    // addresses.
    std::vector<uint32_t> below;
    for (uint32_t level = taskLevel + 1; level <= rootLevel; ++level) {
        std::vector<uint32_t> words = above.words(level);
        if (level > taskLevel + 1)
            for (size_t a = 0; a < words.size();) {
                const uint32_t children = bitCount32(words[a]);
                for (uint32_t i = 1; i <= children; ++i)
                    words[a + i] = below[words[a + i]];
                a += 1 + children;
            }
        below = writeLevel(level, words);
    }
    return root == kNoNode || rootLevel == taskLevel ? root : below[root];
}

// Calls f(node) for all nodes of a level in order of rank. As many as memory allows are collected
// at a time, each time from the whole file.
template <class F>
void LevelMerge::forEachInOrder(uint32_t level, const std::vector<uint32_t>& rank,
                                const F& f) const {
    const LevelCounts& counts = counts_[level];
    if (counts.nodeCount == 0)
        return;
    // Twice the average size of a node, and its start.
    const uint64_t nodeBytes =
        16 + 8 * (level == kLeafLog2 ? 2 : 1 + counts.pointerCount / counts.nodeCount);
    const uint64_t least = std::min<uint64_t>(counts.nodeCount, 1 << 16);
    limit_.require(least * nodeBytes);
    const uint64_t window = std::max(least, limit_.available() / 2 / nodeBytes);
    const auto file = std::make_shared<ReadableFile>(levelPath(level), "scratch file");
    for (uint64_t first = 0; first < counts.nodeCount; first += window) {
        const uint64_t last = std::min(first + window, counts.nodeCount);
        std::vector<uint32_t> words;
        std::vector<size_t> start(last - first, 0);
        words.reserve((last - first) * (nodeBytes - 16) / 8);
        NodeReader reader(file, 0, level, counts,
                          level > kLeafLog2 ? counts_[level - 1].nodeCount : 0);
        NodeWords node;
        for (uint64_t number = 0; reader.next(node); ++number) {
            if (number % kNodesPerCheck == 0)
                check_();
            if (rank[number] < first || rank[number] >= last)
                continue;
            start[rank[number] - first] = words.size();
            words.insert(words.end(), node.words, node.words + node.count);
        }
        for (const size_t at : start)
            f(&words[at]);
    }
}

std::vector<uint32_t> LevelMerge::visit(uint32_t top, const std::vector<uint32_t>& roots,
                                        NodeSink& sink) const {
    limit_.require(4 * counts_[top].nodeCount);
    std::vector<uint32_t> rank(counts_[top].nodeCount, kNoNode), below, rootRanks;
    uint32_t seen = 0;
    for (const uint32_t root : roots) {
        if (root != kNoNode && rank[root] == kNoNode)
            rank[root] = seen++;
        rootRanks.push_back(root == kNoNode ? kNoNode : rank[root]);
    }
    for (uint32_t level = top;; --level) {
        // A node that no root reaches would leave a gap in the order.
        if (seen != counts_[level].nodeCount)
            throw Error(ErrorKind::kInput, "the parts hold nodes of level " +
                                               std::to_string(level) +
                                               " that belong to no task; they are damaged, build "
                                               "them again");
        if (level == kLeafLog2)
            break;
        limit_.require(4 * counts_[level - 1].nodeCount);
        below.assign(counts_[level - 1].nodeCount, kNoNode);
        seen = 0;
        forEachInOrder(level, rank, [&](const uint32_t* node) {
            uint32_t children[8];
            const uint32_t count = bitCount32(node[0]);
            for (uint32_t i = 0; i < count; ++i) {
                uint32_t& child = below[node[1 + i]];
                if (child == kNoNode)
                    child = seen++;
                children[i] = child;
            }
            sink.inner(level, node[0], children);
        });
        rank.swap(below);
        std::vector<uint32_t>().swap(below);
    }
    forEachInOrder(kLeafLog2, rank,
                   [&](const uint32_t* node) { sink.leaf(node[0] | uint64_t(node[1]) << 32); });
    return rootRanks;
}

} // namespace shadowdag
