// SPDX-License-Identifier: Apache-2.0
#include "scenes/light.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace shadowdag {
namespace {

Light pointLight() {
    Light light;
    light.positionWorld = {1, 0, 0};
    light.rangeWorld = 4.0f;
    light.intensity = {8, 16, 0};
    return light;
}

// Looks along -z; full within 60 degrees of opening (half angle 30), dark outside 120 (half angle
// 60).
Light spotLight() {
    Light light = pointLight();
    light.kind = Light::kSpot;
    light.positionWorld = {0, 0, 0};
    light.cosInner = std::sqrt(0.75f);
    light.cosOuter = 0.5f;
    return light;
}

TEST(Light, RangeIsHalfOpen) {
    const Light light = pointLight();
    EXPECT_FALSE(lightReaches(light, {5, 0, 0}));
    EXPECT_TRUE(lightReaches(light, {std::nextafter(5.0f, 0.0f), 0, 0}));
    EXPECT_FALSE(lightReaches(light, light.positionWorld));
    EXPECT_EQ(lightIrradiance(light, {5, 0, 0}), glm::vec3(0.0f));
}

// intensity / d^2 * (1 - (d / range)^4): at d = 2, 8 / 4 * 15 / 16.
TEST(Light, IrradianceFallsAsInTheExtension) {
    const glm::vec3 e = lightIrradiance(pointLight(), {3, 0, 0});
    EXPECT_FLOAT_EQ(e.x, 1.875f);
    EXPECT_FLOAT_EQ(e.y, 3.75f);
    EXPECT_EQ(e.z, 0.0f);
}

TEST(Light, IrradianceReachesZeroAtTheRange) {
    const glm::vec3 e = lightIrradiance(pointLight(), {1.0f + 4.0f * (1.0f - 1e-6f), 0, 0});
    EXPECT_GT(e.x, 0.0f);
    EXPECT_LT(e.x, 1e-5f);
}

TEST(Light, SpotIsFullInsideTheInnerConeAndDarkOutsideTheOuter) {
    const Light spot = spotLight();
    const auto at = [&](float degrees) { // at distance 2
        const float a = degrees * 0.017453292f;
        return lightIrradiance(spot, {2.0f * std::sin(a), 0, -2.0f * std::cos(a)}).x;
    };
    EXPECT_FLOAT_EQ(at(0), 1.875f);
    EXPECT_FLOAT_EQ(at(29), 1.875f);
    EXPECT_LT(at(59), 0.01f);
    EXPECT_EQ(at(61), 0.0f);
    EXPECT_EQ(at(180), 0.0f);
    // Half way in cosine the square of one half remains.
    const float middle = 57.29578f * std::acos(0.5f * (spot.cosInner + spot.cosOuter));
    EXPECT_NEAR(at(middle), 1.875f * 0.25f, 1e-5f);
}

TEST(Light, PointOnTheOuterConeIsDark) {
    Light spot = spotLight();
    spot.cosOuter = 0.6f;
    EXPECT_FALSE(lightReaches(spot, {0.8f * 2.0f, 0, -0.6f * 2.0f - 1e-6f * 0.0f}));
    EXPECT_TRUE(lightReaches(spot, {0.79f * 2.0f, 0, -0.61f * 2.0f}));
    spot.cosOuter = 0.0f; // a half space, its border out
    EXPECT_FALSE(lightReaches(spot, {1, 0, 0}));
    EXPECT_TRUE(lightReaches(spot, {1, 0, -1e-3f}));
}

// The test without a root agrees with the cosine, for every opening, away from the cone itself.
TEST(Light, ConeTestAgreesWithTheCosine) {
    constexpr unsigned kSeed = 5;
    std::mt19937 random(kSeed);
    std::uniform_real_distribution<float> uniform(-1.0f, 1.0f);
    Light spot = spotLight();
    for (int i = 0; i < 100000; ++i) {
        spot.cosOuter = uniform(random);
        spot.directionWorld =
            glm::normalize(glm::vec3(uniform(random), uniform(random), uniform(random)));
        const glm::vec3 p(uniform(random), uniform(random), uniform(random));
        const double cosine =
            glm::dot(glm::dvec3(p), glm::dvec3(spot.directionWorld)) / glm::length(glm::dvec3(p));
        if (std::fabs(cosine - double(spot.cosOuter)) < 1e-5)
            continue;
        ASSERT_EQ(lightReaches(spot, p), cosine > double(spot.cosOuter))
            << "seed " << kSeed << ", case " << i;
    }
}

} // namespace
} // namespace shadowdag
