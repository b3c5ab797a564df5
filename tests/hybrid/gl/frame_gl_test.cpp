// SPDX-License-Identifier: Apache-2.0
// Frames of the OpenGL backend compared with those of the CPU. Bounds were measured on Mesa 22.3's
// llvmpipe at 320 x 180 and rounded up; 0 where nothing differed.
#include "hybrid/gl/frame_gl.h"

#include "gl/slices.h"
#include "hybrid/gl/gl_options.h"
#include "scenes/builtin.h"
#include "tests/gl/gl_device.h"
#include "tests/hybrid/fail_stage.h"
#include "tests/hybrid/gl_parity.h"
#include "tests/scenes/fewer_lights.h"

#include <gmock/gmock.h>

#include <cstdlib>
#include <ctime>
#include <future>
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
        : GlStage(makeBuiltin(name), timeSeconds) {}
    explicit GlStage(Scene authored, float timeSeconds = 0.0f)
        : scene(std::move(authored)), world(scene, {}) {
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
/// faces); of pairs by maps, whether they are dark (texels at outlines), and whether their
/// visibility is another at all, by 1, 4 or 9 taps.
struct Known {
    const char* scene;
    float timeSeconds;
    double otherTrianglePercent, darkByMapsPercent, otherVisibilityPercent = 0;
    bool isLarge = false;     ///< by 4 taps alone: others take a minute each on llvmpipe
    uint32_t lightStride = 1; ///< n: every n-th light
};

void PrintTo(const Known& known, std::ostream* out) {
    *out << known.scene;
}

class FrameGl : public NeedsGl {};
class FrameGlScene : public NeedsGl, public testing::WithParamInterface<Known> {};

// Samples: the same triangle gives the same bits. Rays: every pair as on the CPU, in every bit of
// segment and traversal. Maps: all but texels where the hardware's coverage differs. Colours: a few
// roundings apart at most.
TEST_P(FrameGlScene, EqualsTheCpu) {
    GlStage stage(withEveryNthLight(makeBuiltin(GetParam().scene), GetParam().lightStride),
                  GetParam().timeSeconds);
    for (const auto& [model, taps] : {std::pair<std::string, uint32_t>{"texels:inf", 4},
                                      {"texels:0", 1},
                                      {"texels:0", 4},
                                      {"texels:0", 9},
                                      {"texels:96", 4}}) {
        if (GetParam().isLarge && taps != 4)
            continue;
        FrameOptions options = smallFrame();
        options.maps.taps = options.bias.taps = taps;
        const GlParity p = stage.compare(model, options);
        SCOPED_TRACE(testing::Message() << model << ", " << taps << " taps: " << p);
        EXPECT_LE(p.unlikeVisibilityPercent(),
                  model == "texels:inf" ? 0.0 : GetParam().otherVisibilityPercent);
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
    testing::Values(
        Known{"fail-silhouette", 0, 0.01, 0}, Known{"fail-cube-seam", 0, 0.01, 0},
        Known{"fail-sun", 2, 0.01, 0.01}, Known{"fail-alpha", 2, 0.01, 0.01, 0.02},
        Known{"fail-mover", 2, 0.02, 0.01}, Known{"fail-several-maps", 0, 0.02, 0, 0.03},
        Known{"fail-far-origin", 0, 0, 0}, Known{"fail-coplanar", 0, 0.8, 0.01, 0.05},
        Known{"fail-wires", 0, 0.03, 0, 0.02}, Known{"atrium", 0, 0.2, 0.01, 0.05, true, 4},
        Known{"houses", 0, 0.5, 0.07, 0.3, true}, Known{"necropolis", 0, 0.8, 0.07, 0.5, true, 4}),
    [](const testing::TestParamInfo<Known>& info) {
        std::string name = info.param.scene;
        std::replace(name.begin(), name.end(), '-', '_');
        return name;
    });

// Every material has the texture, once for every metre of its objects' coordinates.
TEST_F(FrameGl, BaseColourTexturesEqualTheCpus) {
    Scene scene = makeBuiltin("fail-alpha");
    const int texture =
        int(scene.textures.add({2, 2, {0, 0, 0, 255, 0, 0, 0, 255, 0, 255, 255, 255}},
                               MaskWrap::kRepeat, MaskWrap::kMirror, false));
    for (Material& material : scene.materials)
        material.baseColorTexture = texture;
    for (Mesh& mesh : scene.meshes)
        if (mesh.uv.empty()) // others are masked
            for (const glm::vec3& p : mesh.positions)
                mesh.uv.emplace_back(p.x + p.y, p.z);
    const FrameResult plain = [] {
        GlStage stage("fail-alpha");
        return GlStage::render(*stage.gl, stage.world, "texels:inf", smallFrame());
    }();
    GlStage stage(std::move(scene));
    const GlParity p = stage.compare("texels:inf");
    SCOPED_TRACE(testing::Message() << p);
    EXPECT_EQ(p.unlikeVisibilityCount, 0u);
    EXPECT_EQ(p.unlikePairListCount, 0u);
    EXPECT_LE(p.colorError, 1e-5);
    const FrameResult textured =
        GlStage::render(*stage.gl, stage.world, "texels:inf", smallFrame());
    EXPECT_EQ(textured.visibility, plain.visibility);
    EXPECT_EQ(textured.pairs.light, plain.pairs.light);
    EXPECT_NE(textured.color, plain.color);
}

/// Where renderers that are made while it lives keep pages.
struct PagesIn {
    explicit PagesIn(GlPages pages) { setGlPages(pages); }
    ~PagesIn() { setGlPages(GlPages::kAuto); }
};

// The lookups of sparse textures, on every device: layers that have all their memory.
TEST_F(FrameGl, LayersEqualTheAtlas) {
    GlStage stage("fail-several-maps");
    const PagesIn layers(GlPages::kDenseLayers);
    FrameRenderer inLayers(Backend::kGl, stage.world, stage.dag);
    for (const uint32_t taps : {1u, 4u, 9u}) {
        SCOPED_TRACE(testing::Message() << taps << " taps");
        FrameOptions options = smallFrame();
        options.maxFaceTexels = 512; // a layer of 2048 texels a side would take 16 MiB
        options.maps.taps = options.bias.taps = taps;
        options.maps.pageTexels = kDensePageTexels;
        const FrameResult a = GlStage::render(*stage.gl, stage.world, "texels:0", options);
        const FrameResult b = GlStage::render(inLayers, stage.world, "texels:0", options);
        EXPECT_EQ(b.counts.missingTapCount, 0u);
        EXPECT_EQ(a.visibility, b.visibility);
        EXPECT_EQ(a.color, b.color);
    }
}

// Kept maps live in OpenGL's pool or layers: what is not drawn again has to be there still.
class FrameGlPages : public NeedsGl, public testing::WithParamInterface<GlPages> {};
INSTANTIATE_TEST_SUITE_P(Pages, FrameGlPages,
                         testing::Values(GlPages::kAtlas, GlPages::kDenseLayers),
                         [](const testing::TestParamInfo<GlPages>& info) {
                             return info.param == GlPages::kAtlas ? "atlas" : "layers";
                         });

TEST_P(FrameGlPages, KeptMapsEqualRedrawnMaps) {
    const PagesIn pages(GetParam());
    for (const std::string name : {"fail-stale-pages", "fail-mover"}) {
        SCOPED_TRACE(name);
        GlStage stage(name);
        const std::unique_ptr<FrameRenderer> anew = stage.gl->shareScene();
        FrameOptions keeps = smallFrame();
        keeps.maxFaceTexels = 512;
        FrameOptions forgets = keeps;
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
TEST_F(FrameGl, ErrorsAreExplainedAsOnTheCpu) {
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

// What a slow driver's frame is ended by, and that nothing is wrong afterwards.
TEST_F(FrameGl, IsCancelledBetweenSubmissionsAndWorksAfterwards) {
    struct Stop {};
    struct NoPoll {
        ~NoPoll() { setGlPoll({}); }
    } noPoll;
    GlStage stage("fail-several-maps");
    const auto render = [&] {
        return GlStage::render(*stage.gl, stage.world, "texels:96", smallFrame());
    };
    int pollCount = 0;
    setGlPoll([&] { ++pollCount; });
    const FrameResult whole = render();
    const int all = pollCount;
    EXPECT_GE(all, 8) << "g-buffer, maps, shading, recording: two pieces each at least";
    for (const int last : {1, all / 2, all}) {
        stage.gl->reset();
        pollCount = 0;
        setGlPoll([&] {
            if (++pollCount >= glm::max(last - 2, 1)) // pieces follow the clock
                throw Stop();
        });
        EXPECT_THROW(render(), Stop);
        setGlPoll({});
        const FrameResult again = render();
        EXPECT_EQ(again.visibility, whole.visibility);
        EXPECT_EQ(again.color, whole.color);
    }
}

/// Without what drivers keep of programs from earlier runs, where EGL starts with this test.
class FrameGlUncached : public NeedsGl {
protected:
    void SetUp() override {
        setenv("MESA_SHADER_CACHE_DISABLE", "true", 1);
        setenv("__GL_SHADER_DISK_CACHE", "0", 1);
        NeedsGl::SetUp();
    }
};

// Drivers compile when programs are first used: that is over before the first frame, or calibration
// would take it for what a method costs. The first renderer's alone: later ones may find compiled
// what it was. Counted is processor time, which other programs do not lengthen.
TEST_F(FrameGlUncached, TheFirstFrameIsAsFastAsLaterOnes) {
    FrameOptions options = smallFrame();
    options.width = 32;
    options.height = 18;
    options.maxFaceTexels = 64;
    for (const char* model : {"texels:inf", "texels:0"}) {
        GlStage stage("fail-silhouette");
        const auto ms = [&] {
            stage.gl->reset();
            const std::clock_t start = std::clock();
            GlStage::render(*stage.gl, stage.world, model, options);
            return 1e3 * double(std::clock() - start) / CLOCKS_PER_SEC;
        };
        const double first = ms();
        double later = 0;
        for (int frame = 0; frame < 9; ++frame)
            later = std::max(later, ms());
        EXPECT_LT(first, 3.0 * later) << model;
        RecordProperty(std::string("first ms ") + model, std::to_string(first));
        RecordProperty(std::string("later ms ") + model, std::to_string(later));
    }
}

// A frame's copies are those to and from OpenGL: of the passes on the processor there are none.
TEST_F(FrameGl, HostCopiesAreCounted) {
    GlStage stage("fail-silhouette");
    FrameOptions options = smallFrame();
    options.recordPairs = false;
    FrameResult frame;
    for (int i = 0; i < 3; ++i)
        frame = GlStage::render(*stage.gl, stage.world, "texels:inf", options);
    // Up: commands of the g-buffer; samples, lights, materials, starts and lights of clusters.
    EXPECT_EQ(frame.counts.hostCopies.uploadCount, 6u);
    EXPECT_EQ(frame.counts.hostCopies.readbackCount, 3u); // seen triangles, colours, counts
}

// Renderers may go while another thread has their context: nothing is thrown from destructors.
TEST_F(FrameGl, CanBeDestroyedWhileAnotherThreadHasItsContext) {
    GlStage stage("fail-silhouette");
    auto scene = std::make_unique<GlScene>(stage.world.triangles(), View<const uint32_t>{},
                                           stage.dag.view());
    auto frame = std::make_unique<GlFrame>(*scene);
    std::promise<void> isTaken, mayGo;
    std::thread other([&] {
        const auto current = frame->makeCurrent();
        isTaken.set_value();
        mayGo.get_future().wait();
    });
    isTaken.get_future().wait();
    frame.reset();
    mayGo.set_value();
    other.join();
    scene.reset();
    EXPECT_NO_THROW(GlStage::render(*stage.gl, stage.world, "texels:96", smallFrame()));
}

TEST_F(FrameGl, PicturesThatTheDeviceDoesNotDrawAreRefused) {
    GlStage stage("fail-silhouette");
    FrameOptions options = smallFrame();
    options.height = uint32_t(glDeviceInfo().maxViewport) + 1;
    options.width = 1;
    try {
        GlStage::render(*stage.gl, stage.world, "texels:96", options);
        FAIL() << "drawn";
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kUsage);
        EXPECT_THAT(error.what(),
                    HasSubstr("draws " + std::to_string(glDeviceInfo().maxViewport) + " per side"));
    }
}

TEST_F(FrameGl, UnsupportedOptionsAreRefusedWithAnAlternative) {
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
                 polygons = smallFrame(), retained = smallFrame();
    retained.maps.useStaticOptimization = retained.maps.retainsPages = true;
    exact.rays.believe = 0.0f;
    level.rays.level = 1;
    footprint.rays.lod = LodRule::kFootprint;
    polygons.maps.lodTexels = 1.0f;
    EXPECT_THAT(refusal(exact), HasSubstr("--believe all"));
    EXPECT_THAT(refusal(level), HasSubstr("level 0"));
    EXPECT_THAT(refusal(footprint), HasSubstr("level of detail"));
    EXPECT_THAT(refusal(polygons), HasSubstr("polygon levels"));
    EXPECT_THAT(refusal(retained), HasSubstr("keeps none that no map requests"));
    EXPECT_EQ(refusal(smallFrame()), "");
}

TEST(GlOptions, RaysThatBelieveSomeVoxelsOnlyAreRefused) {
    FrameOptions options;
    EXPECT_EQ(unfollowedByGl(options), "");
    options.rays.believe = 2.0f;
    EXPECT_THAT(unfollowedByGl(options), HasSubstr("--believe all"));
    options = {};
    options.pruning = PairPruning::kLit; // the proofs are of the wide DAG, which it does not build
    EXPECT_THAT(unfollowedByGl(options), HasSubstr("proofs of light"));
}

} // namespace
} // namespace shadowdag::test
