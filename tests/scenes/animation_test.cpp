// SPDX-License-Identifier: Apache-2.0
#include "scenes/animation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace shadowdag {
namespace {

using Interpolation = AnimationChannel::Interpolation;

AnimationChannel translation(Interpolation interpolation, std::vector<glm::vec4> values) {
    AnimationChannel channel;
    channel.interpolation = interpolation;
    channel.times = {1.0f, 3.0f};
    channel.values = std::move(values);
    return channel;
}

TEST(Animation, StepHoldsTheEarlierKey) {
    const AnimationChannel c = translation(Interpolation::kStep, {{1, 2, 3, 0}, {5, 6, 7, 0}});
    EXPECT_EQ(sampleChannel(c, 0.0f).x, 1.0f);
    EXPECT_EQ(sampleChannel(c, 2.999f).x, 1.0f);
    EXPECT_EQ(sampleChannel(c, 3.0f).x, 5.0f);
    EXPECT_EQ(sampleChannel(c, 9.0f).x, 5.0f);
}

TEST(Animation, LinearIsTheMixOfItsKeys) {
    const AnimationChannel c = translation(Interpolation::kLinear, {{1, 2, 3, 0}, {5, 6, 7, 0}});
    EXPECT_EQ(sampleChannel(c, 0.0f), glm::vec4(1, 2, 3, 0));
    EXPECT_EQ(sampleChannel(c, 1.5f), glm::vec4(2, 3, 4, 0));
    EXPECT_EQ(sampleChannel(c, 3.0f), glm::vec4(5, 6, 7, 0));
}

// A cubic through its own values and slopes is reproduced: p(t) = t^3 - 2 t, with p' = 3 t^2 - 2.
TEST(Animation, CubicSplineReproducesACubic) {
    const auto p = [](float t) { return t * t * t - 2.0f * t; };
    const auto slope = [](float t) { return 3.0f * t * t - 2.0f; };
    const AnimationChannel c = translation(Interpolation::kCubicSpline,
                                           {glm::vec4(99), glm::vec4(p(1)), glm::vec4(slope(1)),
                                            glm::vec4(slope(3)), glm::vec4(p(3)), glm::vec4(99)});
    for (float t : {1.0f, 1.25f, 1.5f, 2.0f, 2.75f, 3.0f})
        EXPECT_FLOAT_EQ(sampleChannel(c, t).x, p(t)) << t;
    EXPECT_EQ(sampleChannel(c, 0.0f).x, p(1));
    EXPECT_EQ(sampleChannel(c, 4.0f).x, p(3));
}

TEST(Animation, RotationTurnsAtConstantSpeed) {
    AnimationChannel c = translation(Interpolation::kLinear,
                                     {{0, 0, 0, 1}, {0, 0, std::sqrt(0.5f), std::sqrt(0.5f)}});
    c.path = AnimationChannel::Path::kRotation;
    for (float t : {1.0f, 1.3f, 2.0f, 2.9f}) {
        const float half = 0.78539816f * (t - 1.0f) / 2.0f; // half the angle of a quarter turn
        EXPECT_NEAR(sampleChannel(c, t).z, std::sin(half), 1e-7f);
        EXPECT_NEAR(sampleChannel(c, t).w, std::cos(half), 1e-7f);
    }
}

TEST(Animation, RotationTakesTheShorterWay) {
    AnimationChannel c = translation(Interpolation::kLinear, {{0, 0, 0, 1}, {0, 0, -0.6f, -0.8f}});
    c.path = AnimationChannel::Path::kRotation;
    EXPECT_GT(sampleChannel(c, 2.0f).w, 0.9f);
    EXPECT_GT(sampleChannel(c, 2.0f).z, 0.3f);
}

// Against the closed form sin((1 - t) a) / sin a, sin(t a) / sin a.
TEST(Animation, SlerpAgreesWithTheClosedForm) {
    constexpr unsigned kSeed = 11;
    std::mt19937 random(kSeed);
    std::normal_distribution<double> normal;
    std::uniform_real_distribution<double> uniform(0.0, 1.0);
    for (int i = 0; i < 1000; ++i) {
        const glm::dvec4 a = glm::normalize(
            glm::dvec4(normal(random), normal(random), normal(random), normal(random)));
        glm::dvec4 b = glm::normalize(
            glm::dvec4(normal(random), normal(random), normal(random), normal(random)));
        const double t = uniform(random);
        const glm::dvec4 got = slerp(a, b, t);
        if (glm::dot(a, b) < 0.0)
            b = -b;
        const double angle = std::acos(glm::dot(a, b));
        const glm::dvec4 expected =
            (std::sin((1 - t) * angle) * a + std::sin(t * angle) * b) / std::sin(angle);
        EXPECT_LT(glm::length(got - expected), 1e-12) << "seed " << kSeed << ", case " << i;
    }
    const glm::dvec4 a(0, 0, 0, 1);
    EXPECT_EQ(slerp(a, a, 0.3), a);
    EXPECT_EQ(slerp(a, -a, 0.3), a); // the same rotation
    EXPECT_EQ(slerp(a, glm::dvec4(1, 0, 0, 0), 0.0), a);
    EXPECT_LT(glm::length(slerp(a, glm::dvec4(1, 0, 0, 0), 1.0) - glm::dvec4(1, 0, 0, 0)), 1e-15);
}

TEST(Animation, SingleKeyHoldsAlways) {
    AnimationChannel c = translation(Interpolation::kLinear, {{4, 0, 0, 0}});
    c.times = {2.0f};
    for (float t : {0.0f, 2.0f, 5.0f})
        EXPECT_EQ(sampleChannel(c, t).x, 4.0f);
}

} // namespace
} // namespace shadowdag
