// SPDX-License-Identifier: Apache-2.0
// Frames whose maps are drawn at a polygon level of detail.
#include "hybrid/frame.h"
#include "hybrid/judge/error.h"
#include "scenes/builtin.h"

#include <gtest/gtest.h>

#include <cmath>

namespace shadowdag::test {
namespace {

/// A floor, eight spheres of 4512 triangles over it, one of which moves, and a lamp above.
Scene spheresOverFloor() {
    constexpr double kPi = 3.14159265358979323846;
    constexpr uint32_t kSectors = 48;
    Scene scene;
    scene.materials.emplace_back();
    scene.meshes.resize(2);
    scene.meshes[0].positions = {{-8, 0, -8}, {-8, 0, 8}, {8, 0, 8}, {8, 0, -8}};
    scene.meshes[0].triangles = {{0, 1, 2}, {0, 2, 3}};
    Mesh& sphere = scene.meshes[1];
    for (uint32_t j = 0; j <= kSectors; ++j)
        for (uint32_t i = 0; i < kSectors; ++i) {
            const double a = 2 * kPi * i / kSectors, b = kPi * j / kSectors;
            sphere.positions.push_back({float(std::sin(b) * std::cos(a)), float(std::cos(b)),
                                        float(std::sin(b) * std::sin(a))});
        }
    for (uint32_t j = 0; j < kSectors; ++j)
        for (uint32_t i = 0; i < kSectors; ++i) {
            const uint32_t p = j * kSectors + i, q = j * kSectors + (i + 1) % kSectors;
            if (j > 0)
                sphere.triangles.push_back({p, p + kSectors, q});
            if (j + 1 < kSectors)
                sphere.triangles.push_back({q, p + kSectors, q + kSectors});
        }
    for (Mesh& mesh : scene.meshes)
        mesh.triangleMaterial.assign(mesh.triangles.size(), 0);
    scene.nodes.resize(10);
    scene.nodes[0].mesh = 0;
    for (int i = 1; i < 9; ++i) {
        scene.nodes[size_t(i)].mesh = 1;
        scene.nodes[size_t(i)].local.translation = {float(2 * (i % 4) - 3), 1.0f,
                                                    i < 5 ? -2.0f : 2.0f};
        scene.nodes[size_t(i)].local.scale = glm::vec3(0.7f);
    }
    scene.lights.resize(1);
    scene.lights[0].rangeWorld = 12.0f;
    scene.lights[0].intensity = 30.0f;
    scene.nodes[9].light = 0;
    scene.nodes[9].local.translation = {0.2f, 5.0f, 0.1f};
    for (int i = 0; i < 10; ++i)
        scene.roots.push_back(i);
    scene.animations.resize(1);
    scene.animations[0].channels.resize(1);
    AnimationChannel& channel = scene.animations[0].channels[0];
    channel.node = 8;
    channel.times = {0, 1};
    const glm::vec4 from(scene.nodes[8].local.translation, 0);
    channel.values = {from, from + glm::vec4(0, 2, 3, 0)};
    return scene;
}

Camera cameraAbove() {
    Camera camera;
    camera.positionWorld = {0.3f, 7.0f, 7.0f};
    camera.forward = glm::normalize(glm::vec3(-0.05f, -1.0f, -1.0f));
    camera.up =
        glm::normalize(glm::cross(glm::cross(camera.forward, glm::vec3(0, 1, 0)), camera.forward));
    return camera;
}

FrameOptions optionsAt(float lodTexels) {
    FrameOptions options;
    options.width = 320;
    options.height = 200;
    options.maps.lodTexels = lodTexels;
    return options;
}

TEST(PolygonLodFrame, TrianglesDrawnFallToAThirdAtOneTexelWithoutAcneAndFewErrors) {
    const Scene scene = spheresOverFloor();
    const World world(scene, {});
    const Dag none;
    FrameRenderer renderer(Backend::kCpu, world, none);
    const Truth truth(world);
    const auto allMaps = makeCostModel("texels:0");
    uint64_t triangles[2];
    ErrorCounts errors[2];
    for (const int i : {0, 1}) {
        const FrameOptions options = optionsAt(float(i));
        const FrameResult frame = renderer.render(cameraAbove(), *allMaps, options);
        triangles[i] = frame.counts.maps.triangleDrawCount;
        ErrorOptions errorOptions;
        errorOptions.nullSampleCount = 0;
        errorOptions.bias = options.bias;
        errors[i] = computeError(renderer, frame, world, truth,
                                 truth.visibility(renderer.gbuffer(), world.lights(), frame.pairs),
                                 errorOptions)
                        .total;
    }
    EXPECT_LE(3 * triangles[1], triangles[0]); // measured: 38600 to 10040
    EXPECT_GT(triangles[1], 0u);
    // Measured of 50687 pairs: 39 false shadows become 17, 61 false lights 130.
    EXPECT_EQ(errors[1].acneCount, 0u);
    EXPECT_LE(errors[1].falseShadowCount, errors[0].falseShadowCount + errors[0].pairCount / 500);
    EXPECT_LE(errors[1].falseLightCount, errors[0].falseLightCount + errors[0].pairCount / 500);
}

TEST(PolygonLodFrame, RoutingUsesTheTrianglesThatWouldBeDrawn) {
    const Scene scene = spheresOverFloor();
    const World world(scene, {});
    const Dag none;
    FrameRenderer renderer(Backend::kCpu, world, none);
    const auto allMaps = makeCostModel("texels:0");
    uint64_t full = 0;
    for (const float texels : {0.0f, 1.0f, 4.0f}) {
        SCOPED_TRACE(texels);
        FrameOptions options = optionsAt(texels);
        options.maps.culling = MapCulling::kSphere; // all that is reached, into six faces
        options.maps.useStaticOptimization = false; // which draws into what needs drawing alone
        const FrameResult frame = renderer.render(cameraAbove(), *allMaps, options);
        uint64_t triangles = 0, batches = 0;
        for (const MapRecord& map : frame.maps) {
            triangles += uint64_t(map.quantities.triangles);
            batches += uint64_t(map.quantities.batches);
        }
        EXPECT_EQ(kFaceCount * triangles, frame.counts.maps.triangleDrawCount);
        EXPECT_EQ(kFaceCount * batches, frame.counts.maps.batchFaceCount);
        if (texels == 0.0f)
            full = triangles;
        else
            EXPECT_LT(triangles, full);
    }
}

TEST(PolygonLodFrame, UpdatesEqualARebuildWithAndWithoutKeptMaps) {
    const Scene scene = spheresOverFloor();
    World world(scene, {});
    const Dag none;
    const auto allMaps = makeCostModel("texels:0");
    for (const bool keeps : {false, true}) {
        SCOPED_TRACE(keeps);
        FrameOptions options = optionsAt(1.0f);
        options.maps.useStaticOptimization = keeps;
        world.setTime(0);
        FrameRenderer renderer(Backend::kCpu, world, none);
        FrameResult last;
        for (const float time : {0.0f, 0.3f, 0.6f, 1.0f, 1.5f}) {
            renderer.worldChanged(world.setTime(time));
            last = renderer.render(cameraAbove(), *allMaps, options);
            FrameRenderer anew(Backend::kCpu, world, none);
            FrameOptions plain = optionsAt(1.0f);
            plain.maps.useStaticOptimization = false;
            EXPECT_EQ(last.visibility, anew.render(cameraAbove(), *allMaps, plain).visibility);
        }
    }
}

TEST(PolygonLodFrame, BatchesOfAnySizeGiveTheSameVisibility) {
    const Scene scene = spheresOverFloor();
    const World world(scene, {});
    const Dag none;
    const auto allMaps = makeCostModel("texels:0");
    std::vector<uint8_t> expected;
    uint64_t batchFaces = ~0ull;
    for (const uint32_t size : {32u, 128u, 512u}) {
        FrameRenderer renderer(Backend::kCpu, world, none, {size, BatchCut::kFull});
        for (const bool isAtomic : {false, true}) {
            FrameOptions options = optionsAt(0.0f);
            options.maps.useAtomicRasterizer = isAtomic;
            const FrameResult frame = renderer.render(cameraAbove(), *allMaps, options);
            if (expected.empty())
                expected = frame.visibility;
            EXPECT_EQ(frame.visibility, expected) << size;
            if (!isAtomic) {
                EXPECT_LT(frame.counts.maps.batchFaceCount, batchFaces);
                batchFaces = frame.counts.maps.batchFaceCount;
            }
        }
    }
}

} // namespace
} // namespace shadowdag::test
