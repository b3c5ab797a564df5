// SPDX-License-Identifier: Apache-2.0
// Tests the shifts that explain errors, and the error analysis with frames built by hand in which
// every class is known, by maps.
#include "hybrid/judge/explain.h"

#include "tests/hybrid/hand_frame.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace shadowdag {
namespace {

using test::MapFrame;

TEST(Shifts, FillTheDiscToItsRim) {
    for (const uint64_t seed : {1u, 2u, 99u}) {
        const auto shifts = makeShifts(seed);
        int rimCount = 0, quadrantCount[4] = {};
        for (const glm::dvec2& s : shifts) {
            EXPECT_LE(glm::length(s), 1.0 + 1e-12);
            rimCount += glm::length(s) > 1.0 - 1e-9;
            ++quadrantCount[(s.x > 0) + 2 * (s.y > 0)];
        }
        EXPECT_EQ(rimCount, 8);
        for (const int count : quadrantCount) {
            EXPECT_GE(count, 6);
            EXPECT_LE(count, 10);
        }
        // No point of the disc is farther than 0.4 from a shift.
        for (double x = -1; x <= 1; x += 0.05)
            for (double y = -1; y <= 1; y += 0.05) {
                if (x * x + y * y > 1)
                    continue;
                double nearest = 9;
                for (const glm::dvec2& s : shifts)
                    nearest = std::min(nearest, glm::length(s - glm::dvec2(x, y)));
                EXPECT_LT(nearest, 0.4) << x << " " << y;
            }
    }
    EXPECT_NE(makeShifts(1)[0], makeShifts(2)[0]);
}

TEST(Error, MapPairsOfEveryKindAreDistinguished) {
    MapFrame f;
    f.bias.constantTexels = 0.0f;
    f.addPair(-6.0f, -6.0f); // 0: an empty texel under an open sky
    f.addPair(-6.0f, 1.0f);  // 1: the floor itself, drawn 0.1 m too near
    f.store(-6.0f, 1.0f, 9.9f);
    f.addPair(1.0f, -6.0f); // 2: a surface that is not there, at half height
    f.store(1.0f, -6.0f, 5.0f);
    f.addPair(6.0f, 6.0f); // 3: a plate beside the ray (at (3, 5, 3)) that its texel sees; texels
                           // are 0.625 m there
    f.store(6.0f, 6.0f, 5.0f);
    f.soup.addLevelSquare({3.45f, 5.0f, 3.45f}, 0.4f);
    f.addPair(6.0f, -3.0f); // 4: a wide plate, drawn right
    f.store(6.0f, -3.0f, 5.0f);
    f.soup.addLevelSquare({3.0f, 5.0f, -1.5f}, 1.0f);
    f.addPair(-3.0f, 6.0f); // 5: a wide plate that the map lacks
    f.soup.addLevelSquare({-1.5f, 5.0f, 3.0f}, 1.0f);
    f.addPair(-7.0f, -2.0f); // 6: the same, narrower than a texel
    f.soup.addLevelSquare({-3.5f, 5.0f, -1.0f}, 0.3f);
    f.answer();
    std::vector<uint8_t> truthVisibility;
    const ErrorReport report = f.judge(&truthVisibility);
    EXPECT_EQ(f.visibility, (std::vector<uint8_t>{255, 0, 0, 0, 0, 255, 255}));
    EXPECT_EQ(truthVisibility, (std::vector<uint8_t>{255, 255, 255, 255, 0, 0, 0}));
    using V = PairVerdict;
    EXPECT_EQ(report.verdicts, (std::vector<V>{V::kRight, V::kAcne, V::kUnexplained, V::kExplained,
                                               V::kRight, V::kUnexplained, V::kExplained}));
    EXPECT_EQ(report.total.acneCount, 1u);
    EXPECT_EQ(report.total.contactCount, 0u);
    EXPECT_EQ(report.total.unexplainedFalseShadowCount, 1u);
    EXPECT_EQ(report.total.unexplainedFalseLightCount, 1u);
}

// The corner of a plate in a voxel of one unit, near a light at the height 40 and far from the
// floor: its shadow is displaced by sqrt(3) 40 / 4 and the lift, 18 to 20 units. A pixel that is
// smaller than an eighth of that sees the edge elsewhere; with a larger one the error is explained.
TEST(Error, AVoxelNearTheLightMagnifiesItsShadow) {
    for (const double pixelAtFloor : {2.0, 3.0}) {
        SCOPED_TRACE(pixelAtFloor);
        test::HandFrame f;
        f.dag = test::makeDag(6, {{32, 36, 32}});
        f.soup.addLevelSquare({32, 0, 32}, 30.0f);
        f.soup.addLevelSquare({33.95f, 36.5f, 33.95f}, 1.4f); // in the voxel, beside the ray
        f.add({32.3f, 0, 32.3f}, {32.3f, 40, 32.3f}, 0);
        f.detail.forward = {0, -1, 0};
        f.detail.eyeWorld = {32, 100, 32};
        f.detail.pixelSize = pixelAtFloor / 100.0;
        f.answer();
        ASSERT_EQ(f.visibility[0], 0);
        const ErrorReport report = f.judge();
        EXPECT_EQ(report.verdicts[0],
                  pixelAtFloor < 2.5 ? PairVerdict::kMagnified : PairVerdict::kExplained);
        EXPECT_EQ(report.total.magnifiedCount, pixelAtFloor < 2.5 ? 1u : 0u);
        EXPECT_EQ(report.total.falseShadowCount, 1u);
        EXPECT_EQ(report.total.unexplainedFalseShadowCount, 0u);
    }
}

// Texels are 1.25 units on the floor, wherever the blocker is; with one tap the edge is within one.
TEST(Error, ATexelThatIsManyPixelsWideMagnifies) {
    for (const double pixel : {0.15, 0.17}) {
        SCOPED_TRACE(pixel);
        MapFrame f;
        f.bias.constantTexels = 0.0f;
        f.addPair(6.0f, 6.0f); // as pair 3 above
        f.store(6.0f, 6.0f, 5.0f);
        f.soup.addLevelSquare({3.45f, 5.0f, 3.45f}, 0.4f);
        f.detail.forward = {0, -1, 0};
        f.detail.eyeWorld = {0, 50, 0};
        f.detail.pixelSize = pixel / 50.0;
        f.answer();
        EXPECT_EQ(f.judge().verdicts[0],
                  pixel < 0.16 ? PairVerdict::kMagnified : PairVerdict::kExplained);
    }
}

TEST(Error, ABlockerCloseOverTheFloorIsNoAcne) {
    MapFrame f;
    f.bias.constantTexels = 0.0f;
    f.addPair(0.4f, 0.4f); // its texel is [0, 1.25]^2 with centre (0.625, 0.625)
    f.store(0.4f, 0.4f, 9.9f);
    f.soup.addLevelSquare({1.0f, 0.1f, 1.0f}, 0.5f); // over the centre, not over the sample
    f.answer();
    EXPECT_EQ(f.judge().verdicts[0], PairVerdict::kExplained);
}

TEST(Error, BlockersWithinTheMapsBiasAreContact) {
    for (const float height : {1.0f, 2.0f}) { // the bias is one texel, 1.25 m
        MapFrame f;
        f.bias.constantTexels = 1.0f;
        f.addPair(0.4f, 0.4f);
        f.soup.addLevelSquare({0, height, 0}, 5.0f);
        f.answer();
        EXPECT_EQ(f.judge().verdicts[0],
                  height < 1.25f ? PairVerdict::kContact : PairVerdict::kUnexplained);
    }
}

TEST(Error, BlockersBeforeTheMapsBiasAreNoContactHoweverLowTheLight) {
    // The light is 10 m over the floor, 80 m away: a texel and with it the bias is 10 m there, all
    // of the light's height. The wall is drawn in neither case.
    for (const float x : {72.0f, 60.0f}) {
        MapFrame f;
        f.bias.constantTexels = 1.0f;
        f.soup.addLevelSquare({0, 0, 0}, 200.0f);
        f.add({80, 0, 0.1f}, {0, 10, 0}, 3, PairServer::drawnMap(0));
        f.soup.addQuad({x, -1, -90}, {x, 30, -90}, {x, 30, 90}, {x, -1, 90});
        f.answer();
        ASSERT_EQ(f.visibility[0], kLit);
        EXPECT_EQ(f.judge().verdicts[0],
                  x > 70.0f ? PairVerdict::kContact : PairVerdict::kUnexplained);
    }
}

TEST(Error, LightByATapsRayThatTheShiftsMissIsSettledByTheTruthAlongIt) {
    // A plate over the whole filter but for a pinhole of 2 cm around a texel's centre, 5 m below
    // the light, where a texel is 0.625 m. The map is right about that texel, and nothing else
    // agrees.
    const auto judged = [](bool hasHole, bool isDrawn) {
        MapFrame f;
        f.bias.constantTexels = 0.0f;
        f.addPair(0.4f,
                  0.5f); // its texel is [0, 1.25]^2, whose centre's ray is at (0.3125, 5, 0.3125)
        const glm::vec3 hole(0.3125f, 5.0f, 0.3125f);
        const float in = hasHole ? 0.01f : 0.0f;
        const glm::vec4 parts[4] = {// x0, x1, z0, z1 around the hole
                                    {-4, -in, -4, 4},
                                    {in, 4, -4, 4},
                                    {-in, in, -4, -in},
                                    {-in, in, in, 4}};
        for (const glm::vec4& p : parts)
            if (p.x < p.y)
                f.soup.addQuad(hole + glm::vec3(p.x, 0, p.z), hole + glm::vec3(p.y, 0, p.z),
                               hole + glm::vec3(p.y, 0, p.w), hole + glm::vec3(p.x, 0, p.w));
        if (isDrawn)
            f.store(0.4f, 0.5f, 5.0f);
        f.answer();
        const ErrorReport report = f.judge();
        EXPECT_EQ(report.total.settledFalseLightCount,
                  report.verdicts[0] == PairVerdict::kTapSettled ? 1u : 0u);
        EXPECT_EQ(report.total.tapSettledCount, report.total.settledFalseLightCount);
        EXPECT_EQ(report.total.unexplainedFalseLightCount, report.total.falseLightCount);
        return report.verdicts[0];
    };
    EXPECT_EQ(judged(true, false), PairVerdict::kTapSettled);
    EXPECT_EQ(judged(false, false), PairVerdict::kUnexplained); // a plate that the map lost
    EXPECT_EQ(judged(false, true), PairVerdict::kRight);
}

TEST(Error, TheTapsNullRateCountsRightPairsThatTheirRaysWouldSettle) {
    // Four answers, all right: the map lacks both plates, which hang beside the pairs' own rays.
    MapFrame f;
    f.bias.constantTexels = 0.0f;
    f.addPair(0.4f, 0.5f); // a speck on its tap's ray alone, at (0.3125, 5, 0.3125)
    f.soup.addLevelSquare({0.3125f, 5.0f, 0.3125f}, 0.005f);
    f.addPair(6.0f, 6.0f); // a plate over its tap's ray at (2.8125, 5, 2.8125) and over some shifts
    f.soup.addLevelSquare({2.465f, 5.0f, 2.465f}, 0.465f);
    f.addPair(-6.0f, -6.0f);          // nothing near
    f.add({-6, 0, 6}, {0, 10, 0}, 0); // a ray, which has no taps
    f.answer();
    const ErrorReport report = f.judge();
    ASSERT_EQ(report.total.falseShadowCount + report.total.falseLightCount, 0u);
    EXPECT_EQ(report.nullSampleCount, 500u);
    EXPECT_NEAR(report.nullRate, 1.0 / 4, 0.08);
    EXPECT_NEAR(double(report.tapNullSampleCount), 500 * 3.0 / 4, 40.0);
    EXPECT_NEAR(report.tapNullRate, 2.0 / 3, 0.08);
    EXPECT_NEAR(report.tapOnlyNullRate, 1.0 / 3, 0.08);
}

TEST(Error, LightThatOnlyTheBiasOnATapsRayLetsThroughIsSettledAndNoContact) {
    // The pair's ray meets the low wall at x = 17, beyond the bias, an eighth of the ray. Its
    // texel's ray is flatter, passes over that wall and meets the high one at x = 19, within the
    // bias, and so do all shifted rays. Contact is a blocker near the pair's own end alone.
    MapFrame f;
    f.bias.constantTexels = 1.0f;
    f.soup.addLevelSquare({0, 0, 0}, 200.0f);
    f.add({20.2f, 0, 0.1f}, {0, 10, 0}, 3, PairServer::drawnMap(0));
    f.soup.addQuad({17, -1, -90}, {17, 1.9f, -90}, {17, 1.9f, 90}, {17, -1, 90});
    f.soup.addQuad({19, -1, -90}, {19, 90, -90}, {19, 90, 90}, {19, -1, 90});
    f.answer();
    ASSERT_EQ(f.visibility[0], kLit);
    EXPECT_EQ(f.judge().verdicts[0], PairVerdict::kTapSettled);
}

TEST(Error, DarknessByMissingPagesIsNeverExplained) {
    MapFrame f;
    f.addPair(0.4f, 0.4f);
    f.soup.addLevelSquare({3.0f, 5.0f, 0.2f}, 2.6f); // near enough for a shift of a few texels
    f.pageTable[3] = kNoPage;
    f.answer();
    ASSERT_EQ(f.visibility[0], 0);
    EXPECT_EQ(f.judge().verdicts[0], PairVerdict::kUnexplained);
}

} // namespace
} // namespace shadowdag
