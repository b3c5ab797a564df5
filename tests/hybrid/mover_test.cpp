// SPDX-License-Identifier: Apache-2.0
// Moving geometry in rays: a plate that slides between a light and the floor, in closed form and
// compared with the truth.
#include "hybrid/judge/error.h"
#include "scenes/builtin.h"
#include "scenes/split_mix.h"
#include "tests/hybrid/fail_stage.h"

#include <gtest/gtest.h>

#include <cmath>

namespace shadowdag::test {
namespace {

constexpr double kPlateHeight = 1.5, kPlateHalf = 0.6, kSpeed = 0.75;

/// A floor of 10 x 6 m at y = 0 and a plate of 1.2 m at y = 1.5 that slides along x, under a light
/// in the middle and one whose sphere the plate never enters.
FailScene slidingPlate() {
    FailScene s{"sliding-plate",
                "a plate that moves and a floor that does not",
                {},
                {{{0.0, 4.0, 0.0}, 12.0, 12.0}, {{4.5, 0.6, 2.5}, 1.2, 1.0}},
                {0, 6, 7},
                {0, 0, 0}};
    FailBox floor, plate;
    floor.center = {0.0, -0.1, 0.0};
    floor.half = {5.0, 0.1, 3.0};
    plate.center = {-2.0, kPlateHeight + 0.01, 0.0};
    plate.half = {kPlateHalf, 0.01, kPlateHalf};
    plate.velocity = {kSpeed, 0.0, 0.0};
    s.boxes = {floor, plate};
    return s;
}

/// Returns how far inside (positive) or outside of the plate's cross-section at a height the
/// segment to the light passes.
double insidePlate(const glm::vec3& sample, const glm::dvec3& light, double time, double height) {
    const glm::dvec3 p(sample);
    const glm::dvec3 q = p + (light - p) * ((height - p.y) / (light.y - p.y));
    return kPlateHalf - std::max(std::fabs(q.x - (-2.0 + kSpeed * time)), std::fabs(q.z));
}

TEST(Movers, CastTheirShadowAsInTheClosedFormAtEveryTime) {
    const FailScene description = slidingPlate();
    const glm::dvec3 light = description.lights[0].position;
    for (const float time : {0.0f, 0.5f, 1.75f, 4.0f}) {
        SCOPED_TRACE(time);
        FailStage stage(description, 7, time);
        const FailOutcome rays = stage.run("texels:inf");
        const GBufferView gbuffer = stage.renderer->gbuffer();
        uint64_t lit = 0, dark = 0, undecided = 0;
        for (size_t s = 0; s + 1 < rays.frame.pairs.sampleStart.size(); ++s)
            for (uint64_t p = rays.frame.pairs.sampleStart[s];
                 p < rays.frame.pairs.sampleStart[s + 1]; ++p) {
                if (std::fabs(gbuffer.positionWorld[s].y) > 1e-4f || rays.frame.pairs.light[p] != 0)
                    continue; // on the floor only
                const double top =
                    insidePlate(gbuffer.positionWorld[s], light, time, kPlateHeight + 0.02);
                const double bottom =
                    insidePlate(gbuffer.positionWorld[s], light, time, kPlateHeight);
                // The light stands above: a ray that misses both faces by more than a thickness
                // misses the plate.
                if (top > 1e-5 || bottom > 1e-5) {
                    EXPECT_EQ(rays.frame.visibility[p], 0);
                    ++dark;
                } else if (top < -0.02 && bottom < -0.02) {
                    EXPECT_EQ(rays.frame.visibility[p], kLit);
                    ++lit;
                } else {
                    ++undecided;
                }
            }
        EXPECT_GT(dark, 1000u);
        EXPECT_GT(lit, 10000u);
        EXPECT_LT(undecided, 1000u);
    }
}

TEST(Movers, AgreeWithTheTruthInEveryPairOfTheirShadow) {
    FailStage stage(slidingPlate(), 7);
    for (const float time : {0.0f, 1.0f, 3.0f}) {
        stage.renderer->worldChanged(stage.world.setTime(time));
        stage.truth->update(stage.world);
        const FailOutcome rays = stage.run("texels:inf");
        // Nothing but the floor is in the voxels, and the plate is exact: no pair differs.
        EXPECT_EQ(rays.report.total.falseLightCount, 0u) << time;
        EXPECT_EQ(rays.report.total.falseShadowCount, 0u) << time;
        EXPECT_GT(rays.report.total.occludedCount, 1000u) << time;
    }
}

// Off the origin the bounds choose the local space of exact rays, and a plate that leaves the hall
// moves the bounds: what stands still must keep its shadows.
TEST(Movers, ThatChangeTheBoundsMoveNoOtherShadow) {
    FailScene description = hallWithScreen();
    const glm::dvec3 far(100.0, 40.0, 0.0);
    for (FailBox& box : description.boxes) {
        box.center += far;
        box.velocity *= 8.0;
    }
    for (FailLight& light : description.lights)
        light.position += far;
    description.eye += far;
    description.target += far;
    FrameOptions options = failFrame();
    options.rays.believe = 0.0f;
    FailStage stage(description, 7);
    for (const float time : {0.0f, 3.5f, 2.5f, 0.0f}) {
        SCOPED_TRACE(time);
        stage.renderer->worldChanged(stage.world.setTime(time));
        stage.truth->update(stage.world);
        const FailOutcome exact = stage.run("texels:inf", options);
        EXPECT_GT(exact.report.total.occludedCount, 1000u);
        EXPECT_LE(exact.report.total.falseShadowCount + exact.report.total.falseLightCount, 2u);
        // Nothing depends on the times before: the same bits as by a renderer of this time alone.
        FailStage fresh(description, 7, time);
        EXPECT_EQ(fresh.run("texels:inf", options).frame.visibility, exact.frame.visibility);
    }
}

TEST(Movers, AreTestedOnlyForLightsWithOneInTheirSphere) {
    FailStage stage(slidingPlate(), 7);
    const FailOutcome rays = stage.run("texels:inf");
    const MoverView movers = stage.renderer->movers();
    EXPECT_TRUE(movers.mayShadow(0));
    EXPECT_FALSE(movers.mayShadow(1));
    uint64_t litByVoxels = 0;
    for (const uint32_t light : rays.frame.pairs.light)
        litByVoxels += light == 0;
    EXPECT_LE(rays.frame.counts.moverTestCount, litByVoxels);
    EXPECT_GT(rays.frame.counts.moverTestCount, litByVoxels / 2);

    FailStage without(failSceneOf("fail-contact"), 7);
    EXPECT_EQ(without.run("texels:inf").frame.counts.moverTestCount, 0u);
    EXPECT_TRUE(without.renderer->movers().isNearLight.empty());
}

TEST(Movers, AreAbsentFromMapsCounts) {
    FailStage stage(slidingPlate(), 7);
    EXPECT_EQ(stage.run("texels:0").frame.counts.moverTestCount, 0u);
}

// 275 static and 101 moving lights among moving objects: wherever a mover is what Embree meets
// first, rays are dark; without movers a good part of those pairs is lit.
TEST(Movers, OfTheNecropolisLoseNoShadowAtAnyTime) {
    const Scene scene = makeBuiltin("necropolis");
    World world(scene, {});
    const Dag dag = voxelize(world.triangles(), viewOf(world.staticTriangles()),
                             gridAround(world.staticBoundsWorld(), 9));
    Truth truth(world);
    FrameRenderer renderer(Backend::kCpu, world, dag);
    FrameOptions options;
    options.width = 160;
    options.height = 90;
    for (const float time : {0.0f, 2.5f}) {
        renderer.worldChanged(world.setTime(time));
        truth.update(world);
        const FrameResult frame =
            renderer.render(world.cameras().at(0), *makeCostModel("texels:inf"), options);
        // Asked by clusters or one by one: the same bits.
        FrameOptions oneByOne = options;
        oneByOne.rays.batch = RayBatch::kSingle;
        const FrameResult single =
            renderer.render(world.cameras().at(0), *makeCostModel("texels:inf"), oneByOne);
        EXPECT_EQ(frame.visibility, single.visibility);
        EXPECT_EQ(frame.counts.moverTestCount, single.counts.moverTestCount);

        const GBufferView gbuffer = renderer.gbuffer();
        const std::vector<uint8_t> right = truth.visibility(gbuffer, world.lights(), frame.pairs);
        const RayInputs voxelsAlone{dag.view(), options.rays};
        uint64_t shadowedByMovers = 0, lostWithoutThem = 0;
        for (size_t s = 0; s + 1 < frame.pairs.sampleStart.size(); ++s)
            for (uint64_t p = frame.pairs.sampleStart[s]; p < frame.pairs.sampleStart[s + 1]; ++p) {
                if (right[p] == kLit)
                    continue;
                const uint32_t light = frame.pairs.light[p];
                const ShadowPair pair{gbuffer.positionWorld[s], gbuffer.normalWorld[s],
                                      world.lights()[light].positionWorld, gbuffer.triangle[s],
                                      light};
                const TruthBlocker blocker = truth.blocker(pair.positionWorld, pair.normalWorld,
                                                           pair.receiver, pair.lightWorld);
                if (blocker.triangle == kBackground ||
                    !world.instances()[world.triangleInstance()[blocker.triangle]].isMoving)
                    continue;
                ++shadowedByMovers;
                lostWithoutThem += !isDarkByRays(voxelsAlone, pair);
                EXPECT_EQ(frame.visibility[p], 0) << "sample " << s << ", light " << light;
            }
        EXPECT_GT(shadowedByMovers, 100u);
        EXPECT_GT(lostWithoutThem, shadowedByMovers / 2);
    }
}

// The hierarchy and the box test leave no triangle out.
TEST(Movers, EqualATestOfEveryTriangle) {
    FailStage stage(failSceneOf("fail-mover"), 5, 1.0f);
    const MoverView movers = stage.renderer->movers();
    uint64_t state = 7;
    const auto random = [&] {
        return float(double(splitMix64(state += kSplitMixGamma) >> 11) * 0x1p-53);
    };
    uint64_t blockedCount = 0;
    for (int i = 0; i < 20000; ++i) {
        const glm::dvec3 from(6 * random() - 4, 2 * random(), 4 * random() - 2);
        const glm::dvec3 to(6 * random() - 4, 2 * random(), 4 * random() - 2);
        TruthRay ray;
        ray.startLocal = glm::vec3(from - movers.geometry.origin);
        ray.direction = glm::vec3(to - from);
        bool isBlocked = false;
        for (uint32_t t = 0; t < movers.geometry.triangles.count(); ++t)
            if (stage.world.instances()[stage.world.triangleInstance()[t]].isMoving)
                isBlocked |= blocksTruthRay(movers.geometry, ray, t);
        ASSERT_EQ(isBlockedByMovers(movers, ray), isBlocked) << i;
        blockedCount += isBlocked;
    }
    EXPECT_GT(blockedCount, 1000u);
}

} // namespace
} // namespace shadowdag::test
