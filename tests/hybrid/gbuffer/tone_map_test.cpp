// SPDX-License-Identifier: Apache-2.0
#include "hybrid/gbuffer/tone_map.h"

#include "scenes/light.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace shadowdag {
namespace {

TEST(ToneMap, CurveAndTransferAreTheHandComputedOnes) {
    // x = 0.5: 0.5 * 1.285 / (0.5 * 1.805 + 0.14) = 0.6425 / 1.0425 = 0.616307; sRGB: 1.055 *
    // 0.616307^(1/2.4) - 0.055.
    const std::vector<glm::vec3> shown = toneMap({{0.5f, 0.25f, 0.0f}}, 1.0f);
    EXPECT_NEAR(shown[0].x, 0.807319f, 1e-5f);
    EXPECT_EQ(shown[0].z, 0.0f);
    EXPECT_EQ(toneMap({{0.25f, 0.125f, 0.0f}}, 2.0f)[0], shown[0]);
}

TEST(ToneMap, EveryInputGivesADisplayValue) {
    const float inf = std::numeric_limits<float>::infinity();
    const std::vector<glm::vec3> shown =
        toneMap({{-1.0f, std::nanf(""), inf}, {1e30f, 1e-30f, 3.0f}}, 1.0f);
    EXPECT_EQ(shown[0].x, 0.0f);
    EXPECT_EQ(shown[0].y, 0.0f);
    EXPECT_EQ(shown[0].z, 1.0f);
    EXPECT_EQ(shown[1].x, 1.0f);
    for (const glm::vec3& p : shown)
        for (int c = 0; c < 3; ++c)
            EXPECT_TRUE(p[c] >= 0.0f && p[c] <= 1.0f);
}

TEST(ToneMap, IsMonotone) {
    float last = -1.0f;
    for (float x = 0.0f; x < 30.0f; x += 0.01f) {
        const float shown = toneMap({glm::vec3(x)}, 1.0f)[0].x;
        ASSERT_GE(shown, last) << x;
        last = shown;
    }
    EXPECT_EQ(last, 1.0f);
}

TEST(ToneMap, SrgbTransferInverts) {
    EXPECT_EQ(srgbFromLinear(1.0f), 1.0f);
    EXPECT_NEAR(srgbFromLinear(0.2140411f), 0.5f, 1e-6f);
    for (float x = 0.0f; x <= 1.0f; x += 0.001f)
        ASSERT_NEAR(linearFromSrgb(srgbFromLinear(x)), x, 1e-6f);
}

TEST(ToneMap, AutoExposurePutsTheMedianLitPixelAtMiddleGrey) {
    // The median of 0.5, 2 and 8 is 2; black and infinite pixels do not count, nor does what only
    // the ambient light reaches, however much of it there is.
    const float inf = std::numeric_limits<float>::infinity();
    std::vector<glm::vec3> image{glm::vec3(0.5f), glm::vec3(8.0f), glm::vec3(2.0f), glm::vec3(0.0f),
                                 glm::vec3(inf)};
    EXPECT_NEAR(autoExposure(image), 0.09f, 1e-6f);
    image.insert(image.end(), 100, glm::vec3(0.8f * kAmbientRadiance));
    EXPECT_NEAR(autoExposure(image), 0.09f, 1e-6f);
    // Where nothing is lit, what there is.
    EXPECT_NEAR(autoExposure({glm::vec3(0.01f), glm::vec3(0.0f)}), 18.0f, 1e-4f);
    EXPECT_EQ(autoExposure({glm::vec3(0.0f)}), 1.0f);
    EXPECT_EQ(autoExposure({}), 1.0f);
}

} // namespace
} // namespace shadowdag
