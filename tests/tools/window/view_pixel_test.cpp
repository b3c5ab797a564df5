// SPDX-License-Identifier: Apache-2.0
// A pixel's pairs and a light's map under a square above a floor, both with known values.
#include "tools/window/view_pixel.h"

#include "hybrid/gbuffer/view_rays.h"
#include "hybrid/judge/truth.h"
#include "tests/hybrid/blocker_stage.h"
#include "tools/window/view_overlay.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

namespace shadowdag {

namespace {

using test::kLightHeight;
using testing::HasSubstr;

/// One light 2 m over the floor, a square of half 0.5 m midway: its umbra has half 1 m.
struct Umbra {
    Umbra() : stage(test::blockerScene({{0, kLightHeight, 0}}), 8), truth(stage.world) {}

    /// Renders by a model and reports the pixel of a point.
    PixelReport at(const char* model, const glm::dvec3& point) {
        frame = stage.renderer.render(test::roomCamera(), *makeCostModel(model), options);
        const ViewRays view = makeViewRays(test::roomCamera(), options.width, options.height);
        const glm::dvec3 d = point - view.origin;
        const double depth = glm::dot(d, view.forward);
        const double x = (glm::dot(d, view.right) / depth - view.firstX) / view.pixelSize,
                     y = (view.firstY - glm::dot(d, view.up) / depth) / view.pixelSize;
        return reportPixel(stage.renderer, stage.world, truth, frame, options,
                           uint32_t(std::lround(x)), uint32_t(std::lround(y)));
    }

    test::Stage stage;
    Truth truth;
    FrameOptions options = test::smallFrame();
    FrameResult frame;
};

TEST(ViewPixel, EveryMethodSeesTheUmbraAndItsOutside) {
    Umbra umbra;
    for (const char* model : {"texels:0", "texels:inf"})
        for (const auto& [point, isDark] :
             {std::pair(glm::dvec3(0.75, 0, 0.75), true), {glm::dvec3(1.5, 0, 1.0), false}}) {
            SCOPED_TRACE(std::string(model) + (isDark ? ", umbra" : ", outside"));
            const PixelReport pixel = umbra.at(model, point);
            ASSERT_TRUE(pixel.hasSample);
            EXPECT_NEAR(pixel.positionWorld.x, point.x, 0.06); // half a pixel's side there
            EXPECT_NEAR(pixel.positionWorld.y, 0.0, 1e-5);
            EXPECT_NEAR(pixel.positionWorld.z, point.z, 0.06);
            EXPECT_EQ(pixel.normalWorld, glm::vec3(0, 1, 0));
            EXPECT_THAT(pixel.surface, HasSubstr("triangle"));
            ASSERT_EQ(pixel.pairs.size(), 1u);
            const PixelPair& pair = pixel.pairs[0];
            const float distance = glm::length(glm::vec3(0, kLightHeight, 0) - pixel.positionWorld);
            EXPECT_NEAR(pair.distanceWorld, distance, 1e-5);
            EXPECT_NEAR(pair.cosine, kLightHeight / distance, 1e-5);
            const bool isMap = model == std::string("texels:0");
            EXPECT_EQ(pair.servedBy, isMap ? "map" : "rays");
            EXPECT_GT(pair.requestedTexels, 0.0f);
            ASSERT_EQ(pair.answers.size(), 4u);
            for (const PairResult& answer : pair.answers) {
                if (answer.method == "maps" && !isMap) {
                    EXPECT_EQ(answer.visibility, -1);
                    EXPECT_EQ(answer.blocker, "no map of it is drawn");
                    continue;
                }
                EXPECT_EQ(answer.visibility, isDark ? 0 : 255) << answer.method;
                EXPECT_GT(answer.nanoseconds, 0.0) << answer.method;
                EXPECT_EQ(answer.blocker.empty(), !isDark) << answer.method;
            }
        }
}

TEST(ViewPixel, BackgroundAndPixelsOutsideHaveNoPairs) {
    Umbra umbra;
    umbra.at("texels:0", {0, 0, 0});
    const auto report = [&](uint32_t x, uint32_t y) {
        return reportPixel(umbra.stage.renderer, umbra.stage.world, umbra.truth, umbra.frame,
                           umbra.options, x, y);
    };
    const GBufferView gbuffer = umbra.stage.renderer.gbuffer();
    uint32_t background = 0;
    while (background < gbuffer.count() && gbuffer.triangle[background] != kBackground)
        ++background;
    if (background < gbuffer.count()) {
        const PixelReport pixel = report(background % gbuffer.width, background / gbuffer.width);
        EXPECT_FALSE(pixel.hasSample);
        EXPECT_TRUE(pixel.pairs.empty());
    }
    EXPECT_FALSE(report(gbuffer.width, 0).hasSample);
    EXPECT_FALSE(report(0, gbuffer.height).hasSample);
}

TEST(ViewOverlay, TheUnfoldedMapShowsTheViewOfTheLight) {
    Umbra umbra;
    umbra.at("texels:0", {0, 0, 0});
    const ViewRequest request;
    const std::vector<glm::vec3> display(umbra.options.width * umbra.options.height);
    const UnfoldedMap map = drawUnfoldedMap({umbra.stage.renderer,
                                             umbra.stage.world,
                                             umbra.frame,
                                             umbra.options,
                                             request,
                                             test::roomCamera(),
                                             display,
                                             {}});
    ASSERT_EQ(map.width, 4u * 96);
    ASSERT_EQ(map.height, 3u * 96);
    EXPECT_THAT(map.title, HasSubstr("light 0"));
    const auto at = [&](uint32_t x, uint32_t y) { return &map.rgba[4 * (y * map.width + x)]; };
    // A cross of six faces: its corners are empty.
    for (const auto& [column, row] : {std::pair(0, 0), {2, 0}, {3, 0}, {0, 2}, {2, 2}, {3, 2}})
        EXPECT_EQ(at(uint32_t(column) * 96 + 48, uint32_t(row) * 96 + 48)[3], 0);
    // Below the light the square, 1 m away: 0.12 + 0.85 sqrt(min(1, range / 8 z)), range 9 m.
    const auto brightest = [&](uint32_t fromX, uint32_t toX, uint32_t fromY, uint32_t toY) {
        int most = 0;
        for (uint32_t y = fromY; y < toY; ++y)
            for (uint32_t x = fromX; x < toX; ++x)
                most = std::max(most, int(at(96 + x, 192 + y)[0]));
        return most;
    };
    EXPECT_NEAR(brightest(44, 52, 44, 52), 255 * 0.97, 2);
    // Beside it, from half the face's half width on, the floor, 2 m away.
    EXPECT_NEAR(brightest(2, 20, 2, 94), 255 * (0.12 + 0.85 * std::sqrt(9.0 / 16.0)), 2);
    ViewRequest none;
    none.light = 3;
    EXPECT_TRUE(drawUnfoldedMap({umbra.stage.renderer,
                                 umbra.stage.world,
                                 umbra.frame,
                                 umbra.options,
                                 none,
                                 test::roomCamera(),
                                 display,
                                 {}})
                    .rgba.empty());
}

} // namespace

} // namespace shadowdag
