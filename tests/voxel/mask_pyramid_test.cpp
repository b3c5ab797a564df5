// SPDX-License-Identifier: Apache-2.0
// Rectangles of masks compared with every texel, and voxels of cut triangles with their points.
#include "voxel/mask_pyramid.h"

#include "tests/voxel/soup.h"
#include "voxel/cut_voxels.h"
#include "voxel/voxelize.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace shadowdag {
namespace {

/// A mask of blobs, so that rectangles are often all of one kind.
AlphaMask blobs(uint32_t width, uint32_t height, MaskWrap wrapU, MaskWrap wrapV,
                std::mt19937& random) {
    AlphaMask mask = makeAlphaMask(width, height, wrapU, wrapV);
    for (int i = 0; i < 6; ++i) {
        const uint32_t x0 = random() % width, y0 = random() % height;
        const uint32_t x1 = std::min(width, x0 + 1 + uint32_t(random() % (width / 3 + 1)));
        const uint32_t y1 = std::min(height, y0 + 1 + uint32_t(random() % (height / 3 + 1)));
        for (uint32_t y = y0; y < y1; ++y)
            for (uint32_t x = x0; x < x1; ++x)
                setOpaque(mask, x, y);
    }
    return mask;
}

MaskWrap wrapOf(uint32_t i) {
    return MaskWrap(i % 3);
}

TEST(MaskPyramid, CoverIsThatOfEveryTexelTouched) {
    const unsigned seed = 7;
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    int counts[3] = {};
    for (int trial = 0; trial < 300; ++trial) {
        const uint32_t width = 1 + random() % 40, height = 1 + random() % 40;
        const AlphaMask mask =
            blobs(width, height, wrapOf(uint32_t(random())), wrapOf(uint32_t(random())), random);
        AlphaMaskSet set;
        set.add(mask);
        const MaskPyramids pyramids(viewOf(set.masks), viewOf(set.words));
        const MaskPyramidView pyramid = pyramids.view()[0];
        EXPECT_EQ(pyramid.size(), glm::dvec2(width, height));
        std::uniform_real_distribution<double> place(-90.0, 90.0),
            extent(0.0, trial % 2 ? 6.0 : 60.0);
        for (int i = 0; i < 60; ++i) {
            glm::dvec2 least(place(random), place(random));
            if (i % 4 == 0)
                least = glm::floor(least); // on a border: the texel above it is touched
            const glm::dvec2 most = least + glm::dvec2(extent(random), extent(random));
            bool any = false, all = true;
            for (double y = std::floor(least.y); y <= std::floor(most.y); ++y)
                for (double x = std::floor(least.x); x <= std::floor(most.x); ++x) {
                    const bool isOpaque = mask.isOpaque(maskTexel(x, width, mask.wrapU),
                                                        maskTexel(y, height, mask.wrapV));
                    any |= isOpaque;
                    all &= isOpaque;
                }
            const MaskCover expected = all   ? MaskCover::kAll
                                       : any ? MaskCover::kSome
                                             : MaskCover::kNone;
            ASSERT_EQ(pyramid.cover(least, most), expected) << trial << " " << i;
            ++counts[int(expected)];
        }
    }
    for (const int count : counts)
        EXPECT_GT(count, 1000);
}

TEST(MaskPyramid, NonFiniteRectanglesCountAsSome) {
    AlphaMaskSet set;
    set.add(makeAlphaMask(3, 3));
    const MaskPyramids pyramids(viewOf(set.masks), viewOf(set.words));
    const MaskPyramidView pyramid = pyramids.view()[0];
    const double infinity = std::numeric_limits<double>::infinity(), nan = std::nan("");
    EXPECT_EQ(pyramid.cover({nan, 0}, {1, 1}), MaskCover::kSome);
    EXPECT_EQ(pyramid.cover({0, 0}, {1, nan}), MaskCover::kSome);
    EXPECT_EQ(pyramid.cover({-infinity, -infinity}, {infinity, infinity}), MaskCover::kNone);
}

/// Random triangles of which most are cut.
struct CutSoup {
    Soup soup;
    AlphaMaskSet set;

