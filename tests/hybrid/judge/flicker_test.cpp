// SPDX-License-Identifier: Apache-2.0
// Flicker in constructed cases: static cameras, changes of resolution and of method, and changes in
// Embree itself.
#include "hybrid/judge/flicker.h"

#include "tests/hybrid/triangle_soup.h"
#include "voxel/voxelize.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

namespace shadowdag::test {
namespace {

using testing::HasSubstr;

// A floor, a square and a cloud of triangles above it, two lights.
Scene cloudScene() {
    TriangleSoup soup;
    soup.addLevelSquare({0, 0, 0}, 6.0f);
    soup.addLevelSquare({0, 1, 0}, 0.5f);
    std::mt19937_64 random(7);
    std::uniform_real_distribution<float> unit(-1.0f, 1.0f);
    for (int i = 0; i < 200; ++i) {
        const glm::vec3 c(3 * unit(random), 1.2f + 0.6f * unit(random), 3 * unit(random));
        glm::vec3 corner[3];
        for (glm::vec3& p : corner)
            p = c + 0.3f * glm::vec3(unit(random), unit(random), unit(random));
        soup.add(corner[0], corner[1], corner[2]);
    }
    Scene scene;
    scene.materials.resize(1);
    scene.meshes = {soup.mesh()};
    scene.nodes.resize(3);
    scene.nodes[0].mesh = 0;
    scene.roots = {0, 1, 2};
    scene.lights.resize(1);
    scene.lights[0].rangeWorld = 9.0f;
    scene.lights[0].intensity = 10.0f;
    for (int l = 0; l < 2; ++l) {
        scene.nodes[1 + l].light = 0;
        scene.nodes[1 + l].local.translation = {l == 0 ? -1.0f : 2.0f, 3.0f, 0.5f};
    }
    return scene;
}

Camera cameraAt(float x) {
    Camera camera;
    camera.positionWorld = {x, 4.0f, 5.0f};
    camera.forward = glm::normalize(glm::vec3(0.0f, -0.75f, -1.0f));
    camera.up =
        glm::normalize(glm::cross(glm::cross(camera.forward, glm::vec3(0, 1, 0)), camera.forward));
    return camera;
}

struct Stage {
    explicit Stage(Scene s = cloudScene())
        : scene(std::move(s)), world(scene, {}),
          dag(voxelize(world.triangles(), viewOf(world.staticTriangles()),
                       gridAround(world.boundsWorld(), 7))),
          renderer(Backend::kCpu, world, dag), truth(world), meter(truth, 1, 3000) {
        options.width = 160;
        options.height = 96;
        options.maps.poolBytes = 64ull << 20;
    }

    FlickerCounts show(const Camera& camera, const char* model, float undersample = 1) {
        options.undersample = undersample;
        renderer.reset();
        const FrameResult frame = renderer.render(camera, *makeCostModel(model), options);
        return add(camera, frame);
    }

    FlickerCounts add(const Camera& camera, const FrameResult& frame) {
        return add(camera, frame, renderer.shadowMaps());
    }

    FlickerCounts add(const Camera& camera, const FrameResult& frame, const ShadowMapView& maps) {
        const ErrorInputs inputs{
            renderer.gbuffer(),     world.triangles(),
            viewOf(world.lights()), frame.pairs,
            frame.visibility,       frame.pairRoute,
            frame.pairServer,       {renderer.rayInputs(options.rays), maps, options.bias}};
        return meter.add({inputs, camera});
    }

