// SPDX-License-Identifier: Apache-2.0
#include "voxel/dag_stream.h"

#include "tests/voxel/voxel_sets.h"
#include "voxel/dag_trace_pass.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace shadowdag {
namespace {

constexpr StreamIsa kIsas[] = {StreamIsa::kPortable, StreamIsa::kAvx2, StreamIsa::kAvx512};

/// Segments as frames ask for them and as nobody should: bundles from a patch to a light, with
/// members of other directions, ends on lattice points, far outside, equal, not numbers.
std::vector<DagSegment> bundles(float size, size_t count, std::mt19937& random) {
    std::uniform_real_distribution<float> unit(0, 1);
    const auto point = [&](float low, float high) {
        return glm::vec3(low + (high - low) * unit(random), low + (high - low) * unit(random),
                         low + (high - low) * unit(random));
    };
    std::vector<DagSegment> segments;
    while (segments.size() < count) {
        const glm::vec3 patch = point(-0.1f * size, 1.1f * size),
                        light = point(-0.5f * size, 1.5f * size);
        const float width = size * std::pow(unit(random), 4.0f);
        const uint32_t members = 1 + random() % 70, oddity = random() % 8;
        for (uint32_t i = 0; i < members; ++i) {
            DagSegment s{patch + width * point(-0.5f, 0.5f), light + point(-1, 1)};
            if (oddity == 0) {
                s.from = glm::round(s.from);
                s.to = glm::round(s.to);
            } else if (oddity == 1 && random() % 4 == 0) {
                const glm::vec3 d(int(random() % 3) - 1, int(random() % 3) - 1,
                                  int(random() % 3) - 1);
                s.to = glm::round(s.from) + d * (2 * size * unit(random));
            } else if (oddity == 2 && random() % 4 == 0) {
                s.to[random() % 3] = s.from[random() % 3];
            } else if (oddity == 3 && random() % 8 == 0) {
                s.to = s.from;
            } else if (oddity == 4 && random() % 8 == 0) {
                constexpr float kBad[] = {std::numeric_limits<float>::quiet_NaN(),
                                          std::numeric_limits<float>::infinity(),
                                          -std::numeric_limits<float>::infinity(),
                                          1e30f,
                                          -3e38f,
                                          9e29f,
                                          -1e9f,
                                          -0.0f};
                (random() % 2 ? s.to : s.from)[random() % 3] = kBad[random() % 8];
            } else if (oddity == 5) {
                s.to = s.from + point(-2, 2);
            }
            segments.push_back(s);
        }
    }
    segments.resize(count);
    return segments;
}

TEST(DagStream, EveryIsaGivesTheBitsOfOccluded) {
    const uint32_t seed = 21;
    std::mt19937 random(seed);
    size_t hits = 0, misses = 0;
    for (uint32_t log2 = 0; log2 <= 8; ++log2)
        for (const double density : {0.0, 0.00002, 0.0005, 0.02, 0.3}) {
            const TwoForms forms(dagOf(randomGrid(log2, density, random)));
            const std::vector<DagSegment> segments =
                bundles(float(1u << log2), 3000 + random() % 70, random);
            std::vector<uint8_t> expected(segments.size());
            for (size_t i = 0; i < segments.size(); ++i)
                expected[i] = occluded(forms.dag.view(), segments[i]);
            hits += size_t(std::count(expected.begin(), expected.end(), 1));
            misses += size_t(std::count(expected.begin(), expected.end(), 0));
            for (const StreamIsa isa : kIsas) {
                if (!hasStreamIsa(isa))
                    continue;
                // One more than requested: streams must not write past their end.
                std::vector<uint8_t> blocked(segments.size() + 1, 7);
                traceStream(forms.view(), viewOf(segments),
                            View<uint8_t>{blocked.data(), segments.size()}, isa);
                EXPECT_EQ(blocked.back(), 7);
                for (size_t i = 0; i < segments.size(); ++i)
                    ASSERT_EQ(blocked[i], expected[i])
                        << streamIsaName(isa) << " seed " << seed << " log2 " << log2 << " density "
                        << density << " segment " << i;
            }
        }
    EXPECT_GT(hits, 20000u);
    EXPECT_GT(misses, 20000u);
}

/// Appends the cells of one level below a node; leaves where the level is kLeafLog2.
void cellsOfLevel(const WideDagView& wide, uint32_t address, uint32_t level, glm::vec3 corner,
                  uint32_t wanted, std::vector<WideCell>& cells) {
    if (level == wanted) {
        cells.push_back({address, level, {corner.x, corner.y, corner.z}});
        return;
    }
    const uint64_t mask = wide.words[address] | uint64_t(wide.words[address + 1]) << 32;
    uint32_t next = address + 2;
    for (uint32_t i = 0; i < 64; ++i)
        if (mask >> i & 1) {
            const glm::vec3 place((i >> 3 & 1) * 2 + (i & 1), (i >> 4 & 1) * 2 + (i >> 1 & 1),
                                  (i >> 5 & 1) * 2 + (i >> 2 & 1));
            cellsOfLevel(wide, wide.words[next++], level - 2,
                         corner + float(1u << (level - 2)) * place, wanted, cells);
        }
}

// All cells of a level are a shaft's cut that is too large; in any order, met or not.
TEST(DagStream, FromCellsGivesTheBitsFromTheRoot) {
    const uint32_t seed = 22;
    std::mt19937 random(seed);
    for (const uint32_t log2 : {3u, 4u, 7u})
        for (const double density : {0.0005, 0.02}) {
            const TwoForms forms(dagOf(randomGrid(log2, density, random)));
            if (forms.wide.words.empty())
                continue;
            const std::vector<DagSegment> segments = bundles(float(1u << log2), 1500, random);
            std::vector<uint8_t> expected(segments.size());
            for (size_t i = 0; i < segments.size(); ++i)
                expected[i] = occluded(forms.dag.view(), segments[i]);
            for (uint32_t level = kLeafLog2; level <= forms.wide.rootLevel; level += 2) {
                std::vector<WideCell> cells;
                cellsOfLevel(forms.wide.view(), forms.wide.rootAddress, forms.wide.rootLevel,
                             glm::vec3(0), level, cells);
                std::shuffle(cells.begin(), cells.end(), random);
                for (const StreamIsa isa : kIsas) {
                    if (!hasStreamIsa(isa))
                        continue;
                    std::vector<uint8_t> blocked(segments.size(), 7);
                    traceStream(forms.view(), View<const WideCell>(viewOf(cells)), viewOf(segments),
                                viewOf(blocked), isa);
                    ASSERT_EQ(blocked, expected) << streamIsaName(isa) << " seed " << seed
                                                 << " log2 " << log2 << " level " << level;
                }
            }
            // No cells: only what is no number is dark.
            std::vector<uint8_t> blocked(segments.size(), 7);
            traceStream(forms.view(), View<const WideCell>{}, viewOf(segments), viewOf(blocked));
            for (size_t i = 0; i < segments.size(); ++i)
                ASSERT_EQ(blocked[i], !(segmentScale(forms.dag.grid, segments[i]) < kLargestScale));
        }
}

TEST(DagStream, AnySplitOfTheListGivesTheSameBits) {
    std::mt19937 random(23);
    const TwoForms forms(dagOf(randomGrid(6, 0.003, random)));
    const std::vector<DagSegment> segments = bundles(64, 1000, random);
    std::vector<uint8_t> whole(segments.size(), 7), parts(segments.size(), 7);
    traceStream(forms.view(), viewOf(segments), viewOf(whole));
    for (size_t first = 0; first < segments.size();) {
        const size_t count = std::min<size_t>(random() % 40, segments.size() - first);
        traceStream(forms.view(), View<const DagSegment>{segments.data() + first, count},
                    View<uint8_t>{parts.data() + first, count});
        first += count;
    }
    EXPECT_EQ(whole, parts);
}

TEST(DagStream, BestIsaIsSupported) {
    EXPECT_TRUE(hasStreamIsa(StreamIsa::kPortable));
    EXPECT_TRUE(hasStreamIsa(bestStreamIsa()));
    for (const StreamIsa isa : kIsas)
        EXPECT_TRUE(!hasStreamIsa(isa) || isa <= bestStreamIsa());
}

TEST(DagTracePass, LevelZeroGoesThroughStreamsForAnyThreadCount) {
    std::mt19937 random(24);
    const TwoForms forms(dagOf(randomGrid(6, 0.003, random)));
    for (const size_t count : {size_t(0), size_t(1), size_t(1024), size_t(2531)}) {
        const std::vector<DagSegment> segments = bundles(64, count, random);
        for (const int threads : {1, 2, 5}) {
            setThreadCount(threads);
            std::vector<uint32_t> bits((count + 31) / 32, 0xffffffffu);
            traceSegments(Backend::kCpu, forms.view(), viewOf(segments), 0, viewOf(bits));
            for (size_t i = 0; i < bits.size() * 32; ++i)
                ASSERT_EQ(bits[i / 32] >> (i % 32) & 1,
                          i < count && occluded(forms.view(), segments[i]));
        }
    }
    setThreadCount(0);
}

} // namespace
} // namespace shadowdag
