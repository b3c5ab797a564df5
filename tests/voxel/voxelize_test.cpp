// SPDX-License-Identifier: Apache-2.0
#include "voxel/voxelize.h"

#include "cuda/error.h"
#include "tests/voxel/exact_geometry.h"
#include "tests/voxel/soup.h"
#include "tests/voxel/voxel_sets.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <numeric>

namespace shadowdag {
namespace {

TEST(Voxelize, EqualsTheExactOverlapOfASoup) {
    std::mt19937 random(31);
    for (uint32_t log2 = 0; log2 <= 4; ++log2) {
        Soup soup;
        for (int i = 0; i < 6; ++i) {
            glm::vec3 t[3];
            for (glm::vec3& p : t)
                for (int a = 0; a < 3; ++a)
                    p[a] = float(int(random() % (8u << log2)) - int(2u << log2)) / 4;
            soup.add(t[0], t[1], t[2]);
        }
        VoxelGrid grid;
        grid.resolutionLog2 = log2;
        const Dag dag = voxelize(soup.view(), soup.all(), grid);
        size_t occupied = 0;
        for (uint32_t z = 0; z < grid.resolution(); ++z)
            for (uint32_t y = 0; y < grid.resolution(); ++y)
                for (uint32_t x = 0; x < grid.resolution(); ++x) {
                    bool touched = false;
                    for (size_t t = 0; t < soup.triangles.size() && !touched; ++t)
                        touched = exact::hullTouchesBox({exact::point(soup.view().vertex(t, 0), 2),
                                                         exact::point(soup.view().vertex(t, 1), 2),
                                                         exact::point(soup.view().vertex(t, 2), 2)},
                                                        {4 * x, 4 * y, 4 * z},
                                                        {4 * x + 4, 4 * y + 4, 4 * z + 4});
                    ASSERT_EQ(isOccupied(dag.view(), x, y, z), touched)
                        << log2 << ": " << x << " " << y << " " << z;
                    occupied += touched;
                }
        EXPECT_EQ(computeDagStats(dag).voxelCount, occupied);
    }
}

// A plane x = 5 in voxel faces is in both layers beside it; closed form.
TEST(Voxelize, PlaneInVoxelFacesFillsBothSides) {
    Soup soup;
    soup.add({5, 0, 0}, {5, 16, 0}, {5, 0, 16});
    soup.add({5, 16, 16}, {5, 16, 0}, {5, 0, 16});
    VoxelGrid grid;
    grid.resolutionLog2 = 4;
    const Dag dag = voxelize(soup.view(), soup.all(), grid);
    EXPECT_EQ(computeDagStats(dag).voxelCount, 2u * 256);
    for (uint32_t x = 0; x < 16; ++x)
        EXPECT_EQ(isOccupied(dag.view(), x, 9, 3), x == 4 || x == 5);
}

TEST(Voxelize, AnyThreadCountAndTriangleOrderGiveTheSameWords) {
    std::mt19937 random(32);
    Soup soup = randomSoup(300, 1.0f, random);
    const VoxelGrid grid = gridAround(soup.bounds(), 10);
    const Dag expected = voxelize(soup.view(), soup.all(), grid);
    EXPECT_GT(computeDagStats(expected).voxelCount, 100000u);
    for (const int threads : {1, 2, 7}) {
        setThreadCount(threads);
        std::shuffle(soup.which.begin(), soup.which.end(), random);
        const Dag dag = voxelize(soup.view(), soup.all(), grid);
        EXPECT_EQ(dag.words, expected.words) << threads;
        EXPECT_EQ(dag.rootAddress, expected.rootAddress);
    }
    setThreadCount(0);
}

// The octree's sorting and the bricks change nothing: each level of a fine grid is the coarser grid
// of the same triangles.
TEST(Voxelize, CoarserGridIsTheFinerOneReduced) {
    std::mt19937 random(33);
    const Soup soup = randomSoup(40, 1.0f, random);
    const VoxelGrid fine = gridAround(soup.bounds(), 8);
    const Dag fineDag = voxelize(soup.view(), soup.all(), fine);
    for (uint32_t log2 = 3; log2 < 8; ++log2) {
        VoxelGrid grid = fine;
        grid.resolutionLog2 = log2;
        grid.voxelSizeWorld = std::ldexp(fine.voxelSizeWorld, int(8 - log2));
        const Dag dag = voxelize(soup.view(), soup.all(), grid);
        DenseGrid reduced(log2);
        for (uint32_t z = 0; z < 256; ++z)
            for (uint32_t y = 0; y < 256; ++y)
                for (uint32_t x = 0; x < 256; ++x)
                    if (isOccupied(fineDag.view(), x, y, z))
                        reduced.set(x >> (8 - log2), y >> (8 - log2), z >> (8 - log2));
        EXPECT_EQ(dag.words, dagOf(reduced).words) << log2;
    }
}

TEST(Voxelize, IgnoresTrianglesOutsideAndNotListed) {
    Soup soup;
    soup.add({1, 1, 1}, {2, 1, 1}, {1, 2, 1});
    soup.add({-50, -50, -50}, {-60, -50, -50}, {-50, -50, -60});
    soup.add({5, 5, 5}, {6, 5, 5}, {5, 6, 5});
    VoxelGrid grid;
    grid.resolutionLog2 = 3;
    soup.which = {0, 1};
    const Dag dag = voxelize(soup.view(), soup.all(), grid);
    EXPECT_TRUE(isOccupied(dag.view(), 1, 1, 1));
    EXPECT_FALSE(isOccupied(dag.view(), 5, 5, 5));
    soup.which = {1};
    EXPECT_TRUE(voxelize(soup.view(), soup.all(), grid).empty());
    soup.which.clear();
    EXPECT_TRUE(voxelize(soup.view(), soup.all(), grid).empty());
}

TEST(Voxelize, GiantTrianglesFillOnlyTheirPlane) {
    Soup soup;
    soup.add({-1e6f, -1e6f, 4.5f}, {3e6f, -1e6f, 4.5f}, {-1e6f, 3e6f, 4.5f});
    VoxelGrid grid;
    grid.resolutionLog2 = 5;
    EXPECT_EQ(computeDagStats(voxelize(soup.view(), soup.all(), grid)).voxelCount, 1024u);
}

TEST(Voxelize, RefusesPositionsThatAreNotFinite) {
    Soup soup;
    soup.add({0, 0, 0}, {1, 0, 0}, {0, std::numeric_limits<float>::quiet_NaN(), 0});
    VoxelGrid grid;
    grid.resolutionLog2 = 3;
    try {
        voxelize(soup.view(), soup.all(), grid);
        FAIL();
    } catch (const Error& e) {
        EXPECT_EQ(e.kind(), ErrorKind::kInput);
        EXPECT_NE(std::string(e.what()).find("triangle 0"), std::string::npos);
    }
}

TEST(Voxelize, ProgressNeverFallsAndEndsAtOne) {
    std::mt19937 random(34);
    const Soup soup = randomSoup(100, 1.0f, random);
    double last = 0;
    int calls = 0;
    voxelize(soup.view(), soup.all(), gridAround(soup.bounds(), 10), [&](double fraction) {
        EXPECT_GE(fraction, last);
        last = fraction;
        ++calls;
    });
    EXPECT_EQ(last, 1.0);
    EXPECT_GT(calls, 10);
}

} // namespace
} // namespace shadowdag
