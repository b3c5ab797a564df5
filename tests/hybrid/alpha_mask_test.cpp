// SPDX-License-Identifier: Apache-2.0
// Alpha masks in every method: G-buffer, truth, exact rays, moving geometry, maps and voxels have
// the same holes, and a chequer board's umbra is correct.
#include "scenes/alpha_mask.h"

#include "hybrid/gbuffer/gbuffer_pass.h"
#include "hybrid/judge/embree_baseline.h"
#include "hybrid/rays/exact_ray.h"
#include "scenes/split_mix.h"
#include "tests/hybrid/fail_stage.h"
#include "tests/hybrid/triangle_soup.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

namespace shadowdag::test {
namespace {

constexpr uint32_t kResolutionLog2 = 9;

FrameOptions exactFrame() {
    FrameOptions options = failFrame();
    options.rays.believe = 0.0f;
    return options;
}

class FailAlpha : public testing::TestWithParam<float> {};

// Truth and exact rays are two traversals over one text: no pair may differ. What Embree says of
// holes has a closed form (builtin_test); what differs from it lies within its float of an outline.
TEST_P(FailAlpha, ExactRaysAreTheTruth) {
    FailStage stage(failSceneOf("fail-alpha"), kResolutionLog2, GetParam());
    const FailOutcome exact = stage.run("texels:inf", exactFrame());
    ASSERT_GT(exact.report.total.pairCount, 20000u);
    EXPECT_GT(exact.report.total.occludedCount, 2000u);
    EXPECT_EQ(exact.report.total.falseShadowCount, 0u);
    EXPECT_EQ(exact.report.total.falseLightCount, 0u);
    EXPECT_GT(exact.frame.counts.moverTestCount, 0u) << "the board that moves is asked";
}

// Errors by maps are outlines: each is explained, or is the contact that the bias forgives.
TEST_P(FailAlpha, MapsDifferAtOutlinesOnly) {
    FailStage stage(failSceneOf("fail-alpha"), kResolutionLog2, GetParam());
    const FailOutcome maps = stage.run("texels:0");
    EXPECT_EQ(maps.report.total.unexplainedFalseShadowCount, 0u);
    EXPECT_EQ(maps.report.total.unexplainedFalseLightCount, 0u);
    EXPECT_EQ(maps.report.total.acneCount, 0u);
    EXPECT_LT(maps.falseShadowPercent() + maps.falseLightPercent(), 1.4);
}

INSTANTIATE_TEST_SUITE_P(Times, FailAlpha, testing::Values(0.0f, 2.0f),
                         [](const auto& info) { return "at" + std::to_string(int(info.param)); });

/// A floor at y = 0 and over it, at `height`, a chequer board of `count` squares a side.
struct BoardStage {
    TriangleSoup soup;
    AlphaMaskSet masks;

