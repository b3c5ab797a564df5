// SPDX-License-Identifier: Apache-2.0
// Whole frames of a small room with a blocker: known umbra by every method, pairs, recording,
// determinism, costs.
#include "hybrid/frame.h"

#include "hybrid/frame_state.h"
#include "tests/hybrid/triangle_soup.h"
#include "voxel/voxelize.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace shadowdag::test {
namespace {

constexpr float kBlockerHeight = 1.0f, kBlockerHalf = 0.5f, kLightHeight = 2.0f;

// A floor of 12 m at y = 0, a level square above it, the given lights.
Scene blockerScene(const std::vector<glm::vec3>& lights, bool hasRandomTriangles = false) {
    TriangleSoup soup;
    soup.addLevelSquare({0, 0, 0}, 6.0f);
    soup.addLevelSquare({0, kBlockerHeight, 0}, kBlockerHalf);
    if (hasRandomTriangles) {
        std::mt19937_64 random(21);
        std::uniform_real_distribution<float> unit(-1.0f, 1.0f);
        for (int i = 0; i < 300; ++i) {
            const glm::vec3 c(5 * unit(random), 1.5f + unit(random), 5 * unit(random));
            glm::vec3 corner[3];
            for (glm::vec3& p : corner)
                p = c + 0.4f * glm::vec3(unit(random), unit(random), unit(random));
            soup.add(corner[0], corner[1], corner[2]);
        }
    }
    Scene scene;
    scene.materials.resize(2);
    scene.materials[1].baseColor = {0.5f, 0.25f, 1.0f};
    scene.materials[1].emission = {0.0f, 0.125f, 0.0f};
    Mesh mesh;
    mesh.positions = soup.positions;
    mesh.triangles = soup.triangles;
    mesh.triangleMaterial.assign(soup.triangles.size(), 1);
    scene.meshes = {mesh};
    scene.nodes.resize(1 + lights.size());
    scene.nodes[0].mesh = 0;
    scene.roots = {0};
    scene.lights.resize(1);
    scene.lights[0].rangeWorld = 9.0f;
    scene.lights[0].intensity = 10.0f;
    for (size_t l = 0; l < lights.size(); ++l) {
        scene.nodes[1 + l].light = 0;
        scene.nodes[1 + l].local.translation = lights[l];
        scene.roots.push_back(int(1 + l));
    }
    return scene;
}

Camera roomCamera() {
    Camera camera;
    camera.positionWorld = {0.3f, 4.0f, 5.0f};
    camera.forward = glm::normalize(glm::vec3(-0.05f, -0.75f, -1.0f));
    camera.up =
        glm::normalize(glm::cross(glm::cross(camera.forward, glm::vec3(0, 1, 0)), camera.forward));
    return camera;
}

FrameOptions smallFrame() {
    FrameOptions options;
    options.width = 160;
    options.height = 96;
    options.maps.poolBytes = 64ull << 20;
    return options;
}

Dag dagOf(const World& world, uint32_t resolutionLog2) {
    return voxelize(world.triangles(), viewOf(world.staticTriangles()),
                    gridAround(world.boundsWorld(), resolutionLog2));
}

const std::vector<glm::vec3> kManyLights{
    {0, kLightHeight, 0}, {3, 2.5f, 1}, {-3, 3, -2}, {1, 0.7f, 3}, {-2, 2, 4}};

// A world and its renderer, kept together.
struct Stage {
    explicit Stage(Scene s, uint32_t resolutionLog2 = 8)
        : scene(std::move(s)), world(scene, {}), dag(dagOf(world, resolutionLog2)),
          renderer(Backend::kCpu, world, dag) {}
    Scene scene;
    World world;
    Dag dag;
    FrameRenderer renderer;
};

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

TEST(Frame, OfRaysAnswersEveryPairAsASingleRayDoes) {
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

TEST(Frame, MixesBothMethodsAsTheModelSays) {
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
        ASSERT_EQ(isTraced, mixed.pairMap[pair] == kByRays);
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
    gatherFrame(state, view, options, stages);
    std::vector<MapRecord> maps = describeMaps(state, options);
    for (size_t m = 0; m < maps.size(); ++m)
        maps[m].route = m % 2 ? Route::kRays : Route::kMap;
    buildMaps(state, maps, options, stages);
    ShadeSamples shading = prepareShading(state, options);
    shadeUnlit(Backend::kCpu, shading);
    shadeLights(Backend::kCpu, shading); // the CPU's order
    const std::vector<glm::vec3> byCluster = state.color.download();
    const std::vector<uint32_t> rays = state.rayCount.download(),
                                lookups = state.lookupCount.download();
    shading = prepareShading(state, options);
    shadeUnlit(Backend::kCpu, shading);
    for (size_t i = 0; i < shading.clusters.samples.count; ++i) // the GPU's
        shading.shadeSample(i);
    EXPECT_EQ(byCluster, state.color.download());
    EXPECT_EQ(rays, state.rayCount.download());
    EXPECT_EQ(lookups, state.lookupCount.download());
}

TEST(Frame, ForgetsHeldResolutionsOnReset) {
    Stage stage(blockerScene(kManyLights));
    Camera near = roomCamera();
    near.positionWorld += 0.35f * near.forward; // asks for a little more everywhere
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

TEST(Frame, WithoutADagRefusesRaysAndDrawsMaps) {
    const Scene scene = blockerScene(kManyLights);
    const World world(scene, {});
    const Dag none;
    FrameRenderer renderer(Backend::kCpu, world, none);
    EXPECT_GT(
        renderer.render(roomCamera(), *makeCostModel("texels:0"), smallFrame()).counts.lookupCount,
        0u);
    try {
        renderer.render(roomCamera(), *makeCostModel("texels:inf"), smallFrame());
        FAIL();
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kUsage);
        EXPECT_THAT(error.what(), testing::HasSubstr("no voxel DAG"));
    }
    EXPECT_THROW(renderer.measureCosts(roomCamera(), smallFrame(), 1), Error);
}

TEST(Frame, DagOfASceneThatOnlyMovesBlocksNothing) {
    const Scene scene = blockerScene({{0, kLightHeight, 0}});
    const World world(scene, {});
    const Dag nothing = voxelize(world.triangles(), {}, gridAround(world.boundsWorld(), 8));
    ASSERT_TRUE(nothing.empty());
    FrameRenderer renderer(Backend::kCpu, world, nothing);
    FrameOptions options = smallFrame();
    options.recordPairs = true;
    const FrameResult result = renderer.render(roomCamera(), *makeCostModel("texels:inf"), options);
    EXPECT_GT(result.counts.rayCount, 0u);
    EXPECT_EQ(result.counts.lookupCount, 0u);
    ASSERT_FALSE(result.visibility.empty());
    for (const uint8_t visibility : result.visibility)
        ASSERT_EQ(visibility, 255);
    EXPECT_NO_THROW(renderer.measureCosts(roomCamera(), smallFrame(), 1));
}

TEST(Frame, RefusesContradictoryOptions) {
    Stage stage(blockerScene({{0, 2, 0}}), 5);
    const auto messageOf = [&](auto change) -> std::string {
        FrameOptions options = smallFrame();
        change(options);
        try {
            stage.renderer.render(roomCamera(), *makeCostModel("texels:inf"), options);
        } catch (const Error& error) {
            return error.what();
        }
        return "accepted";
    };
    using testing::HasSubstr;
    EXPECT_EQ(messageOf([](FrameOptions&) {}), "accepted");
    EXPECT_THAT(messageOf([](FrameOptions& o) { o.undersample = 0.0f; }),
                HasSubstr("undersampling"));
    EXPECT_THAT(messageOf([](FrameOptions& o) { o.maxFaceTexels = 8193; }), HasSubstr("8193"));
    EXPECT_THAT(messageOf([](FrameOptions& o) { o.minFaceTexels = 4096; }), HasSubstr("4096"));
    EXPECT_THAT(messageOf([](FrameOptions& o) { o.maps.taps = 1; }), HasSubstr("taps"));
    EXPECT_THAT(messageOf([](FrameOptions& o) { o.rays.offset = NAN; }), HasSubstr("offset"));
    EXPECT_THAT(messageOf([](FrameOptions& o) { o.rays.level = 6; }), HasSubstr("level of detail"));
    EXPECT_THAT(messageOf([](FrameOptions& o) { o.width = 0; }), HasSubstr("image size"));
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

TEST(Frame, FollowsMovedInstancesAndLightsAsIfBuiltAnew) {
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

TEST(Frame, UndersamplingDividesTheRequest) {
    Stage stage(blockerScene(kManyLights), 5);
    FrameOptions options = smallFrame();
    const FrameResult full =
        stage.renderer.render(roomCamera(), *makeCostModel("texels:inf"), options);
    options.undersample = 2.0f;
    const FrameResult half =
        stage.renderer.render(roomCamera(), *makeCostModel("texels:inf"), options);
    ASSERT_EQ(full.maps.size(), half.maps.size());
    for (size_t m = 0; m < full.maps.size(); ++m)
        EXPECT_FLOAT_EQ(half.maps[m].quantities.texels, 0.5f * full.maps[m].quantities.texels);
}

TEST(Frame, SeveralMapsALightServeEveryPairByItsOctaveWithFewerTexels) {
    Stage stage(blockerScene(kManyLights), 5);
    FrameOptions options = smallFrame();
    options.maps.pageTexels = 16;
    const FrameResult one =
        stage.renderer.render(roomCamera(), *makeCostModel("texels:0"), options);
    options.mapsPerLight = 4;
    const FrameResult four =
        stage.renderer.render(roomCamera(), *makeCostModel("texels:0"), options);
    EXPECT_EQ(one.maps.size(), one.counts.mappedLightCount);
    EXPECT_GT(four.maps.size(), one.maps.size());
    EXPECT_LE(four.maps.size(), 4 * one.maps.size());
    EXPECT_EQ(four.counts.mappedLightCount, one.counts.mappedLightCount);
    EXPECT_EQ(four.counts.missingTapCount, 0u);
    EXPECT_LT(four.counts.maps.texelCount, one.counts.maps.texelCount);
    uint64_t samples = 0, sampleOfOne = 0, pairs = 0;
    for (const MapRecord& map : one.maps)
        sampleOfOne += map.quantities.samples;
    for (size_t m = 0; m < four.maps.size(); ++m) {
        const MapQuantities& map = four.maps[m].quantities;
        samples += map.samples;
        pairs += four.maps[m].pairCount;
        // No map asks for more than its octave holds.
        EXPECT_LT(map.texels, float(2u << map.octave));
        if (m > 0 && four.maps[m - 1].quantities.light == map.light) {
            EXPECT_GT(map.octave, four.maps[m - 1].quantities.octave);
        }
    }
    EXPECT_EQ(samples, sampleOfOne);
    EXPECT_EQ(pairs, four.pairs.count());
    for (size_t p = 0; p < four.pairs.count(); ++p)
        ASSERT_EQ(four.maps[four.pairMap[p]].quantities.light, four.pairs.light[p]);
}

TEST(Frame, ReorderedLightListsChangeNoAnswerAndColoursByRoundingAlone) {
    Stage stage(blockerScene(kManyLights), 5);
    FrameOptions options = smallFrame();
    for (const char* model : {"texels:0", "texels:inf"}) {
        options.reorderLights = false;
        const FrameResult plain =
            stage.renderer.render(roomCamera(), *makeCostModel(model), options);
        options.reorderLights = true;
        const FrameResult ordered =
            stage.renderer.render(roomCamera(), *makeCostModel(model), options);
        const FrameResult again =
            stage.renderer.render(roomCamera(), *makeCostModel(model), options);
        EXPECT_EQ(ordered.color, again.color);
        EXPECT_EQ(ordered.pairs.light, plain.pairs.light);
        EXPECT_EQ(ordered.visibility, plain.visibility);
        EXPECT_EQ(ordered.pairMap, plain.pairMap);
        EXPECT_EQ(ordered.counts.pairCount, plain.counts.pairCount);
        for (size_t i = 0; i < plain.color.size(); ++i)
            for (int c = 0; c < 3; ++c)
                ASSERT_NEAR(ordered.color[i][c], plain.color[i][c], 1e-5f * plain.color[i][c]);
        options.recordPairs = false;
        EXPECT_EQ(stage.renderer.render(roomCamera(), *makeCostModel(model), options).color,
                  ordered.color);
        options.recordPairs = true;
    }
}

TEST(Frame, MeasuredCostsNameEveryMapAndRouteTheOracle) {
    Stage stage(blockerScene(kManyLights, true));
    FrameOptions options = smallFrame();
    options.mapsPerLight = 4;
    const FrameResult frame =
        stage.renderer.render(roomCamera(), *makeCostModel("texels:inf"), options);
    const FrameCosts costs = stage.renderer.measureCosts(roomCamera(), options, 3);
    ASSERT_EQ(costs.maps.size(), frame.maps.size());
    for (size_t m = 0; m < costs.maps.size(); ++m) {
        EXPECT_EQ(costs.maps[m].light, frame.maps[m].quantities.light);
        EXPECT_EQ(costs.maps[m].octave, frame.maps[m].quantities.octave);
        EXPECT_GT(costs.maps[m].raysMs, 0.0);
        EXPECT_GT(costs.maps[m].mapMs, 0.0);
    }
    const auto oracle = makeCostModel("oracle");
    oracle->setCosts(costs);
    const FrameResult routed = stage.renderer.render(roomCamera(), *oracle, options);
    for (size_t m = 0; m < costs.maps.size(); ++m)
        EXPECT_EQ(routed.maps[m].route == Route::kRays, costs.maps[m].raysMs < costs.maps[m].mapMs);
}

TEST(Frame, WithoutLightsShowsTheUnlitWorld) {
    Stage stage(blockerScene({}), 5);
    const FrameResult frame =
        stage.renderer.render(roomCamera(), *makeCostModel("texels:96"), smallFrame());
    EXPECT_EQ(frame.counts.pairCount, 0u);
    EXPECT_TRUE(frame.maps.empty());
    EXPECT_GT(frame.counts.sampleCount, 1000u);
    EXPECT_EQ(frame.pairs.sampleStart.size(), size_t(160 * 96 + 1));
}

} // namespace
} // namespace shadowdag::test
