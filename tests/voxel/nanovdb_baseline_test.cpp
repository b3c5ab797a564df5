// SPDX-License-Identifier: Apache-2.0
#include "voxel/nanovdb_baseline.h"

#include "cuda/buffer.h"
#include "tests/cuda/backends.h"
#include "tests/voxel/voxel_sets.h"
#include "voxel/dag_trace.h"

#include <gtest/gtest.h>

namespace shadowdag {
namespace {

constexpr uint32_t kSeed = 4712;

TEST(NanoVdbBaseline, ContainsTheVoxelsOfTheDag) {
    std::mt19937 random(kSeed);
    for (uint32_t log2 = 0; log2 <= 6; ++log2) {
        const DenseGrid grid = randomGrid(log2, 0.1, random);
        const Dag dag = dagOf(grid);
        const NanoVdbBaseline nano(dag);
        EXPECT_EQ(nano.voxelCount(), grid.count());
        // Segments of length zero ask for single voxels.
        std::vector<DagSegment> points;
        std::vector<uint8_t> expected;
        for (uint32_t z = 0; z < grid.size(); ++z)
            for (uint32_t y = 0; y < grid.size(); ++y)
                for (uint32_t x = 0; x < grid.size(); ++x) {
                    const glm::vec3 p = glm::vec3(x, y, z) + 0.5f;
                    points.push_back({p, p});
                    expected.push_back(grid.at(x, y, z));
                }
        EXPECT_EQ(nano.occluded(points), expected) << log2;
    }
}

TEST(NanoVdbBaseline, EmptyGridBlocksNothing) {
    const Dag dag = dagOf(DenseGrid(5));
    const NanoVdbBaseline nano(dag);
    EXPECT_EQ(nano.voxelCount(), 0u);
    EXPECT_EQ(nano.occluded({{{-1, 3, 3}, {40, 3, 3}}, {{1, 1, 1}, {1, 1, 1}}}),
              (std::vector<uint8_t>{0, 0}));
}

TEST(NanoVdbBaseline, SegmentsAreNotTracedBeyondTheirEnds) {
    DenseGrid grid(6);
    grid.set(40, 5, 5);
    const Dag dag = dagOf(grid);
    const NanoVdbBaseline nano(dag);
    const glm::vec3 from(2.5f, 5.5f, 5.5f);
    EXPECT_EQ(nano.occluded({{from, {39.5f, 5.5f, 5.5f}},
                             {from, {40.5f, 5.5f, 5.5f}},
                             {{60.5f, 5.5f, 5.5f}, {41.5f, 5.5f, 5.5f}},
                             {{60.5f, 5.5f, 5.5f}, {40.5f, 5.5f, 5.5f}},
                             {{40.5f, 90.0f, 5.5f}, {40.5f, -90.0f, 5.5f}},
                             {{41.5f, 90.0f, 5.5f}, {41.5f, -90.0f, 5.5f}}}),
              (std::vector<uint8_t>{0, 1, 0, 1, 1, 0}));
}

// Both walk the same voxels; only what lies within our margin or NanoVDB's step past a boundary of
// a voxel may differ.
TEST(NanoVdbBaseline, AgreesWithTheDagExceptForGrazedCorners) {
    std::mt19937 random(kSeed);
    std::uniform_real_distribution<float> inside(-4.0f, 68.0f);
    const DenseGrid grid = randomGrid(6, 0.01, random);
    const Dag dag = dagOf(grid);
    const NanoVdbBaseline nano(dag);
    std::vector<DagSegment> segments;
    for (int i = 0; i < 100000; ++i) {
        const glm::vec3 from(inside(random), inside(random), inside(random));
        segments.push_back({from, {inside(random), inside(random), inside(random)}});
    }
    double seconds = 0;
    const std::vector<uint8_t> theirs = nano.occluded(segments, &seconds);
    EXPECT_GT(seconds, 0.0);
    size_t darkByOurs = 0, darkByTheirs = 0, dark = 0;
    for (size_t i = 0; i < segments.size(); ++i) {
        const bool ours = occluded(dag.view(), segments[i]);
        dark += ours;
        darkByOurs += ours && !theirs[i];
        darkByTheirs += !ours && theirs[i];
    }
    EXPECT_GT(dark, segments.size() / 10) << "seed " << kSeed;
    EXPECT_LT(dark, segments.size() - segments.size() / 10);
    // A miss needs a chord through the voxel under 1/512 long: 0.06 % were seen, ten times that is
    // a fault.
    EXPECT_LT(darkByOurs, segments.size() / 200) << "seed " << kSeed;
    EXPECT_LT(darkByTheirs, segments.size() / 10000) << "seed " << kSeed;
    std::cout << "[ rays ] " << dark << " dark, " << darkByOurs << " by ours alone, "
              << darkByTheirs << " by NanoVDB alone\n";
}

class NanoVdbPassOn : public OnBackend {};

TEST_P(NanoVdbPassOn, GivesTheAnswersOfOneThread) {
    std::mt19937 random(kSeed);
    std::uniform_real_distribution<float> inside(-4.0f, 68.0f);
    const Dag dag = dagOf(randomGrid(6, 0.01, random));
    const NanoVdbBaseline nano(dag);
    std::vector<DagSegment> segments;
    for (int i = 0; i < 20000; ++i) {
        const glm::vec3 from(inside(random), inside(random), inside(random));
        segments.push_back({from, {inside(random), inside(random), inside(random)}});
    }
    segments.push_back({{9, 9, 9}, {9, 9, 9}});
    Buffer<DagSegment> onBackend(GetParam(), "segments");
    onBackend.upload(segments);
    Buffer<uint8_t> blocked(GetParam(), "blocked", segments.size());
    blocked.fill(0xaa);
    nano.trace(GetParam(), std::as_const(onBackend).view(), blocked.view());
    EXPECT_EQ(blocked.download(), nano.occluded(segments)) << "seed " << kSeed;
}

INSTANTIATE_TEST_SUITE_P(Both, NanoVdbPassOn, kBothBackends, backendSuffix);

} // namespace
} // namespace shadowdag
