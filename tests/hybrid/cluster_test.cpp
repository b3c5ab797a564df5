// SPDX-License-Identifier: Apache-2.0
// Clusters partition the samples, and their boxes contain them.
#include "hybrid/clusters/cluster_pass.h"

#include "cuda/error.h"
#include "tests/hybrid/seen_soup.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace shadowdag::test {
namespace {

struct Clustered {
    Clustered(uint64_t seed, uint32_t width, uint32_t height, ClusterBounds bounds)
        : soup(randomSoup(seed, 500)), view(makeViewRays(frontCamera(), width, height)),
          gbuffer(drawSoup(soup, view)), clusters(Backend::kCpu) {
        buildClusters(Backend::kCpu, gbuffer.view(), view, bounds, clusters);
    }
    TriangleSoup soup;
    ViewRays view;
    GBuffer gbuffer;
    ClusterSet clusters;
};

/// Returns where a pixel stands in its tile: blocks of 8 x 4, four across, row by row.
uint32_t placeInTile(uint32_t x, uint32_t y) {
    const uint32_t block = y % 32 / 4 * 4 + x % 32 / 8;
    return block * 32 + y % 4 * 8 + x % 8;
}

// As a warp fills a tile: all lanes of a block place before the first advances.
TEST(Clusters, FilledByBlocksOfLanesAreThoseFilledOneByOne) {
    for (uint64_t seed = 1; seed <= 3; ++seed) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        const Clustered c(seed, 131, 77, ClusterBounds::kTight);
        const ClusterView clusters = c.clusters.view();
        const GBufferView gbuffer = c.gbuffer.view();
        const ClusterGridView grid = clusterGrid(c.view, c.clusters.sliceStart.view());
        std::vector<uint32_t> cellOfSample(gbuffer.count(), kNoCluster),
            clusterOfSample(gbuffer.count(), 7), filledCount(clusters.count(), 0),
            samples(clusters.samples.count, 7);
        for (size_t i = 0; i < gbuffer.count(); ++i)
            if (clusters.clusterOfSample[i] != kNoCluster)
                cellOfSample[i] = clusters.cell[clusters.clusterOfSample[i]];
        const FillTile fill{grid,
                            viewOf(std::as_const(cellOfSample)),
                            viewOf(clusterOfSample),
                            c.clusters.clusterOfCell.view(),
                            clusters.sampleStart,
                            viewOf(filledCount),
                            viewOf(samples)};
        for (uint32_t tile = 0; tile < grid.tileCount(); ++tile)
            for (uint32_t block = 0; block < FillTile::kBlockCount; ++block) {
                std::vector<uint32_t> found;
                for (uint32_t lane = 0; lane < kGroupLanes; ++lane)
                    found.push_back(fill.find(tile, block, lane));
                std::vector<FillTile::Placed> placed;
                for (uint32_t lane = kGroupLanes; lane-- > 0;) {
                    const auto at = found.begin() + ptrdiff_t(lane);
                    placed.push_back(fill.place(
                        tile, block, lane, *at, uint32_t(std::count(found.begin(), at, *at)),
                        std::find(at + 1, found.end(), *at) == found.end()));
                }
                for (const FillTile::Placed& one : placed)
                    fill.advance(one);
            }
        EXPECT_EQ(samples, c.clusters.samples.download());
        EXPECT_EQ(clusterOfSample, c.clusters.clusterOfSample.download());
        for (size_t k = 0; k < clusters.count(); ++k)
            EXPECT_EQ(filledCount[k], clusters.sampleCount(k));
    }
}

