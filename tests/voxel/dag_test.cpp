// SPDX-License-Identifier: Apache-2.0
#include "voxel/dag.h"

#include "tests/voxel/voxel_sets.h"

#include <gtest/gtest.h>

#include <array>
#include <map>
#include <set>

namespace shadowdag {
namespace {

TEST(Dag, ContainsExactlyTheVoxelsItWasBuiltFrom) {
    std::mt19937 random(1);
    for (uint32_t log2 = 0; log2 <= 5; ++log2)
        for (const double density : {0.0, 0.02, 0.5, 1.0}) {
            const DenseGrid grid = randomGrid(log2, density, random);
            const Dag dag = dagOf(grid);
            EXPECT_EQ(dag.empty(), grid.count() == 0);
            EXPECT_EQ(computeDagStats(dag).voxelCount, grid.count());
            for (uint32_t z = 0; z <= grid.size(); ++z)
                for (uint32_t y = 0; y <= grid.size(); ++y)
                    for (uint32_t x = 0; x <= grid.size(); ++x)
                        ASSERT_EQ(isOccupied(dag.view(), x, y, z), grid.at(x, y, z))
                            << log2 << ": " << x << " " << y << " " << z;
        }
}

TEST(Dag, FullGridHasOneNodeALevel) {
    DenseGrid grid(5);
    grid.bits.assign(grid.bits.size(), true);
    const Dag dag = dagOf(grid);
    const DagStats stats = computeDagStats(dag);
    EXPECT_EQ(stats.nodeCounts, (std::vector<uint64_t>{1, 1, 1, 1, 1}));
    EXPECT_EQ(stats.svoNodeCounts, (std::vector<uint64_t>{1, 8, 64, 512, 4096}));
    EXPECT_EQ(stats.voxelCount, 32768u);
    EXPECT_EQ(stats.leafCount, 1u);
    EXPECT_EQ(dag.words.size(), 3 * 9 + 2u);
    EXPECT_EQ(stats.tracedBytes, dag.words.size() * 4);
}

// 2^51 voxels in 137 words: sizes are 64 bits wide.
TEST(Dag, FullGridOfTheHighestResolutionIsCountedWithoutOverflow) {
    DagBuilder builder(kMaxResolutionLog2);
    uint32_t address = builder.addLeaf(~uint64_t(0));
    for (uint32_t level = kLeafLog2 + 1; level <= kMaxResolutionLog2; ++level) {
        const uint32_t children[8] = {address, address, address, address,
                                      address, address, address, address};
        address = builder.addInner(level, children);
    }
    VoxelGrid grid;
    grid.resolutionLog2 = kMaxResolutionLog2;
    const Dag dag = builder.finish(kMaxResolutionLog2, address, grid);
    const DagStats stats = computeDagStats(dag);
    EXPECT_EQ(stats.voxelCount, uint64_t(1) << 51);
    EXPECT_EQ(stats.svoNodeCounts.back(), uint64_t(1) << 48);
    EXPECT_EQ(dag.words.size(), (kMaxResolutionLog2 - kLeafLog2) * 9 + 2u);
    const uint32_t last = grid.resolution() - 1;
    EXPECT_TRUE(isOccupied(dag.view(), last, last, last));
}

// Counts cells of every level and different contents of them, straight from the dense grid.
TEST(Dag, StatsAgreeWithCountingSubtreesByContent) {
    std::mt19937 random(2);
    for (const double density : {0.01, 0.1, 0.6}) {
        const DenseGrid grid = randomGrid(5, density, random);
        const DagStats stats = computeDagStats(dagOf(grid));
        for (uint32_t level = 1; level <= 5; ++level) {
            std::set<std::vector<bool>> contents;
            uint64_t cells = 0;
            const uint32_t side = 1u << level;
            for (uint32_t z = 0; z < 32; z += side)
                for (uint32_t y = 0; y < 32; y += side)
                    for (uint32_t x = 0; x < 32; x += side) {
                        std::vector<bool> content;
                        bool any = false;
                        for (uint32_t i = 0; i < side * side * side; ++i) {
                            content.push_back(
                                grid.at(x + i % side, y + i / side % side, z + i / side / side));
                            any = any || content.back();
                        }
                        cells += any;
                        if (any)
                            contents.insert(content);
                    }
            EXPECT_EQ(stats.svoNodeCounts[5 - level], cells);
            EXPECT_EQ(stats.nodeCounts[5 - level], contents.size());
        }
    }
}

} // namespace
} // namespace shadowdag
