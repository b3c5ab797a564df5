// SPDX-License-Identifier: Apache-2.0
// Tests the error analysis with frames built by hand in which every class is known, by voxels.
#include "hybrid/judge/error.h"

#include "cuda/backend.h"
#include "cuda/error.h"
#include "tests/hybrid/hand_frame.h"

#include <gtest/gtest.h>

#include <string>

namespace shadowdag {
namespace {

using test::HandFrame;
using test::makeDag;

/// Voxels of 1 m, a floor at y = 0.5 and lights straight above the samples at y = 60. Eight pairs,
/// one of each kind.
HandFrame makeVoxelFrame() {
    HandFrame f;
    f.soup.addLevelSquare({32, 0.5f, 32}, 32.0f);
    const auto pairAt = [&](float x, float z) { f.add({x, 0.5f, z}, {x, 60, z}, z >= x ? 0 : 1); };
    pairAt(5.5f, 10.5f);  // 0: nothing in between
    pairAt(17.5f, 10.5f); // 1: a plate just beside the ray shares its voxel
    f.soup.addLevelSquare({15.2f, 30.5f, 10.5f}, 2.2f);
    pairAt(29.5f, 10.5f); // 2: a voxel that nothing is in
    pairAt(41.5f, 10.5f); // 3: a plate 0.7 m over the floor, below the lifted start
    f.soup.addLevelSquare({41.5f, 1.2f, 10.5f}, 1.0f);
    pairAt(53.5f, 10.5f); // 4: a plate without voxels, wider than any shift
    f.soup.addLevelSquare({53.5f, 30.5f, 10.5f}, 3.5f);
    pairAt(5.5f, 40.5f); // 5: a plate without voxels, narrower than most shifts
    f.soup.addLevelSquare({5.5f, 30.5f, 40.5f}, 1.0f);
    pairAt(17.5f, 40.5f); // 6: a plate 1 m under the light, nearer than sqrt(3) voxels
    f.soup.addLevelSquare({17.5f, 59.0f, 40.5f}, 4.0f);
    pairAt(29.5f, 40.5f); // 7: a plate with its voxel
    f.soup.addLevelSquare({29.5f, 30.5f, 40.5f}, 3.5f);
    f.dag = makeDag(6, {{17, 30, 10}, {29, 30, 10}, {29, 30, 40}});
    f.answer();
    return f;
}

TEST(Error, VoxelPairsOfEveryKindAreDistinguished) {
    const HandFrame f = makeVoxelFrame();
    std::vector<uint8_t> truthVisibility;
    const ErrorReport report = f.judge(&truthVisibility);
    EXPECT_EQ(f.visibility, (std::vector<uint8_t>{255, 0, 0, 255, 255, 255, 255, 0}));
    EXPECT_EQ(truthVisibility, (std::vector<uint8_t>{255, 255, 255, 0, 0, 0, 0, 0}));
    using V = PairVerdict;
    EXPECT_EQ(report.verdicts,
              (std::vector<V>{V::kRight, V::kExplained, V::kUnexplained, V::kContact,
                              V::kUnexplained, V::kExplained, V::kContact, V::kRight}));
    EXPECT_EQ(report.total.pairCount, 8u);
    EXPECT_EQ(report.total.occludedCount, 5u);
    EXPECT_EQ(report.total.falseShadowCount, 2u);
    EXPECT_EQ(report.total.falseLightCount, 4u);
    EXPECT_EQ(report.total.unexplainedFalseShadowCount, 1u);
    EXPECT_EQ(report.total.unexplainedFalseLightCount, 1u);
    EXPECT_EQ(report.total.acneCount, 0u);
    EXPECT_EQ(report.total.contactCount, 2u);
    EXPECT_DOUBLE_EQ(report.total.absVisibilityErrorSum, 6.0);
    EXPECT_DOUBLE_EQ(report.total.meanAbsVisibilityError(), 0.75);
    EXPECT_EQ(report.visibilityHistogram[255], 5u);
    EXPECT_EQ(report.visibilityHistogram[0], 3u);
    // Of the two right pairs neither has an edge within a shift.
    EXPECT_EQ(report.nullRate, 0.0);
    EXPECT_EQ(report.nullSampleCount, 500u);
}

TEST(Error, CountsPerLightAddUpToTheTotal) {
    const HandFrame f = makeVoxelFrame();
    const ErrorReport report = f.judge();
    ASSERT_EQ(report.perLight.size(), 8u);
    ErrorCounts sum;
    for (size_t l = 0; l < 8; ++l) {
        EXPECT_EQ(report.perLight[l].pairCount, 1u);
        sum.add(report.perLight[l]);
    }
    EXPECT_EQ(report.perLight[2].unexplainedFalseShadowCount, 1u);
    EXPECT_EQ(report.perLight[4].unexplainedFalseLightCount, 1u);
    EXPECT_EQ(report.perLight[6].contactCount, 1u);
    EXPECT_EQ(sum.falseLightCount, report.total.falseLightCount);
    EXPECT_EQ(sum.absVisibilityErrorSum, report.total.absVisibilityErrorSum);
}

TEST(Error, ABlockerBeyondTheOffsetIsNoContactThoughAnotherIsNear) {
    HandFrame f = makeVoxelFrame();
    // Over the contact pair 3 hangs a second plate, wide and without voxels.
    f.soup.addLevelSquare({41.5f, 30.5f, 10.5f}, 4.0f);
    f.answer();
    EXPECT_EQ(f.judge().verdicts[3], PairVerdict::kUnexplained);
}

TEST(Error, NullRateCountsRightPairsNearAnEdge) {
    HandFrame f;
    f.soup.addLevelSquare({32, 0.5f, 32}, 32.0f);
    f.soup.addLevelSquare({42.5f, 30.5f, 32}, 10.0f); // its edge is at x = 32.5
    f.dag = makeDag(6, {{50, 60, 50}});
    // A shift is at most sqrt(3) + 1 voxels and a little: 2 m beside the edge flips, 3 m does not.
    f.add({30.5f, 0.5f, 32}, {30.5f, 60, 32}, 0);
    f.add({29.5f, 0.5f, 32}, {29.5f, 60, 32}, 0);
    f.answer();
    const ErrorReport report = f.judge();
    EXPECT_EQ(report.total.falseShadowCount + report.total.falseLightCount, 0u);
    EXPECT_NEAR(report.nullRate, 0.5, 0.1);
}

TEST(Error, ShiftsBelowTheReceiversPlaneAreLiftedBack) {
    // At slanting light half of the shifts push the start under the floor, whose other triangle
    // would stop them.
    HandFrame f;
    f.soup.addLevelSquare({32, 0.5f, 32}, 32.0f);
    f.dag = makeDag(6, {{60, 60, 2}});
    f.add({20, 0.5f, 20.1f}, {55, 20, 50}, 0);
    f.answer();
    ASSERT_EQ(f.visibility[0], kLit);
    EXPECT_EQ(f.judge().nullRate, 0.0);
}

TEST(Error, SpecksThatTheShiftsMissAreSettledByAnAimedOne) {
    // A speck of 1 cm in a voxel of 1 m that the ray crosses; the 32 shifts over a disc of more
    // than 20 square metres miss it, a shift aimed at it does not. Beside it an empty voxel.
    HandFrame f;
    f.soup.addLevelSquare({32, 0.5f, 32}, 32.0f);
    f.soup.addLevelSquare({20.9f, 30.5f, 20.5f}, 0.01f);
    f.dag = makeDag(6, {{20, 30, 20}, {40, 30, 40}});
    f.add({20.3f, 0.5f, 20.4f}, {20.3f, 60, 20.4f}, 1);
    f.add({40.5f, 0.5f, 40.5f}, {40.5f, 60, 40.5f}, 0);
    f.answer();
    const ErrorReport report = f.judge();
    EXPECT_EQ(report.verdicts,
              (std::vector<PairVerdict>{PairVerdict::kSettled, PairVerdict::kUnexplained}));
    EXPECT_EQ(report.total.settledFalseShadowCount, 1u);
    EXPECT_EQ(report.total.unexplainedFalseShadowCount, 2u);
}

TEST(Error, HitsInTheReceiversOwnVoxelsAreAcne) {
    HandFrame f;
    f.rays.offset = 0.0f;
    f.soup.addLevelSquare({32, 0.5f, 32}, 32.0f); // triangle 0: z >= x
    const auto pairAt = [&](float x, float z, float lightX) {
        f.add({x, 0.5f, z}, {lightX, 60.5f, z}, z >= x ? 0 : 1);
    };
    pairAt(5.5f, 10.5f, 5.5f); // 0: stopped by its own triangle's voxel
    pairAt(20.5f, 21.5f,
           20.5f); // 1: stopped by a voxel that only the coplanar neighbour touches, see below
    pairAt(40.5f, 50.5f, 40.5f); // 2: stopped by an empty voxel far above
    f.dag = makeDag(6, {{5, 0, 10}, {40, 30, 50}, {22, 0, 21}});
    // The ray of pair 1 leans over the diagonal: at y = 0.75 it is at x = 22.0 .. in voxel 22,
    // whose cell lies wholly at x > z.
    f.lights[1].positionWorld = {20.5f + 240.0f * 1.75f, 60.5f, 21.5f};
    f.lights[1].rangeWorld = 1e9f;
    f.answer();
    ASSERT_EQ(f.visibility, (std::vector<uint8_t>{0, 0, 0}));
    const ErrorReport report = f.judge();
    EXPECT_EQ(report.total.falseShadowCount, 3u);
    EXPECT_EQ(report.total.acneCount, 2u);
    EXPECT_EQ(report.verdicts[0], PairVerdict::kAcne);
    EXPECT_EQ(report.verdicts[1], PairVerdict::kAcne);
    EXPECT_EQ(report.verdicts[2], PairVerdict::kUnexplained);
}

TEST(Error, FractionalVisibilityIsDarkUnderOneHalf) {
    HandFrame f = makeVoxelFrame();
    f.visibility = {128, 127, 255, 0, 51, 255, 255, 0}; // by the truth: 3 lit, then 5 dark
    const ErrorReport report = f.judge();
    EXPECT_EQ(report.total.falseShadowCount, 1u);
    EXPECT_EQ(report.total.falseLightCount, 2u);
    EXPECT_NEAR(report.total.absVisibilityErrorSum, (127 + 128 + 0 + 0 + 51 + 255 + 255) / 255.0,
                1e-12);
    EXPECT_EQ(report.visibilityHistogram[51], 1u);
    EXPECT_EQ(report.visibilityHistogram[127], 1u);
}

TEST(Error, ReportsAreTheSameForAnyThreadCountAndRun) {
    const HandFrame f = makeVoxelFrame();
    setThreadCount(1);
    const ErrorReport one = f.judge(nullptr, 7);
    setThreadCount(4);
    const ErrorReport four = f.judge(nullptr, 7);
    setThreadCount(0);
    EXPECT_EQ(one.verdicts, four.verdicts);
    EXPECT_EQ(one.nullRate, four.nullRate);
}

TEST(Error, MissingVisibilitiesAreRefused) {
    HandFrame f = makeVoxelFrame();
    f.visibility.pop_back();
    try {
        f.judge();
        FAIL() << "accepted";
    } catch (const Error& e) {
        EXPECT_EQ(e.kind(), ErrorKind::kUsage);
        EXPECT_NE(std::string(e.what()).find("recordPairs"), std::string::npos) << e.what();
    }
}

TEST(Error, ExplainingHasPowerWhereRightPairsAreExplainedLess) {
    ErrorReport report;
    EXPECT_TRUE(report.explainingHasPower()) << "no wrong pair";
    report.total.falseShadowCount = 6;
    report.total.falseLightCount = 4;
    report.total.unexplainedFalseShadowCount = 1;
    report.total.unexplainedFalseLightCount = 2;
    report.total.acneCount = report.total.contactCount = report.total.magnifiedCount = 1;
    EXPECT_EQ(report.explainedCount(), 4u);
    EXPECT_TRUE(report.explainingHasPower()) << "no right pair near an outline";
    report.outlineNullSampleCount = 100;
    report.outlineNullRate = 0.39;
    EXPECT_TRUE(report.explainingHasPower());
    report.outlineNullRate = 0.41;
    EXPECT_FALSE(report.explainingHasPower()) << "4 of 10 wrong ones are explained";
    report.outlineNullSampleCount = 8;
    report.total.falseLightCount += 6; // of 16 wrong ones 10 are explained
    report.outlineNullRate = 0.5;
    EXPECT_TRUE(report.explainingHasPower());
    report.outlineNullRate = 0.51;
    EXPECT_FALSE(report.explainingHasPower()) << "more than half of the right ones";
    report.total.falseShadowCount = report.total.unexplainedFalseShadowCount = 0;
    report.total.falseLightCount = 8;
    report.total.unexplainedFalseLightCount = 3; // and 3 that are acne, contact and magnified
    report.outlineNullRate = 0.25;
    EXPECT_EQ(report.explainedCount(), 2u);
    EXPECT_FALSE(report.explainingHasPower()) << "the same share";
}

TEST(Error, NoPairsGiveAnEmptyReport) {
    HandFrame f;
    f.soup.addLevelSquare({0, 0, 0}, 1.0f);
    const ErrorReport report = f.judge();
    EXPECT_EQ(report.total.pairCount, 0u);
    EXPECT_EQ(report.total.meanAbsVisibilityError(), 0.0);
    EXPECT_EQ(report.nullRate, 0.0);
}

} // namespace
} // namespace shadowdag
