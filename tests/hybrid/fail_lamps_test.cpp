// SPDX-License-Identifier: Apache-2.0
// The failure scenes of lights in lamps, compared with their umbras in closed form: of a lantern's
// bar on a wall over three decades of distance, of a ledge beside a sconce, of a shade, of a closed
// crate.
#include "tests/hybrid/fail_stage.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace shadowdag::test {
namespace {

/// By similar triangles: the umbra of the middle bar on the wall of makeLanternStage, and that of
/// the corner posts, as |x| over the wall's distance.
constexpr double kPostNear = 1.0 / (1.0 + 2.0 * kLanternBarHalf);

bool isUmbra(double xOverWall) {
    return std::abs(xOverWall) < kLanternBarHalf || std::abs(xOverWall) > kPostNear;
}

TEST(LampScenes, ABarsUmbraHasItsClosedFormOverThreeDecades) {
    const double wall = 20.0;
    for (const double bar : {0.01, 0.1, 1.0, 10.0}) {
        const FailScene stage = makeLanternStage(bar, wall);
        int lit = 0;
        for (int k = -99; k <= 99; ++k) { // between the rings, beside the bulb
            const double x = (k + 0.37) / 100.0;
            const std::optional<bool> answer =
                expectedLit(stage, {x * wall, -0.6 * wall, -wall}, 0);
            if (!answer) { // its own margin of a millionth of the extent, seen from the light
                const double edge = std::min(std::abs(std::abs(x) - kLanternBarHalf),
                                             std::abs(std::abs(x) - kPostNear));
                EXPECT_LT(edge, 1e-4 / bar) << "bar at " << bar << ", x " << x;
                continue;
            }
            EXPECT_EQ(*answer, !isUmbra(x)) << "bar at " << bar << ", x " << x;
            lit += *answer ? 1 : 0;
        }
        EXPECT_NEAR(lit, 2 * (kPostNear - kLanternBarHalf) * 100, 4.0);
        for (const double side : {-1.0, 1.0}) { // its edges, beyond that margin
            const double margin = 1e-4 / bar + 1e-5;
            const double in = side * (kLanternBarHalf - margin) * wall,
                         out = side * (kLanternBarHalf + margin) * wall;
            EXPECT_EQ(expectedLit(stage, {in, -0.6 * wall, -wall}, 0), false);
            EXPECT_EQ(expectedLit(stage, {out, -0.6 * wall, -wall}, 0), true);
        }
    }
}

/// What rays through voxels alone and the truth say of the wall between the rings.
struct WallAnswers {
    uint64_t litCount = 0, falseShadowCount = 0;
    uint64_t darkCount = 0, falseLightCount = 0;
    uint64_t beyondCount = 0;     ///< false shadows outside the umbra of the thickened bars
    uint64_t truthWrongCount = 0; ///< of the truth, against the closed form
    double farthest = 0.0; ///< |x| of the middle bar's false shadows, over the wall's distance
    double voxelOverBarDistance = 0.0;
    double falseShadowShare() const { return double(falseShadowCount) / double(litCount); }
};

constexpr double kWall = 20.0;

WallAnswers askWall(double bar, uint32_t resolutionLog2) {
    FailStage stage(makeLanternStage(bar, kWall), resolutionLog2);
    const FailOutcome rays = stage.run("texels:inf");
    const GBufferView gbuffer = stage.renderer->gbuffer();
    const RayInputs voxelsAlone{stage.dag.view(), failFrame().rays};
    WallAnswers answers;
    const double h = stage.dag.grid.voxelSizeWorld / bar, w = kLanternBarHalf;
    answers.voxelOverBarDistance = h;
    // Every voxel that a bar touches lies within h of it on each axis. In bar distances: the middle
    // bar grows to half width w + h from depth 1 - h on, a post reaches from 1 - h aside to 1 + 2 w
    // + h deep. The start's lift of less than two voxels moves the post's shadow inwards.
    const double barEnd = h < 1.0 ? (w + h) / (1.0 - h) : 1e30;
    const double postStart = (1.0 - h) / (1.0 + 2.0 * w + h) * (1.0 - 2.0 * h * bar / kWall);
    const PairList& pairs = rays.frame.pairs;
    for (size_t sample = 0; sample + 1 < pairs.sampleStart.size(); ++sample)
        for (uint64_t pair = pairs.sampleStart[sample]; pair < pairs.sampleStart[sample + 1];
             ++pair) {
            const glm::dvec3 at(gbuffer.positionWorld[sample]);
            if (std::abs(at.z + kWall) > 1e-4 * kWall || at.y > -0.5 * kWall || at.y < -0.7 * kWall)
                continue;
            const ShadowPair asked{gbuffer.positionWorld[sample], gbuffer.normalWorld[sample],
                                   stage.world.lights()[0].positionWorld, gbuffer.triangle[sample],
                                   0};
            const bool isTruthLit = rays.truth[pair] >= kHalfLit;
            const bool isDark = isDarkByRays(voxelsAlone, asked);
            const std::optional<bool> isLit = expectedLit(stage.description, at, 0);
            answers.truthWrongCount += isLit && *isLit != isTruthLit ? 1 : 0;
            if (!isTruthLit) {
                ++answers.darkCount;
                answers.falseLightCount += isDark ? 0 : 1;
                continue;
            }
            ++answers.litCount;
            if (!isDark)
                continue;
            ++answers.falseShadowCount;
            const double x = std::abs(at.x) / kWall;
            answers.beyondCount += x > barEnd && x < postStart ? 1 : 0;
            if (x < 0.5)
                answers.farthest = std::max(answers.farthest, x);
        }
    return answers;
}

// The failure, and its size: a voxel of side h that touches a bar moves the edge of its shadow on
// the wall by h (t_L + t_P) / t_L.
TEST(LampScenes, VoxelsMoveABarsEdgeByTheirSizeTimesTheMagnification) {
    double before = 0.0;
    for (const double bar : {10.0, 1.0, 0.5, 0.25}) {
        const WallAnswers answers = askWall(bar, 9);
        const double h = answers.voxelOverBarDistance;
        SCOPED_TRACE("bar at " + std::to_string(bar) + ", voxels of " + std::to_string(h * bar));
        ASSERT_GT(answers.litCount, 500u);
        EXPECT_GT(answers.darkCount, 50u);
        EXPECT_EQ(answers.truthWrongCount, 0u);
        EXPECT_GT(answers.falseShadowShare(), before);
        EXPECT_EQ(answers.beyondCount, 0u);
        before = answers.falseShadowShare();
    }
    EXPECT_GT(before, 0.5);
}

// Where voxels are larger than a bar's distance to its light, the lantern lies within the offset at
// the ray's end and has no shadow; voxels half as large stop all light. So depth mends it late.
TEST(LampScenes, DeeperVoxelsTurnALostLanternBlackBeforeTheyShowIt) {
    for (const double bar : {0.1, 0.05}) {
        const uint32_t black = bar == 0.1 ? 9 : 10; // voxels of 0.78 bar distances
        SCOPED_TRACE("bar at " + std::to_string(bar));
        const WallAnswers lost = askWall(bar, black - 2);
        EXPECT_EQ(lost.falseLightCount, lost.darkCount);
        EXPECT_EQ(lost.falseShadowCount, 0u);
        EXPECT_EQ(askWall(bar, black).falseShadowShare(), 1.0);
        EXPECT_GT(askWall(bar, black + 1).falseShadowShare(), 0.8);
    }
}

// A light at g from a wall, a ledge that stands out by e with its lower edge a below: its umbra
// ends a g / (g - e) below the light.
TEST(LampScenes, ALedgesUmbraUnderASconceEndsWhereSimilarTrianglesSay) {
    for (const double g : {0.05, 0.1, 0.2}) {
        const double a = 0.5, e = 0.03;
        FailScene s{"ledge", "", {}, {{{0.0, 0.0, g}, 50.0, 1.0}}, {}, {}};
        FailBox wall, ledge;
        wall.center = {0.0, 0.0, -0.1};
        wall.half = {4.0, 4.0, 0.1};
        ledge.center = {0.0, -a + 0.02, 0.5 * e};
        ledge.half = {3.0, 0.02, 0.5 * e};
        s.boxes = {wall, ledge};
        const double end = a * g / (g - e);
        EXPECT_EQ(expectedLit(s, {0.3, -a * 0.91, 0.0}, 0), true);
        EXPECT_EQ(expectedLit(s, {0.3, -a * 1.01, 0.0}, 0), false);
        EXPECT_EQ(expectedLit(s, {0.3, -end * 0.999, 0.0}, 0), false) << g;
        EXPECT_EQ(expectedLit(s, {0.3, -end * 1.001, 0.0}, 0), true) << g;
    }
}

// A panel at r from the light to h above and below it: on a wall at D the umbra is |y| < h D / r.
TEST(LampScenes, AShadesUmbraIsAsHighAsItsNearRims) {
    const FailScene scene = failSceneOf("fail-shade");
    const double floor = 0.0, back = -2.5;
    for (int light = 0; light < 3; ++light) {
        const glm::dvec3 at = scene.lights[size_t(light)].position;
        const double end = 0.6 * (at.z - back); // half the height over the radius
        for (const double side : {-1.0, 1.0}) {
            // Over the foot of the perpendicular of the panel that faces the wall.
            const glm::dvec3 inside(at.x, at.y + side * end * 0.999, back);
            const glm::dvec3 outside(at.x, at.y + side * end * 1.001, back);
            if (outside.y < floor + 0.01)
                continue;
            EXPECT_EQ(expectedLit(scene, inside, light), false) << light;
            // The other shades may stand in between.
            FailScene alone = scene;
            alone.boxes.resize(2);
            alone.boxes.insert(alone.boxes.end(), scene.boxes.begin() + 2 + 9 * light,
                               scene.boxes.begin() + 11 + 9 * light);
            EXPECT_EQ(expectedLit(alone, outside, light), true) << light;
        }
    }
}

// No light leaves the closed crate, and the crates differ as they should.
TEST(LampScenes, AClosedCrateLightsNothing) {
    FailStage stage(failSceneOf("fail-inside"), 9);
    const FailOutcome rays = stage.run("texels:inf"), maps = stage.run("texels:0");
    for (const FailOutcome* outcome : {&rays, &maps}) {
        SCOPED_TRACE(outcome == &rays ? "rays" : "maps");
        const ErrorCounts& closed = outcome->report.perLight[0];
        EXPECT_GT(closed.pairCount, 5000u);
        EXPECT_EQ(closed.occludedCount, closed.pairCount);
        EXPECT_EQ(closed.falseLightCount, 0u);
    }
    const ErrorCounts &leaking = rays.report.perLight[1], &open = rays.report.perLight[2];
    const uint64_t leakedCount = leaking.pairCount - leaking.occludedCount;
    EXPECT_GT(leakedCount, leaking.pairCount / 100);
    EXPECT_LT(leakedCount, leaking.pairCount / 4);
    EXPECT_GT(open.pairCount - open.occludedCount, open.pairCount / 4);
    // Voxels as large as a gap stop what leaks.
    const RayInputs voxelsAlone{stage.dag.view(), failFrame().rays};
    const GBufferView gbuffer = stage.renderer->gbuffer();
    uint64_t stoppedCount = 0;
    const PairList& pairs = maps.frame.pairs;
    for (size_t sample = 0; sample + 1 < pairs.sampleStart.size(); ++sample)
        for (uint64_t pair = pairs.sampleStart[sample]; pair < pairs.sampleStart[sample + 1];
             ++pair)
            if (pairs.light[pair] == 1 && maps.truth[pair] >= kHalfLit)
                stoppedCount += isDarkByRays(voxelsAlone, {gbuffer.positionWorld[sample],
                                                           gbuffer.normalWorld[sample],
                                                           stage.world.lights()[1].positionWorld,
                                                           gbuffer.triangle[sample], 1});
    EXPECT_GT(stoppedCount, leakedCount / 2);
}

} // namespace
} // namespace shadowdag::test