TEST(Clusters, BoxesOfPartsMakeTheBoxOfAllSignsOfZeroToo) {
    const Clustered c(4, 131, 77, ClusterBounds::kTight);
    const ClusterView clusters = c.clusters.view();
    std::vector<glm::vec3> positions = c.gbuffer.positionWorld.download();
    for (size_t i = 0; i < positions.size(); ++i)
        positions[i].y = i % 3 ? 0.0f : -0.0f;
    GBufferView gbuffer = c.gbuffer.view();
    gbuffer.positionWorld = viewOf(std::as_const(positions));
    std::vector<Box> boxes(clusters.count());
    const BoundBySamples bound{gbuffer, clusters, viewOf(boxes)};
    for (size_t k = 0; k < clusters.count(); ++k) {
        bound(k);
        const Box whole = boxes[k];
        Box joined;
        for (uint32_t lane = kGroupLanes; lane-- > 0;)
            joined.add(bound.part(k, lane, kGroupLanes));
        bound.store(k, joined);
        EXPECT_EQ(boxes[k], whole);
        EXPECT_FALSE(std::signbit(whole.min.y) || std::signbit(whole.max.y));
        EXPECT_FALSE(std::signbit(boxes[k].min.y) || std::signbit(boxes[k].max.y));
    }
}

TEST(Clusters, HoldEverySampleExactlyOnceInItsCell) {
    for (uint64_t seed = 1; seed <= 3; ++seed) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        const Clustered c(seed, 131, 77, ClusterBounds::kTight);
        const ClusterView clusters = c.clusters.view();
        const GBufferView gbuffer = c.gbuffer.view();
        const ClusterGridView grid = clusterGrid(c.view, c.clusters.sliceStart.view());
        std::vector<int> seen(gbuffer.count(), 0);
        for (size_t k = 0; k < clusters.count(); ++k) {
            EXPECT_GT(clusters.sampleCount(k), 0u);
            if (k > 0) {
                EXPECT_LT(clusters.cell[k - 1], clusters.cell[k]);
            }
            const uint32_t slice = grid.sliceOfCell(clusters.cell[k]);
            for (uint32_t i = clusters.sampleStart[k]; i < clusters.sampleStart[k + 1]; ++i) {
                const uint32_t sample = clusters.samples[i];
                ++seen[sample];
                EXPECT_EQ(clusters.clusterOfSample[sample], k);
                if (i > clusters.sampleStart[k]) {
                    EXPECT_LT(
                        placeInTile(clusters.samples[i - 1] % 131, clusters.samples[i - 1] / 131),
                        placeInTile(sample % 131, sample / 131));
                }
                EXPECT_EQ(grid.tileOfCell(clusters.cell[k]),
                          sample / 131 / 32 * 5 + sample % 131 / 32);
                EXPECT_GE(gbuffer.depthView[sample], grid.sliceStart[slice]);
                if (slice + 1 < grid.sliceCount()) {
                    EXPECT_LT(gbuffer.depthView[sample], grid.sliceStart[slice + 1]);
                }
            }
        }
        for (size_t i = 0; i < seen.size(); ++i) {
            EXPECT_EQ(seen[i], gbuffer.triangle[i] != kBackground);
            if (gbuffer.triangle[i] == kBackground) {
                EXPECT_EQ(clusters.clusterOfSample[i], kNoCluster);
            }
        }
    }
}

TEST(Clusters, BoxesContainTheirSamplesAndTightOnesAreMinimal) {
    for (const ClusterBounds bounds : {ClusterBounds::kImplicit, ClusterBounds::kTight}) {
        const Clustered c(5, 200, 100, bounds);
        const ClusterView clusters = c.clusters.view();
        for (size_t k = 0; k < clusters.count(); ++k) {
            Box least;
            for (uint32_t i = clusters.sampleStart[k]; i < clusters.sampleStart[k + 1]; ++i)
                least.add(c.gbuffer.view().positionWorld[clusters.samples[i]]);
            const Box box = clusters.boxesWorld[k];
            if (bounds == ClusterBounds::kTight) {
                EXPECT_EQ(box, least);
            }
            Box both = box;
            both.add(least);
            EXPECT_EQ(box, both);
        }
    }
}

