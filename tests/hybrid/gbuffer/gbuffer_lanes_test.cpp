// SPDX-License-Identifier: Apache-2.0
#include "hybrid/gbuffer/gbuffer_lanes.h"

#include "tests/shadowmap/small_scene.h"

#include <gtest/gtest.h>

namespace shadowdag {
namespace {

#if defined(SDAG_DOUBLE_LANES)

/// Triangles with a few corners just before or behind the near plane, and the others where the
/// rectangle of boundPixels begins or ends: at a pixel, but for its margin.
test::SmallScene borderlineScene(std::mt19937& rng, const ViewRays& view) {
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    const auto corner = [&] {
        const auto at = [&](uint32_t pixels) {
            return std::floor((0.5 + 0.6 * unit(rng)) * double(pixels)) +
                   (unit(rng) < 0.0 ? -kPixelMargin : kPixelMargin);
        };
        const double x = at(view.width), y = at(view.height);
        double depth = std::exp2(2.0 + 5.0 * unit(rng));
        if (rng() % 16 == 0)
            depth = view.znear * (1.0 + unit(rng) * std::exp2(-10.0 + 12.0 * unit(rng)));
        return glm::vec3(view.origin + depth * (view.first + x * view.stepX + y * view.stepY));
    };
    test::SmallScene scene;
    for (uint32_t i = 0; i < 100; ++i) {
        const glm::vec3 a = corner(), b = corner();
        scene.addTriangle(a, b, corner());
    }
    return scene;
}

// What floats bound holds what doubles bound, or the triangle is left to the shared code.
TEST(GBufferLanes, BoundsInFloatsHoldThoseInDoubles) {
    const uint32_t seed = 11;
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 rng(seed);
    std::uniform_real_distribution<float> unit(-1.0f, 1.0f);
    size_t found = 0, crossed = 0, dropped = 0;
    for (int trial = 0; trial < 600; ++trial) {
        Camera camera;
        camera.yfov = trial % 2 ? 3.08f : 0.9f;
        camera.znear = std::exp2(-4.0f + 4.0f * unit(rng));
        camera.forward = test::randomDirection(rng);
        camera.up = glm::normalize(glm::cross(camera.forward, test::randomDirection(rng)));
        if (trial % 4 == 3)
            camera.positionWorld = test::randomDirection(rng) * 100.0f;
        const ViewRays view = makeViewRays(camera, 1 + rng() % 16384, 1 + rng() % 2000);
        const test::SmallScene scene = borderlineScene(rng, view);
        const BatchSet set = scene.batches();
        const BatchView batches = set.view();
        const int middle = int(view.height) / 2;
        const avx2::Band band =
            trial % 3 ? avx2::Band{0, int(view.height) - 1} : avx2::Band{middle / 2, middle};
        const auto vertices = std::make_unique<avx2::BatchVertices>();
        for (uint32_t b = 0; b < batches.batches.count; ++b) {
            const Batch& batch = batches.batches[b];
            avx2::projectOnPicture(&batches.vertices.positions[batches.vertices.first[b]],
                                   batches.vertices.count(b), view, *vertices);
            for (uint32_t first = 0; first < batch.count; first += 8) {
                avx2::PixelBounds bound[8];
                uint32_t crossing;
                const uint32_t wanted = std::min(batch.count - first, 8u);
                const uint32_t count =
                    avx2::boundPixelsOfEight(*vertices, &batches.vertices.corners[batch.first],
                                             first, wanted, view, band, crossing, bound);
                ASSERT_EQ(crossing >> wanted, 0u);
                uint32_t next = 0;
                for (uint32_t i = 0; i < wanted; ++i) {
                    const bool isBound = next < count && bound[next].inBatch == first + i;
                    const bool isCrossing = crossing >> i & 1u;
                    ASSERT_FALSE(isBound && isCrossing);
                    SeenTriangle seen;
                    bool isSeen = setUpSeen(scene.view(),
                                            batches.triangles[batch.first + first + i], view, seen);
                    if (isSeen) {
                        seen.rect = band.clip(seen.rect);
                        isSeen = seen.rect.minY <= seen.rect.maxY;
                    }
                    found += isSeen && isBound;
                    crossed += isSeen && isCrossing;
                    dropped += !isBound && !isCrossing;
                    if (isSeen && !isCrossing) {
                        ASSERT_TRUE(isBound) << trial << " triangle " << first + i;
                        const avx2::PixelBounds& t = bound[next];
                        ASSERT_LE(t.rect.minX, seen.rect.minX) << trial;
                        ASSERT_LE(t.rect.minY, seen.rect.minY) << trial;
                        ASSERT_GE(t.rect.maxX, seen.rect.maxX) << trial;
                        ASSERT_GE(t.rect.maxY, seen.rect.maxY) << trial;
                        ASSERT_LE(t.nearest, seen.nearest) << trial;
                    }
                    next += isBound;
                }
                ASSERT_EQ(next, count);
            }
        }
    }
    EXPECT_GT(found, 20000u);
    EXPECT_GT(crossed, 1000u);
    EXPECT_GT(dropped, 1000u);
}

#else

TEST(GBufferLanes, NeedAvx2) {
    GTEST_SKIP() << "this build has no AVX2: the one text draws alone";
}

#endif

} // namespace
} // namespace shadowdag
