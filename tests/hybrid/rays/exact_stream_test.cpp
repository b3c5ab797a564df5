// SPDX-License-Identifier: Apache-2.0
// Exact rays in packets: the answers of the truth's test of every triangle, one by one, for every
// instruction set, on triangles that rays pass at edges, corners and in their planes.
#include "hybrid/rays/exact_stream.h"

#include "hybrid/rays/exact_ray.h"
#include "tests/hybrid/rays/exact_stage.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

namespace shadowdag::test {
namespace {

constexpr uint64_t kSeed = 20261123;

Light directionalLight(const glm::vec3& direction, float distance) {
    Light light;
    light.kind = Light::kSun;
    light.directionWorld = glm::normalize(direction);
    light.directionalDistanceWorld = distance;
    light.rangeWorld = INFINITY;
    return light;
}

struct Outcome {
    uint64_t rayCount = 0, blockedCount = 0, confirmCount = 0;
};

/// Traces rays to the light from points of the triangles and compares them with every triangle.
/// @param weightsOf returns the weights of a triangle's corners at the i-th sample
template <class WeightsOf>
Outcome compareWithEveryTriangle(const ExactStage& stage, const Light& light, size_t count,
                                 Random& random, const WeightsOf& weightsOf) {
    std::vector<TruthStart> starts;
    std::vector<glm::vec3> positions;
    std::vector<uint8_t> expected;
    Outcome outcome;
    for (size_t i = 0; i < count; ++i) {
        const uint32_t triangle = random.below(stage.all.size());
        const TriangleView& t = stage.geometry.triangles;
        const glm::vec3 w = weightsOf();
        const glm::vec3 p =
            w.x * t.vertex(triangle, 0) + w.y * t.vertex(triangle, 1) + w.z * t.vertex(triangle, 2);
        glm::vec3 normal = stage.normalOf(triangle);
        if (!(glm::length(normal) > 0.0f))
            continue;
        const glm::vec3 at = pointAtLight(light, p);
        normal = glm::normalize(glm::dot(normal, at - p) < 0.0f ? -normal : normal);
        starts.push_back(
            makeTruthStart(stage.geometry, makeTruthTriangle(stage.geometry, triangle), p, normal));
        positions.push_back(p);
        const TruthRay ray = truthPairRay(stage.geometry, p, normal, triangle, at);
        const bool isBlockedAlone = isBlockedExactly({stage.geometry, stage.bvh.view()}, ray);
        bool isBlocked = false;
        for (const uint32_t other : stage.all)
            isBlocked =
                isBlocked || (ray.tFar > 0.0f && blocksTruthRay(stage.geometry, ray, other));
        EXPECT_EQ(isBlockedAlone, isBlocked) << "ray " << i << " by itself";
        expected.push_back(isBlocked);
        outcome.blockedCount += isBlocked;
    }
    outcome.rayCount = starts.size();
    std::vector<uint32_t> which(starts.size());
    std::iota(which.begin(), which.end(), 0u);
    for (const StreamIsa isa : {StreamIsa::kPortable, StreamIsa::kAvx2, StreamIsa::kAvx512}) {
        if (!hasStreamIsa(isa))
            continue;
        SCOPED_TRACE(streamIsaName(isa));
        ExactStream stream(stage.geometry, stage.bvh.view(), isa);
        std::vector<uint8_t> blocked(starts.size(), 7);
        stream.trace(light, viewOf(starts), viewOf(positions), viewOf(which), viewOf(blocked));
        for (size_t i = 0; i < starts.size(); ++i)
            EXPECT_EQ(blocked[i], expected[i]) << "ray " << i;
        outcome.confirmCount = stream.confirmCount();
    }
    return outcome;
}

TEST(ExactStream, BlocksWhatATestOfEveryTriangleBlocks) {
    RecordProperty("seed", std::to_string(kSeed));
    Random random(kSeed);
    for (const glm::vec3 around :
         {glm::vec3(0), glm::vec3(3, 0, -2), glm::vec3(1e5f, -2e5f, 3e4f)}) {
        ExactStage stage;
        addClump(stage, random, around);
        stage.build();
        Outcome total;
        for (int l = 0; l < 12; ++l) {
            const Light light = l % 3 == 2 ? directionalLight(random.inCube(1), 1 << 20)
                                           : pointLight(random.inCube(l % 3 ? 5 : 0.5) + around);
            const Outcome o = compareWithEveryTriangle(stage, light, 400, random,
                                                       [&] { return insideWeights(random); });
            total.rayCount += o.rayCount;
            total.blockedCount += o.blockedCount;
            total.confirmCount += o.confirmCount;
        }
        EXPECT_GT(total.blockedCount, total.rayCount / 10);
        EXPECT_LT(total.blockedCount, total.rayCount * 19 / 20);
        if (around.x < 10.0f) { // else rounding is as large as the triangles
            EXPECT_LT(total.confirmCount, total.rayCount / 5);
        }
    }
}

// The rounding of a light's place far beside the scene is no reason to confirm every triangle.
TEST(ExactStream, FarLightsAreTracedWithoutConfirmingEveryTriangle) {
    RecordProperty("seed", std::to_string(kSeed));
    Random random(kSeed);
    ExactStage stage;
    addClump(stage, random, glm::vec3(0));
    stage.build();
    for (const float distance : {1e3f, 1e4f, 1e6f, 1e8f}) {
        SCOPED_TRACE(distance);
        const Light light = pointLight(distance * glm::normalize(glm::vec3(1, 2, 0.5f)));
        const Outcome o = compareWithEveryTriangle(stage, light, 400, random,
                                                   [&] { return insideWeights(random); });
        EXPECT_GT(o.blockedCount, o.rayCount / 10);
        EXPECT_LT(o.confirmCount, 3 * o.rayCount);
    }
}

// Triangles that are points share leaves with blockers and stand before them.
TEST(ExactStream, PointsInALeafHideNoTriangle) {
    RecordProperty("seed", std::to_string(kSeed));
    Random random(kSeed);
    ExactStage stage;
    for (int i = 0; i < 60; ++i) {
        const glm::vec3 at = random.inCube(2);
        stage.soup.add(at, at, at);
        stage.soup.add(at, at + random.inCube(1), at + random.inCube(1));
    }
    stage.build();
    uint64_t blockedCount = 0;
    for (int l = 0; l < 10; ++l)
        blockedCount +=
            compareWithEveryTriangle(stage, pointLight(random.inCube(3)), 400, random, [&] {
                return insideWeights(random);
            }).blockedCount;
    EXPECT_GT(blockedCount, 100u);
}

// Boxes on a lattice, lights and samples at its points: rays run along faces, through edges and
// corners, and start at them.
TEST(ExactStream, RaysThroughEdgesCornersAndFacesAreDecidedAsOneByOne) {
    RecordProperty("seed", std::to_string(kSeed));
    Random random(kSeed);
    ExactStage stage;
    stage.soup.addLevelSquare(glm::vec3(0, -1, 0), 6);
    for (int x = -2; x <= 2; ++x)
        for (int y = 0; y <= 2; ++y)
            for (int z = -2; z <= 2; ++z)
                if ((x + y + z) % 2 == 0)
                    stage.soup.addBox(glm::vec3(x, y, z) - 0.25f, glm::vec3(x, y, z) + 0.25f);
    stage.build();
    const glm::vec3 weights[] = {{1, 0, 0},           {0, 1, 0},       {0, 0, 1},
                                 {0.5f, 0.5f, 0},     {0, 0.5f, 0.5f}, {0.5f, 0, 0.5f},
                                 {0.5f, 0.25f, 0.25f}};
    Outcome total;
    for (int l = 0; l < 60; ++l) {
        const glm::vec3 at = glm::vec3(float(int(random.below(17)) - 8) * 0.25f,
                                       float(int(random.below(13)) - 2) * 0.25f,
                                       float(int(random.below(17)) - 8) * 0.25f);
        const Light light =
            l % 5 == 4 ? directionalLight(at + glm::vec3(0, -5, 0), 1024) : pointLight(at);
        const Outcome o = compareWithEveryTriangle(stage, light, 300, random,
                                                   [&] { return weights[random.below(7)]; });
        total.rayCount += o.rayCount;
        total.blockedCount += o.blockedCount;
        total.confirmCount += o.confirmCount;
    }
    EXPECT_GT(total.confirmCount, 100u); // edges are met exactly
    EXPECT_GT(total.blockedCount, total.rayCount / 10);
    EXPECT_LT(total.blockedCount, total.rayCount * 9 / 10);
}

TEST(ExactStream, TrianglesWithAMaskAreAskedForTheirHoles) {
    RecordProperty("seed", std::to_string(kSeed));
    Random random(kSeed);
    ExactStage stage;
    AlphaMask mask = makeAlphaMask(16, 16, MaskWrap::kRepeat, MaskWrap::kMirror);
    for (uint32_t i = 0; i < 256; ++i)
        if (random() < 0.4)
            setOpaque(mask, i % 16, i / 16);
    stage.masks.add(mask);
    for (int i = 0; i < 120; ++i) {
        const glm::vec3 at = random.inCube(2.0);
        stage.soup.add(at, at + random.inCube(1.5), at + random.inCube(1.5));
        stage.masks.triangleCut.push_back(i % 6 ? uint32_t(stage.masks.cuts.size()) : kNotCut);
        if (i % 6)
            stage.masks.cuts.push_back(
                {0,
                 {glm::vec2(random.inCube(1.0)), glm::vec2(random.inCube(1.0)),
                  glm::vec2(random.inCube(1.0))}});
    }
    stage.build();
    uint64_t blockedCount = 0, rayCount = 0;
    for (int l = 0; l < 10; ++l) {
        const Outcome o = compareWithEveryTriangle(stage, pointLight(random.inCube(3)), 400, random,
                                                   [&] { return insideWeights(random); });
        blockedCount += o.blockedCount;
        rayCount += o.rayCount;
    }
    EXPECT_GT(blockedCount, rayCount / 10);
    EXPECT_LT(blockedCount, rayCount * 9 / 10);
}

TEST(ExactStream, ALightCloserThanTheClearanceIsNotBlocked) {
    ExactStage stage;
    stage.soup.addLevelSquare(glm::vec3(0), 100);
    stage.soup.addLevelSquare(glm::vec3(0, 1e-6f, 0), 100);
    stage.build();
    const TruthStart start = makeTruthStart(stage.geometry, makeTruthTriangle(stage.geometry, 0),
                                            glm::vec3(-20, 0, 20), {0, 1, 0});
    const glm::vec3 above = start.startLocal + glm::vec3(stage.geometry.origin);
    ASSERT_FALSE(
        truthRay(start.plane, start.startLocal, glm::dvec3(above) - stage.geometry.origin).tFar >
        0.0f);
    ExactStream stream(stage.geometry, stage.bvh.view());
    uint8_t blocked = 7;
    const uint32_t which = 0;
    const glm::vec3 position(-20, 0, 20);
    stream.trace(pointLight(above), {&start, 1}, {&position, 1}, {&which, 1}, {&blocked, 1});
    EXPECT_EQ(blocked, 0);
}

TEST(ExactStream, NothingBlocksWithoutTriangles) {
    ExactStage stage;
    stage.soup.addLevelSquare(glm::vec3(0), 1);
    stage.build();
    ExactStream stream(stage.geometry, {});
    const TruthStart start = makeTruthStart(stage.geometry, makeTruthTriangle(stage.geometry, 0),
                                            glm::vec3(0.5f, 0, 0.1f), {0, 1, 0});
    const glm::vec3 position(0.5f, 0, 0.1f);
    uint8_t blocked = 7;
    const uint32_t which = 0;
    stream.trace(pointLight({0, 1, 0}), {&start, 1}, {&position, 1}, {&which, 1}, {&blocked, 1});
    EXPECT_EQ(blocked, 0);
}

} // namespace
} // namespace shadowdag::test
