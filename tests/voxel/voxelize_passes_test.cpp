// SPDX-License-Identifier: Apache-2.0
// Voxels and nodes by passes equal those of the CPU's builder, word by word, with any budget.
#include "voxel/voxelize_passes.h"

#include "cuda/error.h"
#include "scenes/builtin.h"
#include "tests/cuda/backends.h"
#include "tests/voxel/soup.h"
#include "voxel/voxelize.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace shadowdag {
namespace {

constexpr uint64_t kRoomy = uint64_t(4) << 30;

class VoxelizePassesOn : public OnBackend {
protected:
    ~VoxelizePassesOn() override { setThreadCount(0); }

    void expectSame(const TriangleView& triangles, View<const uint32_t> which,
                    const VoxelGrid& grid, const Dag& expected, uint64_t budgetBytes = kRoomy,
                    PassBuildCounts* counts = nullptr) {
        const Dag dag =
            voxelizeByPasses(GetParam(), triangles, which, grid, budgetBytes, {}, counts);
        EXPECT_EQ(dag.rootAddress, expected.rootAddress);
        EXPECT_EQ(dag.grid, expected.grid);
        ASSERT_EQ(dag.words.size(), expected.words.size());
        EXPECT_TRUE(dag.words == expected.words);
    }
    void expectSame(const TriangleView& triangles, View<const uint32_t> which,
                    const VoxelGrid& grid) {
        expectSame(triangles, which, grid, voxelize(triangles, which, grid));
    }
    void expectSame(const Soup& soup, const VoxelGrid& grid) {
        expectSame(soup.view(), soup.all(), grid);
    }
};

VoxelGrid unitGrid(uint32_t log2) {
    VoxelGrid grid;
    grid.resolutionLog2 = log2;
    return grid;
}

TEST_P(VoxelizePassesOn, WithoutTrianglesInsideIsDoneAndCountedAsWell) {
    const Soup soup = [] {
        std::mt19937 random(5);
        return randomSoup(12, 1.0f, random);
    }();
    VoxelGrid far = unitGrid(4);
    far.originWorld = glm::dvec3(1000.0);
    double done = 0;
    PassBuildCounts counts;
    const Dag dag = voxelizeByPasses(
        GetParam(), soup.view(), soup.all(), far, kRoomy, [&](double share) { done = share; },
        &counts);
    EXPECT_TRUE(dag.empty());
    EXPECT_EQ(done, 1.0);
    EXPECT_GT(counts.peakBytes, 0u);
}

TEST_P(VoxelizePassesOn, EqualTheBuilderOnRandomSoupsOfAnyResolution) {
    for (unsigned seed = 91; seed < 95; ++seed)
        for (uint32_t log2 = 0; log2 <= 9; ++log2) {
            SCOPED_TRACE(testing::Message() << "seed " << seed << " log2 " << log2);
            std::mt19937 random(seed);
            const Soup soup = randomSoup(seed % 2 ? 200 : 12, 1.0f, random);
            expectSame(soup, gridAround(soup.bounds(), log2));
        }
}

TEST_P(VoxelizePassesOn, EqualTheBuilderOnBuiltinScenes) {
    for (const BuiltinInfo& info : builtinScenes()) {
        if (info.name == "houses-by-day")
            continue; // the triangles of houses
        const Scene scene = makeBuiltin(info.name);
        const World world(scene, {});
        // Coarser grids are those of the random soups.
        const uint32_t log2 = info.name == "atrium" ? 10 : 9;
        SCOPED_TRACE(info.name + " at 2^" + std::to_string(log2));
        const VoxelGrid grid = gridAround(world.staticBoundsWorld(), log2);
        expectSame(world.triangles(), viewOf(world.staticTriangles()), grid);
    }
}

// Points, segments, slivers, triangles that are there twice, planes in voxel faces, giants.
TEST_P(VoxelizePassesOn, EqualTheBuilderOnDegenerateTriangles) {
    Soup soup;
    soup.add({3.5f, 3.5f, 3.5f}, {3.5f, 3.5f, 3.5f}, {3.5f, 3.5f, 3.5f});
    soup.add({4, 4, 4}, {4, 4, 4}, {4, 4, 4});
    soup.add({1, 2, 3}, {60, 50, 40}, {1, 2, 3});
    soup.add({0, 0, 0}, {64, 64, 64}, {32, 32, 32});
    soup.add({1, 1, 1}, {63, 1, 1}, {32, 1.0000001f, 1});
    soup.add({5, 0, 0}, {5, 16, 0}, {5, 0, 16});
    soup.add({5, 0, 0}, {5, 16, 0}, {5, 0, 16});
    soup.add({-1e6f, -1e6f, 40.5f}, {3e6f, -1e6f, 40.5f}, {-1e6f, 3e6f, 40.5f});
    soup.add({-50, -50, -50}, {-60, -50, -50}, {-50, -50, -60});
    soup.add({64, 64, 64}, {70, 64, 64}, {64, 70, 64});
    for (const uint32_t log2 : {1u, 2u, 3u, 6u, 7u, 8u})
        expectSame(soup, unitGrid(log2));
    for (uint32_t t = 0; t < soup.triangles.size(); ++t) { // each by itself
        SCOPED_TRACE("triangle " + std::to_string(t));
        soup.which = {t};
        expectSame(soup, unitGrid(6));
    }
    soup.which.clear();
    expectSame(soup, unitGrid(6));
}

TEST_P(VoxelizePassesOn, EqualTheBuilderOnTrianglesThatMasksCut) {
    constexpr unsigned kSeed = 96;
    SCOPED_TRACE(testing::Message() << "seed " << kSeed);
    std::mt19937 random(kSeed);
    std::uniform_real_distribution<float> unit(-2.0f, 2.0f);
    const Soup soup = randomSoup(60, 1.0f, random);
    AlphaMaskSet masks;
    for (uint32_t m = 0; m < 4; ++m) {
        AlphaMask mask = makeAlphaMask(5 + 30 * m, 31 - 7 * m, MaskWrap(m % 3), MaskWrap(m / 2));
        for (uint32_t y = 0; y < mask.height; ++y)
            for (uint32_t x = 0; x < mask.width; ++x)
                if ((x / 3 + y / 2) % 2)
                    setOpaque(mask, x, y);
        masks.add(mask);
    }
    for (uint32_t t = 0; t < soup.triangles.size(); ++t) {
        masks.triangleCut.push_back(t % 5 ? uint32_t(masks.cuts.size()) : kNotCut);
        if (t % 5)
            masks.cuts.push_back({t % 4,
                                  {{unit(random), unit(random)},
                                   {unit(random), unit(random)},
                                   {unit(random), unit(random)}}});
    }
    TriangleView view = soup.view();
    view.masks = masks.view();
    for (const uint32_t log2 : {3u, 6u, 8u}) {
        const VoxelGrid grid = gridAround(soup.bounds(), log2);
        const Dag expected = voxelize(view, soup.all(), grid);
        EXPECT_NE(expected.words, voxelize(soup.view(), soup.all(), grid).words);
        expectSame(view, soup.all(), grid, expected);
    }
}

TEST_P(VoxelizePassesOn, EqualTheBuilderWithAnyBudgetAndKeepWithinIt) {
    constexpr unsigned kSeed = 97;
    SCOPED_TRACE(testing::Message() << "seed " << kSeed);
    std::mt19937 random(kSeed);
    const Soup soup = randomSoup(150, 1.0f, random);
    const VoxelGrid grid = gridAround(soup.bounds(), 9);
    const Dag expected = voxelize(soup.view(), soup.all(), grid);
    PassBuildCounts whole;
    expectSame(soup.view(), soup.all(), grid, expected, kRoomy, &whole);
    EXPECT_EQ(whole.tileCount, 1u);
    // All that is held is taken from the budget: what it took fits, a byte less does not.
    PassBuildCounts counts;
    expectSame(soup.view(), soup.all(), grid, expected, whole.peakBytes, &counts);
    EXPECT_EQ(counts.tileCount, 1u);
    EXPECT_EQ(counts.peakBytes, whole.peakBytes);
    uint32_t before = 1;
    for (uint64_t budget = whole.peakBytes - 1; budget > whole.peakBytes / 40; budget /= 2) {
        SCOPED_TRACE("budget " + std::to_string(budget));
        expectSame(soup.view(), soup.all(), grid, expected, budget, &counts);
        EXPECT_GE(counts.tileCount, std::max(2u, before));
        EXPECT_LE(counts.peakBytes, budget);
        before = counts.tileCount;
    }
    EXPECT_GT(before, 50u);
}

/// Returns the bytes of the build's lists in the ledger.
uint64_t heldLists(Backend backend) {
    uint64_t bytes = 0;
    for (const LedgerEntry& entry : bufferLedger())
        if (entry.name.starts_with("voxelize ") && entry.backend == backend)
            bytes += entry.bytes;
    return bytes;
}

TEST_P(VoxelizePassesOn, CountTheCopiesOfTheScene) {
    std::mt19937 random(98);
    const Soup soup = randomSoup(60, 1.0f, random);
    const HostCopyCounts before = hostCopyCounts();
    voxelizeByPasses(GetParam(), soup.view(), soup.all(), gridAround(soup.bounds(), 6), kRoomy);
    EXPECT_EQ(hostCopyCounts().uploadCount - before.uploadCount, 3u)
        << "positions, triangles, which of them; no masks";
}

// The lists of the ledger are those that the budget counts, and all are given back.
TEST_P(VoxelizePassesOn, KeepListsWithinTheBudget) {
    std::mt19937 random(98);
    const Soup soup = randomSoup(60, 1.0f, random);
    const VoxelGrid grid = gridAround(soup.bounds(), 9);
    const uint64_t before = heldLists(GetParam());
    PassBuildCounts counts;
    voxelizeByPasses(GetParam(), soup.view(), soup.all(), grid, kRoomy, {}, &counts);
    EXPECT_EQ(heldLists(GetParam()), before);
    const uint64_t budget = counts.peakBytes / 6;
    const uint64_t sceneBytes =
        GetParam() == Backend::kCpu
            ? 0
            : soup.positions.size() * sizeof(glm::vec3) +
                  soup.triangles.size() * (sizeof(glm::uvec3) + sizeof(uint32_t));
    uint64_t most = 0;
    voxelizeByPasses(GetParam(), soup.view(), soup.all(), grid, budget,
                     [&](double) { most = std::max(most, heldLists(GetParam()) - before); });
    EXPECT_GT(most, 0u);
    EXPECT_LE(most, budget + sceneBytes);
    EXPECT_EQ(heldLists(GetParam()), before);
}

TEST_P(VoxelizePassesOn, RefuseABudgetTooSmallForABrick) {
    std::mt19937 random(99);
    const Soup soup = randomSoup(50, 1.0f, random);
    for (const uint64_t budget : {uint64_t(0), uint64_t(100), uint64_t(5000)})
        try {
            voxelizeByPasses(GetParam(), soup.view(), soup.all(), gridAround(soup.bounds(), 8),
                             budget);
            FAIL() << "no error with " << budget;
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::kResource);
            EXPECT_THAT(error.what(), testing::HasSubstr("at 256^3 holds"));
            EXPECT_THAT(error.what(), testing::HasSubstr("--backend cpu"));
        }
}

