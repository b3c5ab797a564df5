// SPDX-License-Identifier: Apache-2.0
// The filter of base colour textures: values known in closed form, and averages that every level
// keeps.
#include "scenes/base_color.h"

#include <gtest/gtest.h>

#include <random>

namespace shadowdag {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

BaseColorView viewOfSet(const TextureSet& set) {
    BaseColorView view;
    view.textures = viewOf(set.textures);
    view.texels = viewOf(set.texels);
    view.linear = viewOf(linearFromSrgb());
    return view;
}

/// Black, red / green, white.
ColorImage fourTexels() {
    return {2, 2, {0, 0, 0, 255, 0, 0, 0, 255, 0, 255, 255, 255}};
}

glm::vec3 seen(const TextureSet& set, const glm::dvec2& at, double footprint = 0.0) {
    return viewOfSet(set).filtered(set.textures.at(0), at, {footprint, 0.0}, {0.0, footprint});
}

void expectColor(const glm::vec3& color, const glm::vec3& expected, float tolerance = 1e-6f) {
    for (int channel = 0; channel < 3; ++channel)
        EXPECT_NEAR(color[channel], expected[channel], tolerance) << "channel " << channel;
}

TEST(BaseColor, SrgbIsDecodedAsTheStandardSays) {
    EXPECT_EQ(linearFromSrgb()[0], 0.0f);
    EXPECT_EQ(linearFromSrgb()[255], 1.0f);
    EXPECT_NEAR(linearFromSrgb()[10], 10.0 / 255.0 / 12.92, 1e-8); // in the linear part
    EXPECT_NEAR(linearFromSrgb()[128], 0.2158605, 1e-6);
}

TEST(BaseColor, TexelCentresHaveTheirColourAndPointsBetweenTheLinearMean) {
    TextureSet set;
    set.add(fourTexels(), MaskWrap::kClamp, MaskWrap::kClamp, false);
    expectColor(seen(set, {0.25, 0.25}), {0, 0, 0});
    expectColor(seen(set, {0.75, 0.25}), {1, 0, 0});
    expectColor(seen(set, {0.25, 0.75}), {0, 1, 0});
    expectColor(seen(set, {0.75, 0.75}), {1, 1, 1});
    expectColor(seen(set, {0.5, 0.5}), {0.5f, 0.5f, 0.25f});
    expectColor(seen(set, {0.375, 0.25}), {0.25f, 0, 0});
    // The mean of codes would be 0.2159 in linear light.
    expectColor(seen(set, {0.5, 0.25}), {0.5f, 0, 0});
}

TEST(BaseColor, WrapModesContinueTheTexture) {
    const auto at = [](MaskWrap wrap, double u) {
        TextureSet set;
        set.add(fourTexels(), wrap, MaskWrap::kClamp, false);
        return seen(set, {u, 0.25}).x;
    };
    EXPECT_NEAR(at(MaskWrap::kRepeat, 1.25), 0.0, 1e-6);
    EXPECT_NEAR(at(MaskWrap::kMirror, 1.25), 1.0, 1e-6);
    EXPECT_NEAR(at(MaskWrap::kClamp, 1.25), 1.0, 1e-6);
    EXPECT_NEAR(at(MaskWrap::kRepeat, -0.25), 1.0, 1e-6);
    EXPECT_NEAR(at(MaskWrap::kMirror, -0.25), 0.0, 1e-6);
    EXPECT_NEAR(at(MaskWrap::kClamp, -0.25), 0.0, 1e-6);
    EXPECT_NEAR(at(MaskWrap::kRepeat, 0.0), 0.5, 1e-6) << "the opposite border is next";
    EXPECT_NEAR(at(MaskWrap::kMirror, 0.0), 0.0, 1e-6);
    EXPECT_NEAR(at(MaskWrap::kRepeat, 7.75), 1.0, 1e-6);
}

TEST(BaseColor, NearestTexturesHaveSharpTexelsWhereMagnified) {
    TextureSet set;
    set.add(fourTexels(), MaskWrap::kRepeat, MaskWrap::kRepeat, true);
    expectColor(seen(set, {0.49, 0.01}), {0, 0, 0});
    expectColor(seen(set, {0.51, 0.01}), {1, 0, 0});
    expectColor(seen(set, {0.51, 0.01}, 4.0), {0.5f, 0.5f, 0.25f}, 3e-3f);
}

// A pixel as large as the texture sees its mean; codes of 8 bits are at most 0.0045 apart.
TEST(BaseColor, LargePixelsSeeTheMean) {
    TextureSet set;
    set.add(fourTexels(), MaskWrap::kRepeat, MaskWrap::kRepeat, false);
    for (const double footprint : {1.0, 3.0, 1e6, 1e200, kInfinity})
        expectColor(seen(set, {0.1, 0.8}, footprint), {0.5f, 0.5f, 0.25f}, 3e-3f);
    expectColor(seen(set, {0.1, 0.8}, std::nan("")), {0.5f, 0.5f, 0.25f}, 3e-3f);
}

// Columns of black and white: along them a pixel may be eight times as long as wide.
TEST(BaseColor, GrazingPixelsAreBlurredAlongTheirLongAxisOnly) {
    ColorImage image{64, 64, {}};
    for (int i = 0; i < 64 * 64; ++i)
        image.rgb.insert(image.rgb.end(), 3, i % 16 < 8 ? uint8_t(0) : uint8_t(255));
    TextureSet set;
    set.add(image, MaskWrap::kRepeat, MaskWrap::kRepeat, false);
    const BaseColorView view = viewOfSet(set);
    const double texel = 1.0 / 64.0;
    for (const double u : {4.0, 12.0}) {
        const glm::vec3 color =
            view.filtered(set.textures[0], {u * texel, 0.3}, {texel, 0.0}, {0.0, 8.0 * texel});
        EXPECT_NEAR(color.x, u > 8.0 ? 1.0 : 0.0, 1e-6);
        const glm::vec3 across = view.filtered(set.textures[0], {u * texel, 0.3},
                                               {16.0 * texel, 0.0}, {0.0, 2.0 * texel});
        EXPECT_NEAR(across.x, 0.5, 0.02);
    }
}

TEST(BaseColor, EveryLevelHasTheMeanOfTheImage) {
    constexpr unsigned kSeed = 20260901;
    std::mt19937 random(kSeed);
    for (int round = 0; round < 60; ++round) {
        ColorImage image{1 + uint32_t(random() % 40), 1 + uint32_t(random() % 40), {}};
        glm::dvec3 mean(0.0);
        for (uint32_t i = 0; i < 3 * image.width * image.height; ++i) {
            image.rgb.push_back(uint8_t(random()));
            mean[int(i % 3)] += linearFromSrgb()[image.rgb.back()];
        }
        mean /= double(image.width) * image.height;
        TextureSet set;
        set.add({1, 1, {1, 2, 3}}, MaskWrap::kClamp, MaskWrap::kClamp, false);
        EXPECT_EQ(set.add(image, MaskWrap::kClamp, MaskWrap::kClamp, false), 1u);
        size_t at = set.textures[1].firstTexel;
        EXPECT_EQ(at, 1u);
        for (uint32_t w = image.width, h = image.height;;
             w = std::max(w / 2, 1u), h = std::max(h / 2, 1u)) {
            glm::dvec3 sum(0.0);
            for (uint32_t i = 0; i < w * h; ++i, ++at)
                for (int channel = 0; channel < 3; ++channel)
                    sum[channel] += linearFromSrgb()[set.texels.at(at) >> (8 * channel) & 255u];
            for (int channel = 0; channel < 3; ++channel)
                EXPECT_NEAR(sum[channel] / (double(w) * h), mean[channel], 4.6e-3)
                    << "seed " << kSeed << ", round " << round << ", " << w << " x " << h;
            if (w == 1 && h == 1)
                break;
        }
        EXPECT_EQ(at, set.texels.size());
    }
}

TEST(BaseColor, HalfTheLogarithmIsExactAtPowersOfTwo) {
    EXPECT_EQ(halfLog2(1.0), 0.0);
    EXPECT_EQ(halfLog2(0x1p10), 5.0);
    EXPECT_EQ(halfLog2(std::nan("")), 0.0);
    for (double x = 1.0; x < 1e6; x *= 1.01) {
        EXPECT_LE(halfLog2(x), 0.5 * std::log2(x) + 1e-12);
        EXPECT_GE(halfLog2(x), 0.5 * std::log2(x) - 0.044);
    }
}

} // namespace
} // namespace shadowdag
