// SPDX-License-Identifier: Apache-2.0
#include "hybrid/gbuffer/image_metrics.h"

#include "cuda/error.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

namespace shadowdag {
namespace {

TEST(ImageMetrics, RmseIsTheHandComputedOne) {
    // Squared differences 0.01, 0.04, 0.09 and 0, 0.25, 0: their mean over 6 values is 0.39 / 6.
    const std::vector<glm::vec3> a{{0.1f, 0.2f, 0.3f}, {1.0f, 0.5f, 0.0f}},
        b{{0.2f, 0.4f, 0.6f}, {1.0f, 0.0f, 0.0f}};
    EXPECT_NEAR(computeRmse(a, b), std::sqrt(0.39 / 6), 1e-7);
    EXPECT_EQ(computeRmse(a, b), computeRmse(b, a));
    EXPECT_EQ(computeRmse(a, a), 0.0);
    EXPECT_EQ(computeRmse({}, {}), 0.0);
}

using Picture = std::vector<glm::vec3>;

// Pictures of four pixels, one channel of which is looked at.
Picture pictureOf(const std::vector<float>& reds) {
    Picture picture;
    for (const float red : reds)
        picture.emplace_back(red, 0.0f, 0.0f);
    return picture;
}

TEST(FrameDifferenceError, AStandingErrorIsNoneAndAMovingOneIsTwice) {
    const Picture black = pictureOf({0, 0, 0, 0}), third = pictureOf({0, 0, 0.75f, 0}),
                  last = pictureOf({0, 0, 0, 0.75f});
    const double one = 0.75 / (3 * 4);
    EXPECT_EQ(computeFrameDifferenceError(third, third, black, black), 0.0) << "it stays";
    EXPECT_NEAR(computeFrameDifferenceError(black, third, black, black), one, 1e-9) << "it comes";
    EXPECT_NEAR(computeFrameDifferenceError(third, black, black, black), one, 1e-9) << "it goes";
    EXPECT_NEAR(computeFrameDifferenceError(third, last, black, black), 2 * one, 1e-9) << "moves";
}

TEST(FrameDifferenceError, IsTheDifferenceOfChanges) {
    const Picture a = pictureOf({0.1f, 0.2f, 0.3f, 0.4f}), b = pictureOf({0.4f, 0.2f, 0.2f, 0.4f}),
                  black = pictureOf({0, 0, 0, 0}), lit = pictureOf({0.3f, 0.1f, 0, 0});
    EXPECT_NEAR(computeFrameDifferenceError(a, b, a, b), 0.0, 1e-9);
    // Changes of 0.3, 0, -0.1, 0 against 0.3, 0.1, 0, 0.
    EXPECT_NEAR(computeFrameDifferenceError(a, b, black, lit), 0.2 / 12, 1e-7);
    EXPECT_EQ(computeFrameDifferenceError({}, {}, {}, {}), 0.0);
    EXPECT_THROW(computeFrameDifferenceError(a, b, black, {}), Error);
}

TEST(ImageMetrics, ImagesOfDifferentSizeAreRefused) {
    try {
        computeRmse(std::vector<glm::vec3>(3), std::vector<glm::vec3>(2));
        FAIL() << "accepted";
    } catch (const Error& e) {
        EXPECT_EQ(e.kind(), ErrorKind::kUsage);
        EXPECT_NE(std::string(e.what()).find("3 and 2"), std::string::npos) << e.what();
    }
}

} // namespace
} // namespace shadowdag
