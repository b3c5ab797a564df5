// SPDX-License-Identifier: Apache-2.0
// Base colours of the samples of whole frames: a board whose texels are larger than pixels, seen
// straight on, and what textures must not change.
#include "hybrid/gbuffer/resolve_base_color.h"

#include "hybrid/frame.h"
#include "hybrid/judge/error.h"
#include "tests/hybrid/blocker_stage.h"

#include <gtest/gtest.h>

namespace shadowdag::test {
namespace {

constexpr uint32_t kWidth = 96, kHeight = 64;

/// Black, red / green, white, with sharp texels, over the 12 m of the floor and, mirrored and
/// placed twice, over the blocker.
Scene texturedScene() {
    Scene scene = blockerScene({{1, kLightHeight, 0.5f}, {-2, kLightHeight, 1}});
    scene.materials[1].baseColorTexture =
        int(scene.textures.add({2, 2, {0, 0, 0, 255, 0, 0, 0, 255, 0, 255, 255, 255}},
                               MaskWrap::kRepeat, MaskWrap::kRepeat, true));
    for (Mesh& mesh : scene.meshes)
        for (const glm::vec3& p : mesh.positions)
            mesh.uv.push_back(glm::vec2(p.x, p.z) / 12.0f + 0.5f);
    Node mirrored;
    mirrored.mesh = 0;
    mirrored.local.translation = {0.5f, -0.25f, 0};
    mirrored.local.scale = {-1, 1, 1};
    scene.roots.push_back(int(scene.nodes.size()));
    scene.nodes.push_back(mirrored);
    return scene;
}

Scene withoutTextures(Scene scene) {
    scene.materials[1].baseColorTexture = kNone;
    scene.textures = {};
    scene.meshes[0].uv.clear();
    return scene;
}

Camera fromAbove() {
    Camera camera;
    camera.positionWorld = {0.3f, 6, 0.2f};
    camera.forward = {0, -1, 0};
    camera.up = {0, 0, -1};
    camera.yfov = 1.0f;
    camera.znear = 0.1f;
    camera.zfar = 100.0f;
    return camera;
}

/// A scene on the CPU.
struct TexturedStage {
    explicit TexturedStage(Scene authored) : scene(std::move(authored)), world(scene, {}) {
        dag = voxelize(world.triangles(), viewOf(world.staticTriangles()),
                       gridAround(world.boundsWorld(), 8));
        renderer = std::make_unique<FrameRenderer>(Backend::kCpu, world, dag);
    }
    FrameResult render(const std::string& model) {
        FrameOptions options;
        options.width = kWidth;
        options.height = kHeight;
        return renderer->render(fromAbove(), *makeCostModel(model), options);
    }

    Scene scene;
    World world;
    Dag dag;
    std::unique_ptr<FrameRenderer> renderer;
};

TEST(ResolveBaseColor, EverySampleHasTheTexelAtItsPlace) {
    TexturedStage stage(texturedScene());
    stage.render("texels:inf");
    const GBufferView seen = stage.renderer->gbuffer();
    ASSERT_EQ(seen.baseColor.count, size_t(kWidth) * kHeight);
    const glm::vec3 factor = stage.scene.materials[1].baseColor;
    size_t counts[2] = {};
    for (size_t s = 0; s < seen.count(); ++s) {
        if (seen.triangle[s] == kBackground) {
            EXPECT_EQ(seen.baseColor[s], glm::vec3(0.0f));
            continue;
        }
        const bool isMirrored = stage.world.triangleInstance()[seen.triangle[s]] == 1;
        const glm::vec3 p = seen.positionWorld[s];
        const double u = isMirrored ? 0.5 - p.x : p.x, v = p.z; // in metres from the middle
        if (std::fabs(u) < 1e-4 || std::fabs(v) < 1e-4)
            continue;
        const glm::vec3 texel = v > 0 ? (u > 0 ? glm::vec3(1, 1, 1) : glm::vec3(0, 1, 0))
                                      : (u > 0 ? glm::vec3(1, 0, 0) : glm::vec3(0, 0, 0));
        ASSERT_EQ(seen.baseColor[s], factor * texel) << p.x << " " << p.y << " " << p.z;
        ++counts[isMirrored];
    }
    EXPECT_GT(counts[0], 3000u);
    EXPECT_GT(counts[1], 50u) << "the mirrored blocker, beside the other";
}

TEST(ResolveBaseColor, PicturesAreScaledByTheTextureAndNothingElseChanges) {
    TexturedStage textured(texturedScene()), plain(withoutTextures(texturedScene()));
    for (const std::string model : {"texels:inf", "texels:0", "texels:96"}) {
        SCOPED_TRACE(model);
        const FrameResult a = textured.render(model), b = plain.render(model);
        EXPECT_EQ(a.pairs.sampleStart, b.pairs.sampleStart);
        EXPECT_EQ(a.pairs.light, b.pairs.light);
        EXPECT_EQ(a.visibility, b.visibility);
        EXPECT_EQ(a.counts.pairCount, b.counts.pairCount);
        EXPECT_EQ(a.counts.rayCount, b.counts.rayCount);
        EXPECT_EQ(a.counts.lookupCount, b.counts.lookupCount);
        EXPECT_TRUE(plain.renderer->gbuffer().baseColor.empty()) << "no memory without textures";
        const GBufferView seen = textured.renderer->gbuffer();
        const Material& material = plain.scene.materials[1];
        for (size_t s = 0; s < seen.count(); ++s)
            for (int c = 0; c < 3; ++c) {
                if (seen.triangle[s] == kBackground)
                    continue;
                const float share = seen.baseColor[s][c] / material.baseColor[c];
                ASSERT_NEAR(a.color[s][c] - material.emission[c],
                            share * (b.color[s][c] - material.emission[c]), 1e-5f);
            }
        EXPECT_NE(a.color, b.color);
        EXPECT_EQ(shadePairs(seen, textured.world, a.pairs, a.visibility), a.color)
            << "pictures of the truth have the same colours";
    }
}

} // namespace
} // namespace shadowdag::test
