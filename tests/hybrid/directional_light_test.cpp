// SPDX-License-Identifier: Apache-2.0
// Directional lights through the whole frame: closed forms, every method, far from the origin,
// through time.
#include "tests/hybrid/fail_stage.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <set>
#include <tuple>

namespace shadowdag::test {
namespace {

constexpr double kTanElevation = 0.48 / 0.87726848797845236; // of fail-sun: 0.48 / |(0.6, 0.64)|

FailScene moved(FailScene scene, const glm::dvec3& by) {
    for (FailBox& box : scene.boxes)
        box.center += by;
    scene.eye += by;
    scene.target += by;
    return scene;
}

/// Pairs that a closed form answers, and of these the wrong ones.
struct Wrong {
    size_t answeredCount = 0, falseShadowCount = 0, falseLightCount = 0;
};

Wrong againstClosedForm(const FailStage& stage, const PairList& pairs,
                        const std::vector<uint8_t>& visibility) {
    const GBufferView gbuffer = stage.renderer->gbuffer();
    Wrong wrong;
    for (size_t sample = 0; sample + 1 < pairs.sampleStart.size(); ++sample)
        for (uint64_t p = pairs.sampleStart[sample]; p < pairs.sampleStart[sample + 1]; ++p) {
            const std::optional<bool> isLit =
                expectedLit(stage.description, glm::dvec3(gbuffer.positionWorld[sample]),
                            int(pairs.light[p]), double(stage.world.timeSeconds()));
            if (!isLit)
                continue;
            ++wrong.answeredCount;
            wrong.falseShadowCount += *isLit && visibility[p] < kHalfLit;
            wrong.falseLightCount += !*isLit && visibility[p] >= kHalfLit;
        }
    return wrong;
}

TEST(DirectionalLight, IsASphereAroundTheSceneWithParallelRaysAndConstantLight) {
    FailStage stage(failSceneOf("fail-sun"), 5);
    ASSERT_EQ(stage.world.lights().size(), 1u);
    const Light& sun = stage.world.lights()[0];
    EXPECT_EQ(sun.kind, Light::kSun);
    EXPECT_NEAR(glm::length(sun.directionWorld - glm::vec3(0.6f, -0.48f, 0.64f)), 0.0f, 1e-6f);
    const Box& bounds = stage.world.boundsWorld();
    for (int corner = 0; corner < 8; ++corner) {
        const glm::vec3 p(corner & 1 ? bounds.max.x : bounds.min.x,
                          corner & 2 ? bounds.max.y : bounds.min.y,
                          corner & 4 ? bounds.max.z : bounds.min.z);
        EXPECT_LT(glm::distance(p, sun.positionWorld), sun.rangeWorld);
        EXPECT_TRUE(lightReaches(sun, p));
        EXPECT_EQ(lightIrradiance(sun, p), sun.intensity);
        EXPECT_TRUE(mayReach(sun, Box{p, p}));
        EXPECT_TRUE(isPair(sun, p, -sun.directionWorld));
        EXPECT_FALSE(isPair(sun, p, sun.directionWorld));
        // What shines on p is beyond the bounds, straight towards the sun.
        const glm::vec3 at = pointAtLight(sun, p);
        EXPECT_GT(glm::distance(at, sun.positionWorld), sun.rangeWorld);
        EXPECT_GT(glm::dot(glm::normalize(at - p), -sun.directionWorld), 1.0f - 1e-6f);
    }
    // n.l 1 lux / pi of a white surface that faces it.
    const glm::vec3 seen = reflectedRadiance(sun, {1, 2, 3}, -sun.directionWorld,
                                             {glm::vec3(1.0f), glm::vec3(0.0f)}, kLit);
    EXPECT_NEAR(seen.x, sun.intensity.x / M_PI, 1e-5);
}

TEST(DirectionalLight, APostsShadowIsItsHeightOverTheTangentOfTheElevation) {
    FailStage stage(failSceneOf("fail-sun"), 9);
    const glm::dvec2 along = glm::normalize(glm::dvec2(0.6, 0.64));
    const double length = 2.0 / kTanElevation; // the post at the origin is 2 m high
    FrameOptions exactly = failFrame();
    exactly.rays.believe = 0.0f;
    for (const auto& [model, options, slack] :
         {std::tuple("texels:0", failFrame(), 0.25), std::tuple("texels:inf", failFrame(), 0.25),
          std::tuple("texels:inf", exactly, 0.17)}) {
        const FailOutcome outcome = stage.run(model, options);
        const GBufferView gbuffer = stage.renderer->gbuffer();
        const PairList& pairs = outcome.frame.pairs;
        size_t dark = 0, lit = 0;
        for (size_t sample = 0; sample + 1 < pairs.sampleStart.size(); ++sample) {
            const glm::dvec3 p(gbuffer.positionWorld[sample]);
            const glm::dvec2 onFloor(p.x, p.z);
            const double at = glm::dot(onFloor, along);
            // On the middle of the shadow; the post is 0.2 m wide, its far corner 0.14 m ahead.
            if (pairs.sampleStart[sample] == pairs.sampleStart[sample + 1] || p.y > 1e-4 ||
                std::abs(onFloor.x * along.y - onFloor.y * along.x) > 0.04 || at < 0.3 ||
                at > length + 2.0 || std::abs(at - length) < slack)
                continue;
            const uint8_t seen = outcome.frame.visibility[pairs.sampleStart[sample]];
            ASSERT_EQ(seen < kHalfLit, at < length) << model << " at " << at << " of " << length;
            ++(at < length ? dark : lit);
        }
        EXPECT_GT(dark, 20u);
        EXPECT_GT(lit, 10u);
    }
}

TEST(DirectionalLight, EveryMethodAgreesWithTheClosedFormThroughTime) {
    FailStage stage(failSceneOf("fail-sun"), 9);
    for (const float time : {0.0f, 1.3f, 2.6f, 4.0f}) {
        stage.renderer->worldChanged(stage.world.setTime(time));
        stage.truth->update(stage.world);
        const FailOutcome maps = stage.run("texels:0");
        const Wrong truth = againstClosedForm(stage, maps.frame.pairs, maps.truth);
        EXPECT_GT(truth.answeredCount, 30000u);
        EXPECT_EQ(truth.falseShadowCount + truth.falseLightCount, 0u) << time;
        EXPECT_EQ(maps.report.total.unexplainedFalseShadowCount, 0u) << time;
        EXPECT_EQ(maps.report.total.unexplainedFalseLightCount, 0u) << time;
        EXPECT_EQ(maps.report.total.acneCount, 0u) << time;
        EXPECT_LT(maps.falseShadowPercent() + maps.falseLightPercent(), 0.6) << time;

        FrameOptions options = failFrame();
        const FailOutcome voxels = stage.run("texels:inf", options);
        EXPECT_EQ(voxels.report.total.unexplainedFalseShadowCount, 0u) << time;
        EXPECT_EQ(voxels.report.total.unexplainedFalseLightCount, 0u) << time;
        EXPECT_EQ(voxels.report.total.acneCount, 0u) << time;
        EXPECT_LT(voxels.falseShadowPercent(), 1.6) << time;
        EXPECT_LT(voxels.falseLightPercent(), 0.05) << time;

        options.rays.believe = 0.0f;
        const FailOutcome exact = stage.run("texels:inf", options);
        EXPECT_EQ(exact.report.total.falseShadowCount + exact.report.total.falseLightCount, 0u)
            << time;
    }
}

TEST(DirectionalLight, FarFromTheOriginNothingIsUnexplained) {
    const FailScene far = moved(failSceneOf("fail-sun"), {1e5, 0, -1e5});
    FailStage stage(far, 8);
    const Wrong truth = [&] {
        const FailOutcome maps = stage.run("texels:0");
        EXPECT_EQ(maps.report.total.unexplainedFalseShadowCount, 0u);
        EXPECT_EQ(maps.report.total.unexplainedFalseLightCount, 0u);
        EXPECT_EQ(maps.report.total.acneCount, 0u);
        EXPECT_EQ(maps.frame.counts.missingTapCount, 0u);
        EXPECT_LT(maps.falseShadowPercent(), 1.5);
        EXPECT_LT(maps.falseLightPercent(), 1.5);
        return againstClosedForm(stage, maps.frame.pairs, maps.truth);
    }();
    // A float's last bit is 8 mm there: the truth's start is lifted by 24 mm.
    EXPECT_LT(double(truth.falseShadowCount + truth.falseLightCount),
              0.015 * double(truth.answeredCount));
    const FailOutcome voxels = stage.run("texels:inf");
    EXPECT_EQ(voxels.report.total.unexplainedFalseShadowCount, 0u);
    EXPECT_EQ(voxels.report.total.unexplainedFalseLightCount, 0u);
    EXPECT_EQ(voxels.report.total.acneCount, 0u);
    FrameOptions exactly = failFrame();
    exactly.rays.believe = 0.0f;
    const FailOutcome exact = stage.run("texels:inf", exactly);
    // Vertices and samples lie on the same grid of 8 mm: some rays pass through edges exactly.
    EXPECT_LE(exact.report.total.falseShadowCount + exact.report.total.falseLightCount,
              exact.report.total.pairCount / 10000 + 2);
    EXPECT_EQ(exact.report.total.unexplainedFalseShadowCount, 0u);
    EXPECT_EQ(exact.report.total.unexplainedFalseLightCount, 0u);
}

TEST(DirectionalLight, HasAWindowForTwoOctavesForAnyMapsPerLight) {
    FailStage stage(failSceneOf("fail-sun"), 5);
    std::vector<size_t> counts;
    for (const uint32_t mapsPerLight : {1u, 4u, 16u}) {
        FrameOptions options = failFrame();
        options.mapsPerLight = mapsPerLight;
        const FailOutcome outcome = stage.run("texels:0", options);
        counts.push_back(outcome.frame.maps.size());
        std::set<uint32_t> octaves;
        for (const MapRecord& map : outcome.frame.maps) {
            octaves.insert(map.quantities.octave);
            EXPECT_TRUE(map.window.isDirectional());
            EXPECT_EQ(map.quantities.octave % 2, 1u);
            // A texel is no wider than requested: 2^(octave - 1) or more make the scene's extent.
            const double extent = directionalExtentWorld(stage.world.lights()[0]);
            EXPECT_LE(map.window.texelWorld(map.quantities.faceTexels),
                      extent / double(1u << (map.quantities.octave - 1)) * (1.0 + 1e-9));
        }
        EXPECT_EQ(octaves.size(), outcome.frame.maps.size());
    }
    EXPECT_GE(counts[0], 3u);
    EXPECT_EQ(counts[1], counts[0]);
    EXPECT_EQ(counts[2], counts[0]);
}

TEST(DirectionalLight, StreamsEqualSingleRays) {
    FailStage stage(failSceneOf("fail-sun"), 8, 1.0f);
    std::vector<FrameResult> frames;
    for (const RayBatch batch : {RayBatch::kSingle, RayBatch::kStream}) {
        FrameOptions options = failFrame();
        options.rays.batch = batch;
        frames.push_back(stage.run("texels:inf", options).frame);
    }
    EXPECT_EQ(frames[1].visibility, frames[0].visibility);
    EXPECT_EQ(frames[1].color, frames[0].color);
    EXPECT_EQ(frames[1].counts.rayCount, frames[0].counts.rayCount);
    EXPECT_EQ(frames[1].counts.moverTestCount, frames[0].counts.moverTestCount);
    FrameOptions pruned = failFrame();
    pruned.pruning = PairPruning::kLit;
    EXPECT_EQ(stage.run("texels:inf", pruned).frame.visibility, frames[0].visibility);
}

TEST(DirectionalLight, KeptWindowsEqualFreshOnesWhileTheCameraAndABoxMove) {
    FailStage kept(failSceneOf("fail-sun"), 5), fresh(failSceneOf("fail-sun"), 5);
    FrameOptions options = failFrame();
    options.width = 160;
    options.height = 90;
    FrameOptions keeping = options;
    keeping.maps.useStaticOptimization = true;
    const auto model = makeCostModel("texels:0");
    uint64_t keptMaps = 0;
    for (int frame = 0; frame < 24; ++frame) {
        Camera camera = kept.world.cameras().at(0);
        camera.positionWorld.x -= 0.1f * float(frame);
        const float time = frame < 12 ? 0.1f * float(frame) : 1.1f; // then it stands
        for (FailStage* stage : {&kept, &fresh})
            stage->renderer->worldChanged(stage->world.setTime(time));
        const FrameResult a = kept.renderer->render(camera, *model, keeping);
        const FrameResult b = fresh.renderer->render(camera, *model, options);
        ASSERT_EQ(a.visibility, b.visibility) << frame;
        keptMaps += a.counts.maps.keptMapCount;
    }
    EXPECT_GT(keptMaps, 24u);
}

TEST(DirectionalRays, EndBeyondTheGridAndNoFarther) {
    VoxelGrid grid;
    grid.resolutionLog2 = 8;
    std::mt19937 rng(1);
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    for (int trial = 0; trial < 10000; ++trial) {
        const glm::dvec3 from = 256.0 * glm::dvec3(unit(rng), unit(rng), unit(rng));
        glm::dvec3 way = glm::dvec3(unit(rng), unit(rng), unit(rng)) - 0.5;
        if (trial % 5 == 0)
            way[trial % 3] = 0.0;
        const glm::dvec3 to = from + way * 1e6;
        const glm::dvec3 end = endWithinGrid(grid, from, to, 4.0);
        double outside = -1e9;
        for (int axis = 0; axis < 3; ++axis)
            outside = std::max({outside, -end[axis], end[axis] - 256.0});
        ASSERT_NEAR(outside, 4.0, 1e-6);
        ASSERT_LT(glm::length(glm::cross(end - from, way)), 1e-6 * glm::length(end - from) + 1e-9);
        const glm::dvec3 inside = 256.0 * glm::dvec3(unit(rng), unit(rng), unit(rng));
        ASSERT_EQ(endWithinGrid(grid, from, inside, 4.0), inside);
    }
    // A start that has left the grid already.
    EXPECT_EQ(endWithinGrid(grid, {300, 0, 0}, {900, 5, 0}, 4.0), glm::dvec3(300, 0, 0));
}

} // namespace
} // namespace shadowdag::test
