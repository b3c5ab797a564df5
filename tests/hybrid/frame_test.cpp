// SPDX-License-Identifier: Apache-2.0
// Whole frames of a small room with a blocker: known umbra by every method, pairs, recording,
// determinism, from frame to frame.
#include "hybrid/frame.h"

#include "hybrid/frame/frame_state.h"
#include "hybrid/frame/shade_pass.h"
#include "tests/hybrid/blocker_stage.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace shadowdag::test {
namespace {

// The light is 2 m up and the square of half 0.5 m is 1 m up: its umbra on the floor is a square of
// half 1 m.
class Umbra : public testing::TestWithParam<const char*> {};

TEST_P(Umbra, OfALevelSquareIsTheSquareProjectedFromTheLight) {
    Stage stage(blockerScene({{0, kLightHeight, 0}}), 9);
    const FrameOptions options = smallFrame();
    const FrameResult frame =
        stage.renderer.render(roomCamera(), *makeCostModel(GetParam()), options);
    const GBufferView gbuffer = stage.renderer.gbuffer();
    // By rays: voxels of 12 m / 512 widen the blocker by sqrt(3) of their sides, the ends' offset
    // by as much, twice that on the floor. By maps: a texel of the filter's and one of the map's.
    const bool isRays = frame.counts.tracedLightCount == 1;
    const float border = isRays ? 4.0f * 2.0f * 12.0f / 512.0f
                                : 4.0f * 2.0f * kLightHeight / frame.maps[0].quantities.faceTexels;
    size_t darkCount = 0, litCount = 0;
    for (size_t sample = 0; sample < gbuffer.count(); ++sample) {
        if (gbuffer.triangle[sample] > 1)
            continue; // the blocker's own triangles
        const glm::vec3 p = gbuffer.positionWorld[sample];
        ASSERT_EQ(frame.pairs.sampleStart[sample + 1] - frame.pairs.sampleStart[sample], 1u);
        const uint8_t visibility = frame.visibility[frame.pairs.sampleStart[sample]];
        const float outside = std::max(std::abs(p.x), std::abs(p.z)) - 1.0f;
        if (outside < -border) {
            ++darkCount;
            ASSERT_EQ(visibility, 0) << p.x << " " << p.z;
        } else if (outside > border) {
            ++litCount;
            ASSERT_EQ(visibility, 255) << p.x << " " << p.z;
        }
    }
    EXPECT_GT(darkCount, 100u);
    EXPECT_GT(litCount, 3000u);
    EXPECT_EQ(frame.counts.missingTapCount, 0u);
}
INSTANTIATE_TEST_SUITE_P(Methods, Umbra, testing::Values("texels:inf", "texels:0"));

TEST(Frame, RecordsThePairsThatBruteForceFinds) {
    Stage stage(blockerScene(kManyLights, true));
    const FrameResult frame =
        stage.renderer.render(roomCamera(), *makeCostModel("texels:0"), smallFrame());
    const GBufferView gbuffer = stage.renderer.gbuffer();
    PairList expected;
    expected.sampleStart.push_back(0);
    for (size_t sample = 0; sample < gbuffer.count(); ++sample) {
        for (uint32_t l = 0; l < kManyLights.size(); ++l)
            if (gbuffer.triangle[sample] != kBackground &&
                isPair(stage.world.lights()[l], gbuffer.positionWorld[sample],
                       gbuffer.normalWorld[sample]))
                expected.light.push_back(l);
        expected.sampleStart.push_back(expected.light.size());
    }
    EXPECT_EQ(frame.pairs.sampleStart, expected.sampleStart);
    EXPECT_EQ(frame.pairs.light, expected.light);
    EXPECT_EQ(frame.counts.pairCount, expected.count());
    EXPECT_EQ(frame.visibility.size(), expected.count());
    uint64_t sum = 0;
    for (const MapRecord& map : frame.maps) {
        sum += map.pairCount;
        EXPECT_LE(map.pairCount, map.quantities.samples);
        EXPECT_GT(map.quantities.pages, 0u);
        EXPECT_GT(map.quantities.triangles, 0u);
    }
    EXPECT_EQ(sum, expected.count());
}

TEST(Frame, OfRaysEqualsASingleRayInEveryPair) {
    Stage stage(blockerScene(kManyLights, true));
    FrameOptions options = smallFrame();
    options.rays.offset = 1.5f;
    options.rays.level = 1;
    const FrameResult frame =
        stage.renderer.render(roomCamera(), *makeCostModel("texels:inf"), options);
    const GBufferView gbuffer = stage.renderer.gbuffer();
    size_t darkCount = 0;
    for (size_t sample = 0; sample < gbuffer.count(); ++sample)
        for (uint64_t pair = frame.pairs.sampleStart[sample];
             pair < frame.pairs.sampleStart[sample + 1]; ++pair) {
            const Light& light = stage.world.lights()[frame.pairs.light[pair]];
            const bool isDark =
                occluded(stage.dag.view(),
                         shadowSegment(stage.dag.grid, gbuffer.positionWorld[sample],
                                       gbuffer.normalWorld[sample], light.positionWorld, 1.5f, 1),
                         1);
            ASSERT_EQ(frame.visibility[pair], isDark ? 0 : 255);
            ASSERT_EQ(frame.pairRoute[pair], Route::kRays);
            darkCount += isDark;
        }
    EXPECT_EQ(frame.counts.rayCount, frame.pairs.count());
    EXPECT_EQ(frame.counts.lookupCount, 0u);
    EXPECT_GT(darkCount, frame.pairs.count() / 20);
    EXPECT_LT(darkCount, frame.pairs.count() * 19 / 20);
}

TEST(Frame, UsesBothMethodsAsRouted) {
    Stage stage(blockerScene(kManyLights, true));
    const FrameOptions options = smallFrame();
    const FrameResult rays =
        stage.renderer.render(roomCamera(), *makeCostModel("texels:inf"), options);
    const FrameResult maps =
        stage.renderer.render(roomCamera(), *makeCostModel("texels:0"), options);
    std::vector<float> texels;
    for (const MapRecord& map : rays.maps)
        texels.push_back(map.quantities.texels);
    std::sort(texels.begin(), texels.end());
    const float threshold = texels[texels.size() / 2];
    const FrameResult mixed = stage.renderer.render(
        roomCamera(), *makeCostModel("texels:" + std::to_string(threshold)), options);
    EXPECT_GT(mixed.counts.tracedLightCount, 0u);
    EXPECT_GT(mixed.counts.mappedLightCount, 0u);
    EXPECT_EQ(mixed.counts.rayCount + mixed.counts.lookupCount, mixed.pairs.count());
    ASSERT_EQ(mixed.pairs.light, rays.pairs.light);
    for (size_t pair = 0; pair < mixed.pairs.count(); ++pair) {
        const bool isTraced = mixed.pairRoute[pair] == Route::kRays;
        ASSERT_EQ(isTraced, mixed.pairServer[pair] == PairServer::rays());
        ASSERT_EQ(mixed.visibility[pair], (isTraced ? rays : maps).visibility[pair]);
    }
}

TEST(Frame, ColorIsTheSumOverPairs) {
    Stage stage(blockerScene(kManyLights));
    const FrameResult frame =
        stage.renderer.render(roomCamera(), *makeCostModel("texels:0"), smallFrame());
    const GBufferView gbuffer = stage.renderer.gbuffer();
    const glm::dvec3 albedo(0.5, 0.25, 1.0), emission(0.0, 0.125, 0.0);
    for (size_t sample = 0; sample < gbuffer.count(); ++sample) {
        if (gbuffer.triangle[sample] == kBackground) {
            EXPECT_EQ(frame.color[sample], glm::vec3(0.0f));
            continue;
        }
        glm::dvec3 sum = emission + albedo * double(kAmbientRadiance);
        for (uint64_t pair = frame.pairs.sampleStart[sample];
             pair < frame.pairs.sampleStart[sample + 1]; ++pair) {
            const Light& light = stage.world.lights()[frame.pairs.light[pair]];
            const glm::dvec3 to =
                glm::dvec3(light.positionWorld) - glm::dvec3(gbuffer.positionWorld[sample]);
            const double d2 = glm::dot(to, to), q2 = d2 / 81.0;
            const double cosine =
                glm::dot(to, glm::dvec3(gbuffer.normalWorld[sample])) / std::sqrt(d2);
            sum += albedo * (10.0 / d2 * (1.0 - q2 * q2) * cosine * frame.visibility[pair] / 255.0 /
                             3.14159265358979);
        }
        for (int k = 0; k < 3; ++k)
            ASSERT_NEAR(frame.color[sample][k], sum[k], 1e-5 * (1.0 + sum[k])) << sample;
    }
}

TEST(Frame, IsTheSameForOneAndTwoThreadsRunAfterRunAndWithoutRecording) {
    for (const char* model : {"texels:inf", "texels:0", "expr:samples < 9000"}) {
        SCOPED_TRACE(model);
        FrameOptions options = smallFrame();
        setThreadCount(1);
        Stage first(blockerScene(kManyLights, true));
        const FrameResult one = first.renderer.render(roomCamera(), *makeCostModel(model), options);
        setThreadCount(2);
        Stage second(blockerScene(kManyLights, true));
        const FrameResult two =
            second.renderer.render(roomCamera(), *makeCostModel(model), options);
        const FrameResult again =
            second.renderer.render(roomCamera(), *makeCostModel(model), options);
        options.recordPairs = false;
        const FrameResult bare =
            second.renderer.render(roomCamera(), *makeCostModel(model), options);
        setThreadCount(0);
        for (const FrameResult* other : {&two, &again}) {
            EXPECT_EQ(one.visibility, other->visibility);
            EXPECT_EQ(one.pairRoute, other->pairRoute);
            EXPECT_EQ(one.pairs.light, other->pairs.light);
            EXPECT_EQ(one.color, other->color);
            EXPECT_EQ(one.counts.maps.pageCount, other->counts.maps.pageCount);
            ASSERT_EQ(one.maps.size(), other->maps.size());
            for (size_t m = 0; m < one.maps.size(); ++m) {
                EXPECT_EQ(one.maps[m].quantities.texels, other->maps[m].quantities.texels);
                EXPECT_EQ(one.maps[m].quantities.pages, other->maps[m].quantities.pages);
                EXPECT_EQ(one.maps[m].route, other->maps[m].route);
            }
        }
        EXPECT_EQ(one.color, bare.color);
        EXPECT_TRUE(bare.visibility.empty());
        EXPECT_EQ(bare.counts.pairCount, one.counts.pairCount);
    }
}

TEST(Frame, ShadesSampleBySampleAsClusterByCluster) {
    const Scene scene = blockerScene(kManyLights, true);
    const World world(scene, {});
    const Dag dag = dagOf(world, 7);
    FrameState state(Backend::kCpu, world, dag);
    const FrameOptions options = smallFrame();
    StageTimes stages;
    const ViewRays view = makeViewRays(roomCamera(), options.width, options.height);
    state.gather(view, options, stages);
    std::vector<MapRecord> maps = state.routing.describe(state.clusters, options);
    for (size_t m = 0; m < maps.size(); ++m)
        maps[m].route = m % 2 ? Route::kRays : Route::kMap;
    state.maps.build(state.surface, state.clusters, maps, options, stages);
    ShadeSamples shading = state.prepareShading(options);
    shadeUnlit(Backend::kCpu, shading);
    shadeLights(Backend::kCpu, shading); // the CPU's order
    const std::vector<glm::vec3> byCluster = state.shading.color().download();
    const std::vector<uint32_t> rays = state.shading.rayCount().download(),
                                lookups = state.shading.lookupCount().download();
    shading = state.prepareShading(options);
    shadeUnlit(Backend::kCpu, shading);
    for (size_t i = 0; i < shading.clusters.samples.count; ++i) // the GPU's
        shading.shadeSample(i);
    EXPECT_EQ(byCluster, state.shading.color().download());
    EXPECT_EQ(rays, state.shading.rayCount().download());
    EXPECT_EQ(lookups, state.shading.lookupCount().download());
}

TEST(Frame, ForgetsHeldResolutionsOnReset) {
    Stage stage(blockerScene(kManyLights));
    Camera near = roomCamera();
    near.positionWorld += 0.35f * near.forward; // requests a little more everywhere
    const auto model = makeCostModel("texels:0");
    const auto facesOf = [&](const Camera& camera) {
        std::vector<uint32_t> faces;
        for (const MapRecord& map : stage.renderer.render(camera, *model, smallFrame()).maps)
            faces.push_back(map.quantities.faceTexels);
        return faces;
    };
    const std::vector<uint32_t> far = facesOf(roomCamera());
    facesOf(near);
    const std::vector<uint32_t> held = facesOf(roomCamera());
    EXPECT_NE(held, far);
    for (size_t m = 0; m < far.size(); ++m)
        EXPECT_GE(held[m], far[m]);
    stage.renderer.reset();
    EXPECT_EQ(facesOf(roomCamera()), far);
}

// What a frame counts follows from the frame, also where maps are kept: memory and freed pages.
TEST(Frame, AfterAResetEarlierFramesAreNotCounted) {
    Stage stage(blockerScene(kManyLights));
    const auto maps = makeCostModel("texels:0"), rays = makeCostModel("texels:inf");
    FrameOptions options = smallFrame();
    options.maps.useStaticOptimization = true;
    const auto countsOf = [&](const CostModel& model) {
        stage.renderer.reset();
        return stage.renderer.render(roomCamera(), model, options).counts.maps;
    };
    const ShadowMapCounts first = countsOf(*maps), none = countsOf(*rays), again = countsOf(*maps);
    EXPECT_GT(first.mapBytes, 0u);
    EXPECT_EQ(none.mapBytes, 0u);
    EXPECT_EQ(none.pagesFreedCount, 0u);
    EXPECT_EQ(again.mapBytes, first.mapBytes);
    EXPECT_EQ(again.pagesFreedCount, first.pagesFreedCount);
    EXPECT_EQ(again.pagesCommittedCount, first.pagesCommittedCount);
}

// Kept pages serve lookups from elsewhere, and by whatever they were marked.
TEST(Frame, KeptPagesServeAMovingCameraWithAlternatingMarks) {
    Stage drawn(blockerScene(kManyLights)), kept(blockerScene(kManyLights));
    const auto maps = makeCostModel("texels:0");
    FrameOptions fresh = smallFrame();
    fresh.maps.useStaticOptimization = false;
    for (const bool retains : {false, true}) {
        drawn.renderer.reset();
        kept.renderer.reset();
        FrameOptions keeping = smallFrame();
        keeping.maps.useStaticOptimization = true;
        keeping.maps.retainsPages = retains;
        uint64_t keptMaps = 0;
        for (int frame = 0; frame < 6; ++frame) {
            SCOPED_TRACE(frame);
            Camera camera = roomCamera();
            camera.positionWorld.x += 0.15f * float(frame);
            keeping.pageMarks = frame % 3 == 1 ? PageMarks::kBoxes : PageMarks::kLookups;
            const FrameResult expected = drawn.renderer.render(camera, *maps, fresh);
            const FrameResult found = kept.renderer.render(camera, *maps, keeping);
            EXPECT_EQ(found.visibility, expected.visibility);
            EXPECT_EQ(found.counts.missingTapCount, 0u);
            EXPECT_EQ(expected.counts.missingTapCount, 0u);
            keptMaps += found.counts.maps.keptMapCount;
        }
        EXPECT_GT(keptMaps, 0u);
    }
}

// Gives a node a linear path from its place at 0 s to another at 1 s.
void animate(Scene& scene, int node, const glm::vec3& to) {
    AnimationChannel channel;
    channel.node = node;
    channel.times = {0.0f, 1.0f};
    channel.values = {glm::vec4(scene.nodes[node].local.translation, 0.0f), glm::vec4(to, 0.0f)};
    Animation animation;
    animation.channels = {channel};
    scene.animations.push_back(animation);
}

TEST(Frame, UpdatesEqualARebuildForMovedInstancesAndLights) {
    Scene scene = blockerScene(kManyLights, true);
    scene.nodes.push_back(scene.nodes[0]); // a second, moving copy of all triangles
    scene.roots.push_back(int(scene.nodes.size() - 1));
    scene.nodes.back().local.translation = {60.0f, 0.0f, 0.0f}; // out of sight and of every light
    animate(scene, int(scene.nodes.size() - 1), {2.5f, 0.7f, -1.0f});
    animate(scene, 2, {-1.0f, 3.0f, 2.0f});
    World world(scene, {});
    const Dag dag = dagOf(world, 7);
    FrameRenderer renderer(Backend::kCpu, world, dag);
    const FrameResult before =
        renderer.render(roomCamera(), *makeCostModel("texels:0"), smallFrame());
    renderer.worldChanged(world.setTime(1.0f));
    renderer.reset();
    const FrameResult moved =
        renderer.render(roomCamera(), *makeCostModel("texels:0"), smallFrame());
    FrameRenderer anew(Backend::kCpu, world, dag);
    const FrameResult fresh = anew.render(roomCamera(), *makeCostModel("texels:0"), smallFrame());
    EXPECT_NE(before.color, moved.color);
    EXPECT_EQ(moved.color, fresh.color);
    EXPECT_EQ(moved.visibility, fresh.visibility);
    EXPECT_EQ(moved.pairs.light, fresh.pairs.light);
}

} // namespace
} // namespace shadowdag::test
