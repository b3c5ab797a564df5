// SPDX-License-Identifier: Apache-2.0
// The drawn parts of a pair: their places in the picture in closed form, and their colours.
#include "tools/window/view_pair.h"

#include "hybrid/judge/truth.h"
#include "tests/hybrid/blocker_stage.h"
#include "tools/window/view_observer.h"
#include "tools/window/view_pixel.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>

namespace shadowdag {

namespace {

constexpr uint32_t kSide = 101; // the middle of the picture is a pixel's centre: (50, 50)

/// A camera at the origin that sees from -1 to 1 across at a distance of 1.
Camera squareCamera() {
    Camera camera;
    camera.yfov = glm::radians(90.0f);
    camera.znear = 0.5f;
    return camera;
}

/// Returns the pixel of a point, x to the right and y up, at a distance.
glm::dvec2 pixelAt(double x, double y, double distance) {
    const double perUnit = kSide / 2.0;
    return {50.0 + perUnit * x / distance, 50.0 - perUnit * y / distance};
}

void expectNear(const glm::dvec2& a, const glm::dvec2& b) {
    EXPECT_NEAR(a.x, b.x, 1e-4);
    EXPECT_NEAR(a.y, b.y, 1e-4);
}

std::vector<PairLine> linesOf(const std::vector<PairLine>& lines, PairPart part) {
    std::vector<PairLine> found;
    std::copy_if(lines.begin(), lines.end(), std::back_inserter(found),
                 [&](const PairLine& line) { return line.part == part; });
    return found;
}

TEST(ViewPair, ARayEndsAtTheSamplesAndTheLightsPixel) {
    const ViewRays view = makeViewRays(squareCamera(), kSide, kSide);
    PairGeometry pair;
    pair.sampleWorld = {-1, -1, -4};
    pair.lightWorld = {1, 0.5f, -2};
    const std::vector<PairLine> lines = pairLines(view, pair);
    ASSERT_EQ(lines.size(), 1u) << "nothing blocks";
    EXPECT_EQ(lines[0].part, PairPart::kRay);
    expectNear(lines[0].from, pixelAt(-1, -1, 4));
    expectNear(lines[0].to, pixelAt(1, 0.5, 2));
}

TEST(ViewPair, ARayToALightBehindTheViewerEndsAtThePicturesBorder) {
    const ViewRays view = makeViewRays(squareCamera(), kSide, kSide);
    PairGeometry pair;
    pair.sampleWorld = {0, 0, -4};
    pair.lightWorld = {0, 8, 4}; // it crosses the picture's plane of view above its upper border
    std::vector<PairLine> lines = pairLines(view, pair);
    ASSERT_EQ(lines.size(), 1u);
    expectNear(lines[0].from, {50, 50});
    expectNear(lines[0].to, {50, -0.5});
    pair.sampleWorld = {9, 0, -4}; // the whole ray is to the right of the picture
    pair.lightWorld = {9, 1, -4};
    EXPECT_TRUE(pairLines(view, pair).empty());
    pair.sampleWorld = {0, 0, 1};
    EXPECT_TRUE(pairLines(view, {pair.sampleWorld, {0, 0, 2}, {}, {}, {}}).empty()) << "behind";
}

TEST(ViewPair, AVoxelIsAWireBoxAndTexelAndTriangleAreOutlines) {
    const ViewRays view = makeViewRays(squareCamera(), kSide, kSide);
    PairGeometry pair;
    pair.sampleWorld = {0, -1, -4};
    pair.lightWorld = {0, 1, -4};
    pair.voxelWorld = Box{{-0.5f, -0.25f, -3}, {0.25f, 0.5f, -2}};
    pair.texelWorld = std::array{glm::vec3(-1, 1, -4), glm::vec3(0, 1, -4), glm::vec3(0, 1, -2),
                                 glm::vec3(-1, 1, -2)};
    pair.triangleWorld = std::array{glm::vec3(0, 0, -2), glm::vec3(1, 0, -2), glm::vec3(0, 1, -4)};
    const std::vector<PairLine> lines = pairLines(view, pair);
    EXPECT_EQ(linesOf(lines, PairPart::kRay).size(), 1u);
    EXPECT_EQ(linesOf(lines, PairPart::kTexel).size(), 4u);
    const std::vector<PairLine> triangle = linesOf(lines, PairPart::kTriangle);
    ASSERT_EQ(triangle.size(), 3u);
    expectNear(triangle[0].from, {50, 50});
    expectNear(triangle[0].to, pixelAt(1, 0, 2));
    expectNear(triangle[1].to, pixelAt(0, 1, 4));
    expectNear(triangle[2].to, {50, 50});
    const std::vector<PairLine> box = linesOf(lines, PairPart::kVoxel);
    ASSERT_EQ(box.size(), 12u);
    // Each corner is the end of three edges.
    for (const double x : {-0.5, 0.25})
        for (const double y : {-0.25, 0.5})
            for (const double distance : {2.0, 3.0}) {
                const glm::dvec2 corner = pixelAt(x, y, distance);
                const auto count = std::count_if(box.begin(), box.end(), [&](const PairLine& edge) {
                    return glm::length(edge.from - corner) < 1e-4 ||
                           glm::length(edge.to - corner) < 1e-4;
                });
                EXPECT_EQ(count, 3) << x << " " << y << " " << distance;
            }
}

/// One light 2 m over the floor, a square of half 0.5 m midway; what a point in its umbra is told.
PairGeometry umbraPair(const char* model, const glm::vec3& point, uint32_t& faceTexels) {
    test::Stage stage(test::blockerScene({{0, test::kLightHeight, 0}}), 8);
    const Truth truth(stage.world);
    const FrameOptions options = test::smallFrame();
    const FrameResult frame =
        stage.renderer.render(test::roomCamera(), *makeCostModel(model), options);
    const glm::dvec3 pixel = pixelOfPoint(
        makeViewRays(test::roomCamera(), options.width, options.height), glm::dvec3(point));
    const PixelReport report =
        reportPixel(stage.renderer, stage.world, truth, frame, options,
                    uint32_t(std::lround(pixel.x)), uint32_t(std::lround(pixel.y)));
    EXPECT_EQ(report.pairs.size(), 1u);
    if (report.pairs.size() != 1)
        return {};
    faceTexels = report.pairs[0].faceTexels;
    const PairGeometry& geometry = report.pairs[0].geometry;
    EXPECT_EQ(geometry.sampleWorld, report.positionWorld);
    EXPECT_EQ(geometry.lightWorld, glm::vec3(0, test::kLightHeight, 0));
    return geometry;
}

TEST(ViewPair, VoxelTexelAndTriangleAreWhereTheSquareIs) {
    uint32_t faceTexels = 0;
    const PairGeometry pair = umbraPair("texels:0", {0.75f, 0, 0.75f}, faceTexels);
    ASSERT_TRUE(pair.voxelWorld && pair.texelWorld && pair.triangleWorld);
    for (const glm::vec3& corner : *pair.triangleWorld) {
        EXPECT_FLOAT_EQ(corner.y, test::kBlockerHeight);
        EXPECT_FLOAT_EQ(std::abs(corner.x), test::kBlockerHalf);
        EXPECT_FLOAT_EQ(std::abs(corner.z), test::kBlockerHalf);
    }
    // The grid's 256 voxels span the floor's 12 m; the ray crosses the square's plane midway.
    const Box& voxel = *pair.voxelWorld;
    EXPECT_NEAR(voxel.extent().x, 12.0 / 256, 1e-5);
    EXPECT_NEAR(voxel.extent().y, 12.0 / 256, 1e-5);
    EXPECT_LE(voxel.min.y, test::kBlockerHeight + 1e-5f);
    EXPECT_GE(voxel.max.y, test::kBlockerHeight - 1e-5f);
    const glm::vec3 midway = 0.5f * (pair.sampleWorld + pair.lightWorld);
    EXPECT_LT(distanceSquared(voxel, midway), std::pow(2 * 12.0f / 256, 2.0f));
    // The map's face looks down: at the square's depth, 1 m, a texel is 2 / N m wide.
    ASSERT_GT(faceTexels, 0u);
    const float side = 2.0f / float(faceTexels);
    const std::array<glm::vec3, 4>& texel = *pair.texelWorld;
    for (size_t i = 0; i < 4; ++i) {
        EXPECT_NEAR(texel[i].y, test::kBlockerHeight, 1e-4);
        EXPECT_NEAR(glm::length(texel[i] - texel[(i + 1) % 4]), side, 1e-4);
        EXPECT_LT(glm::length(texel[i] - midway), 4 * side);
    }
}

TEST(ViewPair, OfALitPairTheTexelUnderTheSampleIsDrawnAlone) {
    uint32_t faceTexels = 0;
    const PairGeometry pair = umbraPair("texels:0", {1.5f, 0, 1.0f}, faceTexels);
    EXPECT_FALSE(pair.voxelWorld);
    EXPECT_FALSE(pair.triangleWorld);
    ASSERT_TRUE(pair.texelWorld);
    Box box;
    for (const glm::vec3& corner : *pair.texelWorld) {
        EXPECT_NEAR(corner.y, 0.0f, 1e-4);
        box.add(corner + glm::vec3(0, 0.01f, 0));
        box.add(corner - glm::vec3(0, 0.01f, 0));
    }
    EXPECT_EQ(distanceSquared(box, pair.sampleWorld), 0.0f) << "the sample is in its texel";
    EXPECT_FALSE(umbraPair("texels:inf", {1.5f, 0, 1.0f}, faceTexels).texelWorld)
        << "rays have no map";
}

TEST(ViewPair, TheChosenLightIsDrawnElseTheFirstThatIsDark) {
    PixelReport pixel;
    EXPECT_EQ(drawnPair(pixel, 3), -1);
    pixel.pairs.resize(3);
    const int seen[] = {255, 0, 0};
    for (uint32_t i = 0; i < 3; ++i) {
        pixel.pairs[i].light = 10 + i;
        pixel.pairs[i].answers = {{"maps", 255 - seen[i], 1, ""}, {"truth", seen[i], 1, ""}};
    }
    EXPECT_EQ(drawnPair(pixel, 12), 2);
    EXPECT_EQ(drawnPair(pixel, -1), 1);
    EXPECT_EQ(drawnPair(pixel, 3), 1) << "a light that the pixel does not ask for";
    pixel.pairs[1].answers[1].visibility = pixel.pairs[2].answers[1].visibility = 255;
    EXPECT_EQ(drawnPair(pixel, -1), 0);
}

using Matrix = std::array<glm::dvec3, 3>; ///< rows

/// What colour vision deficiencies make of linear RGB. Source: Machado, Oliveira, Fernandes, A
/// Physiologically-based Model for Simulation of Color Vision Deficiency, 2009, severity 1.
constexpr std::array<Matrix, 4> kVisions{{
    {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}},
    {{{0.152286, 1.052583, -0.204868},
      {0.114503, 0.786281, 0.099216},
      {-0.003882, -0.048116, 1.051998}}},
    {{{0.367322, 0.860646, -0.227968},
      {0.280085, 0.672501, 0.047413},
      {-0.011820, 0.042940, 0.968881}}},
    {{{1.255528, -0.076749, -0.178779},
      {-0.078411, 0.930809, 0.147602},
      {0.004733, 0.691367, 0.303900}}},
}};

/// Returns CIE L*a*b* of a display colour as such an eye sees it.
glm::dvec3 labOf(const glm::vec3& display, const Matrix& vision) {
    glm::dvec3 linear;
    for (int i = 0; i < 3; ++i) {
        const double c = display[i];
        linear[i] = c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4);
    }
    glm::dvec3 seen;
    for (int i = 0; i < 3; ++i)
        seen[i] = std::clamp(glm::dot(vision[size_t(i)], linear), 0.0, 1.0);
    const auto f = [](double t) { return t > 0.008856 ? std::cbrt(t) : 7.787 * t + 16.0 / 116; };
    const double x = f(glm::dot(glm::dvec3(0.4124, 0.3576, 0.1805), seen) / 0.9505),
                 y = f(glm::dot(glm::dvec3(0.2126, 0.7152, 0.0722), seen)),
                 z = f(glm::dot(glm::dvec3(0.0193, 0.1192, 0.9505), seen) / 1.089);
    return {116 * y - 16, 500 * (x - y), 200 * (y - z)};
}

TEST(ViewPair, ColoursSurviveColourBlindness) {
    for (size_t vision = 0; vision < kVisions.size(); ++vision)
        for (size_t i = 0; i < kPairParts.size(); ++i) {
            const glm::dvec3 own = labOf(kPairParts[i].color, kVisions[vision]);
            for (size_t j = 0; j < i; ++j)
                EXPECT_GT(glm::length(own - labOf(kPairParts[j].color, kVisions[vision])), 20)
                    << kPairParts[i].name << " and " << kPairParts[j].name << ", vision " << vision;
            EXPECT_GT(glm::length(own - labOf(kPairParts[i].casing, kVisions[vision])), 40)
                << kPairParts[i].name << " on its casing, vision " << vision;
        }
}

} // namespace

} // namespace shadowdag