    Scene scene;
    World world;
    Dag dag;
    FrameRenderer renderer;
    Truth truth;
    FlickerMeter meter;
    FrameOptions options;
};

TEST(Flicker, TheFirstFrameHasNoPredecessor) {
    Stage stage;
    const FlickerCounts counts = stage.show(cameraAt(0), "texels:0");
    EXPECT_EQ(counts.pointCount, 0u);
    EXPECT_EQ(counts.total().answerCount, 0u);
}

TEST(Flicker, AStaticCameraHasNoneByAnyMethod) {
    for (const char* model : {"texels:0", "texels:inf", "texels:96"}) {
        Stage stage;
        stage.show(cameraAt(0), model);
        for (int frame = 0; frame < 2; ++frame) {
            const FlickerCounts counts = stage.show(cameraAt(0), model);
            EXPECT_EQ(counts.pointCount, 3000u) << model;
            EXPECT_GT(counts.of(FlickerChange::kHeld).answerCount, 3000u) << model;
            EXPECT_EQ(counts.total().flickerCount, 0u) << model;
            EXPECT_EQ(counts.missingResultCount, 0u) << model;
            EXPECT_EQ(counts.missingTapCount, 0u) << model;
            EXPECT_EQ(counts.truthChangeCount, 0u) << model;
        }
    }
}

// Rays of Embree are asked again by Embree, with its movers, not through voxels. At an edge an
// answer may depend on the packet.
TEST(Flicker, AStaticCameraHasNoneByRaysOfEmbree) {
    Stage stage;
    stage.options.rays.believe = 0.0f;
    stage.options.rays.triangleRays = TriangleRays::kEmbree;
    stage.show(cameraAt(0), "texels:inf");
    const FlickerCounts counts = stage.show(cameraAt(0), "texels:inf");
    EXPECT_GT(counts.of(FlickerChange::kHeld).answerCount, 3000u);
    EXPECT_LE(counts.total().flickerCount, 1u);
}

TEST(Flicker, AChangeOfResolutionIsCountedAsOneAndClassified) {
    Stage stage;
    stage.show(cameraAt(0), "texels:0");
    const FlickerCounts counts = stage.show(cameraAt(0), "texels:0", 8);
    const FlickerCounts::Class& of = counts.of(FlickerChange::kResolutionSwitch);
    EXPECT_EQ(of.answerCount, counts.total().answerCount);
    EXPECT_GT(of.flickerCount, 10u);
    EXPECT_LT(of.flickerCount, of.answerCount / 5);
    EXPECT_GT(of.magnifiedCount, 10u) << "texels are eight times as wide as pixels";
    EXPECT_GE(of.explainedCount + of.contactCount + of.acneCount + of.magnifiedCount,
              of.flickerCount * 9 / 10);
    EXPECT_EQ(counts.of(FlickerChange::kHeld).answerCount, 0u);
}

TEST(Flicker, AChangeOfMethodIsCountedAsOne) {
    Stage stage;
    stage.show(cameraAt(0), "texels:0");
    const FlickerCounts counts = stage.show(cameraAt(0), "texels:inf");
    const FlickerCounts::Class& of = counts.of(FlickerChange::kMethodSwitch);
    EXPECT_EQ(of.answerCount, counts.total().answerCount);
    EXPECT_GT(of.flickerCount, 10u);
}

TEST(Flicker, RaysDoNotFlickerWhileTheCameraMoves) {
    // Where a ray starts and ends does not depend on the view: no answer may change.
    Stage stage;
    stage.show(cameraAt(0), "texels:inf");
    const FlickerCounts counts = stage.show(cameraAt(0.1f), "texels:inf");
    EXPECT_EQ(counts.pointCount, 3000u);
    EXPECT_GT(counts.of(FlickerChange::kHeld).answerCount, 2000u);
    EXPECT_EQ(counts.total().flickerCount, 0u);
}

TEST(Flicker, MapsOfConstantResolutionDoNotFlickerWhileTheCameraMoves) {
    // Their texels stand still in the world.
    Stage stage;
    stage.options.maxFaceTexels = stage.options.minFaceTexels = 256;
    stage.show(cameraAt(0), "texels:0");
    const FlickerCounts counts = stage.show(cameraAt(0.1f), "texels:0");
    EXPECT_GT(counts.of(FlickerChange::kHeld).answerCount, 2000u);
    EXPECT_EQ(counts.of(FlickerChange::kHeld).flickerCount, 0u);
    EXPECT_LE(counts.missingResultCount + counts.missingTapCount, counts.total().answerCount / 100);
}

TEST(Flicker, InvertedResultsAreCountedOnceAndNotAllExplained) {
    Stage stage;
    const Camera camera = cameraAt(0);
    stage.show(camera, "texels:inf");
    stage.renderer.reset();
    FrameResult frame = stage.renderer.render(camera, *makeCostModel("texels:inf"), stage.options);
    const FlickerCounts before = stage.add(camera, frame);
    ASSERT_EQ(before.total().flickerCount, 0u);
    // A frame that shows the reverse of everything; the next shows the right answers again.
    for (uint8_t& visibility : frame.visibility)
        visibility = uint8_t(kLit - visibility);
    stage.add(camera, frame);
    const FlickerCounts counts = stage.show(camera, "texels:inf");
    EXPECT_EQ(counts.total().flickerCount, counts.total().answerCount);
    // Among so many triangles a shift of a few voxels of a 7-level DAG turns about half of all
    // answers over; the other half nothing explains.
    EXPECT_LT(counts.total().explainedCount, counts.total().flickerCount * 3 / 4);
}

TEST(Flicker, PointsThatLeaveTheViewAreNotFollowed) {
    Stage stage;
    stage.show(cameraAt(0), "texels:inf");
    Camera away = cameraAt(0);
    away.forward = {0, 1, 0};
    away.up = {0, 0, 1};
    EXPECT_EQ(stage.show(away, "texels:inf").pointCount, 0u);
    stage.show(cameraAt(0), "texels:inf");
    stage.meter.forget();
    EXPECT_EQ(stage.show(cameraAt(0), "texels:inf").pointCount, 0u);
}

TEST(Flicker, MovingPointsAreFollowedAndChangesInEmbreeAreIgnored) {
    Scene scene = cloudScene();
    // The cloud's mesh slides over the floor beneath it: every shadow on the floor moves.
    Mesh floor;
    floor.positions = {{-6, -1, -6}, {6, -1, -6}, {6, -1, 6}, {-6, -1, 6}};
    floor.triangles = {{0, 2, 1}, {0, 3, 2}};
    floor.triangleMaterial.assign(2, 0);
    scene.meshes.push_back(floor);
    scene.nodes.emplace_back().mesh = 1;
    scene.roots.push_back(3);
    AnimationChannel slide;
    slide.node = 0;
    slide.path = AnimationChannel::Path::kTranslation;
    slide.times = {0, 1};
    slide.values = {{0, 0, 0, 0}, {0.5f, 0, 0, 0}};
    scene.animations.push_back({"slide", {slide}});
    Stage stage(std::move(scene));
    stage.show(cameraAt(0), "texels:0");
    const std::vector<uint32_t> moved = stage.world.setTime(1.0f);
    ASSERT_EQ(moved.size(), 1u);
    stage.renderer.worldChanged(moved);
    stage.truth.update(stage.world);
    const FlickerCounts counts = stage.show(cameraAt(0), "texels:0");
    EXPECT_GT(counts.pointCount, 1000u);
    EXPECT_GT(counts.truthChangeCount, 20u);
    EXPECT_LT(counts.total().flickerCount, counts.total().answerCount / 20);
}

TEST(Flicker, ResultsWithoutASampleAndWithoutPagesAreCountedSeparately) {
    Stage stage;
    const Camera camera = cameraAt(0);
    stage.show(camera, "texels:0");
    const uint64_t answerCount = stage.show(camera, "texels:0").total().answerCount;
    ASSERT_GT(answerCount, 3000u);

    // The same frame without any page: every answer lacks taps, none lacks its sample.
    stage.show(camera, "texels:0");
    FrameResult frame = stage.renderer.render(camera, *makeCostModel("texels:0"), stage.options);
    ShadowMapView maps = stage.renderer.shadowMaps();
    const std::vector<uint32_t> noPages(maps.pageTable.count, kNoPage);
    maps.pageTable = viewOf(noPages);
    const FlickerCounts pageless = stage.add(camera, frame, maps);
    // Every frame draws other points, which have about as many answers.
    EXPECT_NEAR(double(pageless.missingTapCount), double(answerCount), 0.05 * double(answerCount));
    EXPECT_EQ(pageless.missingResultCount, 0u);
    EXPECT_EQ(pageless.total().answerCount, 0u);

    // The same frame without the pairs of light 1: those answers lack their sample, no taps.
    stage.show(camera, "texels:0");
    FrameResult halved;
    halved.pairs.sampleStart = {0};
    for (size_t s = 0; s + 1 < frame.pairs.sampleStart.size(); ++s) {
        for (uint64_t p = frame.pairs.sampleStart[s]; p < frame.pairs.sampleStart[s + 1]; ++p)
            if (frame.pairs.light[p] == 0) {
                halved.pairs.light.push_back(0);
                halved.visibility.push_back(frame.visibility[p]);
                halved.pairRoute.push_back(frame.pairRoute[p]);
                halved.pairServer.push_back(frame.pairServer[p]);
            }
        halved.pairs.sampleStart.push_back(halved.pairs.light.size());
    }
    const FlickerCounts lightless = stage.add(camera, halved);
    EXPECT_EQ(lightless.missingTapCount, 0u);
    EXPECT_GT(lightless.missingResultCount, 1000u);
    EXPECT_NEAR(double(lightless.missingResultCount + lightless.total().answerCount),
                double(answerCount), 0.05 * double(answerCount));
}

TEST(Flicker, FramesWithoutRecordedPairsAreRefused) {
    Stage stage;
    stage.options.recordPairs = true;
    FrameResult frame =
        stage.renderer.render(cameraAt(0), *makeCostModel("texels:0"), stage.options);
    frame.visibility.clear();
    try {
        stage.add(cameraAt(0), frame);
        FAIL() << "no error";
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kUsage);
        EXPECT_THAT(error.what(), HasSubstr("needs one visibility per pair"));
    }
}

} // namespace
} // namespace shadowdag::test
