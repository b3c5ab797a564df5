// SPDX-License-Identifier: Apache-2.0
// Frames of the OpenGL backend against the CPU's, which is the one text. Bounds are what was
// measured on Mesa 22.3's llvmpipe at 320 x 180, rounded up; 0 where nothing differed.
#include "hybrid/frame_gl.h"

#include "scenes/builtin.h"
#include "tests/gl/gl_device.h"
#include "tests/hybrid/fail_stage.h"
#include "tests/hybrid/gl_parity.h"

#include <gmock/gmock.h>

#include <thread>

namespace shadowdag::test {
namespace {

using testing::HasSubstr;

FrameOptions smallFrame() {
    FrameOptions options;
    options.width = 320;
    options.height = 180;
    return options;
}

/// A built-in scene on both backends.
struct GlStage {
    explicit GlStage(const std::string& name, float timeSeconds = 0.0f)
        : scene(makeBuiltin(name)), world(scene, {}) {
        world.setTime(timeSeconds);
        dag = voxelize(world.triangles(), viewOf(world.staticTriangles()),
                       gridAround(world.boundsWorld(), 9));
        cpu = std::make_unique<FrameRenderer>(Backend::kCpu, world, dag);
        gl = std::make_unique<FrameRenderer>(Backend::kGl, world, dag);
    }

    static FrameResult render(FrameRenderer& renderer, const World& world, const std::string& model,
                              const FrameOptions& options) {
        return renderer.render(world.cameras().at(0), *makeCostModel(model), options);
    }
    GlParity compare(const std::string& model, const FrameOptions& options = smallFrame()) {
        const FrameResult a = render(*cpu, world, model, options);
        const FrameResult b = render(*gl, world, model, options);
        EXPECT_EQ(b.counts.pairCount, b.pairs.count());
        EXPECT_EQ(b.counts.missingTapCount, 0u);
        EXPECT_EQ(a.counts.rayCount == 0, b.counts.rayCount == 0);
        return compareFrames(a, cpu->gbuffer(), b, gl->gbuffer());
    }

