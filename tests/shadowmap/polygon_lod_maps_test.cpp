// SPDX-License-Identifier: Apache-2.0
// Maps drawn at a polygon level of detail.
#include "scenes/polygon_lod.h"
#include "shadowmap/shadow_maps.h"

#include "tests/shadowmap/small_scene.h"

#include <gtest/gtest.h>

namespace shadowdag {
namespace {

using test::freshMaps;
using test::nineTaps;

/// Spheres of 1104 triangles at these places, xyz and radius; the last moves.
Scene spheres(const std::vector<glm::vec4>& placed) {
    test::SmallScene one;
    one.addSphere(glm::vec3(0), 1.0f, 24);
    Scene scene;
    scene.materials.emplace_back();
    scene.meshes.resize(1);
    scene.meshes[0].positions = one.positions;
    scene.meshes[0].triangles = one.triangles;
    scene.meshes[0].triangleMaterial.assign(one.triangles.size(), 0);
    for (const glm::vec4& p : placed) {
        Node node;
        node.mesh = 0;
        node.local.translation = glm::vec3(p);
        node.local.scale = glm::vec3(p.w);
        scene.roots.push_back(int(scene.nodes.size()));
        scene.nodes.push_back(node);
    }
    scene.animations.resize(1);
    scene.animations[0].channels.resize(1);
    AnimationChannel& channel = scene.animations[0].channels[0];
    channel.node = int(placed.size()) - 1;
    channel.times = {0, 4};
    const glm::vec4 from(glm::vec3(placed.back()), 0);
    channel.values = {from, from * 0.2f};
    return scene;
}

struct Stage {
    Scene scene;
    World world;
    PolygonLod lod;
    std::vector<MapRequest> requests;
    std::vector<Box> boxes{test::wholeBox(glm::vec3(0), 40.0f)};
    std::vector<MapReceiver> receivers;

