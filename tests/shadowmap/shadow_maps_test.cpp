// SPDX-License-Identifier: Apache-2.0
#include "shadowmap/shadow_maps.h"

#include "tests/shadowmap/small_scene.h"

#include <gtest/gtest.h>

namespace shadowdag {
namespace {

using test::DrawnMap;
using test::Oracle;
using test::SmallScene;

// A texel's centre ray, as Embree sees it: the stored 1/z is that of the first hit, and 0 where there is none. Rays
// that pass within rounding of an edge may differ; they are few.
TEST(ShadowMaps, StoredDepthIsEmbreesFirstHitAlongEveryTexelCentre) {
    for (const uint32_t seed : {1u, 2u, 3u}) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        std::mt19937 rng(seed);
        const SmallScene scene = test::randomScene(rng, seed == 1 ? 40 : 800, 3.0f, seed == 3 ? 3.0f : 0.5f);
        const Oracle oracle(scene);
        const glm::vec3 light(0.1f, -0.2f, 0.3f);
        for (const uint32_t n : {1u, 7u, 64u, 150u}) {
            const DrawnMap drawn(scene, light, 6.0f, n);
            const ShadowMapView view = drawn.maps.view();
            const ShadowMapInfo& map = view.maps[0];
            ASSERT_EQ(map.faceTexels, n);
            size_t different = 0, blocked = 0;
            for (uint32_t face = 0; face < kFaceCount; ++face)
                for (uint32_t y = 0; y < n; ++y)
                    for (uint32_t x = 0; x < n; ++x) {
                        const uint32_t bits = depthAt(view, map, {face, x, y});
                        ASSERT_NE(bits, kNoPage);
                        const float w = bitsFloat(bits);
                        const glm::vec3 c = lightFromFace(
                            face, glm::vec3(faceCellCentre(int32_t(x), n), faceCellCentre(int32_t(y), n), 1.0f));
                        const float z = oracle.firstHit(light, c, 0.0f, 6.0f);
                        blocked += w > 0.0f;
                        const float expected = std::isinf(z) ? 0.0f : 1.0f / z;
                        // Culling by the sphere may keep or drop what lies beyond the range.
                        if (w < 1.0f / 6.0f && expected == 0.0f)
                            continue;
                        different += std::abs(w - expected) > 2e-5f * expected;
                    }
            EXPECT_LE(different, 6 * n * n / 20000) << n;
            if (n > 7) {
                EXPECT_GT(blocked, n * n / 8) << n;
            }
        }
    }
}

} // namespace
} // namespace shadowdag