    Scene scene;
    World world;
    Dag dag;
    std::unique_ptr<FrameRenderer> cpu, gl;
};

/// What differs in a scene, percent: of pixels, which triangle they see (outlines, and coplanar
/// faces); of pairs by maps, whether they are dark (texels at outlines).
struct Known {
    const char* scene;
    float timeSeconds;
    double otherTrianglePercent, darkByMapsPercent;
};

void PrintTo(const Known& known, std::ostream* out) {
    *out << known.scene;
}

class FrameGl : public NeedsGl {};
class FrameGlScene : public NeedsGl, public testing::WithParamInterface<Known> {};

// Samples: the same triangle gives the same bits. Rays: every pair as on the CPU, in every bit of
// segment and traversal. Maps: all but texels where the hardware's coverage differs. Colours: a few
// roundings apart at most.
TEST_P(FrameGlScene, AnswersAsTheProcessorDoes) {
    GlStage stage(GetParam().scene, GetParam().timeSeconds);
    for (const std::string model : {"texels:inf", "texels:0", "texels:96"}) {
        const GlParity p = stage.compare(model);
        SCOPED_TRACE(testing::Message() << model << ": " << p);
        EXPECT_LE(100.0 - p.sameTrianglePercent(), GetParam().otherTrianglePercent);
        EXPECT_EQ(p.unlikeSampleCount, 0u);
        EXPECT_EQ(p.unlikePairListCount, 0u);
        EXPECT_EQ(p.unlikeRouteCount, 0u);
        EXPECT_EQ(p.unlikeRayCount, 0u);
        EXPECT_LE(p.unlikeDarkPercent(),
                  model == "texels:inf" ? 0.0 : GetParam().darkByMapsPercent);
        EXPECT_LE(p.colorError, 1e-5);
    }
}

INSTANTIATE_TEST_SUITE_P(
    Scenes, FrameGlScene,
    testing::Values(Known{"fail-silhouette", 0, 0.01, 0}, Known{"fail-cube-seam", 0, 0.01, 0},
                    Known{"fail-sun", 2, 0.01, 0.01}, Known{"fail-alpha", 2, 0.01, 0.01},
                    Known{"fail-mover", 2, 0.02, 0.01}, Known{"fail-several-maps", 0, 0.02, 0},
                    Known{"fail-far-origin", 0, 0, 0}, Known{"fail-coplanar", 0, 0.8, 0.01},
                    Known{"fail-wires", 0, 0.03, 0}, Known{"atrium", 0, 0.2, 0.01},
                    Known{"houses", 0, 0.5, 0.07}, Known{"necropolis", 0, 0.8, 0.07}),
    [](const testing::TestParamInfo<Known>& info) {
        std::string name = info.param.scene;
        std::replace(name.begin(), name.end(), '-', '_');
        return name;
    });

// Kept maps live in OpenGL's pool: what is not drawn again has to be there still.
TEST_F(FrameGl, KeptMapsAnswerAsMapsDrawnAnew) {
    for (const std::string name : {"fail-stale-pages", "fail-mover"}) {
        SCOPED_TRACE(name);
        GlStage stage(name);
        const std::unique_ptr<FrameRenderer> anew = stage.gl->shareScene();
        FrameOptions keeps = smallFrame(), forgets = smallFrame();
        keeps.maps.useStaticOptimization = true;
        forgets.maps.useStaticOptimization = false;
        uint64_t keptCount = 0;
        for (int frame = 0; frame < 4; ++frame) {
            stage.gl->worldChanged(stage.world.setTime(0.5f * float(frame)));
            const FrameResult a = GlStage::render(*stage.gl, stage.world, "texels:0", keeps);
            const FrameResult b = GlStage::render(*anew, stage.world, "texels:0", forgets);
            keptCount += a.counts.maps.batchFaceKeptCount;
            EXPECT_EQ(a.visibility, b.visibility) << "frame " << frame;
            EXPECT_EQ(a.color, b.color) << "frame " << frame;
        }
        EXPECT_GT(keptCount, 0u) << "nothing was kept: the test asks nothing";
    }
}

// The window's case: made here, used there, and gone here.
TEST_F(FrameGl, RendersOnAWorkerThread) {
    GlStage stage("fail-silhouette");
    const FrameResult here = GlStage::render(*stage.gl, stage.world, "texels:96", smallFrame());
    FrameResult there;
    std::thread([&] {
        there = GlStage::render(*stage.gl, stage.world, "texels:96", smallFrame());
        EXPECT_GT(stage.gl->shadowMaps().depths.count, 0u);
    }).join();
    EXPECT_EQ(here.visibility, there.visibility);
    EXPECT_EQ(here.color, there.color);
}

// What reports ask of a renderer afterwards: the error against the truth, from the depths drawn.
TEST_F(FrameGl, ErrorsAreExplainedAsThoseOfTheProcessor) {
    FailStage cpu(failSceneOf("fail-silhouette"), 9), gl(failSceneOf("fail-silhouette"), 9);
    gl.renderer = std::make_unique<FrameRenderer>(Backend::kGl, gl.world, gl.dag);
    for (const char* model : {"texels:inf", "texels:0"}) {
        const ErrorCounts a = cpu.run(model).report.total, b = gl.run(model).report.total;
        EXPECT_NEAR(double(a.pairCount), double(b.pairCount), 5.0);
        EXPECT_NEAR(double(a.falseShadowCount), double(b.falseShadowCount), 3.0);
        EXPECT_NEAR(double(a.falseLightCount), double(b.falseLightCount), 3.0);
        EXPECT_NEAR(double(a.unexplainedFalseShadowCount), double(b.unexplainedFalseShadowCount),
                    1.0);
    }
}

TEST_F(FrameGl, CostsOfMapsAreMeasured) {
    GlStage stage("fail-several-maps");
    const FrameCosts costs = stage.gl->measureCosts(stage.world.cameras().at(0), smallFrame(), 1);
    ASSERT_FALSE(costs.maps.empty());
    for (const MapCost& map : costs.maps) {
        EXPECT_GT(map.raysMs, 0.0);
        EXPECT_GT(map.mapMs, 0.0);
    }
}

TEST_F(FrameGl, WhatItCannotDoIsRefusedWithWhatCan) {
    GlStage stage("fail-silhouette");
    const auto refusal = [&](const FrameOptions& options) -> std::string {
        try {
            GlStage::render(*stage.gl, stage.world, "texels:96", options);
            return "";
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::kUsage);
            return error.what();
        }
    };
    FrameOptions exact = smallFrame(), level = smallFrame(), footprint = smallFrame(),
                 polygons = smallFrame();
    exact.rays.kind = RayKind::kExact;
    level.rays.level = 1;
    footprint.rays.lod = LodRule::kFootprint;
    polygons.maps.lodTexels = 1.0f;
    EXPECT_THAT(refusal(exact), HasSubstr("dag-exact"));
    EXPECT_THAT(refusal(level), HasSubstr("level 0"));
    EXPECT_THAT(refusal(footprint), HasSubstr("level of detail"));
    EXPECT_THAT(refusal(polygons), HasSubstr("polygon levels"));
    EXPECT_EQ(refusal(smallFrame()), "");
}

} // namespace
} // namespace shadowdag::test