    explicit Stage(uint32_t faceTexels)
        : scene(spheres({{3, 0, 0, 1}, {0, 9, 1, 2}, {-20, 2, 0, 3}, {0, -1, 30, 2}})),
          world(scene, {}), lod(world) {
        requests.push_back({glm::vec3(0.1f, 0.2f, -0.1f), 40.0f, 0, faceTexels});
        receivers.push_back({0, 0});
    }
    void build(ShadowMaps& maps, const ShadowMapOptions& options,
               View<const uint32_t> moved = {}) const {
        StageTimes stages;
        maps.build(requests, boxes, receivers, lod.triangles(), lod.batches(0.0f), options, stages,
                   moved);
    }
};

TEST(PolygonLodMaps, TrianglesDrawnFallToThoseOfTheLevelsThatTheTexelsAllow) {
    const Stage stage(256);
    ShadowMapOptions options = freshMaps();
    options.culling = MapCulling::kSphere; // every triangle into six faces
    ShadowMaps maps(Backend::kCpu);
    uint64_t before = ~0ull;
    for (const float texels : {0.0f, 0.5f, 2.0f, 8.0f}) {
        SCOPED_TRACE(texels);
        options.lodTexels = texels;
        stage.build(maps, options);
        const PolygonLevelsView levels = stage.lod.batches(texels).levels;
        uint64_t expected = 0;
        for (uint32_t i = 0; i < stage.lod.partCount(); ++i) {
            const uint32_t level = levels.levelFor(i, stage.requests[0].lightPositionWorld, 256);
            EXPECT_TRUE(texels > 0.0f || level == 0);
            expected += kFaceCount * stage.lod.triangleCount(i, level);
        }
        EXPECT_EQ(maps.counts().triangleDrawCount, expected);
        EXPECT_LT(expected, before);
        before = expected;
        // The baseline of culling stays the full detail.
        EXPECT_EQ(maps.counts().triangleSphereCount, kFaceCount * stage.world.triangles().count());
    }
    EXPECT_LE(4 * before, kFaceCount * stage.world.triangles().count());
}

TEST(PolygonLodMaps, NoTexelsGiveTheBitsOfABatchSetWithoutLevels) {
    const Stage stage(200);
    ShadowMaps with(Backend::kCpu), without(Backend::kCpu);
    stage.build(with, {});
    const BatchSet batches(stage.world);
    StageTimes stages;
    without.build(stage.requests, stage.boxes, stage.receivers, stage.world.triangles(),
                  batches.view(), {}, stages);
    const View<const uint32_t> a = with.view().depths, b = without.view().depths;
    ASSERT_EQ(a.count, b.count);
    EXPECT_TRUE(std::equal(a.begin(), a.end(), b.begin()));
}

TEST(PolygonLodMaps, CoverageDiffersOnlyNearSilhouettes) {
    for (const float texels : {1.0f, 3.0f}) {
        SCOPED_TRACE(texels);
        const int n = 256;
        const Stage stage(n);
        ShadowMaps full(Backend::kCpu), coarse(Backend::kCpu);
        stage.build(full, {});
        ShadowMapOptions options = freshMaps();
        options.lodTexels = texels;
        stage.build(coarse, options);
        ASSERT_LT(2 * coarse.counts().triangleDrawCount, full.counts().triangleDrawCount);
        // sqrt(2) texels a texel allowed, a quarter more that errors may miss, half a texel of
        // rounding to centres at either side.
        const int reach = int(std::ceil(1.25f * 1.4143f * texels)) + 1;
        const auto covers = [&](const ShadowMaps& maps, uint32_t face, int x, int y) {
            const uint32_t bits =
                depthAt(maps.view(), maps.view().maps[0], {face, uint32_t(x), uint32_t(y)});
            EXPECT_NE(bits, kNoPage);
            return bits != 0;
        };
        size_t covered = 0, different = 0;
        for (uint32_t face = 0; face < kFaceCount; ++face)
            for (int y = reach; y < n - reach; ++y)
                for (int x = reach; x < n - reach; ++x) {
                    const bool isCovered = covers(full, face, x, y);
                    covered += isCovered;
                    if (covers(coarse, face, x, y) == isCovered)
                        continue;
                    ++different;
                    bool hasSilhouette = false;
                    for (int j = -reach; j <= reach && !hasSilhouette; ++j)
                        for (int i = -reach; i <= reach && !hasSilhouette; ++i)
                            hasSilhouette = covers(full, face, x + i, y + j) != isCovered;
                    EXPECT_TRUE(hasSilhouette) << "face " << face << " at " << x << ", " << y;
                }
        EXPECT_GT(different, 0u);
        EXPECT_LT(different, covered / 10);
    }
}

TEST(PolygonLodMaps, KeptMapsOfAMovingBatchThatChangesItsLevelEqualRedrawnOnes) {
    Stage stage(300);
    ShadowMapOptions options = freshMaps();
    options.lodTexels = 1.0f;
    ShadowMapOptions keeps = options;
    keeps.useStaticOptimization = true;
    ShadowMaps kept(Backend::kCpu);
    std::vector<uint32_t> levels;
    for (int frame = 0; frame < 12; ++frame) {
        stage.lod.update(stage.world.setTime(0.4f * float(frame))); // at rest from second 4 on
        const PolygonLevelsView view = stage.lod.batches(1.0f).levels;
        levels.push_back(view.levelFor(uint32_t(stage.lod.partCount()) - 1,
                                       stage.requests[0].lightPositionWorld, 300));
        stage.build(kept, keeps, viewOf(stage.lod.batchSet().movedBatches()));
        ShadowMaps anew(Backend::kCpu);
        stage.build(anew, options);
        for (uint32_t face = 0; face < kFaceCount; ++face)
            for (uint32_t y = 0; y < 300; ++y)
                for (uint32_t x = 0; x < 300; ++x)
                    ASSERT_EQ(depthAt(kept.view(), kept.view().maps[0], {face, x, y}),
                              depthAt(anew.view(), anew.view().maps[0], {face, x, y}))
                        << "frame " << frame;
    }
    EXPECT_NE(levels.front(), levels.back());
    EXPECT_EQ(kept.counts().triangleDrawCount, 0u);
}

// What a level may stand above its receiver, drawn as a floor of its own: it does not shadow the
// receiver at any angle of light, and what stands higher does.
TEST(PolygonLodMaps, ALevelAboveItsReceiverByTheAllowedTexelsDoesNotShadowIt) {
    const uint32_t n = 256;
    const float texels = 2.0f;
    const glm::vec3 light(0.0f, 3.0f, 0.0f);
    // Straight below the light a texel is 2 height / n wide; farther out it is wider.
    const float allowed = 2.0f * texels * light.y / float(n);
    for (const bool isHigh : {false, true}) {
        test::SmallScene level;
        level.addQuad({0, isHigh ? 12.0f * allowed : 0.98f * allowed, 0}, {20, 0, 0}, {0, 0, 20});
        const test::DrawnMap drawn(level, light, 60.0f, n, {test::wholeBox(light, 60.0f)}, {});
        std::vector<ShadowMapInfo> maps{drawn.maps.view().maps[0]};
        for (const float lodTexels : {0.0f, texels}) {
            maps[0].lodTexels = lodTexels;
            ShadowMapView view = drawn.maps.view();
            view.maps = viewOf(maps);
            ShadowMapBias bias = nineTaps();
            bias.constantTexels = 0.0f;
            for (const uint32_t taps : {1u, 4u, 9u})
                for (float degrees = 5.0f; degrees <= 80.0f; degrees += 2.5f)
                    for (const float turn : {0.1f, 0.7f, 2.9f, 4.0f}) {
                        bias.taps = taps;
                        const float r = light.y * std::tan(glm::radians(degrees));
                        const glm::vec3 p(r * std::cos(turn), 0.0f, r * std::sin(turn));
                        const bool isForgiven = !isHigh && lodTexels > 0.0f;
                        const uint8_t v = lookupVisibility(view, 0, p, {0, 1, 0}, bias);
                        EXPECT_TRUE(isForgiven ? v == 255 : v < 128)
                            << int(v) << ": " << lodTexels << " texels, high " << isHigh << ", "
                            << taps << " taps, " << degrees << " degrees";
                    }
        }
    }
}

TEST(PolygonLodMaps, TexelsWithoutLevelsAndTexelsBelowZeroAreRefused) {
    const Stage stage(64);
    const auto messageFor = [&](float texels, const BatchView& batches) -> std::string {
        ShadowMaps maps(Backend::kCpu);
        ShadowMapOptions options = freshMaps();
        options.lodTexels = texels;
        StageTimes stages;
        try {
            maps.build(stage.requests, stage.boxes, stage.receivers, stage.lod.triangles(), batches,
                       options, stages);
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::kUsage);
            return error.what();
        }
        return "";
    };
    BatchView flat = stage.lod.batches(0.0f);
    flat.levels = {};
    EXPECT_NE(messageFor(1.0f, flat).find("pass the batches of PolygonLod"), std::string::npos);
    EXPECT_NE(messageFor(-1.0f, stage.lod.batches(0.0f)).find("choose a number of texels >= 0"),
              std::string::npos);
    EXPECT_NE(messageFor(std::nanf(""), stage.lod.batches(0.0f)).find("nan"), std::string::npos);
}

} // namespace
} // namespace shadowdag
