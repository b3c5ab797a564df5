// SPDX-License-Identifier: Apache-2.0
#include "voxel/dag_lod.h"

#include "tests/voxel/voxel_sets.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <functional>
#include <limits>

namespace shadowdag {
namespace {

uint32_t rootLevelOf(const DenseGrid& grid) {
    return std::max(grid.log2, kLeafLog2);
}

/// How many of a cell's columns along an axis hold a voxel.
uint32_t coveredColumns(const DenseGrid& grid, const glm::uvec3& cell, uint32_t level, int axis) {
    const uint32_t side = 1u << level;
    uint32_t count = 0;
    for (uint32_t v = 0; v < side; ++v)
        for (uint32_t u = 0; u < side; ++u) {
            bool any = false;
            for (uint32_t w = 0; w < side && !any; ++w) {
                glm::uvec3 p = cell;
                p[axis] += w;
                p[(axis + 1) % 3] += u;
                p[(axis + 2) % 3] += v;
                any = grid.at(p.x, p.y, p.z);
            }
            count += any;
        }
    return count;
}

/// The definition: every cell of every level by itself. Coverages are exact here, those of the text
/// are to level 4.
bool darkByDefinition(const DenseGrid& grid, const DagSegment& segment, const LodTimes& times,
                      uint32_t threshold) {
    VoxelGrid voxelGrid;
    voxelGrid.resolutionLog2 = grid.log2;
    const RaySlabs r = makeRaySlabs(segment, segmentScale(voxelGrid, segment));
    const uint32_t size = 1u << rootLevelOf(grid);
    for (uint32_t level = times.bottom; level <= times.top; ++level) {
        const uint32_t side = 1u << level;
        for (uint32_t z = 0; z < size; z += side)
            for (uint32_t y = 0; y < size; y += side)
                for (uint32_t x = 0; x < size; x += side) {
                    const bool isMet =
                        (portable::childHits(r, float(x), float(y), float(z), float(side),
                                             times.begin[level], times.end[level]) &
                         1) != 0;
                    if (!isMet)
                        continue;
                    uint32_t most = 0;
                    for (int axis = 0; axis < 3; ++axis)
                        most = std::max(most, coveredColumns(grid, {x, y, z}, level, axis));
                    if (most != 0 &&
                        (level == 0 || std::max(1u, 255 * most / (side * side)) >= threshold))
                        return true;
                }
    }
    return false;
}

DagSegment anySegment(float size, std::mt19937& random) {
    std::uniform_real_distribution<float> anywhere(-0.3f * size, 1.3f * size);
    DagSegment s;
    for (int a = 0; a < 3; ++a) {
        s.from[a] = anywhere(random);
        s.to[a] = anywhere(random);
        if (random() % 4 == 0)
            s.from[a] = std::round(s.from[a]);
        if (random() % 4 == 0)
            s.to[a] = random() % 2 ? s.from[a] : std::round(s.to[a]);
    }
    return s;
}

Footprint anyFootprint(const DagSegment& s, uint32_t topLevel, std::mt19937& random) {
    std::uniform_real_distribution<double> log(-1.0, double(topLevel) + 0.99);
    const double start = std::exp2(log(random));
    const double length = glm::length(glm::dvec3(s.to) - glm::dvec3(s.from));
    return {start, std::max(start / std::max(length, 1e-9), random() % 2 ? 0.0 : 0.3)};
}

TEST(DagLod, EqualsATestOfEveryCellBitForBit) {
    int hits = 0, misses = 0, byLevel[6] = {};
    for (uint32_t seed = 1; seed <= 3; ++seed) {
        std::mt19937 random(seed);
        for (uint32_t log2 = 0; log2 <= 5; ++log2)
            for (const double density : {0.002, 0.02, 0.2}) {
                const DenseGrid grid = randomGrid(log2, density, random);
                const Dag dag = withCoverage(dagOf(grid));
                for (int i = 0; i < 300; ++i) {
                    const DagSegment s = anySegment(float(grid.size()), random);
                    const LodTimes times = footprintLodTimes(
                        dag.grid, s, anyFootprint(s, std::min(log2 + 1, 4u), random));
                    const uint32_t threshold = random() % 3 == 0 ? 0 : random() % 256;
                    const bool expected = darkByDefinition(grid, s, times, threshold);
                    ASSERT_EQ(occludedByLevels(dag.view(), s, times, threshold), expected)
                        << "seed " << seed << " log2 " << log2 << " density " << density << " ray "
                        << i << " top " << times.top << " threshold " << threshold;
                    DagHit hit;
                    ASSERT_EQ(occludedByLevels(dag.view(), s, times, threshold, &hit), expected);
                    ++(expected ? hits : misses);
                    if (expected) {
                        ASSERT_LE(hit.level, times.top);
                        ++byLevel[hit.level];
                        const uint32_t side = 1u << hit.level;
                        bool any = false;
                        for (int axis = 0; axis < 3; ++axis)
                            any = any || coveredColumns(grid, hit.cell, hit.level, axis) != 0;
                        ASSERT_TRUE(any) << side;
                    }
                }
            }
    }
    EXPECT_GT(hits, 2000);
    EXPECT_GT(misses, 2000);
    for (const int count : {byLevel[0], byLevel[1], byLevel[2], byLevel[3]})
        EXPECT_GT(count, 100);
}

// Odd and even resolutions: the root is alone in its wide node, or is not.
TEST(DagLod, WideFormGivesTheSameBits) {
    int hits = 0, misses = 0;
    for (uint32_t seed = 21; seed <= 22; ++seed) {
        std::mt19937 random(seed);
        for (uint32_t log2 = 3; log2 <= 7; ++log2)
            for (const double density : {0.0002, 0.003, 0.03}) {
                const Dag dag = withCoverage(dagOf(randomGrid(log2, density, random)));
                if (dag.empty())
                    continue;
                const WideDag wide = buildWideDag(dag);
                const std::vector<uint32_t> coverage = wideCoverage(dag, wide);
                DagView view = dag.view();
                view.wide = wide.view();
                view.wide.coverage = viewOf(coverage);
                for (int i = 0; i < 3000; ++i) {
                    const DagSegment s = anySegment(float(dag.grid.resolution()), random);
                    const LodTimes times =
                        i % 5 == 0
                            ? fixedLodTimes(dag.grid, random() % (log2 + 2))
                            : footprintLodTimes(dag.grid, s, anyFootprint(s, log2 + 1, random));
                    const uint32_t threshold = random() % 3 == 0 ? 0 : random() % 256;
                    const bool expected = occludedByLevels(dag.view(), s, times, threshold);
                    ASSERT_EQ(occludedByLevels(view, s, times, threshold), expected)
                        << "seed " << seed << " log2 " << log2 << " density " << density << " ray "
                        << i << " top " << times.top << " threshold " << threshold;
                    ++(expected ? hits : misses);
                }
            }
    }
    EXPECT_GT(hits, 5000);
    EXPECT_GT(misses, 5000);
}

TEST(DagLod, FixedTimesGiveTheBitsOfOccluded) {
    std::mt19937 random(4);
    for (uint32_t log2 = 0; log2 <= 6; ++log2) {
        const DenseGrid grid = randomGrid(log2, 0.01, random);
        const Dag dag = dagOf(grid);
        for (int i = 0; i < 3000; ++i) {
            const DagSegment s = anySegment(float(grid.size()), random);
            const uint32_t level = random() % (log2 + 2);
            ASSERT_EQ(occludedByLevels(dag.view(), s, fixedLodTimes(dag.grid, level), 0),
                      occluded(dag.view(), s, level));
        }
    }
}

TEST(DagLod, FootprintUnderTwoVoxelsGivesTheBitsOfLevelZero) {
    std::mt19937 random(5);
    for (uint32_t log2 = 0; log2 <= 6; ++log2) {
        const Dag dag = withCoverage(dagOf(randomGrid(log2, 0.01, random)));
        for (int i = 0; i < 3000; ++i) {
            const DagSegment s = anySegment(float(dag.grid.resolution()), random);
            const LodTimes times = footprintLodTimes(dag.grid, s, {1.9999, 1e3});
            ASSERT_EQ(occludedByLevels(dag.view(), s, times, 200), occluded(dag.view(), s));
        }
    }
}

// Coarser cells enclose finer ones: without a threshold more footprint is never more light.
TEST(DagLod, WiderFootprintsOnlyAddShadow) {
    std::mt19937 random(6);
    const Dag dag = dagOf(randomGrid(6, 0.003, random));
    int added = 0;
    for (int i = 0; i < 20000; ++i) {
        const DagSegment s = anySegment(64, random);
        bool isDark = false;
        for (const double start : {1.0, 2.0, 5.0, 9.0, 30.0, 100.0}) {
            const double length = glm::length(glm::dvec3(s.to) - glm::dvec3(s.from));
            const LodTimes times = footprintLodTimes(dag.grid, s, {start, start / length});
            const bool next = occludedByLevels(dag.view(), s, times, 0);
            ASSERT_LE(isDark, next) << "seed 6 ray " << i << " footprint " << start;
            added += next && !isDark;
            isDark = next;
        }
    }
    EXPECT_GT(added, 1000);
}

TEST(DagLod, TimesAbutAndFollowTheFootprint) {
    VoxelGrid grid;
    grid.resolutionLog2 = 10;
    // 100 voxels long, 16 wide at the receiver: level L from there to where 2^L / 16 of the way is
    // left.
    const DagSegment s{glm::vec3(10, 20, 30), glm::vec3(110, 20, 30)};
    const LodTimes times = footprintLodTimes(grid, s, makeFootprint(16, 100, 0, 1));
    EXPECT_EQ(times.top, 4u);
    EXPECT_EQ(times.bottom, 0u);
    EXPECT_EQ(times.begin[4], 0.0f);
    EXPECT_EQ(times.end[4], 0.0f); // level 4 is requested at the very start
    EXPECT_EQ(times.end[3], 0.5f);
    EXPECT_EQ(times.end[2], 0.75f);
    EXPECT_EQ(times.end[1], 0.875f);
    EXPECT_EQ(times.end[0], 1.0f);
    for (uint32_t level = 0; level < 4; ++level)
        EXPECT_EQ(times.begin[level], times.end[level + 1]);
    // Texels of a face of 25, 2 s / 25 at distance s, are as wide as 4 voxels at 50: the pixel's 4
    // rule from there on.
    const LodTimes texels = footprintLodTimes(grid, s, makeFootprint(4, 100, 25, 1));
    EXPECT_EQ(texels.top, 2u);
    EXPECT_EQ(texels.end[2], 0.5f);
    EXPECT_EQ(texels.end[1], 0.75f);
    // A larger map than the pixel requests does not make the ray finer than its pixel's cone.
    EXPECT_EQ(footprintLodTimes(grid, s, makeFootprint(16, 100, 4096, 1)).end[3], 0.5f);
    EXPECT_EQ(footprintLodTimes(grid, s, makeFootprint(16, 100, 0, 0.5)).top, 3u);
    EXPECT_EQ(lodLevel(std::numeric_limits<double>::quiet_NaN()), 0u);
    EXPECT_EQ(lodLevel(std::numeric_limits<double>::infinity()), kMaxResolutionLog2);
}

/// Returns the coverage that the text gives to the cell of a level at a corner.
uint32_t coverageAt(const Dag& dag, const glm::uvec3& cell, uint32_t level) {
    uint32_t address = dag.rootAddress;
    for (uint32_t l = std::max(dag.grid.resolutionLog2, kLeafLog2); l > level; --l) {
        const uint32_t half = l - 1, mask = dag.words[address] & 0xffu;
        const uint32_t c =
            (cell.x >> half & 1) | (cell.y >> half & 1) << 1 | (cell.z >> half & 1) << 2;
        EXPECT_TRUE(mask >> c & 1);
        address = dag.words[address + 1 + uint32_t(std::popcount(mask & ((1u << c) - 1)))];
    }
    return detail::cellCoverage(dag.words.data(), address, level);
}

TEST(DagLodCoverage, WallsCoverAllOfTheirCellsAndAnEdgeItsShare) {
    for (int axis = 0; axis < 3; ++axis) {
        DenseGrid grid(6);
        for (uint32_t v = 0; v < 64; ++v)
            for (uint32_t u = 0; u < 40; ++u) {
                glm::uvec3 p;
                p[axis] = 21;
                p[(axis + 1) % 3] = u;
                p[(axis + 2) % 3] = v;
                grid.set(p.x, p.y, p.z);
            }
        const Dag dag = withCoverage(dagOf(grid));
        for (uint32_t level = 2; level <= 5; ++level) {
            glm::uvec3 cell(0);
            cell[axis] = 21u >> level << level;
            EXPECT_EQ(coverageAt(dag, cell, level), 255u) << "axis " << axis << " level " << level;
        }
        glm::uvec3 edge(0);
        edge[axis] = 16;
        edge[(axis + 1) % 3] = 32;
        EXPECT_EQ(coverageAt(dag, edge, 4), 255u / 2) << "axis " << axis; // 8 of 16 columns
        EXPECT_EQ(coverageAt(dag, glm::uvec3(0), 6), uint32_t(255 * 0.625)) << "axis " << axis;
    }
}

TEST(DagLodCoverage, PolesCoverTheirShareAcross) {
    DenseGrid grid(6);
    for (uint32_t z = 0; z < 64; ++z)
        for (uint32_t y = 1; y < 64; y += 4)
            for (uint32_t x = 2; x < 64; x += 4)
                grid.set(x, y, z);
    const Dag dag = withCoverage(dagOf(grid));
    for (uint32_t level = 2; level <= 6; ++level) // across x or y a pole every 4 voxels
        EXPECT_EQ(coverageAt(dag, {0, 0, 0}, level), 255u / 4) << "level " << level;
    EXPECT_EQ(detail::octantCoverage(0x11), 255u / 2); // one pole of a 2^3 cell
    EXPECT_EQ(detail::octantCoverage(0x01), 255u / 4);
}

TEST(DagLodCoverage, IsExactToLevelFourAndALowerBoundAbove) {
    for (uint32_t seed = 7; seed < 11; ++seed) {
        std::mt19937 random(seed);
        const DenseGrid grid = randomGrid(6, seed % 2 ? 0.004 : 0.08, random);
        const Dag dag = withCoverage(dagOf(grid));
        uint32_t above = 0;
        for (uint32_t level = 2; level <= 6; ++level)
            for (uint32_t i = 0; i < 4; ++i) {
                const uint32_t side = 1u << level;
                glm::uvec3 cell(random() % 64, random() % 64, random() % 64);
                cell = cell / side * side;
                uint32_t columns = 0;
                for (int axis = 0; axis < 3; ++axis)
                    columns = std::max(columns, coveredColumns(grid, cell, level, axis));
                if (columns == 0)
                    continue;
                const uint32_t truth = std::max(1u, 255 * columns / (side * side));
                const uint32_t told = coverageAt(dag, cell, level);
                if (level <= 4) {
                    ASSERT_EQ(told, truth) << "seed " << seed << " level " << level;
                    continue;
                }
                ASSERT_LE(told, truth) << "seed " << seed;
                ASSERT_GE((told + 1) << (level - 4), truth) << "seed " << seed;
                above += told < truth;
            }
        EXPECT_GT(above, 0u) << "nothing overlapped: the test shows less than it says";
    }
}

TEST(DagLodCoverage, DoesNotChangeTheDagForOtherReaders) {
    std::mt19937 random(12);
    const Dag dag = dagOf(randomGrid(6, 0.01, random));
    const Dag covered = withCoverage(dag);
    for (int i = 0; i < 20000; ++i) {
        const uint32_t x = random() % 64, y = random() % 64, z = random() % 64;
        ASSERT_EQ(isOccupied(covered.view(), x, y, z), isOccupied(dag.view(), x, y, z));
        const DagSegment s = anySegment(64, random);
        ASSERT_EQ(occluded(covered.view(), s, i % 5), occluded(dag.view(), s, i % 5));
    }
    EXPECT_TRUE(withCoverage(Dag{}).empty());
    for (const int threads : {1, 3}) {
        setThreadCount(threads);
        EXPECT_EQ(withCoverage(dag).words, covered.words);
    }
    setThreadCount(0);
}

// A screen of poles stops rays by the threshold, be it between poles or onto one.
TEST(DagLodCoverage, ScreensStopByTheirShare) {
    DenseGrid grid(6);
    for (uint32_t z = 0; z < 64; ++z)
        for (uint32_t y = 0; y < 64; y += 4)
            grid.set(32, y, z);
    const Dag dag = withCoverage(dagOf(grid));
    const DagSegment through{glm::vec3(3, 30.5f, 31.5f), glm::vec3(60, 30.5f, 31.5f)};
    ASSERT_FALSE(occluded(dag.view(), through));
    const LodTimes times = footprintLodTimes(dag.grid, through, {8, 8.0 / 50});
    EXPECT_TRUE(occludedByLevels(dag.view(), through, times, 0));
    EXPECT_TRUE(occludedByLevels(dag.view(), through, times, coverageThreshold(0.25f)));
    EXPECT_FALSE(occludedByLevels(dag.view(), through, times, coverageThreshold(0.26f)));
    const DagSegment onto{glm::vec3(3, 32.5f, 31.5f), glm::vec3(60, 32.5f, 31.5f)};
    ASSERT_TRUE(occluded(dag.view(), onto));
    EXPECT_FALSE(occludedByLevels(dag.view(), onto, times, coverageThreshold(0.26f))); // lets pass
}

TEST(DagLod, NotANumberIsDarkAndNothingIsLit) {
    DenseGrid grid(4);
    grid.set(1, 2, 3);
    const Dag dag = dagOf(grid);
    const DagSegment bad{glm::vec3(9), glm::vec3(10, std::numeric_limits<float>::quiet_NaN(), 0)};
    const DagSegment point{glm::vec3(9), glm::vec3(9)};
    EXPECT_TRUE(occludedByLevels(dag.view(), bad, footprintLodTimes(dag.grid, bad, {4, 1}), 0));
    EXPECT_FALSE(
        occludedByLevels(dag.view(), point, footprintLodTimes(dag.grid, point, {4, 1}), 0));
    EXPECT_FALSE(
        occludedByLevels(Dag{}.view(), point, footprintLodTimes(dag.grid, point, {4, 1}), 0));
}

} // namespace
} // namespace shadowdag
