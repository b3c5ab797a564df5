// SPDX-License-Identifier: Apache-2.0
// The parts of triangles that alpha masks cut out are missing from maps, and nothing else is.
#include "shadowmap/rasterize.h"
#include "tests/shadowmap/small_scene.h"

#include <gtest/gtest.h>

#include <cmath>

namespace shadowdag {
namespace {

using test::DrawnMap;
using test::freshMaps;
using test::SmallScene;

AlphaMask randomMask(uint32_t width, uint32_t height, std::mt19937& rng) {
    AlphaMask mask = makeAlphaMask(width, height);
    for (uint32_t y = 0; y < height; ++y)
        for (uint32_t x = 0; x < width; ++x)
            if (rng() & 1u)
                setOpaque(mask, x, y);
    return mask;
}

/// Cuts all triangles by a mask, with texture coordinates that are a function of positions.
template <class UvOf> void cut(SmallScene& scene, const AlphaMask& mask, const UvOf& uvOf) {
    const uint32_t index = scene.masks.add(mask);
    for (const glm::uvec3& t : scene.triangles) {
        scene.masks.triangleCut.push_back(uint32_t(scene.masks.cuts.size()));
        scene.masks.cuts.push_back(
            {index,
             {uvOf(scene.positions[t.x]), uvOf(scene.positions[t.y]), uvOf(scene.positions[t.z])}});
    }
}

uint32_t bitsAt(const DrawnMap& drawn, uint32_t face, uint32_t x, uint32_t y) {
    const ShadowMapView view = drawn.maps.view();
    return depthAt(view, view.maps[0], {face, x, y});
}

// A square that fills a face, cut by m x m texels: the texel of the map whose centre lies in texel
// (i, j) of the mask is covered where that is opaque. By whole numbers.
TEST(CutTriangles, AMaskOverAFaceIsTheMask) {
    const uint32_t seed = 31;
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 rng(seed);
    size_t coveredCount = 0, openCount = 0;
    for (const uint32_t m : {1u, 2u, 7u, 40u})
        for (const uint32_t n : {5u, 8u, 64u, 131u})
            for (const uint32_t cells : {1u, 3u, 16u}) { // narrow and wide triangles
                const AlphaMask mask = randomMask(m, m, rng);
                SmallScene scene;
                scene.addQuad({0, 0, 2}, {2, 0, 0}, {0, 2, 0}, cells);
                cut(scene, mask,
                    [](const glm::vec3& p) { return glm::vec2(p.x + 2.0f, p.y + 2.0f) * 0.25f; });
                const DrawnMap drawn(scene, {0, 0, 0}, 5.0f, n);
                for (uint32_t y = 0; y < n; ++y)
                    for (uint32_t x = 0; x < n; ++x) {
                        if ((2 * x + 1) * m % (2 * n) == 0 || (2 * y + 1) * m % (2 * n) == 0)
                            continue; // on a border of the mask's texels
                        const bool isOpaque =
                            mask.isOpaque((2 * x + 1) * m / (2 * n), (2 * y + 1) * m / (2 * n));
                        ASSERT_EQ(bitsFloat(bitsAt(drawn, 4, x, y)), isOpaque ? 0.5f : 0.0f)
                            << m << " " << n << " " << cells << ": " << x << " " << y;
                        ++(isOpaque ? coveredCount : openCount);
                    }
            }
    EXPECT_GT(coveredCount, 10000u);
    EXPECT_GT(openCount, 10000u);
}

// Perspective: every texel of leaning triangles against the crossing of its ray, in long double.
TEST(CutTriangles, LeaningTrianglesAreCutWhereTheirRaysCross) {
    using Vec = glm::vec<3, long double>;
    const uint32_t seed = 32;
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 rng(seed);
    std::uniform_real_distribution<float> unit(-1.0f, 1.0f);
    size_t coveredCount = 0, openCount = 0;
    for (int trial = 0; trial < 60; ++trial) {
        SmallScene scene = test::randomScene(rng, 1, 1.0f, 3.0f);
        const AlphaMask mask = randomMask(9, 6, rng);
        const glm::vec2 du(unit(rng), unit(rng)), dv(unit(rng), unit(rng)),
            dw(unit(rng), unit(rng));
        cut(scene, mask, [&](const glm::vec3& p) { return p.x * du + p.y * dv + p.z * dw; });
        const uint32_t n = trial % 3 ? 120 : 9;
        const DrawnMap drawn(scene, {0, 0, 0}, 20.0f, n);
        const Vec a(scene.positions[0]), b(scene.positions[1]), c(scene.positions[2]);
        const CutTriangle& uv = scene.masks.cuts[0];
        for (uint32_t face = 0; face < kFaceCount; ++face)
            for (uint32_t y = 0; y < n; ++y)
                for (uint32_t x = 0; x < n; ++x) {
                    const auto at = [n](uint32_t i) { return (2.0 * i + 1.0 - n) / n; };
                    const Vec ray(lightFromFace(face, glm::dvec3(at(x), at(y), 1.0)));
                    const Vec normal = glm::cross(b - a, c - a);
                    const long double depth = glm::dot(normal, a) / glm::dot(normal, ray);
                    const Vec p = ray * depth;
                    const long double area = glm::dot(normal, normal);
                    const long double wb = glm::dot(glm::cross(p - a, c - a), normal) / area;
                    const long double wc = glm::dot(glm::cross(b - a, p - a), normal) / area;
                    const long double wa = 1.0L - wb - wc;
                    const long double inside = std::min({wa, wb, wc});
                    if (depth < 1e-3L || std::abs(inside) < 1e-6L)
                        continue;
                    const long double u = wa * uv.uv[0].x + wb * uv.uv[1].x + wc * uv.uv[2].x;
                    const long double v = wa * uv.uv[0].y + wb * uv.uv[1].y + wc * uv.uv[2].y;
                    const long double tu = u * 9, tv = v * 6;
                    if (std::abs(tu - std::round(tu)) < 1e-6L ||
                        std::abs(tv - std::round(tv)) < 1e-6L)
                        continue;
                    const bool isOpaque = mask.isOpaque(maskTexel(double(tu), 9, mask.wrapU),
                                                        maskTexel(double(tv), 6, mask.wrapV));
                    const bool isCovered = inside > 0.0L && isOpaque;
                    ASSERT_EQ(bitsAt(drawn, face, x, y) != 0, isCovered)
                        << trial << ": " << face << " " << x << " " << y;
                    coveredCount += isCovered;
                    openCount += inside > 0.0L && !isOpaque;
                }
    }
    EXPECT_GT(coveredCount, 30000u);
    EXPECT_GT(openCount, 30000u);
}

// Both kernels of the CPU, bit for bit: cut and solid triangles side by side in one batch.
TEST(CutTriangles, BothKernelsDrawTheSame) {
    const uint32_t seed = 33;
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 rng(seed);
    for (int trial = 0; trial < 6; ++trial) {
        SmallScene scene = test::randomScene(rng, 300, 1.5f, trial % 2 ? 1.0f : 0.1f);
        cut(scene, randomMask(16, 16, rng),
            [](const glm::vec3& p) { return 3.0f * glm::vec2(p.x, p.y + p.z); });
        for (uint32_t t = 0; t < scene.triangles.size(); t += 3)
            scene.masks.triangleCut[t] = kNotCut;
        ShadowMapOptions atomic = freshMaps();
        atomic.useAtomicRasterizer = true;
        SmallScene solid = scene;
        solid.masks = {};
        const glm::vec3 light(0.1f, 0.2f, -0.3f);
        const DrawnMap byFace(scene, light, 6.0f, 150),
            byTriangle(scene, light, 6.0f, 150, {}, atomic), uncut(solid, light, 6.0f, 150);
        size_t lessCount = 0;
        for (uint32_t face = 0; face < kFaceCount; ++face)
            for (uint32_t y = 0; y < 150; ++y)
                for (uint32_t x = 0; x < 150; ++x) {
                    ASSERT_EQ(bitsAt(byFace, face, x, y), bitsAt(byTriangle, face, x, y));
                    ASSERT_LE(bitsAt(byFace, face, x, y), bitsAt(uncut, face, x, y));
                    lessCount += bitsAt(byFace, face, x, y) < bitsAt(uncut, face, x, y);
                }
        EXPECT_GT(lessCount, 100u);
    }
}

} // namespace
} // namespace shadowdag
