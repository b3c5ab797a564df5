// SPDX-License-Identifier: Apache-2.0
// Rays of Embree as a method of the frame: known umbras, brute force in double, and frames that
// differ from exact rays at outlines alone.
#include "hybrid/rays/embree_scene.h"

#include "cuda/backend.h"
#include "hybrid/rays/truth_ray.h"
#include "tests/hybrid/fail_stage.h"
#include "tests/hybrid/random.h"
#include "tests/hybrid/triangle_soup.h"
#include "voxel/dag_stream.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

namespace shadowdag::test {
namespace {

constexpr uint64_t kSeed = 20261125;

std::vector<uint32_t> countTo(size_t count) {
    std::vector<uint32_t> all(count);
    std::iota(all.begin(), all.end(), 0u);
    return all;
}

std::vector<uint8_t> traced(const EmbreeScene& scene, const Light& light,
                            const std::vector<glm::vec3>& positions, const glm::vec3& normal) {
    const std::vector<glm::vec3> normals(positions.size(), normal);
    const std::vector<uint32_t> which = countTo(positions.size());
    std::vector<uint8_t> blocked(positions.size(), 7);
    scene.trace(light, viewOf(positions), viewOf(normals), viewOf(which), viewOf(blocked));
    return blocked;
}

// Packets of 16 are slower than packets of 8 where Embree has no vectors for them.
TEST(EmbreeScene, PacketsAreNoWiderThanTheProcessorsVectors) {
    TriangleSoup soup;
    soup.addLevelSquare({0, 0, 0}, 1.0f);
    const std::vector<uint32_t> all = countTo(soup.triangles.size());
    const uint32_t width = EmbreeScene(soup.view(), viewOf(all)).packetWidth();
    EXPECT_TRUE(width == 8 || (width == 16 && hasStreamIsa(StreamIsa::kAvx512))) << width;
}

// A square of half a metre, half way between a light and a floor, has an umbra of twice its size;
// light from straight above has one of its size.
TEST(EmbreeScene, UmbrasOfASquareAreKnown) {
    TriangleSoup soup;
    soup.addLevelSquare({0, 0, 0}, 20.0f);
    soup.addLevelSquare({0, 2, 0}, 0.5f);
    const std::vector<uint32_t> all = countTo(soup.triangles.size());
    const EmbreeScene scene(soup.view(), viewOf(all));
    Light point;
    point.positionWorld = {0, 4, 0};
    Light straight;
    straight.kind = Light::kSun;
    straight.directionWorld = {0, -1, 0};
    straight.directionalDistanceWorld = 64.0f;
    std::vector<glm::vec3> positions;
    for (int i = -60; i < 61; ++i) // no multiple of a packet's 16
        for (int j = -60; j < 61; ++j)
            positions.emplace_back(0.025f * (float(i) + 0.37f), 0.0f, 0.025f * (float(j) + 0.41f));
    for (const auto& [light, half] : {std::pair{point, 1.0f}, std::pair{straight, 0.5f}}) {
        const std::vector<uint8_t> blocked = traced(scene, light, positions, {0, 1, 0});
        for (size_t i = 0; i < positions.size(); ++i) {
            const glm::vec3& p = positions[i];
            ASSERT_EQ(blocked[i], std::fabs(p.x) < half && std::fabs(p.z) < half)
                << p.x << " " << p.z << " of " << half;
        }
    }
    EXPECT_GT(scene.bytes(), soup.positions.size() * 16);
}

// Only the listed triangles block.
TEST(EmbreeScene, TrianglesThatAreNotListedDoNotBlock) {
    TriangleSoup soup;
    const uint32_t left = soup.add({-1, 1, -1}, {-1, 1, 1}, {0, 1, 0});
    soup.add({1, 1, -1}, {1, 1, 1}, {0, 1, 0});
    const std::vector<uint32_t> one{left};
    const EmbreeScene scene(soup.view(), viewOf(one));
    Light light;
    light.positionWorld = {0, 100, 0};
    EXPECT_EQ(traced(scene, light, {{-0.6f, 0, 0}, {0.6f, 0, 0}}, {0, 1, 0}),
              (std::vector<uint8_t>{1, 0}));
}

// Rays that pass every edge and end at a distance are decided as in double.
TEST(EmbreeScene, AgreesWithBruteForceAwayFromEdges) {
    RecordProperty("seed", std::to_string(kSeed));
    Random random(kSeed);
    TriangleSoup soup;
    for (int i = 0; i < 60; ++i) {
        const glm::vec3 center = random.inCube(4.0f);
        const glm::vec3 a = random.inCube(1), b = random.inCube(1), c = random.inCube(1);
        soup.add(center + a, center + b, center + c);
    }
    const std::vector<uint32_t> all = countTo(soup.triangles.size());
    const EmbreeScene scene(soup.view(), viewOf(all));
    const TruthSpace space = truthSpaceOf(viewOf(soup.positions));
    const TruthGeometry geometry{soup.view(), space.origin, space.diagonal};
    size_t decided = 0, dark = 0;
    for (int l = 0; l < 20; ++l) {
        Light light;
        light.positionWorld = random.inCube(6.0f);
        std::vector<glm::vec3> positions;
        for (int i = 0; i < 333; ++i)
            positions.push_back(random.inCube(6.0f));
        const std::vector<uint8_t> blocked = traced(scene, light, positions, {0, 1, 0});
        for (size_t i = 0; i < positions.size(); ++i) {
            // Nudged rays around it: where all agree in double, no edge or end is near.
            int votes = 0, asked = 0;
            for (const float nudge : {-1e-3f, 0.0f, 1e-3f})
                for (int axis = 0; axis < 3; ++axis) {
                    glm::vec3 from = positions[i];
                    from[axis] += nudge;
                    TruthRay ray;
                    ray.startLocal = glm::vec3(glm::dvec3(from) - space.origin);
                    ray.direction = glm::vec3(glm::dvec3(light.positionWorld) - glm::dvec3(from));
                    const bool isDark = std::any_of(all.begin(), all.end(), [&](uint32_t t) {
                        return blocksTruthRay(geometry, ray, t);
                    });
                    votes += isDark;
                    ++asked;
                }
            if (votes != 0 && votes != asked)
                continue;
            ++decided;
            dark += votes > 0;
            ASSERT_EQ(blocked[i], votes > 0) << "light " << l << ", sample " << i;
        }
    }
    EXPECT_GT(decided, 5000u);
    EXPECT_GT(dark, 500u);
}

TEST(EmbreeScene, LiftsByTheLargestCoordinateOfTheSampleAndItsWay) {
    const float share = 0x1p-18f;
    EXPECT_EQ(liftedSample({2, -1, 0}, {1, 0, 0}, {}), glm::vec3(2 + 2 * share, -1, 0));
    EXPECT_EQ(liftedSample({1, -4, 0}, {0, -1, 0}, {1, 2, 3}), glm::vec3(1, -4 - 4 * share, 0));
    EXPECT_EQ(liftedSample({1, -1, 0}, {0, 0, 1}, {1, -64, 3}), glm::vec3(1, -1, 64 * share));
}

// A floor whose height is near 0, and turned so that its triangles are not level in any frame of
// floats, is lit by a light that is far away: rays end there with the rounding of their whole way.
TEST(EmbreeScene, AFarLightLeavesNoAcneOnAFloorNearTheOrigin) {
    TriangleSoup soup;
    const auto heightAt = [](float x, float z) { return 0.01f + 1e-3f * x - 7e-4f * z; };
    const auto corner = [&](float x, float z) { return glm::vec3(x, heightAt(x, z), z); };
    soup.add(corner(-1000, -900), corner(-900, 1100), corner(1200, 1000));
    soup.add(corner(-1000, -900), corner(1200, 1000), corner(1000, -1100));
    const std::vector<uint32_t> all = countTo(soup.triangles.size());
    const EmbreeScene scene(soup.view(), viewOf(all));
    const glm::vec3 normal = glm::normalize(glm::vec3(-1e-3f, 1.0f, 7e-4f));
    std::vector<glm::vec3> positions;
    for (int i = -20; i <= 20; ++i)
        for (int j = -20; j <= 20; ++j)
            positions.push_back(corner(0.37f * float(i), 0.41f * float(j)));
    for (const float height : {10.0f, 100.0f, 1000.0f, 10000.0f}) {
        Light light;
        light.positionWorld = {0.3f * height, height, -0.2f * height};
        const std::vector<uint8_t> blocked = traced(scene, light, positions, normal);
        EXPECT_EQ(std::accumulate(blocked.begin(), blocked.end(), 0), 0) << height;
    }
}

FrameOptions embreeFrame() {
    FrameOptions options = failFrame();
    options.rays.believe = 0.0f;
    options.rays.triangleRays = TriangleRays::kEmbree;
    return options;
}

// Holes are cut out and moving triangles asked: nearly all answers are those of exact rays.
TEST(EmbreeFrames, DifferFromExactRaysAtOutlinesAlone) {
    FailStage stage(failSceneOf("fail-alpha"), 7, 2.0f);
    const FailOutcome embree = stage.run("texels:inf", embreeFrame());
    EXPECT_GT(embree.frame.counts.moverTestCount, 0u);
    EXPECT_EQ(embree.frame.counts.rayCount, embree.report.total.pairCount);
    EXPECT_EQ(embree.frame.counts.drawnMapCount, 0u);
    EXPECT_LT(embree.falseShadowPercent() + embree.falseLightPercent(), 0.1);
    EXPECT_GT(stage.renderer->embreeBytes(), 0u);
}

TEST(EmbreeFrames, AreTheSameByAnyNumberOfThreads) {
    FailStage stage(failSceneOf("fail-alpha"), 7);
    setThreadCount(1);
    const FailOutcome one = stage.run("texels:inf", embreeFrame());
    setThreadCount(3);
    const FailOutcome three = stage.run("texels:inf", embreeFrame());
    setThreadCount(0);
    EXPECT_EQ(one.frame.visibility, three.frame.visibility);
    EXPECT_EQ(one.frame.color, three.frame.color);
}

TEST(EmbreeFrames, BelieveNoVoxel) {
    FailStage stage(failSceneOf("fail-silhouette"), 7);
    FrameOptions options = embreeFrame();
    options.rays.believe = 2.0f;
    EXPECT_THROW(stage.run("texels:inf", options), Error);
}

} // namespace
} // namespace shadowdag::test
