// SPDX-License-Identifier: Apache-2.0
// Acne of smooth surfaces, maps that are coarser than asked, pairs near outlines, and the names of
// unexplained errors, with frames built by hand.
#include "hybrid/judge/explain.h"
#include "hybrid/judge/smooth_patch.h"

#include "tests/hybrid/fail_stage.h"
#include "tests/hybrid/hand_frame.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <functional>

namespace shadowdag {
namespace {

using test::failFrame;
using test::FailStage;
using test::hallWithScreen;
using test::HandFrame;
using test::MapFrame;
using test::TriangleSoup;
using testing::UnorderedElementsAre;

/// Adds a level floor at `y` up to x = `edge` and a ramp of that slope from `start` on.
/// @return the ramp's first triangle
uint32_t addBend(TriangleSoup& soup, float y, float edge, float start, float slope, float length) {
    soup.addQuad({edge - 40, y, -60}, {edge - 40, y, 60}, {edge, y, 60}, {edge, y, -60});
    const float far = start + length, top = y + slope * length;
    return soup.addQuad({start, y, -60}, {start, y, 60}, {far, top, 60}, {far, top, -60});
}

TEST(SmoothPatch, FollowsSharedVerticesToTheAngleAndTheRadius) {
    TriangleSoup soup; // a fan of strips along z, each 30 degrees steeper than the one before
    glm::vec3 at(0, 0, 0);
    std::vector<uint32_t> first;
    for (int strip = 0; strip < 4; ++strip) {
        const double angle = strip * 0.5235987755982988;
        const glm::vec3 next = at + glm::vec3(std::cos(angle), std::sin(angle), 0);
        first.push_back(soup.addQuad({at.x, at.y, -1}, {at.x, at.y, 1}, {next.x, next.y, 1},
                                     {next.x, next.y, -1}));
        at = next;
    }
    const uint32_t apart = // flat, beside the first strip, with vertices of its own
        soup.addQuad({-1, 0, -1}, {-1, 0, 1}, {-0.001f, 0, 1}, {-0.001f, 0, -1});
    const Truth truth(soup.view());
    const glm::vec3 sample(0.9f, 0.0f, 0.0f);
    // 60 degrees are too steep, however near.
    EXPECT_THAT(smoothPatch(truth, soup.view(), first[0], sample, 5.0),
                UnorderedElementsAre(first[0], first[0] + 1, first[1], first[1] + 1));
    // The second strip begins 0.1 from the sample.
    EXPECT_THAT(smoothPatch(truth, soup.view(), first[0], sample, 0.09),
                UnorderedElementsAre(first[0], first[0] + 1));
    EXPECT_THAT(smoothPatch(truth, soup.view(), apart, {-0.5f, 0, 0}, 5.0),
                UnorderedElementsAre(apart, apart + 1));
}

// The texel [0, 1.25]^2 of the map looks at the ramp, which is a little above the floor there.
// A fan and a mesh of a hundred thousand triangles, each a patch as a whole: by pairs of triangles
// this took minutes.
TEST(SmoothPatch, TakesTimeInProportionToItsTriangles) {
    TriangleSoup soup;
    constexpr int kSide = 200, kFan = 20000;
    for (int z = 0; z < kSide; ++z)
        for (int x = 0; x < kSide; ++x)
            soup.addQuad({x, 0, z}, {x, 0, z + 1}, {x + 1, 0, z + 1}, {x + 1, 0, z});
    for (int i = 0; i < kFan; ++i) {
        const float a = 6.2831853f * float(i) / kFan, b = 6.2831853f * float(i + 1) / kFan;
        soup.add({0, 0, 0}, {-std::cos(a), 0, std::sin(a)}, {-std::cos(b), 0, std::sin(b)});
    }
    const Truth truth(soup.view());
    const uint32_t count = soup.view().count();
    const auto start = std::chrono::steady_clock::now();
    EXPECT_EQ(smoothPatch(truth, soup.view(), 0, {0.2f, 0, 0.2f}, 1e3).size(), count);
    EXPECT_EQ(smoothPatch(truth, soup.view(), count - 1, {0, 0, 0}, 1e3).size(), count);
    EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(20));
}

TEST(Acne, OfMapsIsABlockerThatContinuesTheReceiverSmoothly) {
    const auto judged = [](float start, float slope) {
        MapFrame f;
        f.soup = TriangleSoup{};
        f.bias.constantTexels = 0.0f;
        addBend(f.soup, 0.0f, 0.5f, start, slope, 2.5f);
        f.add({0.4f, 0, 0.4f}, {0, 10, 0}, 1, PairServer::drawnMap(0));
        // The centre's ray, x = 0.0625 (10 - y), meets the ramp, y = slope (x - 0.5), at this
        // height.
        const float up = slope * (0.625f - 0.5f) / (1.0f + 0.0625f * slope);
        f.store(0.4f, 0.4f, 10.0f - up);
        f.answer();
        EXPECT_EQ(f.visibility[0], 0);
        return f.judge().verdicts[0];
    };
    EXPECT_EQ(judged(0.5f, 0.4f), PairVerdict::kAcne);
    EXPECT_NE(judged(0.501f, 0.4f), PairVerdict::kAcne) << "not connected";
    EXPECT_NE(judged(0.5f, 1.5f), PairVerdict::kAcne) << "as steep as another surface";
}

// The ray at 45 degrees passes over the ramp and through the voxel (12, 2, 10), which the ramp
// enters.
TEST(Acne, OfVoxelsIsACellThatTheReceiversSmoothSurfaceEnters) {
    const auto judged = [](float start, const glm::uvec3& voxel) {
        HandFrame f;
        addBend(f.soup, 0.5f, 11.0f, start, 0.8f, 20.0f);
        f.dag = test::makeDag(6, {voxel});
        f.add({10.5f, 0.5f, 10.5f}, {50.5f, 40.5f, 10.5f}, 1);
        f.answer();
        EXPECT_EQ(f.visibility[0], 0);
        return f.judge().verdicts[0];
    };
    EXPECT_EQ(judged(11.0f, {12, 2, 10}), PairVerdict::kAcne);
    EXPECT_NE(judged(11.001f, {12, 2, 10}), PairVerdict::kAcne) << "not connected";
    EXPECT_NE(judged(11.0f, {20, 10, 10}), PairVerdict::kAcne) << "farther than rho, and empty";
}

// The method was asked without the receiver's plane, so it is repeated without: on a slope the
// texel's own surface is nearer than the sample.
TEST(Acne, IsSeenWhereLookupsHadNoPlane) {
    MapFrame f;
    f.soup = TriangleSoup{};
    f.bias.constantTexels = 0.0f;
    f.soup.addQuad({-20, -20, -40}, {-20, -20, 40}, {9, 9, 40}, {9, 9, -40}); // y = x
    f.add({0.1f, 0.1f, 0.6f}, {0, 10, 0}, 1, PairServer::drawnMap(0));
    f.row.normal[0] = glm::normalize(glm::vec3(-1, 1, 0));
    f.store(0.1f, 0.6f, 1.0001f * 10.0f / (1.0f + 0.0625f)); // at the texel's centre, x = z / 16
    f.visibility = {0};
    const Truth truth(f.soup.view());
    const std::vector<uint8_t> lit = truth.visibility(f.row.view(), f.lights, f.pairs);
    ASSERT_EQ(lit[0], kLit);
    for (const bool hasPlane : {true, false}) {
        ErrorInputs inputs = f.inputs();
        inputs.hasPlane = hasPlane;
        const ErrorReport report = computeError(inputs, truth, lit, {});
        EXPECT_EQ(report.total.acneCount, hasPlane ? 0u : 1u);
    }
}

// The plate's corner and the texel's centre are 0.29 and 0.30 m beside the ray, 5 m below the
// light: within a texel of 16 a face (0.625 m), not of 64.
TEST(Error, AMapIsHeldToTheResolutionThatIsAsked) {
    for (const float asked : {0.0f, 10.0f, 16.0f, 64.0f}) {
        SCOPED_TRACE(asked);
        MapFrame f;
        f.bias.constantTexels = 0.0f;
        f.addPair(5.1f, 5.1f);
        f.store(5.1f, 5.1f, 5.0f);
        f.soup.addLevelSquare({3.3f, 5.0f, 3.3f}, 0.5f);
        f.answer();
        ASSERT_EQ(f.visibility[0], 0);
        ErrorInputs inputs = f.inputs();
        inputs.askedTexels = {asked};
        const Truth truth(f.soup.view());
        const std::vector<uint8_t> right = truth.visibility(f.row.view(), f.lights, f.pairs);
        const ErrorReport report = computeError(inputs, truth, right, {});
        EXPECT_EQ(report.verdicts[0],
                  asked > 16.0f ? PairVerdict::kUnexplained : PairVerdict::kExplained);
        const PairJudge judge(inputs, truth, 1);
        EXPECT_EQ(judge.nameOf(0, 0, true),
                  asked > 16.0f ? FailureName::kCoarserThanAsked : FailureName::kNone);
    }
}

// A coarse map is no excuse for a surface that is nowhere near.
TEST(Error, ACoarserMapNamesOnlyWhatItsOwnTexelsExplain) {
    MapFrame f;
    f.addPair(5.1f, 5.1f);
    f.store(5.1f, 5.1f, 5.0f);
    f.answer();
    ASSERT_EQ(f.visibility[0], 0);
    ErrorInputs inputs = f.inputs();
    inputs.askedTexels = {64.0f};
    const Truth truth(f.soup.view());
    EXPECT_EQ(PairJudge(inputs, truth, 1).nameOf(0, 0, true), FailureName::kNone);
}

// The bias of one texel skips 1.25 m of the ray; of a map with a quarter of the texels that were
// asked, it may skip 0.31 m.
TEST(Error, ACoarserMapMakesContactNoLonger) {
    for (const float asked : {0.0f, 64.0f}) {
        MapFrame f;
        f.bias.constantTexels = 1.0f;
        f.addPair(0.4f, 0.4f);
        f.soup.addLevelSquare({0, 1.0f, 0}, 5.0f);
        f.answer();
        ErrorInputs inputs = f.inputs();
        inputs.askedTexels = {asked};
        const Truth truth(f.soup.view());
        const std::vector<uint8_t> right = truth.visibility(f.row.view(), f.lights, f.pairs);
        EXPECT_EQ(computeError(inputs, truth, right, {}).verdicts[0],
                  asked == 0.0f ? PairVerdict::kContact : PairVerdict::kUnexplained);
    }
}

TEST(Error, AskedResolutionsAreThoseOfDrawnMapsUpToTheLimit) {
    std::vector<MapRecord> maps(4);
    const float texels[] = {100.0f, 50.0f, 3000.0f, 7.0f};
    for (size_t i = 0; i < 4; ++i) {
        maps[i].quantities.texels = texels[i];
        maps[i].route = i == 1 ? Route::kRays : Route::kMap;
    }
    EXPECT_EQ(askedTexels(maps, 2048), (std::vector<float>{100.0f, 2048.0f, 7.0f}));
}

// A picture of 4 x 3 pixels: the light's shadow covers the two columns to the right.
TEST(Error, PairsNearAnOutlineHaveANeighbourOfTheOtherTruth) {
    GBufferView gbuffer;
    gbuffer.width = 4;
    gbuffer.height = 3;
    PairList pairs{{0}, {}};
    std::vector<uint8_t> truth;
    for (int i = 0; i < 12; ++i) {
        pairs.light.push_back(5);
        truth.push_back(i % 4 < 2 ? kLit : 0);
        if (i == 0) { // another light, all lit
            pairs.light.push_back(9);
            truth.push_back(kLit);
        }
        pairs.sampleStart.push_back(pairs.light.size());
    }
    for (uint32_t sample = 0; sample < 12; ++sample) {
        const bool isNear = sample % 4 == 1 || sample % 4 == 2;
        EXPECT_EQ(isNearOutline(gbuffer, pairs, truth, sample, pairOf(pairs, sample, 5)), isNear)
            << sample;
    }
    EXPECT_FALSE(isNearOutline(gbuffer, pairs, truth, 0, pairOf(pairs, 0, 9)));
    EXPECT_EQ(pairOf(pairs, 3, 9), pairs.count());
}

/// Returns the null rate near outlines of a frame by a model, of many samples.
double outlineNullRate(FailStage& stage, const std::string& model) {
    FrameOptions options = failFrame();
    options.rays.believe = 0.0f;
    const FrameResult frame =
        stage.renderer->render(stage.world.cameras().at(0), *makeCostModel(model), options);
    const std::vector<uint8_t> truth =
        stage.truth->visibility(stage.renderer->gbuffer(), stage.world.lights(), frame.pairs);
    ErrorOptions judging;
    judging.nullSampleCount = 8000;
    judging.rays = options.rays;
    judging.bias = options.bias;
    const ErrorReport report =
        computeError(*stage.renderer, frame, stage.world, *stage.truth, truth, judging);
    EXPECT_GT(report.total.falseShadowCount + report.total.falseLightCount, 20u) << model;
    EXPECT_EQ(report.outlineNullSampleCount, 2000u) << model;
    return report.outlineNullRate;
}

// A light by exact rays has no errors, and nothing that could be explained: it must not dilute the
// rate of the light by a map.
TEST(Error, TheNullRateOfAHybridIsThatOfTheMethodsOfItsWrongPairs) {
    FailScene both = hallWithScreen();
    both.boxes.pop_back(); // the plate
    both.lights.erase(both.lights.begin() + 1);
    FailStage stage(both, 7);
    const FrameResult drawn = stage.renderer->render(stage.world.cameras().at(0),
                                                     *makeCostModel("texels:0"), failFrame());
    ASSERT_EQ(drawn.maps.size(), 2u);
    const float a = drawn.maps[0].quantities.texels, b = drawn.maps[1].quantities.texels;
    ASSERT_NE(a, b);
    FailScene alone = both;
    alone.lights = {both.lights[drawn.maps[a > b ? 0 : 1].quantities.light]};
    FailStage mapped(alone, 7);
    const double ofHybrid = outlineNullRate(stage, "texels:" + std::to_string((a + b) / 2)),
                 ofMap = outlineNullRate(mapped, "texels:0");
    EXPECT_GT(ofMap, 0.1);
    EXPECT_NEAR(ofHybrid, ofMap, 0.05);
}

// Right answers only: of the pairs near the outline the shifts flip all, of all pairs few.
TEST(Error, TheNullRateNearOutlinesIsOfPairsBesideThem) {
    HandFrame f;
    f.soup.addLevelSquare({32, 0.5f, 32}, 32.0f);
    f.soup.addLevelSquare({42.5f, 30.5f, 32}, 10.0f); // its edge is at x = 32.5
    f.dag = test::makeDag(6, {{32, 30, 33}, {36, 30, 33}, {38, 30, 33}, {40, 30, 33}});
    const float xs[] = {5, 8, 11, 14, 17, 20, 23, 26, 29, 32.4f, 32.6f, 36, 38, 40};
    f.lights = {test::pointLight({32.5f, 6000, 32})};
    for (const float x : xs) {
        f.row.add({x, 0.5f, 33}, {0, 1, 0}, x <= 33 ? 0 : 1);
        f.pairs.light.push_back(0);
        f.pairs.sampleStart.push_back(f.pairs.light.size());
        f.pairServer.push_back(PairServer::rays());
        f.route.push_back(Route::kRays);
    }
    const Truth truth(f.soup.view());
    f.visibility = truth.visibility(f.row.view(), f.lights, f.pairs);
    ErrorOptions options;
    options.nullSampleCount = 400;
    const ErrorReport report = computeError(f.inputs(), truth, f.visibility, options);
    EXPECT_EQ(report.outlineNullSampleCount, 100u);
    EXPECT_EQ(report.outlineNullRate, 1.0);
    EXPECT_LT(report.nullRate, 0.35);
    EXPECT_GT(report.nullRate, 0.05);
}

/// Returns the name of a pair at (10.5, 0.9, 10.5) that the voxel (10, 1, 10) stops.
FailureName nameIn(const std::function<void(TriangleSoup&)>& addBlocker,
                   const glm::vec3& light = {60, 2.5f, 10.5f}) {
    HandFrame f;
    f.rays.offset = 0.3f;
    f.soup.addLevelSquare({32, 0.9f, 32}, 32.0f);
    addBlocker(f.soup);
    f.dag = test::makeDag(6, {{10, 1, 10}});
    f.add({10.5f, 0.9f, 10.5f}, light, 0);
    f.answer();
    EXPECT_EQ(f.visibility[0], 0);
    const ErrorInputs inputs = f.inputs();
    const Truth truth(f.soup.view());
    return PairJudge(inputs, truth, 1).nameOf(0, 0, true);
}

void addWall(TriangleSoup& soup, float x) {
    soup.addQuad({x, 0.9f, 5}, {x, 0.9f, 15}, {x, 1.8f, 15}, {x, 1.8f, 5});
}

TEST(FailureNames, ASurfaceIsBehindIfAllOfItInTheCellIs) {
    EXPECT_EQ(nameIn([](TriangleSoup& soup) { addWall(soup, 10.2f); }),
              FailureName::kSurfaceBehind);
    EXPECT_EQ(nameIn([](TriangleSoup& soup) { addWall(soup, 10.8f); }), FailureName::kNone);
    EXPECT_EQ(nameIn([](TriangleSoup& soup) {
                  addWall(soup, 10.2f);
                  addWall(soup, 10.8f);
              }),
              FailureName::kNone);
}

TEST(FailureNames, AnEmptyVoxelHasNoName) {
    EXPECT_EQ(nameIn([](TriangleSoup&) {}), FailureName::kNone);
}

TEST(FailureNames, ASurfaceAlongTheRayIsEdgeOn) {
    const glm::vec3 light(60, 2.5f, 10.5f); // rays stay in the plane z = 10.5
    for (const float lean : {0.0f, 0.2f})
        EXPECT_EQ(nameIn(
                      [&](TriangleSoup& soup) {
                          soup.addQuad({10.6f, 1.0f, 10.7f}, {12.0f, 1.0f, 10.7f + lean},
                                       {12.0f, 1.9f, 10.7f + lean}, {10.6f, 1.9f, 10.7f});
                      },
                      light),
                  lean == 0.0f ? FailureName::kSurfaceEdgeOn : FailureName::kNone);
}

TEST(FailureNames, ALightInTheReceiversPlane) {
    const auto wall = [](TriangleSoup& soup) { addWall(soup, 10.8f); };
    EXPECT_EQ(nameIn(wall, {60, 0.9f, 10.5f}), FailureName::kLightInPlane);
    EXPECT_EQ(nameIn(wall, {60, 0.95f, 10.5f}), FailureName::kNone);
}

TEST(FailureNames, AreKnownByTheirText) {
    EXPECT_TRUE(isTestedFailure("surface-behind"));
    EXPECT_TRUE(isTestedFailure(failureNameText(FailureName::kCoarserThanAsked)));
    EXPECT_FALSE(isTestedFailure("unsettled-voxel"));
    EXPECT_FALSE(isTestedFailure(""));
}

} // namespace
} // namespace shadowdag