    BoardStage(float height, float half, float count) {
        soup.addLevelSquare(glm::vec3(0.0f), 20.0f);
        AlphaMask mask = makeAlphaMask(2, 2);
        setOpaque(mask, 0, 0);
        setOpaque(mask, 1, 1);
        const uint32_t index = masks.add(mask);
        masks.triangleCut.assign(soup.triangles.size(), kNotCut);
        soup.addLevelSquare({0, height, 0}, half);
        for (size_t t = masks.triangleCut.size(); t < soup.triangles.size(); ++t) {
            CutTriangle cut{index, {}};
            for (int corner = 0; corner < 3; ++corner) {
                const glm::vec3 p = soup.positions[soup.triangles[t][corner]];
                cut.uv[corner] = (glm::vec2(p.x, p.z) / half + 1.0f) * (count / 4.0f);
            }
            masks.triangleCut.push_back(uint32_t(masks.cuts.size()));
            masks.cuts.push_back(cut);
        }
    }
    TriangleView view() const {
        TriangleView triangles = soup.view();
        triangles.masks = masks.view();
        return triangles;
    }
};

// A light 4 m over the floor and a board half way: squares of 25 cm have umbras of 50 cm.
TEST(AlphaMaskTruth, AChequerBoardsUmbraIsTwiceItsSquares) {
    const BoardStage stage(2.0f, 1.0f, 8.0f);
    const Truth truth(stage.view());
    const EmbreeBaseline baseline(stage.view());
    size_t darkCount = 0;
    std::vector<WorldSegment> segments;
    std::vector<uint8_t> expected;
    for (int i = -120; i < 120; ++i)
        for (int j = -120; j < 120; ++j) {
            const glm::vec3 p(0.025f * (float(i) + 0.37f), 0.0f, 0.025f * (float(j) + 0.41f));
            const bool isUnder = std::fabs(p.x) < 2.0f && std::fabs(p.z) < 2.0f;
            const int square = int(std::floor(p.x * 2.0f)) + int(std::floor(p.z * 2.0f));
            const bool isDark = isUnder && square % 2 == 0;
            ASSERT_EQ(truth.isBlocked(p, {0, 4, 0}), isDark) << p.x << " " << p.z;
            darkCount += isDark;
            segments.push_back({p, {0, 4, 0}});
            expected.push_back(isDark);
        }
    EXPECT_GT(darkCount, 10000u);
    for (const EmbreeCall call : embreeCalls())
        EXPECT_EQ(baseline.occluded(call, segments), expected) << embreeCallName(call);
    // The first blocker of a ray through a hole is what stands behind it.
    EXPECT_EQ(truth.traceFirst(truth.segmentRay({0.1f, 4, 0.3f}, {0.1f, -1, 0.3f})) / 2, 0u);
    EXPECT_EQ(truth.traceFirst(truth.segmentRay({0.1f, 4, -0.3f}, {0.1f, -1, -0.3f})) / 2, 1u);
}

TEST(AlphaMaskTruth, RebuildingFollowsTheMasks) {
    BoardStage stage(2.0f, 1.0f, 8.0f);
    Truth truth(stage.view());
    EXPECT_FALSE(truth.isBlocked({0.1f, 0, 0.3f}, {0.1f, 4, 0.3f}));
    stage.masks = {};
    truth.update(stage.view());
    EXPECT_TRUE(truth.isBlocked({0.1f, 0, 0.3f}, {0.1f, 4, 0.3f}));
}

// The camera looks straight down through the board at the floor.
TEST(AlphaMaskGBuffer, HolesShowTheSurfaceBehind) {
    const BoardStage stage(2.0f, 1.0f, 8.0f);
    const BatchSet batches(stage.view(), std::vector<uint32_t>(stage.soup.triangles.size(), 0u));
    Camera camera;
    camera.positionWorld = {0, 5, 0};
    camera.forward = {0, -1, 0};
    camera.up = {0, 0, -1};
    camera.yfov = 1.2f;
    camera.znear = 0.1f;
    camera.zfar = 100.0f;
    const ViewRays view = makeViewRays(camera, 160, 90);
    GBuffer gbuffer(Backend::kCpu);
    drawGBuffer(Backend::kCpu, stage.view(), batches.view(), view, gbuffer);
    GBuffer bySlot(Backend::kCpu);
    drawGBuffer(Backend::kCpu, stage.view(), batches.view(), view, bySlot, GBufferDraw::kBySlot);
    EXPECT_EQ(gbuffer.visibility.download(), bySlot.visibility.download());
    const GBufferView seen = gbuffer.view();
    size_t boardCount = 0, holeCount = 0;
    for (uint32_t y = 0; y < 90; ++y)
        for (uint32_t x = 0; x < 160; ++x) {
            const glm::dvec3 p = view.origin + view.direction(x, y) * 3.0; // at the board's height
            const double u = (p.x + 1.0) * 4.0, v = (p.z + 1.0) * 4.0;
            if (std::fabs(u - std::round(u)) < 1e-4 || std::fabs(v - std::round(v)) < 1e-4)
                continue;
            const bool isOver = u > 0.0 && u < 8.0 && v > 0.0 && v < 8.0;
            const bool isBoard = isOver && (int(u) + int(v)) % 2 == 0;
            ASSERT_EQ(seen.triangle[y * 160 + x] >= 2, isBoard) << x << " " << y;
            ASSERT_EQ(seen.depthView[y * 160 + x], isBoard ? 3.0f : 5.0f);
            boardCount += isBoard;
            holeCount += isOver && !isBoard;
        }
    EXPECT_GT(boardCount, 300u);
    EXPECT_GT(holeCount, 300u);
}

// Single rays through the hierarchy over opaque parts against every triangle.
TEST(AlphaMaskExact, RaysThroughCutSoupsAreDecidedAsByEveryTriangle) {
    constexpr uint64_t kSeed = 20260401;
    RecordProperty("seed", std::to_string(kSeed));
    uint64_t state = kSeed;
    const auto random = [&] {
        return float(double(splitMix64(state += kSplitMixGamma) >> 11) * 0x1p-53);
    };
    const auto inCube = [&](float half) {
        const float x = random(), y = random(), z = random();
        return (glm::vec3(x, y, z) * 2.0f - 1.0f) * half;
    };
    TriangleSoup soup;
    AlphaMaskSet masks;
    AlphaMask mask = makeAlphaMask(16, 16, MaskWrap::kRepeat, MaskWrap::kMirror);
    for (uint32_t i = 0; i < 256; ++i)
        if (random() < 0.4f)
            setOpaque(mask, i % 16, i / 16);
    masks.add(mask);
    for (int i = 0; i < 120; ++i) {
        const glm::vec3 at = inCube(2.0f);
        soup.add(at, at + inCube(1.5f), at + inCube(1.5f));
        masks.triangleCut.push_back(i % 6 ? uint32_t(masks.cuts.size()) : kNotCut);
        if (i % 6)
            masks.cuts.push_back(
                {0, {glm::vec2(inCube(1.0f)), glm::vec2(inCube(1.0f)), glm::vec2(inCube(1.0f))}});
    }
    TriangleView triangles = soup.view();
    triangles.masks = masks.view();
    std::vector<uint32_t> all(triangles.count());
    std::iota(all.begin(), all.end(), 0u);
    const TruthSpace space = truthSpaceOf(triangles.positions);
    const TruthGeometry geometry{triangles, space.origin, space.diagonal};
    const Truth truth(triangles);
    const TriangleBvh bvh = buildTriangleBvh(geometry, viewOf(all));
    uint64_t blockedCount = 0, throughHoleCount = 0;
    for (int i = 0; i < 20000; ++i) {
        const glm::vec3 from = inCube(3.0f), to = inCube(3.0f);
        const TruthRay ray = truth.segmentRay(from, to);
        bool isBlocked = false, crossesAny = false;
        for (const uint32_t t : all) {
            const bool blocks = blocksTruthRay(geometry, ray, t);
            isBlocked |= blocks;
            TruthGeometry solid = geometry;
            solid.triangles.masks = {};
            crossesAny |= blocksTruthRay(solid, ray, t);
        }
        ASSERT_EQ(isBlockedExactly({geometry, bvh.view()}, ray), isBlocked) << i;
        uint8_t byEmbree = 0;
        truth.traceBlocked(&ray, 1, &byEmbree);
        ASSERT_EQ(byEmbree != 0, isBlocked) << i;
        blockedCount += isBlocked;
        throughHoleCount += crossesAny && !isBlocked;
    }
    EXPECT_GT(blockedCount, 2000u);
    EXPECT_GT(throughHoleCount, 1000u);
}

} // namespace
} // namespace shadowdag::test
