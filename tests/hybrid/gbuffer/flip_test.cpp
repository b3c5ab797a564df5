// SPDX-License-Identifier: Apache-2.0
// FLIP compared with values computed from the paper: by hand if possible, otherwise by
// flip_reference.py.
#include "hybrid/gbuffer/flip.h"

#include "cuda/backend.h"
#include "cuda/error.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

namespace shadowdag {
namespace {

using Image = std::vector<glm::vec3>;

constexpr uint32_t kWidth = 24, kHeight = 16;

/// The two pictures of flip_reference.py.
void makePictures(Image& a, Image& b) {
    a.clear();
    for (uint32_t y = 0; y < kHeight; ++y)
        for (uint32_t x = 0; x < kWidth; ++x)
            a.emplace_back(float(x) / 23.0f, float(y) / 15.0f, float((x * 5 + y * 3) % 8) / 7.0f);
    b = a;
    for (uint32_t y = 4; y < 9; ++y)
        for (uint32_t x = 6; x < 12; ++x)
            b[y * kWidth + x] = glm::min(b[y * kWidth + x] + 0.25f, glm::vec3(1.0f));
    for (uint32_t y = 0; y < kHeight; ++y)
        b[y * kWidth + 17] = glm::vec3(0.0f);
    b[12 * kWidth + 3] = {1.0f, 0.0f, 0.5f};
}

TEST(Flip, AgreesWithTheIndependentReference) {
    Image a, b;
    makePictures(a, b);
    std::vector<float> map;
    EXPECT_NEAR(computeFlip(a, b, kWidth, kHeight, &map), 0.188240564, 1e-5);
    ASSERT_EQ(map.size(), size_t(kWidth) * kHeight);
    struct Pixel {
        uint32_t x, y;
        double value;
    };
    // Printed by flip_reference.py. The tolerance is that of float planes, and of 1 / largest near
    // equal colours.
    constexpr Pixel kPixels[] = {{0, 0, 0.001306533},  {3, 12, 0.444240979}, {8, 6, 0.641012052},
                                 {12, 6, 0.386185580}, {17, 8, 0.469826041}, {18, 2, 0.337631003},
                                 {23, 15, 0.073523778}};
    for (const Pixel& p : kPixels)
        EXPECT_NEAR(map[p.y * kWidth + p.x], p.value, 3e-5) << p.x << " " << p.y;
}

TEST(Flip, EqualImagesDoNotDiffer) {
    Image a, b;
    makePictures(a, b);
    std::vector<float> map;
    EXPECT_EQ(computeFlip(a, a, kWidth, kHeight, &map), 0.0);
    EXPECT_EQ(*std::max_element(map.begin(), map.end()), 0.0f);
}

TEST(Flip, BlackToWhiteIsTheClosedForm) {
    // No features in flat images; greys have no chroma, so HyAB is the 100 of lightness:
    // 0.95 + (100^0.7 / c_max - 0.4) / 0.6 * 0.05 with c_max the compressed distance of green to
    // blue.
    const Image black(kWidth * kHeight, glm::vec3(0.0f)), white(kWidth * kHeight, glm::vec3(1.0f));
    std::vector<float> map;
    EXPECT_NEAR(computeFlip(black, white, kWidth, kHeight, &map), 0.967379, 1e-5);
    EXPECT_NEAR(*std::min_element(map.begin(), map.end()), 0.967379f, 1e-5f);
}

TEST(Flip, GreenToBlueIsOne) {
    const Image green(kWidth * kHeight, glm::vec3(0, 1, 0)),
        blue(kWidth * kHeight, glm::vec3(0, 0, 1));
    EXPECT_NEAR(computeFlip(green, blue, kWidth, kHeight), 1.0, 1e-5);
}

TEST(Flip, IsSymmetric) {
    Image a, b;
    makePictures(a, b);
    std::vector<float> ab, ba;
    computeFlip(a, b, kWidth, kHeight, &ab);
    computeFlip(b, a, kWidth, kHeight, &ba);
    EXPECT_EQ(ab, ba);
}

TEST(Flip, TurnedImagesGiveTheTurnedMap) {
    Image a, b;
    makePictures(a, b);
    const auto turned = [](const auto& image) {
        auto out = image;
        for (uint32_t y = 0; y < kHeight; ++y)
            for (uint32_t x = 0; x < kWidth; ++x)
                out[x * kHeight + y] = image[y * kWidth + x];
        return out;
    };
    std::vector<float> straight, across;
    computeFlip(a, b, kWidth, kHeight, &straight);
    computeFlip(turned(a), turned(b), kHeight, kWidth, &across);
    const std::vector<float> expected = turned(straight);
    for (size_t i = 0; i < expected.size(); ++i)
        ASSERT_NEAR(across[i], expected[i], 2e-5f) << i;
}

TEST(Flip, DoesNotDependOnThreads) {
    Image a, b;
    makePictures(a, b);
    setThreadCount(1);
    const double one = computeFlip(a, b, kWidth, kHeight);
    setThreadCount(4);
    const double four = computeFlip(a, b, kWidth, kHeight);
    setThreadCount(0);
    EXPECT_EQ(one, four);
}

TEST(Flip, SmallestImagesWork) {
    EXPECT_EQ(computeFlip({}, {}, 0, 0), 0.0);
    EXPECT_NEAR(computeFlip({glm::vec3(0.0f)}, {glm::vec3(1.0f)}, 1, 1), 0.967379, 1e-5);
}

TEST(Flip, WrongSizesAreRefused) {
    const Image a(12), b(11);
    try {
        computeFlip(a, b, 4, 3);
        FAIL() << "accepted";
    } catch (const Error& e) {
        EXPECT_EQ(e.kind(), ErrorKind::kUsage);
        EXPECT_NE(std::string(e.what()).find("4 x 3"), std::string::npos) << e.what();
        EXPECT_NE(std::string(e.what()).find("11"), std::string::npos) << e.what();
    }
}

} // namespace
} // namespace shadowdag
