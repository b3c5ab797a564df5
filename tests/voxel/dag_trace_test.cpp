// SPDX-License-Identifier: Apache-2.0
#include "voxel/dag_trace.h"

#include "tests/voxel/exact_geometry.h"
#include "tests/voxel/voxel_sets.h"
#include "voxel/dag_lod.h"
#include "voxel/dag_trace_pass.h"
#include "voxel/voxelize.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace shadowdag {
namespace {

/// The definition: some occupied cell of the level passes the slab test.
bool occludedByDefinition(const DenseGrid& grid, const DagSegment& segment, uint32_t level) {
    VoxelGrid voxelGrid;
    voxelGrid.resolutionLog2 = grid.log2;
    const RaySlabs r = makeRaySlabs(segment, segmentScale(voxelGrid, segment));
    const uint32_t top = std::max(grid.log2, kLeafLog2);
    const uint32_t side = 1u << std::min(level, top);
    const uint32_t size = std::max(grid.size(), side);
    for (uint32_t z = 0; z < size; z += side)
        for (uint32_t y = 0; y < size; y += side)
            for (uint32_t x = 0; x < size; x += side) {
                bool any = false;
                for (uint32_t i = 0; i < side * side * side && !any; ++i)
                    any = grid.at(x + i % side, y + i / side % side, z + i / side / side);
                if (any && hitsCube(r, float(x), float(y), float(z), float(side)))
                    return true;
            }
    return false;
}

/// Ends that provoke ties: on lattice points, on their halves, a rounding beside them, anywhere.
glm::vec3 awkwardPoint(float size, std::mt19937& random) {
    std::uniform_real_distribution<float> anywhere(-0.3f * size, 1.3f * size);
    glm::vec3 p;
    const int kind = random() % 5;
    for (int a = 0; a < 3; ++a) {
        p[a] = anywhere(random);
        if (kind >= 1 && kind <= 3)
            p[a] = std::round(kind == 2 ? 2 * p[a] : p[a]) / (kind == 2 ? 2 : 1);
        if (kind == 3)
            p[a] = std::nextafter(p[a], random() % 2 ? 1e9f : -1e9f);
    }
    return p;
}

DagSegment awkwardSegment(float size, std::mt19937& random) {
    DagSegment s{awkwardPoint(size, random), awkwardPoint(size, random)};
    switch (random() % 6) {
    case 0: // one of the 26 directions, any length
    case 1: {
        glm::vec3 d(int(random() % 3) - 1, int(random() % 3) - 1, int(random() % 3) - 1);
        s.to = s.from + d * (std::uniform_real_distribution<float>(0, 2 * size)(random));
        break;
    }
    case 2: // a component far smaller than the others
        s.to[random() % 3] = s.from[random() % 3];
        break;
    case 3:
        s.to = s.from;
        break;
    default:
        break;
    }
    return s;
}

TEST(DagTrace, EqualsATestOfEveryVoxelBitForBit) {
    std::mt19937 random(11);
    int hits = 0, misses = 0;
    for (uint32_t log2 = 0; log2 <= 5; ++log2)
        for (const double density : {0.002, 0.02, 0.2}) {
            const DenseGrid grid = randomGrid(log2, density, random);
            const Dag dag = dagOf(grid);
            for (int i = 0; i < 1500; ++i) {
                const DagSegment segment = awkwardSegment(float(grid.size()), random);
                const uint32_t level = random() % (log2 + 2);
                const bool expected = occludedByDefinition(grid, segment, level);
                ASSERT_EQ(occluded(dag.view(), segment, level), expected)
                    << "log2 " << log2 << " density " << density << " ray " << i << " level "
                    << level;
                ++(expected ? hits : misses);
            }
        }
    EXPECT_GT(hits, 3000);
    EXPECT_GT(misses, 3000);
}

// Odd and even resolutions, so that the root is in a node by itself and is not; 2^7 for paths of
// several nodes.
TEST(DagTrace, WideFormEqualsTheCanonicalOneBitForBit) {
    std::mt19937 random(16);
    int hits = 0, misses = 0;
    for (uint32_t log2 = 0; log2 <= 7; ++log2)
        for (const double density : {0.00002, 0.002, 0.02}) {
            const DenseGrid grid = randomGrid(log2, density, random);
            const Dag dag = dagOf(grid);
            const WideDag wide = buildWideDag(dag);
            ASSERT_EQ(wide.words.empty(), dag.empty() || log2 <= kLeafLog2);
            DagView view = dag.view();
            view.wide = wide.view();
            for (int i = 0; i < 3000; ++i) {
                const DagSegment segment = awkwardSegment(float(grid.size()), random);
                const bool expected = occluded(dag.view(), segment);
                ASSERT_EQ(occluded(view, segment), expected)
                    << "log2 " << log2 << " density " << density << " ray " << i;
                ++(expected ? hits : misses);
            }
        }
    EXPECT_GT(hits, 3000);
    EXPECT_GT(misses, 3000);
}

/// Calls visit(cell, voxels) for the leaves under a wide node, depth first; cell is its number
/// among the cells of its size in Morton order.
template <class Visit>
void forWideLeaves(const WideDag& wide, uint32_t address, uint32_t level, uint64_t cell,
                   const Visit& visit) {
    const uint64_t cells = wide.words.at(address) | uint64_t(wide.words.at(address + 1)) << 32;
    if (level == kLeafLog2)
        return visit(cell, cells);
    uint32_t next = address + 2;
    for (uint64_t rest = cells; rest != 0; rest &= rest - 1)
        forWideLeaves(wide, wide.words.at(next++), level - 2,
                      cell << 6 | uint64_t(std::countr_zero(rest)), visit);
}

// Levels of up to 4096 nodes that have wide ones, several parts for threads; an even and an odd
// root.
TEST(WideDag, LargeOnesHaveTheLeavesOfTheCanonicalFormForAnyThreadCount) {
    std::mt19937 random(19);
    for (const auto& [log2, density] : {std::pair{8u, 0.02}, std::pair{7u, 0.3}}) {
        const DenseGrid grid = randomGrid(log2, density, random);
        const Dag dag = dagOf(grid);
        setThreadCount(1);
        const WideDag wide = buildWideDag(dag);
        setThreadCount(3);
        EXPECT_TRUE(buildWideDag(dag).words == wide.words) << log2;
        setThreadCount(0);
        uint64_t voxelCount = 0, wrongCount = 0;
        forWideLeaves(wide, wide.rootAddress, wide.rootLevel, 0,
                      [&](uint64_t cell, uint64_t voxels) {
                          uint32_t at[3] = {0, 0, 0};
                          for (uint32_t bit = 0; bit < 3 * kMaxResolutionLog2; ++bit)
                              at[bit % 3] |= uint32_t(cell >> bit & 1) << (bit / 3);
                          voxelCount += uint64_t(std::popcount(voxels));
                          for (; voxels != 0; voxels &= voxels - 1) {
                              const uint32_t v = uint32_t(std::countr_zero(voxels));
                              wrongCount += !grid.at(4 * at[0] + 2 * (v >> 3 & 1) + (v & 1),
                                                     4 * at[1] + 2 * (v >> 4 & 1) + (v >> 1 & 1),
                                                     4 * at[2] + 2 * (v >> 5 & 1) + (v >> 2 & 1));
                          }
                      });
        EXPECT_EQ(voxelCount, grid.count()) << log2;
        EXPECT_EQ(wrongCount, 0u) << log2;
    }
}

// As a GPU traces, here on the CPU; also where many nodes lie on the way.
TEST(DagTrace, FlatTraversalEqualsTheCanonicalOneBitForBit) {
    constexpr unsigned kSeed = 17;
    std::mt19937 random(kSeed);
    int hits = 0, misses = 0;
    for (uint32_t log2 = 0; log2 <= 7; ++log2)
        for (const double density : {0.00002, 0.002, 0.02, 0.3}) {
            const Dag dag = dagOf(randomGrid(log2, density, random));
            if (dag.empty())
                continue;
            const Dag covered = withCoverage(dag); // bits above the masks of children
            for (int i = 0; i < 3000; ++i) {
                const DagSegment segment = awkwardSegment(float(1u << log2), random);
                const RaySlabs slabs = makeRaySlabs(segment, segmentScale(dag.grid, segment));
                const bool expected = occluded(dag.view(), segment);
                ASSERT_EQ(detail::meetsVoxel(dag.words.data(), dag.rootAddress,
                                             std::max(log2, kLeafLog2), slabs),
                          expected)
                    << "seed " << kSeed << " log2 " << log2 << " density " << density << " ray "
                    << i;
                ASSERT_EQ(detail::meetsVoxel(covered.words.data(), covered.rootAddress,
                                             std::max(log2, kLeafLog2), slabs),
                          expected)
                    << "with coverage, seed " << kSeed << " log2 " << log2 << " ray " << i;
                ++(expected ? hits : misses);
            }
        }
    EXPECT_GT(hits, 3000);
    EXPECT_GT(misses, 3000);
}

TEST(DagTrace, FlatSlabsHaveTheBitsOfThePortableOnes) {
    constexpr unsigned kSeed = 18;
    std::mt19937 random(kSeed);
    for (int i = 0; i < 200000; ++i) {
        const uint32_t log2 = 1 + random() % 17, side = 1u << random() % log2;
        const DagSegment s = awkwardSegment(float(1u << log2), random);
        VoxelGrid grid;
        grid.resolutionLog2 = log2;
        const RaySlabs r = makeRaySlabs(s, segmentScale(grid, s));
        const auto coordinate = [&] { return uint32_t(random() % (1u << log2)) / side * side; };
        const portable::Corner corner{coordinate(), coordinate(), coordinate()};
        const detail::FlatSlabs flat(r);
        ASSERT_EQ(flat.childHits(corner, side), portable::Tester(r, true).childHits(corner, side))
            << "seed " << kSeed << " ray " << i;
        const uint32_t some = 1 + random() % 255;
        ASSERT_EQ(flat.first(some), portable::Tester(r, true).first(some));
        const uint32_t word = random() & random() & random();
        uint32_t bytes = 0;
        for (int b = 0; b < 4; ++b)
            bytes |= uint32_t((word >> (8 * b) & 0xff) != 0) << b;
        ASSERT_EQ(detail::bytesInUse(word), bytes) << word;
    }
}

TEST(DagTrace, HitIsAnOccupiedCellThatTheSegmentMeets) {
    std::mt19937 random(12);
    for (const uint32_t log2 : {1u, 2u, 3u, 5u}) {
        const DenseGrid grid = randomGrid(log2, 0.03, random);
        const Dag dag = dagOf(grid);
        for (int i = 0; i < 3000; ++i) {
            const DagSegment segment = awkwardSegment(float(grid.size()), random);
            const uint32_t level = random() % (std::max(log2, 2u) + 1);
            DagHit hit;
            const bool isDark = occluded(dag.view(), segment, level, &hit);
            ASSERT_EQ(isDark, occluded(dag.view(), segment, level)); // visited from the other end
            if (!isDark)
                continue;
            ASSERT_EQ(hit.level, level);
            const uint32_t side = 1u << level;
            bool any = false;
            for (uint32_t v = 0; v < side * side * side && !any; ++v)
                any = grid.at(hit.cell.x + v % side, hit.cell.y + v / side % side,
                              hit.cell.z + v / side / side);
            ASSERT_TRUE(any);
            const RaySlabs r = makeRaySlabs(segment, segmentScale(dag.grid, segment));
            ASSERT_TRUE(
                hitsCube(r, float(hit.cell.x), float(hit.cell.y), float(hit.cell.z), float(side)));
        }
    }
}

// Each of the 26 directions through a single voxel in an 8^3 grid: over its face, edge and corner,
// and one past it.
TEST(DagTrace, TwentySixDirectionsThroughCornersEdgesAndFaces) {
    DenseGrid grid(3);
    grid.set(3, 4, 5);
    const Dag dag = dagOf(grid);
    const glm::vec3 lo(3, 4, 5);
    for (int dz = -1; dz <= 1; ++dz)
        for (int dy = -1; dy <= 1; ++dy)
            for (int dx = -1; dx <= 1; ++dx) {
                const glm::vec3 d(dx, dy, dz);
                if (d == glm::vec3(0))
                    continue;
                for (int c = 0; c < 27; ++c) { // corners, edge middles, face middles, the centre
                    const glm::vec3 p = lo + glm::vec3(c % 3, c / 3 % 3, c / 9) * 0.5f;
                    EXPECT_TRUE(occluded(dag.view(), {p - 20.0f * d, p + 20.0f * d}));
                    EXPECT_TRUE(occluded(dag.view(), {p, p + 20.0f * d}));
                    EXPECT_TRUE(occluded(dag.view(), {p - 20.0f * d, p}));
                }
                // Beside it by 1/64, along an axis in which the direction does not move: a miss.
                for (int a = 0; a < 3; ++a)
                    if (d[a] == 0) {
                        glm::vec3 p = lo + 0.5f;
                        p[a] = lo[a] - 1.0f / 64;
                        EXPECT_FALSE(occluded(dag.view(), {p - 20.0f * d, p + 20.0f * d}));
                        p[a] = lo[a] + 1 + 1.0f / 64;
                        EXPECT_FALSE(occluded(dag.view(), {p - 20.0f * d, p + 20.0f * d}));
                    }
                // Ending 1/64 before it: a miss.
                EXPECT_FALSE(occluded(dag.view(),
                                      {lo + 0.5f - 20.0f * d, lo + 0.5f - d * (0.5f + 1.0f / 64)}));
            }
}

TEST(DagTrace, ZeroLengthTestsItsPoint) {
    DenseGrid grid(4);
    grid.set(7, 7, 7);
    const Dag dag = dagOf(grid);
    EXPECT_TRUE(occluded(dag.view(), {glm::vec3(7.5f), glm::vec3(7.5f)}));
    EXPECT_TRUE(occluded(dag.view(), {glm::vec3(7), glm::vec3(7)}));
    EXPECT_FALSE(occluded(dag.view(), {glm::vec3(6.9f), glm::vec3(6.9f)}));
}

TEST(DagTrace, NotANumberInfinityAndOverflowAreDark) {
    DenseGrid grid(4);
    grid.set(1, 2, 3);
    const Dag dag = dagOf(grid);
    const float nan = std::numeric_limits<float>::quiet_NaN(),
                infinity = std::numeric_limits<float>::infinity();
    for (const float bad : {nan, infinity, -infinity, 1e31f, -3e38f})
        for (int end = 0; end < 2; ++end)
            for (int axis = 0; axis < 3; ++axis) {
                DagSegment s{glm::vec3(9), glm::vec3(10)};
                EXPECT_FALSE(occluded(dag.view(), s));
                (end ? s.to : s.from)[axis] = bad;
                EXPECT_TRUE(occluded(dag.view(), s));
                EXPECT_TRUE(occluded(Dag{}.view(), s));
            }
}

TEST(DagTrace, EmptyDagIsLit) {
    EXPECT_FALSE(occluded(Dag{}.view(), {glm::vec3(0), glm::vec3(1)}));
}

TEST(DagTrace, MinusZeroIsZero) {
    DenseGrid grid(2);
    grid.set(0, 0, 0);
    const Dag dag = dagOf(grid);
    EXPECT_TRUE(occluded(dag.view(), {glm::vec3(-0.0f), glm::vec3(-0.0f)}));
    EXPECT_TRUE(occluded(dag.view(), {glm::vec3(-0.0f, 0, 3), glm::vec3(0, -0.0f, -3)}));
}

// The slab test against integers: it accepts whatever the exact segment touches, and nothing that
// it does not touch when grown by twice the margin.
TEST(RaySlabs, IsConservativeByTwiceTheMarginAtMost) {
    std::mt19937 random(13);
    int touching = 0, apart = 0, between = 0;
    for (const uint32_t log2 : {2u, 7u, 12u, 17u}) {
        VoxelGrid grid;
        grid.resolutionLog2 = log2;
        const float size = float(grid.resolution());
        for (int i = 0; i < 6000; ++i) {
            DagSegment s = awkwardSegment(size, random);
            // A cube near some point of the segment, of any power of two.
            const uint32_t side = 1u << (random() % (log2 + 1));
            const glm::vec3 near =
                glm::mix(s.from, s.to, std::uniform_real_distribution<float>(-0.1f, 1.1f)(random));
            glm::vec3 corner = glm::floor(near / float(side) + glm::vec3(int(random() % 3) - 1,
                                                                         int(random() % 3) - 1,
                                                                         int(random() % 3) - 1)) *
                               float(side);
            if (random() % 4 == 0) // start a few roundings beside a face
                s.from[random() % 3] = std::nextafter(corner[0], random() % 2 ? 1e9f : -1e9f);
            const float scale = segmentScale(grid, s);
            const bool computed =
                hitsCube(makeRaySlabs(s, scale), corner.x, corner.y, corner.z, float(side));
            const exact::Point p = exact::point(s.from), q = exact::point(s.to);
            const auto touches = [&](double grow) {
                exact::Point lo, hi;
                for (int a = 0; a < 3; ++a) {
                    lo[a] = exact::scaled(double(corner[a]) - grow, 149);
                    hi[a] = exact::scaled(double(corner[a]) + side + grow, 149);
                }
                return exact::hullTouchesBox({p, q}, lo, hi);
            };
            if (touches(0)) {
                ASSERT_TRUE(computed) << "log2 " << log2 << " ray " << i;
                ++touching;
            } else if (!touches(2.0 * slabMargin(scale))) {
                ASSERT_FALSE(computed) << "log2 " << log2 << " ray " << i;
                ++apart;
            } else {
                ++between;
            }
        }
    }
    EXPECT_GT(touching, 2000);
    EXPECT_GT(apart, 2000);
    EXPECT_GT(between, 20);
}

TEST(RaySlabs, LanesGiveThePortableBits) {
    std::mt19937 random(14);
    VoxelGrid grid;
    grid.resolutionLog2 = 6;
    uint64_t any = 0;
    for (int i = 0; i < 200000; ++i) {
        const DagSegment s = awkwardSegment(64, random);
        const RaySlabs r = makeRaySlabs(s, segmentScale(grid, s));
        const glm::vec3 p = glm::floor(glm::mix(s.from, s.to, 0.5f) / 8.0f) * 8.0f;
        const float h = float(1u << (random() % 4));
        if (!(glm::all(glm::greaterThanEqual(p, glm::vec3(0))) &&
              glm::all(glm::lessThan(p, glm::vec3(64)))))
            continue;
        const glm::uvec3 cell(p);
        const bool isFromBack = i % 2 != 0;
        const slabs::Tester tester(r, isFromBack);
        const portable::Tester portableTester(r, isFromBack);
        slabs::Corner corner;
        for (uint32_t level = 6; level-- > 0;)
            corner = corner.child((cell.x >> level & 1) | (cell.y >> level & 1) << 1 |
                                      (cell.z >> level & 1) << 2,
                                  1u << level);
        ASSERT_EQ(corner.cell(), cell);
        const portable::Corner portableCorner{cell.x, cell.y, cell.z};
        ASSERT_EQ(corner.ancestor(3).cell(), portableCorner.ancestor(3).cell());
        ASSERT_EQ(tester.childHits(corner, uint32_t(h)),
                  portableTester.childHits(portableCorner, uint32_t(h)));
        const uint64_t hits = portableTester.leafHits(portableCorner);
        ASSERT_EQ(tester.leafHits(corner), hits);
        const uint32_t some = 1 + random() % 255;
        ASSERT_EQ(tester.first(some), portableTester.first(some));
        any |= hits;
        for (uint32_t v = 0; v < 64; v += 1 + random() % 8) {
            const uint32_t o = v / 8, c = v % 8;
            ASSERT_EQ(hits >> v & 1, hitsCube(r, p.x + 2 * (o & 1) + (c & 1),
                                              p.y + 2 * (o >> 1 & 1) + (c >> 1 & 1),
                                              p.z + 2 * (o >> 2) + (c >> 2), 1.0f));
        }
    }
    EXPECT_EQ(any, ~uint64_t(0));
}

TEST(DagTracePass, BitsAreThoseOfOccludedForAnyThreadCount) {
    std::mt19937 random(15);
    const DenseGrid grid = randomGrid(5, 0.01, random);
    const Dag dag = dagOf(grid);
    std::vector<DagSegment> segments;
    for (int i = 0; i < 1003; ++i)
        segments.push_back(awkwardSegment(32, random));
    for (const int threads : {1, 2, 5}) {
        setThreadCount(threads);
        std::vector<uint32_t> bits((segments.size() + 31) / 32, 0xffffffffu);
        traceSegments(Backend::kCpu, dag.view(), viewOf(segments), 1, viewOf(bits));
        for (size_t i = 0; i < bits.size() * 32; ++i)
            ASSERT_EQ(bits[i / 32] >> (i % 32) & 1,
                      i < segments.size() && occluded(dag.view(), segments[i], 1));
    }
    setThreadCount(0);
}

TEST(DagVisits, AreTheNodesOnTheWayToTheOnlyVoxel) {
    // One voxel in the corner of 64^3: nodes of level 6, 5, 4, 3 and the leaf.
    DenseGrid grid(6);
    grid.set(0, 0, 0);
    const Dag dag = dagOf(grid);
    EXPECT_EQ(countDagVisits(dag.view(), {{-1, 0.5f, 0.5f}, {65, 0.5f, 0.5f}}), 5u);
    EXPECT_EQ(countDagVisits(dag.view(), {{-1, 0.5f, 0.5f}, {65, 0.5f, 0.5f}}, 4), 2u)
        << "a cell of 16 voxels answers from its parent's mask";
    EXPECT_EQ(countDagVisits(dag.view(), {{40, 40, 40}, {60, 60, 60}}), 1u) << "the root alone";
    EXPECT_EQ(countDagVisits(dag.view(), {{0, 0, 0}, {1, 1, 1}}, 6), 0u) << "the root's own level";
    EXPECT_EQ(countDagVisits(DagView{}, {{0, 0, 0}, {1, 1, 1}}), 0u);
    const float nan = std::numeric_limits<float>::quiet_NaN();
    EXPECT_EQ(countDagVisits(dag.view(), {{nan, 0, 0}, {1, 1, 1}}), 0u);
}

} // namespace
} // namespace shadowdag
