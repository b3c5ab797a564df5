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
