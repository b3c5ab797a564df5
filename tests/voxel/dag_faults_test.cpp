// SPDX-License-Identifier: Apache-2.0
// Each fault of the voxels' content does what it says.
#include "voxel/dag_faults.h"

#include "tests/voxel/voxel_sets.h"

#include <gtest/gtest.h>

namespace shadowdag {
namespace {

#if SDAG_HAS_MUTANTS

Dag faulty(const DenseGrid& grid, Mutant mutant) {
    const Mutant before = detail::chosenMutant;
    detail::chosenMutant = mutant;
    Dag dag = withVoxelFault(dagOf(grid));
    detail::chosenMutant = before;
    return dag;
}

/// Calls visit(x, y, z, whether the DAG holds it) for every voxel of the grid.
template <class Visit> void forVoxels(const DenseGrid& grid, const Dag& dag, const Visit& visit) {
    for (uint32_t z = 0; z < grid.size(); ++z)
        for (uint32_t y = 0; y < grid.size(); ++y)
            for (uint32_t x = 0; x < grid.size(); ++x)
                visit(x, y, z, isOccupied(dag.view(), x, y, z));
}

/// Returns how many of a voxel's 26 neighbours within the grid, and itself, are occupied or empty.
uint32_t countAround(const DenseGrid& grid, uint32_t x, uint32_t y, uint32_t z) {
    uint32_t count = 0;
    for (uint32_t k = 0; k < 27; ++k)
        count += grid.at(x + k % 3 - 1, y + k / 3 % 3 - 1, z + k / 9 - 1);
    return count;
}

TEST(DagFaults, DilationOccupiesExactlyTheNeighbours) {
    std::mt19937 random(7);
    const DenseGrid grid = randomGrid(5, 0.01, random);
    const Dag dag = faulty(grid, Mutant::kDagDilated);
    forVoxels(grid, dag, [&](uint32_t x, uint32_t y, uint32_t z, bool is) {
        ASSERT_EQ(is, countAround(grid, x, y, z) > 0) << x << " " << y << " " << z;
    });
}

TEST(DagFaults, ErosionKeepsVoxelsWhoseNeighboursAlongTheAxesAreOccupied) {
    std::mt19937 random(8);
    const DenseGrid grid = randomGrid(5, 0.8, random);
    const uint32_t n = grid.size();
    const Dag dag = faulty(grid, Mutant::kDagEroded);
    const auto isSolid = [&](uint32_t x, uint32_t y, uint32_t z) { // the grid's sides do not erode
        return x >= n || y >= n || z >= n || grid.at(x, y, z);
    };
    uint32_t keptCount = 0;
    forVoxels(grid, dag, [&](uint32_t x, uint32_t y, uint32_t z, bool is) {
        const bool isInside = isSolid(x - 1, y, z) && isSolid(x + 1, y, z) &&
                              isSolid(x, y - 1, z) && isSolid(x, y + 1, z) &&
                              isSolid(x, y, z - 1) && isSolid(x, y, z + 1);
        ASSERT_EQ(is, grid.at(x, y, z) && isInside) << x << " " << y << " " << z;
        keptCount += is;
    });
    EXPECT_GT(keptCount, 100u);
}

TEST(DagFaults, ShiftMovesAllVoxelsAlongX) {
    std::mt19937 random(9);
    const DenseGrid grid = randomGrid(5, 0.3, random);
    const Dag dag = faulty(grid, Mutant::kDagShifted);
    forVoxels(grid, dag, [&](uint32_t x, uint32_t y, uint32_t z, bool is) {
        ASSERT_EQ(is, grid.at(x - 1, y, z)) << x << " " << y << " " << z;
    });
}

TEST(DagFaults, OthersChangeSomeVoxelsButNotAll) {
    std::mt19937 random(10);
    const DenseGrid grid = randomGrid(6, 0.1, random);
    for (const Mutant mutant :
         {Mutant::kDagSubtreesSwapped, Mutant::kDagSubtreeLost, Mutant::kDagBitsFlipped}) {
        const Dag dag = faulty(grid, mutant);
        size_t changed = 0, same = 0;
        forVoxels(grid, dag, [&](uint32_t x, uint32_t y, uint32_t z, bool is) {
            changed += is != grid.at(x, y, z);
            same += is && grid.at(x, y, z);
        });
        EXPECT_GT(changed, 10u) << int(mutant);
        EXPECT_GT(same, grid.count() / 8) << int(mutant);
    }
}

#endif

TEST(DagFaults, WithoutAFaultNothingChanges) {
    std::mt19937 random(11);
    const Dag dag = dagOf(randomGrid(5, 0.1, random));
    EXPECT_EQ(withVoxelFault(dag).words, dag.words);
}

} // namespace
} // namespace shadowdag