    CutSoup(int count, std::mt19937& random) : soup(randomSoup(count, 3.0f, random)) {
        std::uniform_real_distribution<float> unit(-2.0f, 2.0f);
        for (uint32_t m = 0; m < 4; ++m)
            set.add(blobs(5 + 13 * m, 30 - 7 * m, wrapOf(m), wrapOf(m / 2), random));
        for (uint32_t t = 0; t < soup.triangles.size(); ++t) {
            set.triangleCut.push_back(t % 8 ? uint32_t(set.cuts.size()) : kNotCut);
            if (t % 8)
                set.cuts.push_back({uint32_t(random() % 4),
                                    {{unit(random), unit(random)},
                                     {unit(random), unit(random)},
                                     {unit(random), unit(random)}}});
        }
    }
    TriangleView view() const {
        TriangleView v = soup.view();
        v.masks = set.view();
        return v;
    }
};

bool hasVoxelAt(const DagView& dag, const glm::dvec3& pointWorld) {
    const glm::dvec3 p = dag.grid.voxelFromWorld(pointWorld);
    const glm::ivec3 cell = glm::clamp(glm::ivec3(glm::floor(p)), glm::ivec3(0),
                                       glm::ivec3(int(dag.grid.resolution()) - 1));
    return isOccupied(dag, uint32_t(cell.x), uint32_t(cell.y), uint32_t(cell.z));
}

uint64_t countVoxels(const Dag& dag) {
    return dag.empty() ? 0 : computeDagStats(dag).voxelCount;
}

// The one text decides which points are opaque; each of them must lie in a voxel.
TEST(CutVoxels, ContainEveryOpaquePointAndFewerVoxelsThanTheFullTriangles) {
    const unsigned seed = 11;
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    for (const uint32_t log2 : {3u, 6u, 9u}) {
        SCOPED_TRACE(log2);
        const CutSoup cut(200, random);
        const VoxelGrid grid = gridAround(cut.soup.bounds(), log2);
        const Dag dag = voxelize(cut.view(), cut.soup.all(), grid);
        const Dag solid = voxelize(cut.soup.view(), cut.soup.all(), grid);
        const TriangleView triangles = cut.view();
        uint64_t opaqueCount = 0, missingCount = 0;
        std::uniform_real_distribution<double> unit(0.0, 1.0);
        for (int i = 0; i < 300000; ++i) {
            const uint32_t t = uint32_t(random() % triangles.count());
            double u = unit(random), v = unit(random);
            if (u + v > 1.0) {
                u = 1.0 - u;
                v = 1.0 - v;
            }
            if (triangles.masks.isCut(t) && !triangles.masks.isOpaque(t, 1.0 - u - v, u, v))
                continue;
            glm::dvec3 p(0.0);
            const double w[3] = {1.0 - u - v, u, v};
            for (int corner = 0; corner < 3; ++corner)
                p += w[corner] * glm::dvec3(triangles.vertex(t, corner));
            ++opaqueCount;
            missingCount += !hasVoxelAt(dag.view(), p);
            ASSERT_TRUE(hasVoxelAt(solid.view(), p));
        }
        EXPECT_GT(opaqueCount, 50000u);
        EXPECT_EQ(missingCount, 0u) << "of " << opaqueCount;
        const uint64_t cutVoxels = countVoxels(dag), solidVoxels = countVoxels(solid);
        EXPECT_LE(cutVoxels, solidVoxels);
        if (log2 == 9) {
            EXPECT_LT(double(cutVoxels), 0.75 * double(solidVoxels));
        }
    }
}

// A chequer board whose squares are eight voxels wide, in the plane between two layers' middles: by
// counting, n^2 / 2 squares of 8 x 8 voxels, and the voxels that squares' closed borders touch.
TEST(CutVoxels, OfAChequerBoardAreItsSquares) {
    AlphaMaskSet set;
    AlphaMask mask = makeAlphaMask(2, 2);
    setOpaque(mask, 0, 0);
    setOpaque(mask, 1, 1);
    set.add(mask);
    Soup soup;
    soup.add({0, 10.5f, 0}, {64, 10.5f, 64}, {64, 10.5f, 0});
    soup.add({0, 10.5f, 0}, {0, 10.5f, 64}, {64, 10.5f, 64});
    set.triangleCut = {0, 1};
    set.cuts = {{0, {{0, 0}, {4, 4}, {4, 0}}}, {0, {{0, 0}, {0, 4}, {4, 4}}}};
    TriangleView triangles = soup.view();
    triangles.masks = set.view();
    VoxelGrid grid;
    grid.resolutionLog2 = 6;
    const Dag dag = voxelize(triangles, soup.all(), grid);
    uint64_t inSquares = 0, inHoles = 0, beyondBorder = 0;
    for (int x = 0; x < 64; ++x)
        for (int z = 0; z < 64; ++z) {
            const bool isThere = hasVoxelAt(dag.view(), {x + 0.5, 10.5, z + 0.5});
            const bool isSquare = (x / 8 + z / 8) % 2 == 0;
            inSquares += isSquare && isThere;
            inHoles += !isSquare && isThere;
            const bool isAtBorder = x % 8 == 0 || x % 8 == 7 || z % 8 == 0 || z % 8 == 7;
            beyondBorder += !isSquare && isThere && !isAtBorder;
        }
    EXPECT_EQ(inSquares, 64u * 64u / 2u);
    EXPECT_LE(inHoles, 32u * 28u) << "a hole's outermost voxels touch a square";
    EXPECT_EQ(beyondBorder, 0u);
    EXPECT_EQ(countVoxels(dag), inSquares + inHoles);
}

// What is thinner than its texture coordinates are known is taken as opaque.
TEST(CutVoxels, SliversStayWhole) {
    AlphaMaskSet set;
    set.add(makeAlphaMask(4, 4)); // all holes
    Soup soup;
    soup.add({1, 1, 1}, {60, 50, 40}, {60, 50, 40.000004f});
    soup.add({1, 1, 1}, {60, 50, 40}, {1, 50, 40});
    set.triangleCut = {0, 1};
    set.cuts = {{0, {{0, 0}, {1, 0}, {0, 1}}}, {0, {{0, 0}, {1, 0}, {0, 1}}}};
    TriangleView triangles = soup.view();
    triangles.masks = set.view();
    VoxelGrid grid;
    grid.resolutionLog2 = 6;
    const uint32_t sliver[1] = {0}, board[1] = {1};
    EXPECT_GT(countVoxels(voxelize(triangles, {sliver, 1}, grid)), 59u);
    EXPECT_EQ(countVoxels(voxelize(triangles, {board, 1}, grid)), 0u);
}

} // namespace
} // namespace shadowdag