TEST(Clusters, OfAnEmptyImageAreNone) {
    const TriangleSoup soup;
    const ViewRays view = makeViewRays(frontCamera(), 40, 40);
    const GBuffer gbuffer = drawSoup(soup, view);
    ClusterSet clusters(Backend::kCpu);
    buildClusters(Backend::kCpu, gbuffer.view(), view, ClusterBounds::kTight, clusters);
    EXPECT_EQ(clusters.view().count(), 0u);
    EXPECT_EQ(clusters.samples.size(), 0u);
}

TEST(Clusters, AreTheSameForOneAndTwoThreads) {
    setThreadCount(1);
    const Clustered one(9, 320, 200, ClusterBounds::kTight);
    setThreadCount(2);
    const Clustered two(9, 320, 200, ClusterBounds::kTight);
    setThreadCount(0);
    EXPECT_EQ(one.clusters.cell.download(), two.clusters.cell.download());
    EXPECT_EQ(one.clusters.samples.download(), two.clusters.samples.download());
    EXPECT_EQ(one.clusters.sampleStart.download(), two.clusters.sampleStart.download());
    EXPECT_EQ(one.clusters.boxesWorld.download(), two.clusters.boxesWorld.download());
}

TEST(ClusterGrid, SlicesAreHalfOpenAndSelfSimilar) {
    const ViewRays view = makeViewRays(frontCamera(), 640, 360);
    const std::vector<float> starts = makeSliceTable(view);
    const ClusterGridView grid = clusterGrid(view, viewOf(starts));
    ASSERT_GT(starts.size(), 50u);
    EXPECT_EQ(starts.front(), 0.1f);
    EXPECT_LT(starts.back(), 100.0f);
    const double ratio = 1.0 + 32.0 * 2.0 * std::tan(0.45) / 360.0;
    EXPECT_GE(starts.back() * ratio, 100.0 * (1.0 - 1e-5));
    for (uint32_t k = 0; k < starts.size(); ++k) {
        EXPECT_NEAR(starts[k], 0.1 * std::pow(ratio, k), 1e-5 * starts[k]);
        EXPECT_EQ(grid.sliceOf(starts[k]), k);
        EXPECT_EQ(grid.sliceOf(std::nextafter(starts[k], 0.0f)), k == 0 ? 0 : k - 1);
        EXPECT_EQ(grid.sliceOf(std::nextafter(starts[k], 1e9f)), k);
    }
    EXPECT_EQ(grid.sliceOf(0.0f), 0u);
    EXPECT_EQ(grid.sliceOf(1e9f), starts.size() - 1);
}

TEST(ClusterGrid, TilesAreHalfOpen) {
    const ViewRays view = makeViewRays(frontCamera(), 70, 40);
    const std::vector<float> starts = makeSliceTable(view);
    const ClusterGridView grid = clusterGrid(view, viewOf(starts));
    EXPECT_EQ(grid.tileCountX, 3u);
    EXPECT_EQ(grid.tileCountY, 2u);
    EXPECT_EQ(grid.tileOf(31, 31), 0u);
    EXPECT_EQ(grid.tileOf(32, 31), 1u);
    EXPECT_EQ(grid.tileOf(31, 32), 3u);
    EXPECT_EQ(grid.tileOf(69, 39), 5u);
    const uint32_t cell = grid.cellOf(4, 7);
    EXPECT_EQ(grid.tileOfCell(cell), 4u);
    EXPECT_EQ(grid.sliceOfCell(cell), 7u);
}

TEST(Clusters, TinyFieldOfViewIsRefusedNotLooped) {
    Camera camera = frontCamera();
    for (const float yfov : {1e-17f, 1e-5f, 0.0f}) {
        camera.yfov = yfov;
        EXPECT_THROW(makeViewRays(camera, 64, 64), Error);
    }
    camera.yfov = kMinFieldOfView;
    ViewRays view = makeViewRays(camera, 64, 64);
    EXPECT_GT(makeSliceTable(view).size(), 1000u);
    for (const double pixelSize : {1e-17, 1e-12, 0.0}) { // rays made by hand end as well
        view.pixelSize = pixelSize;
        try {
            makeSliceTable(view);
            FAIL();
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::kResource);
        }
    }
}

} // namespace
} // namespace shadowdag::test
