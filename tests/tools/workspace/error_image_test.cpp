// SPDX-License-Identifier: Apache-2.0
#include "tools/workspace/error_image.h"

#include <gtest/gtest.h>

namespace shadowdag {

namespace {

/// Three pixels: two pairs, none, one pair.
PairList threePixels() {
    return {{0, 2, 2, 3}, {0, 1, 0}};
}

} // namespace

TEST(ErrorImage, CountsFalsePairsAPixel) {
    // Pair 0: dark, truly lit: false shadow. Pair 1: half lit counts as lit, truly dark: false
    // light. Pair 2: right.
    const PixelErrors errors = countPixelErrors(threePixels(), {127, 128, 0}, {255, 0, 0});
    EXPECT_EQ(errors.pairCount, (std::vector<float>{2, 0, 1}));
    EXPECT_EQ(errors.falseShadow, (std::vector<float>{1, 0, 0}));
    EXPECT_EQ(errors.falseLight, (std::vector<float>{1, 0, 0}));
}

TEST(ErrorImage, MeanVisibilityOfNoPairsIsLit) {
    EXPECT_EQ(meanVisibility(threePixels(), {255, 0, 51}), (std::vector<float>{0.5f, 1.0f, 0.2f}));
}

TEST(ErrorImage, RayShareIsTheShareOfPairsByRays) {
    EXPECT_EQ(rayShare(threePixels(), {Route::kRays, Route::kMap, Route::kRays}),
              (std::vector<float>{0.5f, 0.0f, 1.0f}));
}

TEST(ErrorImage, FalseShadowIsVermilionAndFalseLightBlue) {
    const PixelErrors errors{{1, 1, 1}, {1, 0, 0}, {0, 1, 0}};
    const std::vector<glm::vec3> picture =
        errorPicture(std::vector<glm::vec3>(3, glm::vec3(0.5f)), errors);
    EXPECT_GT(picture[0].r, picture[0].b + 0.5f);
    EXPECT_GT(picture[1].b, picture[1].r + 0.5f);
    EXPECT_FLOAT_EQ(picture[2].r, picture[2].b);
}

TEST(ErrorImage, ALightInTheMiddleIsDrawnInTheMiddle) {
    Camera camera; // at the origin, along -z
    Light light;
    light.positionWorld = {0, 0, -5};
    MapRecord map;
    map.quantities.light = 0;
    map.route = Route::kMap;
    const std::vector<glm::vec3> picture =
        methodPicture(std::vector<glm::vec3>(21 * 21, glm::vec3(0.0f)),
                      std::vector<float>(21 * 21, 1.0f), {map}, {light}, camera, 21, 21);
    const glm::vec3 middle = picture[10 * 21 + 10], corner = picture[0];
    EXPECT_GT(middle.r, middle.b + 0.5f); // orange: a map
    EXPECT_GT(corner.b, corner.r);        // sky blue: rays
}

TEST(ErrorImage, PointsAreWhereTheCameraSeesThem) {
    Camera camera; // at the origin, along -z
    const float edge = 5 * std::tan(camera.yfov * 0.5f);
    EXPECT_EQ(pixelOf({0, 0, -5}, camera, 40, 20), glm::vec2(20, 10));
    const glm::vec2 above = pixelOf({edge, 0.5f * edge, -5}, camera, 40, 20).value();
    EXPECT_NEAR(above.x, 30, 1e-4f); // as far to the right as half of the height
    EXPECT_NEAR(above.y, 5, 1e-4f);
    EXPECT_FALSE(pixelOf({0, 0, 5}, camera, 40, 20)) << "behind the camera";
}

TEST(ErrorImage, LightsOfASmallerPictureCoverTheSameShareOfIt) {
    Camera camera;
    Light light;
    light.positionWorld = {0, 0, -5};
    MapRecord map;
    map.quantities.light = 0;
    map.route = Route::kMap;
    const auto coveredShare = [&](uint32_t side, float scale) {
        const size_t count = size_t(side) * side;
        const std::vector<glm::vec3> picture = methodPicture(
            std::vector<glm::vec3>(count, glm::vec3(0.0f)), std::vector<float>(count, 1.0f), {map},
            {light}, camera, side, side, scale);
        size_t covered = 0;
        for (const glm::vec3& p : picture)
            covered += p.r > p.b || p == glm::vec3(1.0f);
        return double(covered) / double(count);
    };
    // Sides at which a quarter still draws a disc of several pixels.
    for (const uint32_t full : {720u, 1440u}) {
        const double share = coveredShare(full, 1);
        EXPECT_NEAR(coveredShare(full / 4, 0.25f) / share, 1.0, 0.35) << full;
        EXPECT_LT(coveredShare(full / 8, 0.125f) / share, 3.0) << full;
        EXPECT_GT(coveredShare(full / 8, 0.125f), 0.0) << full;
    }
}

} // namespace shadowdag
