// SPDX-License-Identifier: Apache-2.0
#include "voxel/dag_builder.h"

#include "cuda/error.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <string>

namespace shadowdag {
namespace {

uint32_t innerWordCount(uint32_t mask) {
    return 1 + uint32_t(std::popcount(mask));
}

uint32_t wordCountAt(uint32_t level, const std::vector<uint32_t>& words, size_t address) {
    return level == kLeafLog2 ? 2 : innerWordCount(words[address]);
}

} // namespace

void throwTooManyWords() {
    throw Error(ErrorKind::kResource,
                "the voxel DAG needs more than the 2^32 words that 32-bit addresses reach; "
                "choose a lower resolution");
}

void throwOutOfMemory(const std::string& doing, const VoxelGrid& grid) {
    throw Error(ErrorKind::kResource, "out of memory while " + doing + " at " +
                                          std::to_string(grid.resolution()) +
                                          "^3; choose a lower resolution");
}

// One multiplication per word, then a final step that mixes the high bits into the low ones. Any
// function would be correct, because equality is decided by content.
uint32_t NodeTable::hashWords(const uint32_t* words, uint32_t count) {
    uint64_t h = words[0] * 0x9e3779b97f4a7c15u;
    for (uint32_t i = 1; i < count; ++i)
        h = (std::rotl(h, 23) ^ words[i]) * 0x9e3779b97f4a7c15u;
    h = (h ^ (h >> 32)) * 0xd6e8feb86659fd93u;
    return uint32_t(h >> 32);
}

uint32_t NodeTable::findOrAdd(const uint32_t* node, uint32_t wordCount) {
    if (nodeCount_ * 2 >= slots_.size())
        grow();
    const uint32_t hash = hash_(node, wordCount);
    const size_t last = slots_.size() - 1;
    for (size_t i = hash & last;; i = (i + 1) & last) {
        const uint64_t slot = slots_[i];
        if (slot == kFree) {
            const size_t address = words_.size();
            if (address + wordCount > maxWordCount_)
                throwTooManyWords();
            words_.insert(words_.end(), node, node + wordCount);
            slots_[i] = uint64_t(hash) << 32 | address;
            ++nodeCount_;
            return uint32_t(address);
        }
        const uint32_t address = uint32_t(slot);
        // Equal first words mean equal counts, so comparing the rest cannot leave words_.
        if (slot >> 32 == hash && words_[address] == node[0] &&
            std::memcmp(words_.data() + address + 1, node + 1, (wordCount - 1) * 4) == 0)
            return address;
    }
}

void NodeTable::clear() {
    words_.clear();
    std::fill(slots_.begin(), slots_.end(), kFree);
    nodeCount_ = 0;
}

void NodeTable::grow() {
    const std::vector<uint64_t> old = std::move(slots_);
    slots_.assign(old.empty() ? 64 : old.size() * 2, kFree);
    const size_t last = slots_.size() - 1;
    for (const uint64_t slot : old) {
        if (slot == kFree)
            continue;
        size_t i = (slot >> 32) & last;
        while (slots_[i] != kFree)
            i = (i + 1) & last;
        slots_[i] = slot;
    }
}

uint32_t DagBuilder::addLeaf(uint64_t voxels) {
    if (voxels == 0)
        return kNoNode;
    const uint32_t words[2] = {uint32_t(voxels), uint32_t(voxels >> 32)};
    return table(kLeafLog2).findOrAdd(words, 2);
}

uint32_t DagBuilder::addInner(uint32_t level, const uint32_t children[8]) {
    uint32_t words[9];
    uint32_t mask = 0, count = 1;
    for (uint32_t c = 0; c < 8; ++c)
        if (children[c] != kNoNode) {
            mask |= 1u << c;
            words[count++] = children[c];
        }
    if (mask == 0)
        return kNoNode;
    words[0] = mask;
    return table(level).findOrAdd(words, count);
}

uint32_t DagBuilder::addSubtree(const DagBuilder& other, uint32_t level, uint32_t address) {
    if (address == kNoNode)
        return kNoNode;
    // From the leaves up: below[a] is the new address of the node at a of the level below.
    std::vector<uint32_t> below, here;
    for (uint32_t l = kLeafLog2; l <= level; ++l) {
        const std::vector<uint32_t>& words = other.table(l).words();
        here.assign(words.size(), kNoNode);
        for (size_t a = 0; a < words.size();) {
            const uint32_t count = wordCountAt(l, words, a);
            uint32_t node[9];
            std::memcpy(node, &words[a], count * 4);
            if (l > kLeafLog2)
                for (uint32_t i = 1; i < count; ++i)
                    node[i] = below[node[i]];
            here[a] = table(l).findOrAdd(node, count);
            a += count;
        }
        below.swap(here);
    }
    return below[address];
}

void DagBuilder::clear() {
    for (NodeTable& t : tables_)
        t.clear();
}

Dag DagBuilder::finish(uint32_t level, uint32_t address, const VoxelGrid& grid) const {
    Dag dag;
    dag.grid = grid;
    if (address == kNoNode)
        return dag;
    // Breadth first: `order` holds a level's nodes as first visited, `base` the address of the
    // first of them.
    std::vector<uint32_t> order{address}, next, newAddress;
    uint64_t base = 0;
    dag.rootAddress = 0;
    for (uint32_t l = level;; --l) {
        const std::vector<uint32_t>& words = table(l).words();
        uint64_t wordCount = 0;
        for (const uint32_t a : order)
            wordCount += wordCountAt(l, words, a);
        const uint64_t nextBase = base + wordCount;
        if (nextBase > maxWordCount_)
            throwTooManyWords();
        dag.words.reserve(nextBase);
        if (l == kLeafLog2) {
            for (const uint32_t a : order)
                dag.words.insert(dag.words.end(), {words[a], words[a + 1]});
            return dag;
        }
        newAddress.assign(table(l - 1).words().size(), kNoNode);
        next.clear();
        uint64_t cursor = nextBase;
        for (const uint32_t a : order) {
            const uint32_t count = wordCountAt(l, words, a);
            dag.words.push_back(words[a]);
            for (uint32_t i = 1; i < count; ++i) {
                const uint32_t child = words[a + i];
                if (newAddress[child] == kNoNode) {
                    if (cursor > maxWordCount_)
                        throwTooManyWords();
                    newAddress[child] = uint32_t(cursor);
                    cursor += wordCountAt(l - 1, table(l - 1).words(), child);
                    next.push_back(child);
                }
                dag.words.push_back(newAddress[child]);
            }
        }
        order.swap(next);
        base = nextBase;
    }
}

uint64_t DagBuilder::byteCount() const {
    uint64_t bytes = 0, growth = 0;
    for (const NodeTable& t : tables_) {
        bytes += t.byteCount();
        growth = std::max(growth, t.growthByteCount());
    }
    return bytes + growth;
}

LevelCounts DagBuilder::counts(uint32_t level) const {
    const NodeTable& t = table(level);
    return {t.nodeCount(), level == kLeafLog2 ? 0 : t.words().size() - t.nodeCount()};
}

std::vector<uint32_t> DagBuilder::visit(uint32_t level, const std::vector<uint32_t>& roots,
                                        NodeSink& sink) const {
    // order: a level's nodes as first visited; number: of each address of a level.
    std::vector<uint32_t> order, next, number(table(level).words().size(), kNoNode);
    const auto numberOf = [](uint32_t address, std::vector<uint32_t>& numbers,
                             std::vector<uint32_t>& list) {
        if (numbers[address] == kNoNode) {
            numbers[address] = uint32_t(list.size());
            list.push_back(address);
        }
        return numbers[address];
    };
    std::vector<uint32_t> rootNumbers;
    for (const uint32_t root : roots)
        rootNumbers.push_back(root == kNoNode ? kNoNode : numberOf(root, number, order));
    for (uint32_t l = level; l > kLeafLog2; --l) {
        const std::vector<uint32_t>& words = table(l).words();
        number.assign(table(l - 1).words().size(), kNoNode);
        next.clear();
        for (const uint32_t a : order) {
            uint32_t children[8];
            const uint32_t count = wordCountAt(l, words, a) - 1;
            for (uint32_t i = 0; i < count; ++i)
                children[i] = numberOf(words[a + 1 + i], number, next);
            sink.inner(l, words[a], children);
        }
        order.swap(next);
    }
    const std::vector<uint32_t>& leaves = table(kLeafLog2).words();
    for (const uint32_t a : order)
        sink.leaf(leaves[a] | uint64_t(leaves[a + 1]) << 32);
    return rootNumbers;
}

} // namespace shadowdag
