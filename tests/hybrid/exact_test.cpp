// SPDX-License-Identifier: Apache-2.0
// Exact rays one by one: the hierarchy against every triangle, and whole frames against the truth.
#include "hybrid/rays/exact_ray.h"

#include "tests/hybrid/fail_stage.h"
#include "tests/hybrid/random.h"
#include "tests/hybrid/triangle_soup.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numeric>

namespace shadowdag::test {
namespace {

constexpr uint64_t kSeed = 20260101;

/// Bare triangles with everything that exact rays need.
struct Stage {
    TriangleSoup soup;
    std::vector<uint32_t> all;
    TriangleBvh bvh;
    TruthSpace space;

    void build() {
        all.resize(soup.view().count());
        std::iota(all.begin(), all.end(), 0u);
        space = truthSpaceOf(soup.view().positions);
        bvh = buildTriangleBvh(view().geometry, viewOf(all));
    }
    ExactView view() const { return {{soup.view(), space.origin, space.diagonal}, bvh.view()}; }
    bool isBlockedByAny(const TruthRay& ray) const {
        for (const uint32_t triangle : all)
            if (blocksTruthRay(view().geometry, ray, triangle))
                return true;
        return false;
    }
};

/// Many small triangles in a clump, some long and thin ones through everything, degenerate ones.
/// @param at the middle of all
Stage clump(const glm::vec3& middle) {
    Stage stage;
    Random random(kSeed);
    for (int i = 0; i < 300; ++i) {
        const glm::vec3 at = random.inCube(1.0) + glm::vec3(3.0f);
        stage.soup.add(at, at + random.inCube(0.2), at + random.inCube(0.2));
    }
    for (int i = 0; i < 40; ++i)
        stage.soup.add(random.inCube(4), random.inCube(4), random.inCube(4));
    for (int i = 0; i < 10; ++i) {
        const glm::vec3 a = random.inCube(4), b = random.inCube(4);
        stage.soup.add(a, b, b);
        stage.soup.add(a, a, a);
    }
    stage.soup.move(middle);
    stage.build();
    return stage;
}

TEST(ExactRays, EqualATestOfEveryTriangle) {
    RecordProperty("seed", std::to_string(kSeed));
    // Far from the origin coordinates are coarse: 2^-9 of a unit at 8000.
    for (const float far : {0.0f, 100.0f, 8000.0f}) {
        SCOPED_TRACE(far);
        const Stage stage = clump(glm::vec3(far, 0, -far));
        const ExactView exact = stage.view();
        Random random(kSeed);
        uint64_t blockedCount = 0;
        uint32_t blocker = kBackground;
        for (int i = 0; i < 5000; ++i) {
            const glm::vec3 middle(far, 0, -far);
            glm::vec3 from = middle + random.inCube(5), to = middle + random.inCube(5);
            if (i % 5 == 0) // along an axis
                to = glm::vec3(from.x, from.y, to.z);
            TruthRay ray;
            ray.startLocal = glm::vec3(glm::dvec3(from) - stage.space.origin);
            ray.direction = to - from;
            ray.receiver = i % 7 == 0 ? uint32_t(random() * double(stage.all.size())) : kBackground;
            const bool isBlocked = stage.isBlockedByAny(ray);
            ASSERT_EQ(isBlockedExactly(exact, ray, &blocker), isBlocked) << i;
            if (isBlocked) {
                ASSERT_TRUE(blocksTruthRay(exact.geometry, ray, blocker));
            }
            blockedCount += isBlocked;
        }
        EXPECT_GT(blockedCount, 500u);
        EXPECT_LT(blockedCount, 4500u);
    }
}

TEST(ExactRays, AHierarchyIsMovedToAnotherSpaceExactly) {
    Stage stage = clump(glm::vec3(100, 0, -8000));
    const glm::dvec3 before = stage.space.origin;
    ASSERT_NE(before, glm::dvec3(0.0));
    const TriangleBvh built = stage.bvh;
    for (const glm::dvec3& to : {glm::dvec3(0.0), before + glm::dvec3(3.5, 0, -16), before}) {
        moveToSpace(stage.bvh, stage.space.origin, to);
        stage.space.origin = to;
        const TruthGeometry geometry = stage.view().geometry;
        std::vector<bool> isFound(stage.all.size());
        for (const TriangleBvhLeaf& leaf : stage.bvh.leaves)
            for (uint32_t i = 0; i < kTrianglesPerLeaf; ++i) {
                if (leaf.longest[i] == 0.0f)
                    continue; // unused, or a point
                const glm::dvec3 corner(leaf.corner[0][i], leaf.corner[1][i], leaf.corner[2][i]);
                bool isVertex = false;
                for (int k = 0; k < 3; ++k)
                    isVertex = isVertex || corner == geometry.vertex(leaf.triangle[i], k);
                EXPECT_TRUE(isVertex) << leaf.triangle[i];
                isFound[leaf.triangle[i]] = true;
            }
        EXPECT_GT(std::count(isFound.begin(), isFound.end(), true), 300);
    }
    for (size_t i = 0; i < built.nodes.size(); ++i)
        EXPECT_EQ(std::memcmp(&stage.bvh.nodes[i], &built.nodes[i], sizeof built.nodes[i]), 0);
}

TEST(ExactRays, MeetABlockerBehindOtherTriangles) {
    Stage stage;
    stage.soup.add({-4, -4, -4}, {-4, -3.9f, -4}, {-3.9f, -4, -4}); // spans the bounds
    stage.soup.add({4, 4, 4}, {4, 3.9f, 4}, {3.9f, 4, 4});
    stage.soup.add({0, 0.01f, 0}, {0, 0.2f, 0}, {0, 0.1f, 0.1f});
    stage.soup.add({2, -1, -1}, {2, 1, -1}, {2, 0, 1});
    stage.build();
    TruthRay ray;
    ray.startLocal = glm::vec3(glm::dvec3(-3, 0, 0) - stage.space.origin);
    ray.direction = glm::vec3(6, 0, 0);
    uint32_t blocker = kBackground;
    EXPECT_TRUE(isBlockedExactly(stage.view(), ray, &blocker));
    EXPECT_EQ(blocker, 3u);
    ray.direction = glm::vec3(4.9f, 0, 0); // ends before it
    EXPECT_FALSE(isBlockedExactly(stage.view(), ray));
    ray.direction = glm::vec3(6, 0, 0);
    ray.receiver = 3;
    EXPECT_FALSE(isBlockedExactly(stage.view(), ray));
    ray.receiver = kBackground;
    ray.tFar = 0.0f;
    EXPECT_FALSE(isBlockedExactly(stage.view(), ray));
}

TEST(ExactRays, WithNanEndsAreDark) {
    const Stage stage = clump(glm::vec3(0.0f));
    TruthRay ray;
    ray.startLocal = glm::vec3(0, NAN, 0);
    ray.direction = glm::vec3(1, 0, 0);
    EXPECT_TRUE(isBlockedExactly(stage.view(), ray));
}

/// Returns how far the ray's line passes the nearest edge of a triangle, in units of c of truth.h;
/// what rounding can turn is below 1.
double edgeDistance(const TruthGeometry& geometry, const TruthRay& ray, uint32_t triangle) {
    const glm::dvec3 way = glm::normalize(glm::dvec3(ray.direction));
    double nearest = 1e300;
    for (int i = 0; i < 3; ++i) {
        const glm::dvec3 a = geometry.vertex(triangle, i) - glm::dvec3(ray.startLocal);
        const glm::dvec3 b = geometry.vertex(triangle, (i + 1) % 3) - glm::dvec3(ray.startLocal);
        const glm::dvec3 across = glm::cross(way, b - a);
        const double length = glm::length(across);
        nearest = std::min(nearest, length > 0.0 ? std::fabs(glm::dot(a, across)) / length
                                                 : glm::length(glm::cross(way, a)));
    }
    return nearest / truthClearance(geometry, glm::dvec3(ray.startLocal),
                                    makeTruthTriangle(geometry, ray.receiver));
}

// Every failure scene, contacts, wires, lights on faces and movers included: what differs from the
// truth is a ray that passes an edge within rounding.
TEST(ExactRays, DifferFromTheTruthOnlyByRoundingAtAnEdge) {
    FrameOptions options = failFrame();
    options.rays.believe = 0.0f;
    uint64_t pairCount = 0, wrongCount = 0;
    double farthest = 0.0;
    for (const FailScene& description : failScenes()) {
        SCOPED_TRACE(description.name);
        FailStage stage(description, 8, 1.0f);
        const FailOutcome exact = stage.run("texels:inf", options);
        const ErrorCounts& total = exact.report.total;
        pairCount += total.pairCount;
        wrongCount += total.falseShadowCount + total.falseLightCount;
        EXPECT_EQ(total.unexplainedFalseShadowCount + total.unexplainedFalseLightCount, 0u);
        EXPECT_EQ(total.acneCount + total.contactCount, 0u);
        EXPECT_LT(total.falseShadowCount + total.falseLightCount, total.pairCount / 10000 + 2);
        const GBufferView gbuffer = stage.renderer->gbuffer();
        const TruthGeometry geometry = stage.renderer->exact().geometry;
        for (size_t s = 0; s + 1 < exact.frame.pairs.sampleStart.size(); ++s)
            for (uint64_t p = exact.frame.pairs.sampleStart[s];
                 p < exact.frame.pairs.sampleStart[s + 1]; ++p) {
                if (exact.frame.visibility[p] == exact.truth[p])
                    continue;
                const TruthRay ray = truthPairRay(
                    geometry, gbuffer.positionWorld[s], gbuffer.normalWorld[s], gbuffer.triangle[s],
                    pointAtLight(stage.world.lights()[exact.frame.pairs.light[p]],
                                 gbuffer.positionWorld[s]));
                double nearest = 1e300;
                for (uint32_t t = 0; t < geometry.triangles.count(); ++t)
                    if (t != ray.receiver)
                        nearest = std::min(nearest, edgeDistance(geometry, ray, t));
                EXPECT_LT(nearest, 1.0);
                farthest = std::max(farthest, nearest);
            }
    }
    std::printf("%llu of %llu pairs differ; the farthest from an edge by %.3f c\n",
                static_cast<unsigned long long>(wrongCount),
                static_cast<unsigned long long>(pairCount), farthest);
}

// What the offset gave away comes back, at any resolution; neither it nor the level has a say.
TEST(ExactRays, RestoreContactShadowsAtAnyResolutionOffsetAndLevel) {
    FrameOptions options = failFrame();
    options.rays.believe = 0.0f;
    std::vector<uint8_t> first;
    for (const uint32_t log2 : {5u, 9u}) {
        FailStage stage(failSceneOf("fail-contact"), log2);
        const FailOutcome voxels = stage.run("texels:inf");
        EXPECT_GT(voxels.report.total.falseLightCount, 100u);
        options.rays.offset = log2 == 5 ? 1.0f : 4.0f;
        options.rays.level = log2 == 5 ? 0 : 2;
        const FailOutcome exact = stage.run("texels:inf", options);
        EXPECT_LE(exact.report.total.falseLightCount, 2u);
        if (first.empty())
            first = exact.frame.visibility;
        EXPECT_EQ(exact.frame.visibility, first);
    }
}

} // namespace
} // namespace shadowdag::test
