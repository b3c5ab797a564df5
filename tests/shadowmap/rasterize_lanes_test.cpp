// SPDX-License-Identifier: Apache-2.0
#include "shadowmap/rasterize_lanes.h"

#include "tests/shadowmap/small_scene.h"

#include <gtest/gtest.h>

namespace shadowdag {
namespace {

#if defined(SDAG_RASTERIZE_AVX2)

// Small whole numbers and no tolerance put the ends of rows exactly on texel centres, where a
// quotient rounds to either side: guesses are wrong there, and must be found out.
TEST(RasterizeLanes, RowsEndAsInTheSharedCode) {
    const uint32_t seed = 5;
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 rng(seed);
    const auto whole = [&](int limit) {
        return double(std::uniform_int_distribution<int>(-limit, limit)(rng));
    };
    size_t covered = 0;
    for (int trial = 0; trial < 200000; ++trial) {
        const int32_t n = 1 + int32_t(rng() % 100);
        FaceTriangle t{};
        double rEx[3];
        for (int k = 0; k < 3; ++k) {
            t.ex[k] = whole(49);
            t.ey[k] = whole(49);
            t.e0[k] = whole(49 * n);
            t.tolerance[k] = trial % 3 ? 0.0 : 0.5;
            if (trial % 2) { // one edge across the rows, on a centre or between two
                t.ex[k] = k ? 0.0 : t.ex[k];
                t.ey[k] = 0.0;
                t.e0[k] = k ? 1.0 : t.ex[k] * whole(n);
            }
            rEx[k] = 1.0 / t.ex[k];
        }
        t.x0 = int32_t(rng() % uint32_t(n));
        t.x1 = t.x0 + int32_t(rng() % uint32_t(n - t.x0));
        const int32_t y = int32_t(rng() % uint32_t(n));
        const uint32_t edges = trial % 5 ? 7u : rng() % 8; // the others count as met everywhere
        avx2::RowSpans spans;
        avx2::spanRows(t, rEx, y, n, t.x0, t.x1, edges, spans);
        for (int i = 0; i < 4; ++i) {
            int32_t first = t.x0, last = t.x1;
            for (int k = 0; k < 3; ++k)
                if (edges >> k & 1u)
                    narrowSpan(t.ex[k], t.ey[k] * double(2 * (y + i) + 1 - n) + t.e0[k],
                               t.tolerance[k], rEx[k], n, first, last);
            const bool isEmpty = first > last;
            ASSERT_EQ(spans.first[i] > spans.last[i], isEmpty) << trial;
            if (isEmpty)
                continue;
            ASSERT_EQ(spans.first[i], first) << trial;
            ASSERT_EQ(spans.last[i], last) << trial;
            covered += size_t(last - first + 1);
        }
    }
    EXPECT_GT(covered, 1000000u);
}

TEST(RasterizeLanes, SetupEqualsTheSharedCodeBitForBit) {
    const uint32_t seed = 6;
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 rng(seed);
    const ShadowMapInfo map{{0.1f, 0.2f, -0.3f}, 8.0f, 200, 4, 0};
    size_t ready = 0, left = 0;
    for (int trial = 0; trial < 20000; ++trial) {
        const test::SmallScene scene =
            test::randomScene(rng, 4, 2.0f, std::exp2(-float(trial % 12)) * 2.0f);
        const uint32_t triangles[4] = {0, 1, 2, 3};
        const uint32_t face = uint32_t(trial) % kFaceCount;
        avx2::Lanes3 corners[3];
        for (int corner = 0; corner < 3; ++corner)
            corners[corner] = avx2::cornersFromLight(scene.view(), triangles, corner, map, face);
        avx2::FaceTriangles four;
        uint32_t crossing = 0;
        const uint32_t set =
            avx2::setUpTriangles(corners[0], corners[1], corners[2], map, 15, crossing, four);
        ASSERT_EQ(set & crossing, 0u);
        for (uint32_t lane = 0; lane < 4; ++lane) {
            glm::dvec3 p[3];
            for (int corner = 0; corner < 3; ++corner)
                p[corner] = faceFromLight(face, cornerFromLight(scene.view(), lane, corner, map));
            FaceTriangle t;
            const bool isSet = setUpTriangle(p[0], p[1], p[2], map, t);
            if (crossing >> lane & 1u) {
                left += isSet;
                continue;
            }
            ASSERT_EQ(set >> lane & 1u, isSet) << trial;
            if (!isSet)
                continue;
            ++ready;
            const FaceTriangle own = four.at(int(lane));
            ASSERT_EQ(memcmp(own.ex, t.ex, 12 * sizeof(double)), 0);
            ASSERT_EQ(memcmp(&own.wx, &t.wx, 3 * sizeof(double)), 0);
            ASSERT_EQ(own.wMin, t.wMin);
            ASSERT_EQ(own.wMax, t.wMax);
            ASSERT_LE(t.wMax, t.wNear); // why the lanes do not test the near plane
            ASSERT_EQ(memcmp(&own.x0, &t.x0, 4 * sizeof(int32_t)), 0);
        }
    }
    EXPECT_GT(ready, 5000u);
    EXPECT_GT(left, 500u);
}

#else

TEST(RasterizeLanes, NeedAvx2) {
    GTEST_SKIP() << "this build has no AVX2: the one text draws alone";
}

#endif

} // namespace
} // namespace shadowdag
