// SPDX-License-Identifier: Apache-2.0
#include "voxel/pass_nodes.h"

namespace shadowdag {
namespace {

/// Replaces the cells of a level by those of the level above; returns that level's nodes.
Words joinLevel(PassMemory& memory, LongWords& keys, Words& nodeOfCell) {
    std::optional<PassMemory::HeldRuns> held(memory.runsOf(keys, 3));
    const size_t count = held->runs.count();
    LongWords keysAbove = memory.longWords("voxelize cell keys", count);
    Words children = memory.words("voxelize cell children", count * kChildCount);
    runPass(memory.backend,
            GatherChildren{std::as_const(keys).view(), std::as_const(nodeOfCell).view(),
                           held->runs.start.view(), keysAbove.view(), children.view()});
    held.reset();
    keys = std::move(keysAbove);
    Words order = memory.counting("voxelize cell order", count);
    {
        LongWords packed = memory.longWords("voxelize node keys", count);
        for (uint32_t key = 0; key < kNodeKeyCount; ++key) {
            runPass(memory.backend, PackNodeKeys{std::as_const(children).view(),
                                                 std::as_const(order).view(), key, packed.view()});
            memory.sort(packed, order);
        }
    }
    PassMemory::HeldRuns distinct(memory, count);
    distinct.runs.next.resize(count + 1);
    runPass(memory.backend,
            MarkDistinctNodes{std::as_const(children).view(), std::as_const(order).view(),
                              distinct.runs.next.view()});
    listMarkedRuns(memory.backend, distinct.runs);
    Words nodes = memory.words("voxelize nodes", distinct.runs.count() * kChildCount);
    runPass(memory.backend,
            ListDistinctNodes{std::as_const(children).view(), std::as_const(order).view(),
                              distinct.runs.start.view(), nodes.view()});
    Words nodeOfAbove = memory.words("voxelize node of cell", count);
    runPass(memory.backend, NumberByRun{std::as_const(order).view(), distinct.runs.next.view(),
                                        nodeOfAbove.view()});
    nodeOfCell = std::move(nodeOfAbove);
    return nodes;
}

/// One level in canonical order.
struct OrderedLevel {
    Words order;
    std::optional<Words> first; ///< edges before each node; empty for leaves
    uint32_t base = 0;

    LevelWords place() const { return {base, first ? first->view() : View<const uint32_t>{}}; }
};

/// Returns the offset of a level of `count` words and advances past it.
uint32_t nextBase(uint64_t& wordCount, uint64_t count) {
    const uint64_t base = wordCount;
    wordCount += count;
    if (wordCount > kNoNode - 1)
        throwTooManyWords();
    return uint32_t(base);
}

} // namespace

PassNodes buildNodes(PassMemory& memory, std::optional<PassLeaves> leaves, uint32_t topLevel) {
    PassNodes nodes;
    if (!leaves)
        return nodes;
    LongWords keys = std::move(leaves->keys);
    Words nodeOfCell = memory.words("voxelize node of cell", keys.size());
    {
        LongWords sorted = std::move(leaves->voxels);
        leaves.reset();
        Words order = memory.counting("voxelize cell order", keys.size());
        memory.sort(sorted, order);
        const PassMemory::HeldRuns held = memory.runsOf(sorted, 0);
        nodes.leaves.emplace(memory.longWords("voxelize leaves", held.runs.count()));
        runPass(memory.backend, ListRunValues{std::as_const(sorted).view(), held.runs.start.view(),
                                              nodes.leaves->view()});
        runPass(memory.backend,
                NumberByRun{std::as_const(order).view(), held.runs.next.view(), nodeOfCell.view()});
    }
    for (uint32_t level = kLeafLog2 + 1; level <= topLevel; ++level)
        nodes.inner.push_back(joinLevel(memory, keys, nodeOfCell));
    return nodes;
}

uint32_t mergeNodes(const PassNodes& nodes, uint32_t topLevel, DagBuilder& merged) {
    if (!nodes.leaves)
        return kNoNode;
    std::vector<uint32_t> below, here;
    for (const uint64_t voxels : nodes.leaves->buffer().download())
        here.push_back(merged.addLeaf(voxels));
    for (uint32_t l = kLeafLog2 + 1; l <= topLevel; ++l) {
        below.swap(here);
        here.clear();
        std::vector<uint32_t> children = nodes.inner[l - kLeafLog2 - 1].buffer().download();
        for (size_t n = 0; n < children.size(); n += kChildCount) {
            for (uint32_t c = 0; c < kChildCount; ++c)
                if (children[n + c] != kNoNode)
                    children[n + c] = below[children[n + c]];
            here.push_back(merged.addInner(l, &children[n]));
        }
    }
    SDAG_ASSERT(here.size() == 1);
    return here[0];
}

std::vector<uint32_t> canonicalWords(PassMemory& memory, const PassNodes& nodes) {
    if (!nodes.leaves)
        return {};
    // levels[0] is the root's; ranks[i] of the nodes of levels[i].
    std::vector<OrderedLevel> levels;
    std::vector<Words> ranks;
    levels.push_back({memory.counting("voxelize canonical order", 1), {}, 0});
    ranks.push_back(memory.counting("voxelize ranks", 1));
    uint64_t wordCount = 0;
    for (size_t i = nodes.inner.size(); i-- > 0;) {
        OrderedLevel& here = levels.back();
        const View<const uint32_t> children = nodes.inner[i].view();
        const View<const uint32_t> order = std::as_const(here.order).view();
        here.first.emplace(memory.places("voxelize first edge", order.count));
        runPass(memory.backend, CountEdges{children, order, here.first->view()});
        const size_t edgeCount = memory.scan(*here.first);
        here.base = nextBase(wordCount, order.count + edgeCount);
        const size_t belowCount =
            i > 0 ? nodes.inner[i - 1].size() / kChildCount : nodes.leaves->size();
        Words firstEdge = memory.words("voxelize first visits", belowCount);
        firstEdge.buffer().fill(0xff);
        runPass(memory.backend,
                VisitEdges{children, order, std::as_const(*here.first).view(), firstEdge.view()});
        Words below = memory.counting("voxelize canonical order", belowCount);
        {
            const Reservation scratch(memory.budget, 2 * belowCount * sizeof(uint32_t));
            sortPairs(memory.backend, firstEdge.view(), below.view());
        }
        Words rank = memory.words("voxelize ranks", belowCount);
        runPass(memory.backend, RankNodes{std::as_const(below).view(), rank.view()});
        levels.push_back({std::move(below), {}, 0});
        ranks.push_back(std::move(rank));
    }
    levels.back().base = nextBase(wordCount, 2 * uint64_t(nodes.leaves->size()));
    Words all = memory.words("voxelize words", wordCount);
    for (size_t k = 0; k + 1 < levels.size(); ++k)
        runPass(memory.backend, WriteInnerNodes{nodes.inner[nodes.inner.size() - 1 - k].view(),
                                                std::as_const(levels[k].order).view(),
                                                levels[k].place(), levels[k + 1].place(),
                                                std::as_const(ranks[k + 1]).view(), all.view()});
    runPass(memory.backend,
            WriteLeaves{nodes.leaves->view(), std::as_const(levels.back().order).view(),
                        levels.back().place(), all.view()});
    return all.buffer().download();
}

} // namespace shadowdag