TEST_P(VoxelizePassesOn, RefusePositionsThatAreNotFinite) {
    Soup soup;
    soup.add({0, 0, 0}, {1, 0, 0}, {0, 1, 0});
    soup.add({0, 0, 0}, {1, 0, 0}, {0, std::numeric_limits<float>::quiet_NaN(), 0});
    soup.add({0, 0, 0}, {1, 0, 0}, {0, std::numeric_limits<float>::infinity(), 0});
    soup.which = {0, 2, 1};
    const auto messageOf = [&](const auto& build) -> std::string {
        try {
            build();
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::kInput);
            return error.what();
        }
        return "no error";
    };
    const std::string expected = messageOf([&] { voxelize(soup.view(), soup.all(), unitGrid(3)); });
    EXPECT_THAT(expected, testing::HasSubstr("triangle 2"));
    EXPECT_EQ(messageOf([&] {
                  voxelizeByPasses(GetParam(), soup.view(), soup.all(), unitGrid(3), kRoomy);
              }),
              expected);
}

TEST_P(VoxelizePassesOn, ReportProgressThatNeverFallsAndEndsAtOne) {
    std::mt19937 random(100);
    const Soup soup = randomSoup(100, 1.0f, random);
    PassBuildCounts counts;
    voxelizeByPasses(GetParam(), soup.view(), soup.all(), gridAround(soup.bounds(), 9), kRoomy, {},
                     &counts);
    for (const uint64_t budget : {kRoomy, counts.peakBytes / 4}) {
        double last = 0;
        int calls = 0;
        voxelizeByPasses(GetParam(), soup.view(), soup.all(), gridAround(soup.bounds(), 9), budget,
                         [&](double fraction) {
                             EXPECT_GE(fraction, last);
                             last = fraction;
                             ++calls;
                         });
        EXPECT_DOUBLE_EQ(last, 1.0);
        EXPECT_GT(calls, budget == kRoomy ? 0 : 8);
    }
}

INSTANTIATE_TEST_SUITE_P(Both, VoxelizePassesOn, kBothBackends, backendSuffix);

TEST(VoxelizePasses, AnyThreadCountAndTriangleOrderGiveTheSameWords) {
    std::mt19937 random(101);
    Soup soup = randomSoup(150, 1.0f, random);
    const VoxelGrid grid = gridAround(soup.bounds(), 9);
    const Dag expected = voxelizeByPasses(Backend::kCpu, soup.view(), soup.all(), grid, kRoomy);
    for (const int threads : {1, 3, 7}) {
        setThreadCount(threads);
        std::shuffle(soup.which.begin(), soup.which.end(), random);
        EXPECT_EQ(voxelizeByPasses(Backend::kCpu, soup.view(), soup.all(), grid, kRoomy).words,
                  expected.words)
            << threads;
    }
    setThreadCount(0);
}

} // namespace
} // namespace shadowdag
