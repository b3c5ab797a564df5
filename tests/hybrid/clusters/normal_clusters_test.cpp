// SPDX-License-Identifier: Apache-2.0
// Normal clustering: cells partition directions, clusters partition samples, and no pair is lost.
#include "hybrid/clusters/cluster_pass.h"
#include "hybrid/clusters/light_assign_pass.h"
#include "hybrid/clusters/light_bvh.h"
#include "hybrid/clusters/pairs.h"
#include "tests/hybrid/fail_stage.h"
#include "tests/hybrid/seen_soup.h"

#include <gtest/gtest.h>

#include <set>

namespace shadowdag::test {
namespace {

glm::vec3 randomDirection(std::mt19937_64& random) {
    std::normal_distribution<float> normal;
    const float x = normal(random), y = normal(random), z = normal(random);
    return glm::normalize(glm::vec3(x, y, z));
}

TEST(NormalCells, AreNumberedByFaceRowAndColumn) {
    EXPECT_EQ(normalCellOf({1, 0, 0}, 1), 0u);
    EXPECT_EQ(normalCellOf({-1, 0, 0}, 1), 1u);
    EXPECT_EQ(normalCellOf({0, 1, 0}, 1), 2u);
    EXPECT_EQ(normalCellOf({0, -2, 0}, 1), 3u);
    EXPECT_EQ(normalCellOf({0, 0, 1}, 1), 4u);
    EXPECT_EQ(normalCellOf({0, 0, -1}, 1), 5u);
    // Nk3: the middle cell of +X, its first and its last one.
    EXPECT_EQ(normalCellOf({1, 0, 0}, 3), 4u);
    EXPECT_EQ(normalCellOf({1, -1, -1}, 3), 0u);
    EXPECT_EQ(normalCellOf({1, 1, 1}, 3), 8u); // an edge: the earlier axis, the last cell
    EXPECT_EQ(normalCellOf({1, 0.5f, -0.5f}, 3), 2u);
    EXPECT_EQ(normalCellOf({0, -1, 0.5f}, 3), 3u * 9 + 2 * 3 + 1);
    EXPECT_EQ(normalCellOf({0.5f, 0, -1}, 3), 5u * 9 + 1 * 3 + 2);
    EXPECT_EQ(normalCellOf({-1, -1, -1}, kMaxNormalCellsPerEdge), 256u);
    std::mt19937_64 random(1);
    for (int i = 0; i < 10000; ++i) {
        EXPECT_LT(normalCellOf(randomDirection(random), 1), 6u);
        EXPECT_LT(normalCellOf(randomDirection(random), 16), 1536u);
    }
}

TEST(NormalCells, NeverCallALightHiddenThatASampleFaces) {
    constexpr uint64_t kSeed = 77;
    SCOPED_TRACE("seed " + std::to_string(kSeed));
    std::mt19937_64 random(kSeed);
    std::uniform_real_distribution<float> place(-4.0f, 4.0f), unit(0.0f, 1.0f);
    size_t hiddenCount = 0, facedCount = 0, testCount = 0;
    for (const uint32_t k : {1u, 2u, 3u, 7u, 16u})
        for (int round = 0; round < 3000; ++round) {
            Box box;
            box.add({place(random), place(random), place(random)});
            box.max += glm::vec3(unit(random), unit(random), unit(random));
            Light light;
            light.positionWorld = {place(random), place(random), place(random)};
            light.rangeWorld = 100.0f;
            if (round % 5 == 0) {
                light.kind = Light::kSun;
                light.directionWorld = randomDirection(random);
            }
            glm::vec3 normal = randomDirection(random);
            const uint32_t cell = normalCellOf(normal, k);
            const bool mayBeFaced = mayFace(light, box, cell, k);
            ++testCount;
            hiddenCount += !mayBeFaced;
            for (int sample = 0; sample < 30; ++sample) {
                const glm::vec3 p =
                    glm::mix(box.min, box.max, glm::vec3(unit(random), unit(random), unit(random)));
                // A normal nearly perpendicular to the light, where rounding decides.
                const glm::vec3 toLight = towardsLight(light, p);
                glm::vec3 n = sample % 2
                                  ? normal
                                  : glm::normalize(normal - toLight * (glm::dot(normal, toLight) /
                                                                       glm::dot(toLight, toLight)));
                if (normalCellOf(n, k) != cell || !(glm::dot(toLight, n) > 0.0f))
                    continue;
                ++facedCount;
                ASSERT_TRUE(mayBeFaced) << "k " << k << ", round " << round;
            }
        }
    EXPECT_GT(facedCount, testCount);
    EXPECT_GT(hiddenCount, testCount / 5); // and not by hiding none
}

TEST(NormalCells, SeeALightThatOneCornerJustFaces) {
    // A corner of the box and a corner of the cell, the light a little above the plane of both:
    // often no other point and no other normal faces it more.
    constexpr uint64_t kSeed = 5;
    SCOPED_TRACE("seed " + std::to_string(kSeed));
    std::mt19937_64 random(kSeed);
    std::uniform_real_distribution<float> place(-4.0f, 4.0f);
    size_t hiddenBelowCount = 0;
    constexpr int kRounds = 40000;
    for (int round = 0; round < kRounds; ++round) {
        const uint32_t k = 1 + uint32_t(random() % 4);
        const auto border = [&] { // just inside of a border between cells
            const float inside = random() % 2 ? 1e-5f : -1e-5f;
            const float along = 2.0f * float(random() % (k + 1)) / float(k) - 1.0f;
            return std::clamp(along + inside, -1.0f + 1e-5f, 1.0f - 1e-5f);
        };
        const glm::vec3 n = glm::normalize(glm::vec3(border(), 1.0f, border()));
        Box box;
        box.add({place(random), place(random), place(random)});
        box.max += glm::vec3(1.0f, 0.5f, 2.0f);
        const glm::vec3 p(random() % 2 ? box.min.x : box.max.x,
                          random() % 2 ? box.min.y : box.max.y,
                          random() % 2 ? box.min.z : box.max.z);
        const glm::vec3 across = glm::normalize(glm::cross(n, randomDirection(random)));
        Light light;
        light.rangeWorld = 100.0f;
        light.positionWorld = p + 4.0f * across + 1e-3f * n;
        ASSERT_GT(glm::dot(light.positionWorld - p, n), 0.0f);
        ASSERT_TRUE(mayFace(light, box, normalCellOf(n, k), k)) << "round " << round;
        light.positionWorld = p + 4.0f * across - 1e-3f * n;
        hiddenBelowCount += !mayFace(light, box, normalCellOf(n, k), k);
    }
    EXPECT_GT(hiddenBelowCount, size_t(kRounds / 50)); // that corner was the one that decides
}

TEST(NormalClusters, HoldEverySampleOnceInTheCellOfItsNormal) {
    const TriangleSoup soup = randomSoup(3, 500);
    const ViewRays view = makeViewRays(frontCamera(), 200, 130);
    const GBuffer gbuffer = drawSoup(soup, view);
    ClusterSet plain(Backend::kCpu), set(Backend::kCpu);
    buildClusters(Backend::kCpu, gbuffer.view(), view, ClusterBounds::kTight, plain);
    for (const uint32_t k : {1u, 3u, 16u}) {
        buildClusters(Backend::kCpu, gbuffer.view(), view, ClusterBounds::kTight, set, k);
        const ClusterView clusters = set.view(), before = plain.view();
        EXPECT_EQ(clusters.normals.k, k);
        ASSERT_EQ(clusters.normals.cells.count, clusters.count());
        std::set<std::pair<uint32_t, uint32_t>> keys;
        std::vector<int> seen(gbuffer.view().count(), 0);
        for (size_t c = 0; c < clusters.count(); ++c) {
            ASSERT_GT(clusters.sampleCount(c), 0u);
            if (c > 0) {
                ASSERT_LT(std::pair(clusters.cell[c - 1], clusters.normals.cells[c - 1]),
                          std::pair(clusters.cell[c], clusters.normals.cells[c]));
            }
            for (uint32_t i = clusters.sampleStart[c]; i < clusters.sampleStart[c + 1]; ++i) {
                const uint32_t sample = clusters.samples[i];
                ++seen[sample];
                ASSERT_EQ(clusters.clusterOfSample[sample], c);
                ASSERT_EQ(normalCellOf(gbuffer.view().normalWorld[sample], k),
                          clusters.normals.cells[c]);
                ASSERT_EQ(before.cell[before.clusterOfSample[sample]], clusters.cell[c]);
            }
        }
        for (size_t i = 0; i < seen.size(); ++i)
            ASSERT_EQ(seen[i], gbuffer.view().triangle[i] != kBackground);
        for (size_t i = 0; i < seen.size(); ++i)
            if (seen[i])
                keys.emplace(before.cell[before.clusterOfSample[i]],
                             normalCellOf(gbuffer.view().normalWorld[i], k));
        EXPECT_EQ(keys.size(), clusters.count());
    }
    buildClusters(Backend::kCpu, gbuffer.view(), view, ClusterBounds::kTight, set, 0);
    EXPECT_TRUE(set.view().normals.cells.empty());
    EXPECT_EQ(set.cell.download(), plain.cell.download());
    EXPECT_EQ(set.samples.download(), plain.samples.download());
}

TEST(NormalClusters, OfAnEmptyImageAreNone) {
    const TriangleSoup soup;
    const ViewRays view = makeViewRays(frontCamera(), 40, 40);
    const GBuffer gbuffer = drawSoup(soup, view);
    ClusterSet clusters(Backend::kCpu);
    buildClusters(Backend::kCpu, gbuffer.view(), view, ClusterBounds::kExplicit, clusters, 3);
    EXPECT_EQ(clusters.view().count(), 0u);
    EXPECT_EQ(clusters.sampleStart.download(), std::vector<uint32_t>{0});
}

TEST(NormalClusters, LoseNoPairOfARandomSoup) {
    constexpr uint64_t kSeed = 12;
    SCOPED_TRACE("seed " + std::to_string(kSeed));
    const TriangleSoup soup = randomSoup(kSeed, 500);
    const ViewRays view = makeViewRays(frontCamera(), 160, 100);
    const GBuffer gbuffer = drawSoup(soup, view);
    std::mt19937_64 random(kSeed);
    std::uniform_real_distribution<float> place(-10.0f, 10.0f);
    std::vector<Light> lights(60);
    for (Light& light : lights) {
        light.positionWorld = {place(random), place(random), place(random)};
        light.rangeWorld = 8.0f;
    }
    const WideBvh bvh = buildLightBvh(lights);
    ClusterSet set(Backend::kCpu);
    buildClusters(Backend::kCpu, gbuffer.view(), view, ClusterBounds::kTight, set, 3);
    const ClusterView clusters = set.view();
    ClusterLights lists(Backend::kCpu), all(Backend::kCpu);
    assignLights(Backend::kCpu, clusters.boxesWorld, bvh.view(), viewOf(lights), lists,
                 clusters.normals);
    assignLights(Backend::kCpu, clusters.boxesWorld, bvh.view(), viewOf(lights), all);
    const ClusterLightsView view3 = lists.view();
    for (size_t i = 0; i < gbuffer.view().count(); ++i) {
        const uint32_t c = clusters.clusterOfSample[i];
        if (c == kNoCluster)
            continue;
        for (uint32_t l = 0; l < lights.size(); ++l)
            if (isPair(lights[l], gbuffer.view().positionWorld[i], gbuffer.view().normalWorld[i])) {
                ASSERT_TRUE(std::binary_search(view3.lights.data + view3.start[c],
                                               view3.lights.data + view3.start[c + 1], l))
                    << "sample " << i << ", light " << l;
            }
    }
    EXPECT_LT(lists.lights.size(), all.lights.size() * 3 / 4);
}

uint64_t lightingComputationsOf(const FrameResult& frame) {
    uint64_t sum = 0;
    for (const MapRecord& map : frame.maps)
        sum += map.quantities.samples;
    return sum;
}

TEST(NormalClusters, ChangeNoRayAndSaveLightingComputationsForMoreClusters) {
    FailStage stage(hallWithScreen(), 9, 1.0f);
    FrameOptions options = failFrame();
    options.width = 640;
    options.height = 360;
    const auto frameOf = [&](uint32_t k) {
        options.normalClusters = k;
        stage.renderer->reset();
        return stage.renderer->render(stage.world.cameras().at(0), *makeCostModel("texels:inf"),
                                      options);
    };
    const FrameResult plain = frameOf(0), nk3 = frameOf(3);
    EXPECT_EQ(nk3.pairs.light, plain.pairs.light);
    EXPECT_EQ(nk3.visibility, plain.visibility);
    EXPECT_EQ(nk3.color, plain.color);
    EXPECT_EQ(nk3.counts.rayCount, plain.counts.rayCount);
    EXPECT_GT(nk3.counts.clusterCount, plain.counts.clusterCount);
    EXPECT_LT(lightingComputationsOf(nk3), lightingComputationsOf(plain));
    EXPECT_GE(lightingComputationsOf(nk3), nk3.pairs.count());
    RecordProperty("clusters", std::to_string(plain.counts.clusterCount) + " to " +
                                   std::to_string(nk3.counts.clusterCount));
    RecordProperty("lighting_computations", std::to_string(lightingComputationsOf(plain)) + " to " +
                                                std::to_string(lightingComputationsOf(nk3)));
    options.normalClusters = kMaxNormalCellsPerEdge + 1;
    EXPECT_THROW(
        stage.renderer->render(stage.world.cameras().at(0), *makeCostModel("texels:inf"), options),
        Error);
}

} // namespace
} // namespace shadowdag::test
