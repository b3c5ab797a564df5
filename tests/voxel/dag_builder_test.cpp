// SPDX-License-Identifier: Apache-2.0
#include "voxel/dag_builder.h"

#include "cuda/error.h"
#include "tests/voxel/voxel_sets.h"

#include <gtest/gtest.h>

#include <set>
#include <string>

namespace shadowdag {
namespace {

TEST(NodeTable, FindsEveryNodeAgainThroughManyGrowths) {
    NodeTable table;
    std::mt19937 random(3);
    std::vector<std::vector<uint32_t>> nodes;
    std::vector<uint32_t> addresses;
    std::set<std::vector<uint32_t>> seen;
    while (nodes.size() < 20000) {
        // Few values, so that many nodes share most of their words.
        std::vector<uint32_t> node(1 + random() % 8);
        for (uint32_t& w : node)
            w = random() % 8;
        node[0] = (1u << (node.size() - 1)) - 1 + (uint32_t(random() % 512) << 8);
        if (!seen.insert(node).second)
            continue;
        addresses.push_back(table.findOrAdd(node.data(), uint32_t(node.size())));
        nodes.push_back(node);
    }
    const size_t words = table.words().size();
    for (size_t i = 0; i < nodes.size(); ++i) {
        EXPECT_EQ(table.findOrAdd(nodes[i].data(), uint32_t(nodes[i].size())), addresses[i]);
        EXPECT_TRUE(
            std::equal(nodes[i].begin(), nodes[i].end(), table.words().begin() + addresses[i]));
    }
    EXPECT_EQ(table.words().size(), words);
}

// Nodes are equal only when their words are, whatever their hashes: all keys into one chain.
TEST(NodeTable, NodesWithEqualHashesAreDistinguished) {
    NodeTable table(+[](const uint32_t*, uint32_t) { return 7u; });
    std::vector<uint32_t> addresses;
    for (uint32_t i = 0; i < 300; ++i) {
        const uint32_t node[2] = {1, i};
        addresses.push_back(table.findOrAdd(node, 2));
    }
    EXPECT_EQ(std::set<uint32_t>(addresses.begin(), addresses.end()).size(), 300u);
    for (uint32_t i = 0; i < 300; ++i) {
        const uint32_t node[2] = {1, i};
        EXPECT_EQ(table.findOrAdd(node, 2), addresses[i]);
    }
}

TEST(DagBuilder, OrderOfAdditionsDoesNotMatter) {
    std::mt19937 random(4);
    const DenseGrid grid = randomGrid(5, 0.1, random);
    const Dag expected = dagOf(grid);
    // Other things first, then the grid through a second builder.
    DagBuilder whole(5), part(5);
    addCell(whole, randomGrid(5, 0.3, random), 5, 0, 0, 0);
    const uint32_t root = addCell(part, grid, 5, 0, 0, 0);
    const Dag dag = whole.finish(5, whole.addSubtree(part, 5, root), expected.grid);
    EXPECT_EQ(dag.words, expected.words);
    EXPECT_EQ(dag.rootAddress, expected.rootAddress);
}

TEST(DagBuilder, CanonicalOrderIsByLevelThenFirstVisit) {
    std::mt19937 random(5);
    const Dag dag = dagOf(randomGrid(6, 0.03, random));
    std::vector<uint32_t> level{dag.rootAddress};
    uint32_t expected = 0;
    for (uint32_t l = 6; l > kLeafLog2; --l) {
        std::vector<uint32_t> below;
        uint32_t next = expected;
        for (const uint32_t a : level) {
            EXPECT_EQ(a, next);
            next += 1 + bitCount32(dag.words[a]);
        }
        std::set<uint32_t> seen;
        for (const uint32_t a : level)
            for (uint32_t i = 1; i <= bitCount32(dag.words[a]); ++i)
                if (seen.insert(dag.words[a + i]).second)
                    below.push_back(dag.words[a + i]);
        expected = next;
        level = below;
    }
    for (const uint32_t a : level) {
        EXPECT_EQ(a, expected);
        expected += 2;
    }
    EXPECT_EQ(expected, dag.words.size());
}

// The limit of 32-bit addresses, met early: every word up to it fits, the next is refused, by a
// level as by the whole.
TEST(DagBuilder, MoreWordsThanAddressesReachAreRefusedNotWrapped) {
    NodeTable table(NodeTable::hashWords, 10);
    for (uint32_t i = 0; i < 5; ++i) {
        const uint32_t node[2] = {1, i};
        EXPECT_EQ(table.findOrAdd(node, 2), 2 * i);
    }
    const uint32_t old[2] = {1, 3}, fresh[2] = {1, 5};
    EXPECT_EQ(table.findOrAdd(old, 2), 6u);
    EXPECT_THROW(table.findOrAdd(fresh, 2), Error);
    EXPECT_EQ(table.words().size(), 10u);

    std::mt19937 random(9);
    const DenseGrid grid = randomGrid(5, 0.3, random);
    const uint64_t wordCount = dagOf(grid).words.size();
    VoxelGrid voxelGrid;
    voxelGrid.resolutionLog2 = 5;
    for (const uint64_t limit : {wordCount, wordCount - 1}) {
        DagBuilder builder(5, limit);
        const uint32_t root = addCell(builder, grid, 5, 0, 0, 0);
        if (limit == wordCount) {
            EXPECT_EQ(builder.finish(5, root, voxelGrid).words.size(), wordCount);
            continue;
        }
        try {
            builder.finish(5, root, voxelGrid);
            FAIL() << "one word too many was taken";
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::kResource);
            EXPECT_NE(std::string(error.what()).find("lower resolution"), std::string::npos);
        }
    }
}

TEST(DagBuilder, NothingAddedGivesAnEmptyDag) {
    DagBuilder builder(3);
    EXPECT_EQ(builder.addLeaf(0), kNoNode);
    const uint32_t children[8] = {kNoNode, kNoNode, kNoNode, kNoNode,
                                  kNoNode, kNoNode, kNoNode, kNoNode};
    EXPECT_EQ(builder.addInner(3, children), kNoNode);
    EXPECT_TRUE(builder.finish(3, kNoNode, VoxelGrid{}).empty());
}

} // namespace
} // namespace shadowdag
