// SPDX-License-Identifier: Apache-2.0
#include "voxel/dag_window.h"

#include "tests/voxel/voxel_sets.h"

#include <gtest/gtest.h>

namespace shadowdag {
namespace {

VoxelGrid cube(uint32_t log2) {
    VoxelGrid grid;
    grid.resolutionLog2 = log2;
    return grid;
}

/// Returns the window, voxel by voxel.
DenseGrid denseWindow(const DenseGrid& from, const glm::uvec3& corner, uint32_t log2) {
    DenseGrid to(log2);
    for (uint32_t z = 0; z < to.size(); ++z)
        for (uint32_t y = 0; y < to.size(); ++y)
            for (uint32_t x = 0; x < to.size(); ++x)
                if (from.at(corner.x + x, corner.y + y, corner.z + z))
                    to.set(x, y, z);
    return to;
}

TEST(DagWindow, IsTheDagOfTheShiftedVoxels) {
    for (unsigned seed = 0; seed < 60; ++seed) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        std::mt19937 random(seed);
        const uint32_t fromLog2 = 2 + random() % 4, toLog2 = 2 + random() % (fromLog2 - 1);
        const DenseGrid from = randomGrid(fromLog2, seed % 3 ? 0.1 : 0.9, random);
        const uint32_t side = from.size() + 4;
        const glm::uvec3 corner(random() % side, random() % side, random() % side);
        const Dag expected = dagOf(denseWindow(from, corner, toLog2));
        const Dag found = cutWindow(dagOf(from), corner, cube(toLog2));
        EXPECT_EQ(found.words, expected.words);
        EXPECT_EQ(found.rootAddress, expected.rootAddress);
    }
}

TEST(DagWindow, AtTheOriginOfTheSameSizeIsTheSame) {
    std::mt19937 random(7);
    const Dag dag = dagOf(randomGrid(5, 0.2, random));
    EXPECT_EQ(cutWindow(dag, glm::uvec3(0), dag.grid).words, dag.words);
}

TEST(DagWindow, OfNothingIsEmpty) {
    EXPECT_TRUE(cutWindow(dagOf(DenseGrid(4)), glm::uvec3(3), cube(4)).empty());
    DenseGrid one(4);
    one.set(15, 15, 15);
    EXPECT_TRUE(cutWindow(dagOf(one), glm::uvec3(16, 0, 0), cube(4)).empty());
    EXPECT_TRUE(cutWindow(dagOf(one), glm::uvec3(1u << 30), cube(4)).empty());
    EXPECT_FALSE(cutWindow(dagOf(one), glm::uvec3(15), cube(2)).empty());
}

TEST(DagWindow, OfAFullGridCostsItsLevelsAlone) {
    // All of 2^17 voxels per axis, shifted by an odd step: 2^51 voxels that must not be expanded.
    DagBuilder builder(kMaxResolutionLog2);
    uint32_t address = builder.addLeaf(~uint64_t(0));
    for (uint32_t level = kLeafLog2 + 1; level <= kMaxResolutionLog2; ++level) {
        uint32_t children[8];
        std::fill_n(children, 8, address);
        address = builder.addInner(level, children);
    }
    const Dag full = builder.finish(kMaxResolutionLog2, address, cube(kMaxResolutionLog2));
    const Dag window = cutWindow(full, glm::uvec3(12345, 1, 0), cube(kMaxResolutionLog2));
    const VoxelBounds bounds = occupiedBounds(window);
    EXPECT_EQ(bounds.min, glm::uvec3(0));
    EXPECT_EQ(bounds.max, glm::uvec3(131071 - 12345, 131070, 131071));
    EXPECT_EQ(computeDagStats(window).voxelCount, (131072ull - 12345) * 131071 * 131072);
}

TEST(DagWindow, BoundsAreThoseOfTheVoxels) {
    for (unsigned seed = 0; seed < 20; ++seed) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        std::mt19937 random(seed);
        DenseGrid grid(5);
        VoxelBounds expected{glm::uvec3(31), glm::uvec3(0)};
        for (int i = 0; i < 3; ++i) {
            const glm::uvec3 p(random() % 32, random() % 32, random() % 32);
            grid.set(p.x, p.y, p.z);
            expected.min = glm::min(expected.min, p);
            expected.max = glm::max(expected.max, p);
        }
        EXPECT_EQ(occupiedBounds(dagOf(grid)), expected);
    }
}

} // namespace
} // namespace shadowdag
